//! Twin of `shaders/dielectric.wgsl`.

use std::f32::consts::LOG2_E;

use glam::Vec3;

use super::differential::HitDifferential;
use super::math::{dot, exp2, max};
use super::path::{Path, reflected_path, refracted_path};
use super::specular::{fresnel, refracted_cosine, refracted_direction};
use super::surface::Surface;
use crate::records::Material;

pub fn transmittance(absorption: Vec3, distance: f32) -> Vec3 {
    let d = absorption * (distance * -LOG2_E);
    Vec3::new(exp2(d.x), exp2(d.y), exp2(d.z))
}

pub fn eta_of(surface: &Surface, material: &Material) -> f32 {
    if surface.side > 0.0 {
        1.0 / material.ior
    } else {
        material.ior
    }
}

pub fn refracts_inwards(surface: &Surface, material: &Material, normal: Vec3) -> bool {
    let eta = eta_of(surface, material);
    let cosine_i = max(dot(surface.wo, normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    let d = refracted_direction(-surface.wo, normal, eta, cosine_i, cosine_t);
    (dot(d, surface.normal) < 0.0) | (cosine_t == 0.0)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DielectricSample {
    pub path: Path,
    pub is_transmitted: bool,
    pub eta: f32,
}

pub fn dielectric_sample(
    path: Path,
    surface: Surface,
    hit_diff: HitDifferential,
    material: &Material,
    random: f32,
) -> DielectricSample {
    let eta = eta_of(&surface, material);
    let cosine_i = max(dot(surface.wo, surface.shading_normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    if random < fresnel(cosine_i, cosine_t, eta) {
        return DielectricSample {
            path: reflected_path(path, surface, hit_diff, path.throughput),
            is_transmitted: false,
            eta: 1.0,
        };
    }
    let throughput = path.throughput * material.tint * (eta * eta);
    DielectricSample {
        path: refracted_path(path, surface, hit_diff, throughput, eta, cosine_i, cosine_t),
        is_transmitted: true,
        eta,
    }
}
