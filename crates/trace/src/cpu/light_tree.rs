//! Twin of `shaders/light_tree.wgsl`.

use glam::Vec4;

use super::lanes::{Children, LightNodes};
use super::math::max4;

#[inline(always)]
pub fn mean_above<C: Children>(m: C, r: C) -> C {
    C::select(max4(m, m.splat(0.0)), (m + r) * 0.25 * ((m + r) / r), m.abs().lt(r))
}

#[inline(always)]
pub fn light_importances<N: LightNodes>(node: &N, p: N::Vec3, n: N::Vec3) -> N::Vec4 {
    let ([px, py, pz], [nx, ny, nz]) = (N::components(p), N::components(n));
    let (radius, cosine) = (node.get(|node| node.radius), node.get(|node| node.cosine));
    let intensity = node.get(|node| node.intensity);
    let axis_x = node.get(|node| node.axis_x);
    let axis_y = node.get(|node| node.axis_y);
    let axis_z = node.get(|node| node.axis_z);
    let x = node.get(|node| node.x) - px;
    let y = node.get(|node| node.y) - py;
    let z = node.get(|node| node.z) - pz;
    let zero = x.splat(0.0);
    let d2 = x * x + y * y + z * z;
    let d = d2.sqrt();
    let signed_axial = -(axis_x * x + axis_y * y + axis_z * z);
    let axial = Children::select(signed_axial, signed_axial.abs(), node.is_two_sided());
    let sine = max4(x.splat(1.0) - cosine * cosine, zero).sqrt();
    let rotated = axial * cosine + max4(d2 - signed_axial * signed_axial, zero).sqrt() * sine;
    let emitter_height = Children::select(rotated, d, (cosine * d).le(axial));
    let is_any_side = (nx * nx + ny * ny + nz * nz).eq(zero);
    let surface_height = Children::select(x * nx + y * ny + z * nz, d, is_any_side);
    let min_height = radius * 0.03;
    let mean_emitter_height = max4(mean_above(emitter_height, radius), min_height);
    let mean_surface_height = max4(mean_above(surface_height, radius), min_height);
    let inverse = x.splat(1.0) / max4((d2 + radius * 0.1 * radius).sqrt(), x.splat(1e-15));
    let value = intensity * (mean_emitter_height * inverse) * (mean_surface_height * inverse) * (inverse * inverse);
    let may_emit = ((node.get(|node| node.edge) - 1e-3) * d).lt(emitter_height + radius * 1.5707964);
    let may_arrive = may_emit & (d * -1e-3).lt(surface_height + radius) & zero.lt(intensity);
    Children::select(zero, max4(value, x.splat(1e-36)), may_arrive)
}

#[inline(always)]
pub fn light_shares<C: Children>(importances: C) -> C {
    let zero = importances.splat(0.0);
    let sum = importances.sum();
    let clamped = C::select(zero, max4(importances, sum * 0.00024414063), zero.lt(importances));
    let shares = clamped / clamped.sum();
    C::select(shares, shares.first(), sum.eq(zero))
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
