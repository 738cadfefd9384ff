//! Twin of `shaders/tangent.wgsl`: tangents of surfaces and mapped normals.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::math::{cross, dot, max, normalize};
use super::surface::Surface;
use crate::pack::{ELLIPSOID, Primitive, RECTANGLE, Texture};

pub fn vector_to_world(q: &Primitive, v: Vec3) -> Vec3 {
    let sum = cross(q.y, q.z) * v.x + cross(q.z, q.x) * v.y + cross(q.x, q.y) * v.z;
    sum / q.determinant
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangents {
    pub u: Vec3,
    pub v: Vec3,
}

pub fn local_tangents(q: &Primitive, local: Vec3) -> Tangents {
    if q.kind == ELLIPSOID {
        let r = max(local.x * local.x + local.y * local.y, 1e-12).sqrt();
        let u = Vec3::new(-local.y, local.x, 0.0) * TAU;
        let v = Vec3::new(-local.z * local.x / r, -local.z * local.y / r, r) * PI;
        return Tangents { u, v };
    }
    let scale = if q.kind == RECTANGLE { 2.0 } else { 1.0 };
    Tangents {
        u: Vec3::new(scale, 0.0, 0.0),
        v: Vec3::new(0.0, scale, 0.0),
    }
}

pub fn mapped_normal(q: &Primitive, local: Vec3, surface: Surface, t: &Texture, n: Vec3) -> Vec3 {
    let tangents = local_tangents(q, local);
    let du = vector_to_world(q, tangents.u);
    let dv = vector_to_world(q, tangents.v);
    let sign = if t.u.x * t.v.y - t.u.y * t.v.x > 0.0 { 1.0 } else { -1.0 };
    let along_u = (du * t.v.y - dv * t.v.x) * sign;
    let along_v = (dv * t.u.x - du * t.u.y) * sign;
    let outward = surface.normal * surface.side;
    let tangent = normalize(along_u - outward * dot(outward, along_u));
    let across = cross(outward, tangent);
    let bitangent = across * if dot(across, along_v) > 0.0 { 1.0 } else { -1.0 };
    normalize(tangent * n.x + bitangent * n.y + outward * max(n.z, 0.001)) * surface.side
}
