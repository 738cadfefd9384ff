//! Twin of `shaders/modified_phong.wgsl`.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::diffuse::{Angles, diffuse_pdf, diffuse_sample};
use super::math::{dot, max, min, normalize, power};
use super::surface::largest;
use super::warp::{disk_sample, vector_around};
use crate::records::Material;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhongFactors {
    pub diffuse: Vec3,
    pub specular: Vec3,
    pub diffuse_share: f32,
}

pub fn phong_factors(material: &Material) -> PhongFactors {
    let max_sum = largest(material.diffuse + material.specular);
    let scaled = |factor: Vec3| if max_sum > 1.0 { factor / max_sum } else { factor };
    let (diffuse, specular) = (scaled(material.diffuse), scaled(material.specular));
    let d = diffuse.x + diffuse.y + diffuse.z;
    let s = specular.x + specular.y + specular.z;
    PhongFactors {
        diffuse,
        specular,
        diffuse_share: if s > 0.0 { d / (d + s) } else { 1.0 },
    }
}

pub fn phong_lobe(material: &Material, angles: Angles) -> f32 {
    let cosine = 2.0 * angles.wi * angles.wo - angles.between;
    power(min(max(cosine, 0.0), 1.0), material.shininess)
}

pub fn modified_phong_eval(material: &Material, angles: Angles) -> Vec3 {
    let factors = phong_factors(material);
    let specular = phong_lobe(material, angles) * (material.shininess + 2.0) * 0.159_154_94;
    (factors.diffuse * FRAC_1_PI + factors.specular * specular) * max(angles.wi, 0.0)
}

pub fn modified_phong_pdf(material: &Material, angles: Angles) -> f32 {
    let share = phong_factors(material).diffuse_share;
    let specular = phong_lobe(material, angles) * (material.shininess + 1.0) * 0.159_154_94;
    diffuse_pdf(angles) * share + specular * (1.0 - share)
}

pub fn modified_phong_sample(material: &Material, normal: Vec3, wo: Vec3, u: Vec2, random: f32) -> Vec3 {
    if random < phong_factors(material).diffuse_share {
        return diffuse_sample(normal, u);
    }
    let p = disk_sample(u);
    let r2 = p.x * p.x + p.y * p.y;
    let cosine = power(max(1.0 - r2, 0.0), 1.0 / (material.shininess + 1.0));
    let sine = max(1.0 - cosine * cosine, 0.0).sqrt();
    let offset = p * (sine / max(r2, 1e-20).sqrt());
    let mirrored = normalize(normal * (2.0 * dot(normal, wo)) - wo);
    normalize(vector_around(mirrored, offset.extend(cosine)))
}
