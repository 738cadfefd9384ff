//! Twin of `shaders/surface.wgsl`.

use glam::{UVec2, Vec2, Vec3};

use super::lanes::{Real, SurfaceVectors, Vector3};
use super::math::{dot, max, positive_zero};
use super::primitive::{
    is_solid, local_tangents, primitive_gradient, primitive_height, primitive_normal, primitive_uv,
};
use super::ray::{Ray, point_to_local, vector_to_local, vector_to_world};
use crate::records::{FirstHit, NO_INDEX, Primitive};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    pub position: Vec3,
    pub normal: Vec3,
    pub smooth_normal: Vec3,
    pub shading_normal: Vec3,
    pub wo: Vec3,
    pub ray_origin: Vec3,
    pub terminator_offset: Vec3,
    pub side: f32,
    pub exclude_front: UVec2,
    pub exclude_back: UVec2,
    pub uv: Vec2,
    pub du: Vec3,
    pub dv: Vec3,
}

impl SurfaceVectors for Surface {
    type Real = f32;

    #[inline(always)]
    fn normal(&self) -> Vec3 {
        self.normal
    }

    #[inline(always)]
    fn smooth_normal(&self) -> Vec3 {
        self.smooth_normal
    }

    #[inline(always)]
    fn wo(&self) -> Vec3 {
        self.wo
    }
}

#[inline(always)]
pub fn largest<V: Vector3>(v: V) -> V::Real {
    max(max(v.x().abs(), v.y().abs()), v.z().abs())
}

pub fn surface_at(q: &Primitive, i: u32, ray: Ray, t: f32, epsilon: f32) -> Surface {
    let point = ray.origin + ray.direction * t;
    let offset = point - q.anchor;
    let from_anchor = vector_to_local(q, offset);
    let gradient = primitive_gradient(q, from_anchor - q.middle);
    let inverse_slope = 1.0 / dot(gradient, gradient).sqrt();
    let outward = gradient * inverse_slope;
    let solid = is_solid(q.kind);
    let height = primitive_height(q, from_anchor);
    let position = point - outward * (height * inverse_slope);
    let inside = dot(outward, ray.direction) > 0.0;
    let side = if inside { -1.0 } else { 1.0 };
    let normal = outward * side;
    let size = max(largest(position), largest(offset));
    Surface {
        position,
        normal,
        smooth_normal: normal,
        shading_normal: normal,
        wo: -ray.direction,
        ray_origin: position + normal * (epsilon * size),
        side,
        terminator_offset: Vec3::ZERO,
        exclude_front: UVec2::new(0, if solid & inside { NO_INDEX } else { i }),
        exclude_back: UVec2::new(0, if solid & !inside { NO_INDEX } else { i }),
        uv: Vec2::ZERO,
        du: Vec3::ZERO,
        dv: Vec3::ZERO,
    }
}

pub fn with_coordinates(surface: Surface, q: &Primitive) -> Surface {
    let local = point_to_local(q, surface.position);
    let tangents = local_tangents(q, local);
    Surface {
        uv: primitive_uv(q, local),
        du: vector_to_world(q, tangents.u),
        dv: vector_to_world(q, tangents.v),
        ..surface
    }
}

pub fn with_positive_zeros(v: Vec3) -> Vec3 {
    Vec3::new(positive_zero(v.x), positive_zero(v.y), positive_zero(v.z))
}

pub fn first_hit(q: &Primitive, ray: Ray, t: f32) -> FirstHit {
    let local = point_to_local(q, ray.origin + ray.direction * t);
    let n = primitive_normal(q, local);
    let normal = with_positive_zeros(n);
    let uv = primitive_uv(q, local);
    FirstHit {
        normal,
        depth: t,
        uv: Vec2::new(positive_zero(uv.x), positive_zero(uv.y)),
        shape: q.shape,
        material: q.material,
        shading_normal: normal,
        primitive: q.shape,
        barycentric: Vec2::ZERO,
        unused: UVec2::ZERO,
    }
}
