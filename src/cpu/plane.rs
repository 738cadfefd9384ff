//! Twin of `shaders/plane.wgsl`: z = 0 in local space.

use glam::Vec3;

use super::ray::{Ray, crosses_plane, plane_distance};
use crate::pack::Primitive;

pub fn intersect_plane(q: &Primitive, ray: Ray, limit: f32) -> f32 {
    let t = plane_distance(q, ray);
    if (t > 0.0) & (t < limit) { t } else { limit }
}

pub fn plane_blocks(o: Vec3, d: Vec3, reach: f32) -> bool {
    crosses_plane(o, d, reach)
}
