//! Twin of `shaders/specular.wgsl`.

use glam::Vec3;

use super::math::{dot, max};

pub fn reflected_direction(d: Vec3, n: Vec3) -> Vec3 {
    d - n * (2.0 * dot(d, n))
}

pub fn refracted_direction(d: Vec3, n: Vec3, eta: f32, cosine_i: f32, cosine_t: f32) -> Vec3 {
    d * eta + n * (eta * cosine_i - cosine_t)
}

pub fn refracted_cosine(cosine_i: f32, eta: f32) -> f32 {
    max((1.0 - eta * eta) + eta * eta * (cosine_i * cosine_i), 0.0).sqrt()
}

pub fn fresnel(cosine_i: f32, cosine_t: f32, eta: f32) -> f32 {
    let s = (eta * cosine_i - cosine_t) / (eta * cosine_i + cosine_t);
    let p = (cosine_i - eta * cosine_t) / (cosine_i + eta * cosine_t);
    0.5 * (s * s + p * p)
}
