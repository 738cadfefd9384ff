//! Twin of `shaders/slab.wgsl`.

use glam::{Vec2, Vec3};

use super::lanes::{Real, Vector2, Vector3, constant, select};
use super::math::{max, min};
use crate::records::INFINITE_T;

/// Precomputed terms of a ray for box tests: the origin for lower and upper sides, offset by the padding, and 1 over
/// the direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slabs<V = Vec3> {
    pub low_origin: V,
    pub high_origin: V,
    pub inverse: V,
}

#[inline(always)]
pub fn slabs<V: Vector3>(origin: V, direction: V, pad: V::Real) -> Slabs<V> {
    let inverse = V::new(
        inverse_of(direction.x()),
        inverse_of(direction.y()),
        inverse_of(direction.z()),
    );
    Slabs {
        low_origin: origin + pad,
        high_origin: origin - pad,
        inverse,
    }
}

#[inline(always)]
pub fn inverse_of<F: Real>(x: F) -> F {
    let smallest = select(x.splat(7.888609e-31), x.splat(-7.888609e-31), x.lt(x.splat(0.0)));
    constant(1.0) / select(smallest, x, x.abs().ge(x.splat(7.888609e-31)))
}

#[inline(always)]
pub fn box_interval<V: Vector3>(low: V, high: V, s: Slabs<V>) -> <V::Real as Real>::Vec2 {
    let a = (low - s.low_origin) * s.inverse;
    let b = (high - s.high_origin) * s.inverse;
    let near = max(max(min(a.x(), b.x()), min(a.y(), b.y())), min(a.z(), b.z()));
    let far = min(min(max(a.x(), b.x()), max(a.y(), b.y())), max(a.z(), b.z()));
    Vector2::new(near, far)
}

#[inline(always)]
pub fn interval_hits<V: Vector2>(interval: V, limit: V::Real) -> <V::Real as Real>::Mask {
    let (near, far) = (interval.x(), interval.y());
    near.le(far) & far.ge(far.splat(0.0)) & near.le(limit)
}

/// A bundle of rays with a common origin, whose direction components are in given ranges, as precomputed terms for box
/// tests. `shaders/slab.wgsl` documents the fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayInterval {
    pub low_origin: Vec3,
    pub high_origin: Vec3,
    pub near_low: Vec3,
    pub near_high: Vec3,
    pub far_low: Vec3,
    pub far_high: Vec3,
}

pub fn ray_interval(origin: Vec3, min_direction: Vec3, max_direction: Vec3, pad: f32) -> RayInterval {
    let is_positive = min_direction.cmpge(Vec3::ZERO);
    let is_negative = max_direction.cmplt(Vec3::ZERO);
    let inverse_min = Vec3::new(
        inverse_of(min_direction.x),
        inverse_of(min_direction.y),
        inverse_of(min_direction.z),
    );
    let inverse_max = Vec3::new(
        inverse_of(max_direction.x),
        inverse_of(max_direction.y),
        inverse_of(max_direction.z),
    );
    let zero = Vec3::ZERO;
    RayInterval {
        low_origin: origin + pad,
        high_origin: origin - pad,
        near_low: Vec3::select(is_negative, zero, inverse_max),
        near_high: Vec3::select(is_positive, zero, inverse_min),
        far_low: Vec3::select(is_negative, inverse_max, zero),
        far_high: Vec3::select(is_positive, inverse_min, zero),
    }
}

pub fn ray_interval_box(low: Vec3, high: Vec3, rays: RayInterval) -> Vec2 {
    let a = low - rays.low_origin;
    let b = high - rays.high_origin;
    let t_low = a * rays.near_low;
    let t_high = b * rays.near_high;
    let near = max(
        max(max(t_low.x, t_high.x), max(t_low.y, t_high.y)),
        max(t_low.z, t_high.z),
    );
    let is_unbounded = rays.far_low.cmpeq(Vec3::ZERO) & rays.far_high.cmpeq(Vec3::ZERO);
    let far = Vec3::select(
        is_unbounded,
        Vec3::splat(INFINITE_T),
        a * rays.far_low + b * rays.far_high,
    );
    Vec2::new(near, min(min(far.x, far.y), far.z))
}
