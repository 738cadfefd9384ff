//! Twin of `shaders/ellipsoid.wgsl`: the unit sphere of local space.

use glam::Vec3;

use super::math::{cross, dot, max, min};
use super::ray::{Ray, point_to_local, vector_to_local};
use crate::pack::Primitive;

pub fn intersect_ellipsoid(q: &Primitive, ray: Ray, limit: f32) -> f32 {
    let o = point_to_local(q, ray.origin);
    let d = vector_to_local(q, ray.direction);
    let a = dot(d, d);
    let b = dot(o, d);
    let nearest = o - d * (b / a);
    let discriminant = 1.0 - dot(nearest, nearest);
    let root = (a * max(discriminant, 0.0)).sqrt();
    let sum = if b < 0.0 { root - b } else { -b - root };
    let t0 = (dot(o, o) - 1.0) / sum;
    let t1 = sum / a;
    let near = min(t0, t1);
    let t = if near > 0.0 { near } else { max(t0, t1) };
    if (discriminant >= 0.0) & (t > 0.0) & (t < limit) {
        t
    } else {
        limit
    }
}

pub fn ellipsoid_blocks(o: Vec3, d: Vec3, reach: f32) -> bool {
    let a = dot(d, d);
    let b = dot(o, d);
    let start = dot(o, o) - 1.0;
    let end = start + reach * (2.0 * b + reach * a);
    let moment = cross(o, d);
    let passes = (b < 0.0) & (-b < reach * a) & (dot(moment, moment) <= a);
    ((start < 0.0) & (end > 0.0)) | ((start > 0.0) & ((end < 0.0) | passes))
}
