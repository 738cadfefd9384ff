//! Twin of `shaders/slab.wgsl`.

use glam::{Vec2, Vec3};

use super::math::{max, min};
use crate::records::INFINITE_T;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slabs {
    pub low_origin: Vec3,
    pub high_origin: Vec3,
    pub inverse: Vec3,
}

pub fn slabs(origin: Vec3, direction: Vec3, pad: f32) -> Slabs {
    let inverse = Vec3::new(
        inverse_of(direction.x),
        inverse_of(direction.y),
        inverse_of(direction.z),
    );
    Slabs {
        low_origin: origin + pad,
        high_origin: origin - pad,
        inverse,
    }
}

pub fn inverse_of(x: f32) -> f32 {
    let least = if x < 0.0 { -7.888609e-31 } else { 7.888609e-31 };
    1.0 / if x.abs() >= 7.888609e-31 { x } else { least }
}

pub fn box_interval(low: Vec3, high: Vec3, s: Slabs) -> Vec2 {
    let a = (low - s.low_origin) * s.inverse;
    let b = (high - s.high_origin) * s.inverse;
    let near = max(max(min(a.x, b.x), min(a.y, b.y)), min(a.z, b.z));
    let far = min(min(max(a.x, b.x), max(a.y, b.y)), max(a.z, b.z));
    Vec2::new(near, far)
}

pub fn interval_hits(interval: Vec2, limit: f32) -> bool {
    (interval.x <= interval.y) & (interval.y >= 0.0) & (interval.x <= limit)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayInterval {
    pub low_origin: Vec3,
    pub high_origin: Vec3,
    pub near_low: Vec3,
    pub near_high: Vec3,
    pub far_low: Vec3,
    pub far_high: Vec3,
}

pub fn ray_interval(origin: Vec3, least: Vec3, most: Vec3, pad: f32) -> RayInterval {
    let up = least.cmpge(Vec3::ZERO);
    let down = most.cmplt(Vec3::ZERO);
    let of_least = Vec3::new(inverse_of(least.x), inverse_of(least.y), inverse_of(least.z));
    let of_most = Vec3::new(inverse_of(most.x), inverse_of(most.y), inverse_of(most.z));
    let zero = Vec3::ZERO;
    RayInterval {
        low_origin: origin + pad,
        high_origin: origin - pad,
        near_low: Vec3::select(down, zero, of_most),
        near_high: Vec3::select(up, zero, of_least),
        far_low: Vec3::select(down, of_most, zero),
        far_high: Vec3::select(up, of_least, zero),
    }
}

pub fn ray_interval_box(low: Vec3, high: Vec3, f: RayInterval) -> Vec2 {
    let a = low - f.low_origin;
    let b = high - f.high_origin;
    let by_low = a * f.near_low;
    let by_high = b * f.near_high;
    let near = max(
        max(max(by_low.x, by_high.x), max(by_low.y, by_high.y)),
        max(by_low.z, by_high.z),
    );
    let none = f.far_low.cmpeq(Vec3::ZERO) & f.far_high.cmpeq(Vec3::ZERO);
    let far = Vec3::select(none, Vec3::splat(INFINITE_T), a * f.far_low + b * f.far_high);
    Vec2::new(near, min(min(far.x, far.y), far.z))
}
