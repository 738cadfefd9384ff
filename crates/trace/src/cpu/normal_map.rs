//! Twin of `shaders/normal_map.wgsl`: normal mapping.

use glam::Vec3;

use super::math::{cross, dot, max, normalize};
use super::surface::Surface;
use crate::records::Texture;

pub fn mapped_normal(surface: Surface, t: &Texture, n: Vec3) -> Vec3 {
    let sign = if t.u.x * t.v.y - t.u.y * t.v.x > 0.0 { 1.0 } else { -1.0 };
    let along_u = (surface.du * t.v.y - surface.dv * t.v.x) * sign;
    let along_v = (surface.dv * t.u.x - surface.du * t.u.y) * sign;
    let outward = surface.shading_normal * surface.side;
    let tangent = normalize(along_u - outward * dot(outward, along_u));
    let perpendicular = cross(outward, tangent);
    let bitangent = perpendicular * if dot(perpendicular, along_v) > 0.0 { 1.0 } else { -1.0 };
    normalize(tangent * n.x + bitangent * n.y + outward * max(n.z, 0.001)) * surface.side
}
