//! Twin of `shaders/surface.wgsl`: the point where a ray meets a primitive.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::math::{atan2, dot, max, normalize, positive_zero};
use super::ray::{Ray, point_to_local};
use crate::pack::{ELLIPSOID, FirstHit, Primitive, RECTANGLE};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    pub position: Vec3,
    pub normal: Vec3,
    pub wo: Vec3,
    pub start: Vec3,
    pub side: f32,
}

pub fn primitive_normal(q: &Primitive, local: Vec3) -> Vec3 {
    let round = q.x * local.x + q.y * local.y + q.z * local.z;
    normalize(if q.kind == ELLIPSOID { round } else { q.z })
}

pub fn surface_at(q: &Primitive, ray: Ray, t: f32, epsilon: f32) -> Surface {
    let position = ray.origin + ray.direction * t;
    let outward = primitive_normal(q, point_to_local(q, position));
    let side = if dot(outward, ray.direction) > 0.0 { -1.0 } else { 1.0 };
    let normal = outward * side;
    let size = max(max(position.x.abs(), position.y.abs()), max(position.z.abs(), t));
    Surface {
        position,
        normal,
        wo: -ray.direction,
        start: position + normal * (epsilon * size),
        side,
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
