//! Twin of `shaders/triangle.wgsl`: x >= 0, y >= 0, x + y <= 1, z = 0 in local space.

use glam::Vec3;

use super::math::dot;
use super::ray::{Ray, crosses_plane, plane_distance, scaled_crossing};
use crate::pack::Primitive;

pub fn intersect_triangle(q: &Primitive, ray: Ray, limit: f32) -> f32 {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - q.center;
    let x = dot(q.x, p);
    let y = dot(q.y, p);
    let inside = (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0);
    if (t > 0.0) & (t < limit) & inside { t } else { limit }
}

pub fn triangle_blocks(o: Vec3, d: Vec3, reach: f32) -> bool {
    let p = scaled_crossing(o, d);
    crosses_plane(o, d, reach) & (p.x >= 0.0) & (p.y >= 0.0) & (p.x + p.y <= d.z.abs())
}
