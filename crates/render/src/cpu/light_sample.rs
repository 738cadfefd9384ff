//! Twin of `shaders/light_sample.wgsl`: points of what shines, and how densely they lie.

use glam::{Vec2, Vec3};

use super::ellipsoid::{ellipsoid_discriminant, ellipsoid_level};
use super::math::{dot, max, normalize};
use super::ray::{vector_to_local, vector_to_world};
use super::warp::{cap_sample, disk_sample, vector_around};
use crate::records::Primitive;

pub fn solid_angle_pdf(density: f32, to: Vec3, normal: Vec3) -> f32 {
    let d2 = dot(to, to);
    density * d2 * d2.sqrt() / dot(normal, to).abs()
}

pub fn ellipsoid_area(q: &Primitive) -> f32 {
    7.255_197_5 * (dot(q.x, q.x) + dot(q.y, q.y) + dot(q.z, q.z)).sqrt() / q.determinant.abs()
}

pub fn ellipsoid_cap(level: f32) -> f32 {
    let sine2 = 1.0 / (1.0 + level);
    if level > 0.0 {
        sine2 / (1.0 + max(1.0 - sine2, 0.0).sqrt())
    } else {
        2.0
    }
}

pub fn ellipsoid_sample(q: &Primitive, p: Vec3, u: Vec2) -> Vec3 {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let level = ellipsoid_level(q, from_anchor);
    let axis = if level > 0.0 { -normalize(o) } else { Vec3::Z };
    let direction = normalize(vector_around(axis, cap_sample(disk_sample(u), ellipsoid_cap(level))));
    let b = dot(o, direction);
    let root = max(ellipsoid_discriminant(o, direction, level), 0.0).sqrt();
    let t = if level > 0.0 {
        level / (root - b)
    } else if b > 0.0 {
        -level / (b + root)
    } else {
        root - b
    };
    vector_to_world(q, direction * t)
}

pub fn ellipsoid_pdf(q: &Primitive, p: Vec3, wi: Vec3) -> f32 {
    let cap = ellipsoid_cap(ellipsoid_level(q, vector_to_local(q, p - q.anchor)));
    let l = vector_to_local(q, wi);
    let l2 = dot(l, l);
    0.159_154_94 / cap * q.determinant.abs() / (l2 * l2.sqrt())
}

pub fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    if own > 0.0 { 1.0 / (1.0 + ratio * ratio) } else { 0.0 }
}

pub fn whole_below(bits: u32, count: u32) -> u32 {
    ((u64::from(bits) * u64::from(count)) >> 32) as u32
}
