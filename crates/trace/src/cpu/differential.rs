//! Twin of `shaders/differential.wgsl`: ray differentials.

use glam::Vec3;

use super::math::dot;
use super::primitive::{is_solid, solid_gradient, solid_gradient_derivative};
use super::ray::{Ray, point_to_local, vector_to_local};
use super::surface::Surface;
use crate::records::Primitive;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Derivative {
    pub position: Vec3,
    pub direction: Vec3,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Differential {
    pub x: Derivative,
    pub y: Derivative,
}

pub fn transferred(derivative: Derivative, ray: Ray, t: f32, normal: Vec3) -> Derivative {
    let moved = derivative.position + derivative.direction * t;
    let dt = dot(moved, normal) / dot(ray.direction, normal);
    Derivative {
        position: moved - ray.direction * dt,
        direction: derivative.direction,
    }
}

pub fn normal_derivative(q: &Primitive, local: Vec3, dp: Vec3) -> Vec3 {
    let dl = vector_to_local(q, dp);
    let s = solid_gradient(q.kind, local);
    let ds = solid_gradient_derivative(q.kind, local, dl);
    let g = q.x * s.x + q.y * s.y + q.z * s.z;
    let dg = q.x * ds.x + q.y * ds.y + q.z * ds.z;
    let scale = 1.0 / dot(g, g).sqrt();
    let n = g * scale;
    if is_solid(q.kind) {
        (dg - n * dot(n, dg)) * scale
    } else {
        Vec3::ZERO
    }
}

pub fn reflected_derivative(derivative: Derivative, d: Vec3, n: Vec3, dn: Vec3) -> Derivative {
    let d_n = dot(derivative.direction, n) + dot(d, dn);
    Derivative {
        position: derivative.position,
        direction: derivative.direction - (dn * dot(d, n) + n * d_n) * 2.0,
    }
}

pub fn refracted_derivative(derivative: Derivative, d: Vec3, n: Vec3, dn: Vec3, eta: f32, cosine: f32) -> Derivative {
    let d_n = dot(d, n);
    let mu = eta * d_n + cosine;
    let dmu = (eta + eta * eta * d_n / cosine) * (dot(derivative.direction, n) + dot(d, dn));
    Derivative {
        position: derivative.position,
        direction: derivative.direction * eta - (dn * mu + n * dmu),
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HitDifferential {
    pub x: Derivative,
    pub y: Derivative,
    pub normal_x: Vec3,
    pub normal_y: Vec3,
}

pub fn primitive_hit_differential(
    q: &Primitive,
    differential: Differential,
    ray: Ray,
    t: f32,
    surface: Surface,
) -> HitDifferential {
    let local = point_to_local(q, surface.position);
    let x = transferred(differential.x, ray, t, surface.normal);
    let y = transferred(differential.y, ray, t, surface.normal);
    let normal_x = normal_derivative(q, local, x.position) * surface.side;
    let normal_y = normal_derivative(q, local, y.position) * surface.side;
    HitDifferential {
        x,
        y,
        normal_x,
        normal_y,
    }
}

pub fn reflected_differential(hit_diff: HitDifferential, d: Vec3, n: Vec3) -> Differential {
    Differential {
        x: reflected_derivative(hit_diff.x, d, n, hit_diff.normal_x),
        y: reflected_derivative(hit_diff.y, d, n, hit_diff.normal_y),
    }
}

pub fn refracted_differential(hit_diff: HitDifferential, d: Vec3, n: Vec3, eta: f32, cosine: f32) -> Differential {
    Differential {
        x: refracted_derivative(hit_diff.x, d, n, hit_diff.normal_x, eta, cosine),
        y: refracted_derivative(hit_diff.y, d, n, hit_diff.normal_y, eta, cosine),
    }
}
