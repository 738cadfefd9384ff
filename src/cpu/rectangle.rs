//! Twin of `shaders/rectangle.wgsl`: |x| <= 1, |y| <= 1, z = 0 in local space.

use glam::Vec3;

use super::math::dot;
use super::ray::{Ray, crosses_plane, plane_distance, scaled_crossing};
use crate::pack::Primitive;

pub fn intersect_rectangle(q: &Primitive, ray: Ray, limit: f32) -> f32 {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - q.center;
    let inside = (dot(q.x, p).abs() <= 1.0) & (dot(q.y, p).abs() <= 1.0);
    if (t > 0.0) & (t < limit) & inside { t } else { limit }
}

pub fn rectangle_blocks(o: Vec3, d: Vec3, reach: f32) -> bool {
    let p = scaled_crossing(o, d);
    crosses_plane(o, d, reach) & (p.x.abs() <= d.z.abs()) & (p.y.abs() <= d.z.abs())
}
