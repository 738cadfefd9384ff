//! Twin of `shaders/surface.wgsl`: the point where a ray meets a primitive.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::ellipsoid::ellipsoid_level;
use super::math::{atan2, dot, max, normalize, positive_zero};
use super::ray::{Ray, point_to_local, vector_to_local};
use crate::pack::{ELLIPSOID, FirstHit, NOTHING, Primitive, RECTANGLE};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    pub position: Vec3,
    pub normal: Vec3,
    pub wo: Vec3,
    pub start: Vec3,
    pub side: f32,
    pub facing: Vec3,
    pub above: u32,
    pub below: u32,
}

pub fn primitive_gradient(q: &Primitive, local: Vec3) -> Vec3 {
    let round = q.x * local.x + q.y * local.y + q.z * local.z;
    if q.kind == ELLIPSOID { round } else { q.z }
}

pub fn primitive_normal(q: &Primitive, local: Vec3) -> Vec3 {
    normalize(primitive_gradient(q, local))
}

pub fn largest(v: Vec3) -> f32 {
    max(max(v.x.abs(), v.y.abs()), v.z.abs())
}

pub fn surface_at(q: &Primitive, i: u32, ray: Ray, t: f32, epsilon: f32) -> Surface {
    let met = ray.origin + ray.direction * t;
    let way = met - q.anchor;
    let from_anchor = vector_to_local(q, way);
    let gradient = primitive_gradient(q, from_anchor - q.middle);
    let inverse_slope = 1.0 / dot(gradient, gradient).sqrt();
    let outward = gradient * inverse_slope;
    let height = if q.kind == ELLIPSOID {
        0.5 * ellipsoid_level(q, from_anchor)
    } else {
        from_anchor.z
    };
    let position = met - outward * (height * inverse_slope);
    let inside = dot(outward, ray.direction) > 0.0;
    let side = if inside { -1.0 } else { 1.0 };
    let normal = outward * side;
    let size = max(largest(position), largest(way));
    let round = q.kind == ELLIPSOID;
    Surface {
        position,
        normal,
        wo: -ray.direction,
        start: position + normal * (epsilon * size),
        side,
        facing: normal,
        above: if round & inside { NOTHING } else { i },
        below: if round & !inside { NOTHING } else { i },
    }
}

pub fn primitive_uv(q: &Primitive, local: Vec3) -> Vec2 {
    if q.kind == RECTANGLE {
        return Vec2::new(0.5 * local.x + 0.5, 0.5 * local.y + 0.5);
    }
    if q.kind == ELLIPSOID {
        let longitude = atan2(local.y, local.x) * (0.5 * FRAC_1_PI);
        let latitude = atan2((local.x * local.x + local.y * local.y).sqrt(), -local.z) * FRAC_1_PI;
        return Vec2::new(if longitude < 0.0 { longitude + 1.0 } else { longitude }, latitude);
    }
    Vec2::new(local.x, local.y)
}

pub fn first_hit(q: &Primitive, ray: Ray, t: f32) -> FirstHit {
    let local = point_to_local(q, ray.origin + ray.direction * t);
    let n = primitive_normal(q, local);
    let normal = Vec3::new(positive_zero(n.x), positive_zero(n.y), positive_zero(n.z));
    let uv = primitive_uv(q, local);
    FirstHit {
        normal,
        depth: t,
        uv: Vec2::new(positive_zero(uv.x), positive_zero(uv.y)),
        shape: q.shape,
        material: q.material,
    }
}
