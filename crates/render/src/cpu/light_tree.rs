//! Twin of `shaders/light_tree.wgsl`.

use glam::{BVec4A, Vec3, Vec4};

use super::math::{dot, max4};
use crate::records::LightNode;

#[inline(always)]
pub fn mean_above(m: Vec4, r: Vec4) -> Vec4 {
    Vec4::select(m.abs().cmplt(r), 0.25 * (m + r) * ((m + r) / r), max4(m, Vec4::ZERO))
}

#[inline(always)]
pub fn light_importances(node: &LightNode, p: Vec3, n: Vec3) -> Vec4 {
    let x = node.x - p.x;
    let y = node.y - p.y;
    let z = node.z - p.z;
    let d2 = x * x + y * y + z * z;
    let d = d2.sqrt();
    let signed_axial = -(node.axis_x * x + node.axis_y * y + node.axis_z * z);
    let is_two_sided = BVec4A::from(node.sides.to_array().map(|sides| sides == 2));
    let axial = Vec4::select(is_two_sided, signed_axial.abs(), signed_axial);
    let sine = max4(1.0 - node.cosine * node.cosine, Vec4::ZERO).sqrt();
    let rotated = axial * node.cosine + max4(d2 - signed_axial * signed_axial, Vec4::ZERO).sqrt() * sine;
    let emitter_height = Vec4::select(axial.cmpge(node.cosine * d), d, rotated);
    let surface_height = if dot(n, n) == 0.0 {
        d
    } else {
        x * n.x + y * n.y + z * n.z
    };
    let min_height = 0.03 * node.radius;
    let mean_emitter_height = max4(mean_above(emitter_height, node.radius), min_height);
    let mean_surface_height = max4(mean_above(surface_height, node.radius), min_height);
    let inverse = 1.0 / max4((d2 + 0.1 * node.radius * node.radius).sqrt(), Vec4::splat(1e-15));
    let value =
        node.intensity * (mean_emitter_height * inverse) * (mean_surface_height * inverse) * (inverse * inverse);
    let may_emit = (emitter_height + 1.5707964 * node.radius).cmpgt((node.edge - 1e-3) * d);
    let may_arrive = may_emit & (surface_height + node.radius).cmpgt(-1e-3 * d) & node.intensity.cmpgt(Vec4::ZERO);
    Vec4::select(may_arrive, max4(value, Vec4::splat(1e-36)), Vec4::ZERO)
}

#[inline(always)]
pub fn light_shares(importances: Vec4) -> Vec4 {
    let sum = (importances.x + importances.y) + (importances.z + importances.w);
    if sum == 0.0 {
        return Vec4::X;
    }
    let is_positive = importances.cmpgt(Vec4::ZERO);
    let clamped = Vec4::select(
        is_positive,
        max4(importances, Vec4::splat(sum * 0.00024414063)),
        Vec4::ZERO,
    );
    clamped / ((clamped.x + clamped.y) + (clamped.z + clamped.w))
}

#[inline(always)]
pub fn light_child(shares: Vec4, random: f32) -> u32 {
    let second = shares.x + shares.y;
    let third = second + shares.z;
    let child = u32::from(random >= shares.x) + u32::from(random >= second) + u32::from(random >= third);
    let last = match shares {
        _ if shares.w > 0.0 => 3,
        _ if shares.z > 0.0 => 2,
        _ if shares.y > 0.0 => 1,
        _ => 0,
    };
    child.min(last)
}
