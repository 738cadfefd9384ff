//! Twin of `shaders/ray.wgsl`.

use glam::{UVec2, Vec2, Vec3};

use super::lanes::{Real, Vector2, Vector3};
use super::math::{cross, dot};
use crate::records::{INFINITE_T, NO_INDEX, Primitive};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray<V = Vec3> {
    pub origin: V,
    pub direction: V,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    pub instance: u32,
    pub primitive: u32,
    pub slot: u32,
    pub barycentric: Vec2,
}

pub fn no_hit() -> Hit {
    Hit {
        t: INFINITE_T,
        instance: 0,
        primitive: NO_INDEX,
        slot: 0,
        barycentric: Vec2::ZERO,
    }
}

pub fn standalone_prim(prim_id: UVec2) -> u32 {
    if prim_id.x == 0 { prim_id.y } else { NO_INDEX }
}

#[inline(always)]
pub fn point_to_local<V: Vector3>(q: &Primitive, p: V) -> V {
    vector_to_local(q, p - p.broadcast(q.anchor)) - p.broadcast(q.middle)
}

#[inline(always)]
pub fn vector_to_local<V: Vector3>(q: &Primitive, v: V) -> V {
    V::new(
        dot(v.broadcast(q.x), v),
        dot(v.broadcast(q.y), v),
        dot(v.broadcast(q.z), v),
    )
}

pub fn vector_to_world(q: &Primitive, v: Vec3) -> Vec3 {
    let sum = cross(q.y, q.z) * v.x + cross(q.z, q.x) * v.y + cross(q.x, q.y) * v.z;
    sum / q.determinant
}

#[inline(always)]
pub fn plane_distance<V: Vector3>(q: &Primitive, ray: Ray<V>) -> V::Real {
    let z = ray.origin.broadcast(q.z);
    dot(z, ray.origin.broadcast(q.anchor) - ray.origin) / dot(z, ray.direction)
}

#[inline(always)]
pub fn crosses_plane<V: Vector3>(o: V, d: V, t_max: V::Real) -> <V::Real as Real>::Mask {
    (o.z() * d.z()).lt(t_max.splat(0.0)) & o.z().abs().lt(t_max * d.z().abs())
}

#[inline(always)]
pub fn scaled_crossing<V: Vector3>(o: V, d: V) -> <V::Real as Real>::Vec2 {
    let a = d.z().abs();
    let s = o.z().abs();
    Vector2::new(o.x() * a + s * d.x(), o.y() * a + s * d.y())
}

pub fn closer(hit: Hit, t: f32, i: u32, origin_prim: u32) -> Hit {
    let nearer = (t < hit.t) & (i != origin_prim);
    Hit {
        t: if nearer { t } else { hit.t },
        primitive: if nearer { i } else { hit.primitive },
        ..hit
    }
}

pub fn nearer_hit(a: Hit, b: Hit) -> Hit {
    let lower = (b.instance < a.instance) | ((b.instance == a.instance) & (b.primitive < a.primitive));
    let nearer = (b.t < INFINITE_T) & ((b.t < a.t) | ((b.t == a.t) & lower));
    if nearer { b } else { a }
}
