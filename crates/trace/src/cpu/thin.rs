//! Twin of `shaders/thin.wgsl`.

use glam::{Vec2, Vec3};

use super::ggx::{ggx_d, ggx_length, ggx_sample};
use super::lanes::{Real, constant};
use super::lobe::{LobeSample, facet_alpha, facet_eval, facet_pdf, facet_weight, half_vector};
use super::math::{dot, max, min};
use super::rough_dielectric::dielectric_gain;
use super::specular::{fresnel, refracted_cosine};
use crate::records::Material;

#[inline(always)]
pub fn thin_reflectance<F: Real>(ior: F, cosine: F) -> F {
    let c = min(max(cosine, ior.splat(1e-6)), ior.splat(1.0));
    let eta = constant(1.0) / ior;
    let one_side = fresnel(c, refracted_cosine(c, eta), eta);
    constant(2.0) * one_side / (constant(1.0) + one_side)
}

pub fn to_upper_side(wi: Vec3) -> Vec3 {
    Vec3::new(wi.x, wi.y, wi.z.abs())
}

pub fn thin_eval(material: &Material, wo: Vec3, wi: Vec3) -> Vec3 {
    let up = to_upper_side(wi);
    let reflected = thin_reflectance(material.ior, dot(wo, half_vector(wo, up)));
    let share = if wi.z > 0.0 {
        Vec3::splat(reflected)
    } else {
        material.tint * (1.0 - reflected)
    };
    let value = share * (facet_eval(facet_alpha(material), wo, up) * dielectric_gain(material));
    if (wo.z > 0.0) & (up.z > 0.0) { value } else { Vec3::ZERO }
}

pub fn thin_pdf(material: &Material, wo: Vec3, wi: Vec3) -> f32 {
    let up = to_upper_side(wi);
    let reflected = thin_reflectance(material.ior, dot(wo, half_vector(wo, up)));
    let share = if wi.z > 0.0 { reflected } else { 1.0 - reflected };
    if (wo.z > 0.0) & (up.z > 0.0) {
        share * facet_pdf(facet_alpha(material), wo, up)
    } else {
        0.0
    }
}

pub fn thin_sample(material: &Material, wo: Vec3, u: Vec2, random: f32) -> LobeSample {
    let alpha = facet_alpha(material);
    let m = ggx_sample(alpha, wo, u);
    let cosine = dot(wo, m);
    let reflected = thin_reflectance(material.ior, cosine);
    let reflects = random < reflected;
    let up = m * (2.0 * cosine) - wo;
    let lit = (wo.z > 0.0) & (up.z > 0.0) & (cosine > 0.0);
    let weight =
        if reflects { Vec3::ONE } else { material.tint } * (facet_weight(alpha, wo, up) * dielectric_gain(material));
    let share = if reflects { reflected } else { 1.0 - reflected };
    let pdf = share * ggx_d(alpha, m) * 0.5 / max(wo.z + ggx_length(alpha, wo), 1e-30);
    LobeSample {
        wi: Vec3::new(up.x, up.y, if reflects { up.z } else { -up.z }),
        weight: if lit { weight } else { Vec3::ZERO },
        pdf: if lit { pdf } else { 0.0 },
        eta: 1.0,
    }
}
