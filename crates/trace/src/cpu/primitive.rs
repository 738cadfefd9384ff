//! Twin of `shaders/primitive.wgsl`.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Vec2, Vec3};

use super::cylinder::{
    cylinder_bitangent, cylinder_gradient, cylinder_gradient_derivative, cylinder_height, cylinder_levels,
    cylinder_occludes, cylinder_tangent, cylinder_uv, cylinder_uv_derivative, intersect_cylinder,
};
use super::disk::{disk_occludes, intersect_disk};
use super::ellipsoid::{ellipsoid_level, ellipsoid_occludes, intersect_ellipsoid, longitude};
use super::lanes::{Real, Vector2, Vector3, select};
use super::math::{atan2, max, normalize};
use super::plane::{intersect_plane, plane_occludes};
use super::ray::Ray;
use super::rectangle::{intersect_rectangle, rectangle_occludes};
use super::solid::levels_on_surface;
use super::triangle::{intersect_triangle, triangle_occludes};
use crate::records::{CYLINDER, DISK, ELLIPSOID, Primitive, RECTANGLE, SOLID_KINDS, TRIANGLE};

#[inline(always)] // compiled for each kind
pub fn intersect<V: Vector3>(
    kind: u32,
    q: &Primitive,
    from_inside: <V::Real as Real>::Mask,
    ray: Ray<V>,
    limit: V::Real,
) -> V::Real {
    if kind == RECTANGLE {
        return intersect_rectangle(q, ray, limit);
    }
    if kind == TRIANGLE {
        return intersect_triangle(q, ray, limit);
    }
    if kind == ELLIPSOID {
        return intersect_ellipsoid(q, from_inside, ray, limit);
    }
    if kind == DISK {
        return intersect_disk(q, ray, limit);
    }
    if kind == CYLINDER {
        return intersect_cylinder(q, from_inside, ray, limit);
    }
    intersect_plane(q, ray, limit)
}

#[inline(always)] // compiled for each kind
pub fn occludes<V: Vector3>(
    kind: u32,
    o: V,
    d: V,
    levels: <V::Real as Real>::Vec2,
    t_max: V::Real,
) -> <V::Real as Real>::Mask {
    if kind == RECTANGLE {
        return rectangle_occludes(o, d, t_max);
    }
    if kind == TRIANGLE {
        return triangle_occludes(o, d, t_max);
    }
    if kind == ELLIPSOID {
        return ellipsoid_occludes(o, d, levels.x(), t_max);
    }
    if kind == DISK {
        return disk_occludes(o, d, t_max);
    }
    if kind == CYLINDER {
        return cylinder_occludes(o, d, levels, t_max);
    }
    plane_occludes(o, d, t_max)
}

pub fn is_solid(kind: u32) -> bool {
    ((SOLID_KINDS >> kind) & 1) == 1
}

pub fn is_centered(kind: u32) -> bool {
    (kind == RECTANGLE) | (kind == DISK)
}

#[inline(always)] // compiled for each kind
pub fn solid_levels<V: Vector3>(
    kind: u32,
    q: &Primitive,
    from_anchor: V,
    from_inside: <V::Real as Real>::Mask,
) -> <V::Real as Real>::Vec2 {
    let inner_level = from_anchor.x().splat(-1e-30);
    if kind == CYLINDER {
        let levels = cylinder_levels(q, from_anchor);
        return Vector2::select(levels, levels_on_surface(levels, inner_level), from_inside);
    }
    let level = select(ellipsoid_level(q, from_anchor), inner_level, from_inside);
    Vector2::new(level, level.splat(0.0))
}

pub fn primitive_gradient(q: &Primitive, local: Vec3) -> Vec3 {
    if !is_solid(q.kind) {
        return q.z;
    }
    let solid = solid_gradient(q.kind, local);
    q.x * solid.x + q.y * solid.y + q.z * solid.z
}

pub fn solid_gradient(kind: u32, local: Vec3) -> Vec3 {
    if kind == CYLINDER {
        cylinder_gradient(local)
    } else {
        local
    }
}

pub fn solid_gradient_derivative(kind: u32, local: Vec3, d: Vec3) -> Vec3 {
    if kind == CYLINDER {
        cylinder_gradient_derivative(local, d)
    } else {
        d
    }
}

pub fn primitive_height(q: &Primitive, from_anchor: Vec3) -> f32 {
    if !is_solid(q.kind) {
        return from_anchor.z;
    }
    if q.kind == CYLINDER {
        cylinder_height(q, from_anchor)
    } else {
        0.5 * ellipsoid_level(q, from_anchor)
    }
}

pub fn primitive_normal(q: &Primitive, local: Vec3) -> Vec3 {
    normalize(primitive_gradient(q, local))
}

pub fn primitive_uv(q: &Primitive, local: Vec3) -> Vec2 {
    if is_centered(q.kind) {
        return Vec2::new(0.5 * local.x + 0.5, 0.5 * local.y + 0.5);
    }
    if q.kind == ELLIPSOID {
        let latitude = atan2((local.x * local.x + local.y * local.y).sqrt(), -local.z) * FRAC_1_PI;
        return Vec2::new(longitude(local), latitude);
    }
    if q.kind == CYLINDER {
        return cylinder_uv(local);
    }
    Vec2::new(local.x, local.y)
}

pub fn uv_derivative(q: &Primitive, local: Vec3, d: Vec3) -> Vec2 {
    if is_centered(q.kind) {
        return Vec2::new(d.x, d.y) * 0.5;
    }
    if q.kind == ELLIPSOID {
        let r2 = max(local.x * local.x + local.y * local.y, 1e-12);
        let du = (local.x * d.y - local.y * d.x) / r2;
        let r = r2.sqrt();
        let dv = r * d.z - local.z * ((local.x * d.x + local.y * d.y) / r);
        return Vec2::new(du * (0.5 * FRAC_1_PI), dv * FRAC_1_PI);
    }
    if q.kind == CYLINDER {
        return cylinder_uv_derivative(local, d);
    }
    Vec2::new(d.x, d.y)
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tangents<V = Vec3> {
    pub u: V,
    pub v: V,
}

pub fn local_tangents(q: &Primitive, local: Vec3) -> Tangents {
    if q.kind == ELLIPSOID {
        let r = max(local.x * local.x + local.y * local.y, 1e-12).sqrt();
        let u = Vec3::new(-local.y, local.x, 0.0) * TAU;
        let v = Vec3::new(-local.z * local.x / r, -local.z * local.y / r, r) * PI;
        return Tangents { u, v };
    }
    if q.kind == CYLINDER {
        return Tangents {
            u: cylinder_tangent(local),
            v: cylinder_bitangent(local),
        };
    }
    let scale = if is_centered(q.kind) { 2.0 } else { 1.0 };
    Tangents {
        u: Vec3::new(scale, 0.0, 0.0),
        v: Vec3::new(0.0, scale, 0.0),
    }
}
