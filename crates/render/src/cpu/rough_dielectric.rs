//! Twin of `shaders/rough_dielectric.wgsl`: the rough material `dielectric`.

use glam::{Vec2, Vec3};

use super::ggx::{ggx_d, ggx_g1, ggx_length, ggx_pdf, ggx_sample};
use super::lobe::{LobeSample, facet_alpha, facet_eval, facet_pdf, facet_weight, half_vector};
use super::math::{dot, max, normalize};
use super::specular::{fresnel, refracted_cosine};
use crate::records::Material;

pub fn dielectric_gain(material: &Material) -> f32 {
    1.0 + material.loss
}

pub fn refracting_normal(material: &Material, wo: Vec3, wi: Vec3) -> Vec3 {
    let sum = wo + wi * material.ior;
    let unit = sum * (1.0 / max(dot(sum, sum), 1e-20).sqrt());
    unit * if unit.z > 0.0 { 1.0 } else { -1.0 }
}

pub fn rough_dielectric_eval(material: &Material, wo: Vec3, wi: Vec3) -> Vec3 {
    let alpha = facet_alpha(material);
    let eta = 1.0 / material.ior;
    let above = wi.z > 0.0;
    let m = if above {
        half_vector(wo, wi)
    } else {
        refracting_normal(material, wo, wi)
    };
    let o = dot(wo, m);
    let i = dot(wi, m);
    let reflected = fresnel(max(o, 1e-6), refracted_cosine(max(o, 1e-6), eta), eta);
    let mirrored = Vec3::splat(reflected * facet_eval(alpha, wo, wi));
    let transmits = (o > 0.0) & (i < 0.0) & (wi.z < 0.0);
    let d = o + material.ior * i;
    let visible = 2.0 / max(wo.z + ggx_length(alpha, wo), 1e-30) * ggx_g1(alpha, wi);
    let btdf = (1.0 - reflected) * ggx_d(alpha, m) * visible * o * -i / max(d * d, 1e-30);
    let refracted = if transmits { material.tint * btdf } else { Vec3::ZERO };
    let value = if above { mirrored } else { refracted } * dielectric_gain(material);
    if wo.z > 0.0 { value } else { Vec3::ZERO }
}

pub fn rough_dielectric_pdf(material: &Material, wo: Vec3, wi: Vec3) -> f32 {
    let alpha = facet_alpha(material);
    let eta = 1.0 / material.ior;
    let above = wi.z > 0.0;
    let m = if above {
        half_vector(wo, wi)
    } else {
        refracting_normal(material, wo, wi)
    };
    let o = dot(wo, m);
    let i = dot(wi, m);
    let reflected = fresnel(max(o, 1e-6), refracted_cosine(max(o, 1e-6), eta), eta);
    let mirrored = reflected * facet_pdf(alpha, wo, wi);
    let transmits = (o > 0.0) & (i < 0.0) & (wi.z < 0.0);
    let d = o + material.ior * i;
    let transmitted =
        (1.0 - reflected) * ggx_pdf(alpha, wo, m) * (material.ior * material.ior) * -i / max(d * d, 1e-30);
    if wo.z > 0.0 {
        if above {
            mirrored
        } else if transmits {
            transmitted
        } else {
            0.0
        }
    } else {
        0.0
    }
}

pub fn rough_dielectric_sample(material: &Material, wo: Vec3, u: Vec2, random: f32) -> LobeSample {
    let alpha = facet_alpha(material);
    let eta = 1.0 / material.ior;
    let m = ggx_sample(alpha, wo, u);
    let o = max(dot(wo, m), 1e-6);
    let t = refracted_cosine(o, eta);
    let reflected = fresnel(o, t, eta);
    let reflects = random < reflected;
    let gain = dielectric_gain(material);
    let reflected_wi = m * (2.0 * o) - wo;
    let refracted_wi = m * (eta * o - t) - wo * eta;
    let wi = normalize(if reflects { reflected_wi } else { refracted_wi });
    let d = o - material.ior * t;
    let normal_pdf = ggx_pdf(alpha, wo, m);
    let mirrored = normal_pdf * reflected * 0.25 / o;
    let transmitted = normal_pdf * (1.0 - reflected) * (material.ior * material.ior) * t / max(d * d, 1e-30);
    let transmitted_weight = material.tint * (ggx_g1(alpha, wi) * (eta * eta));
    let weight = if reflects {
        Vec3::splat(facet_weight(alpha, wo, wi))
    } else {
        transmitted_weight
    } * gain;
    let lit = (wo.z > 0.0) & (wi.z * if reflects { 1.0 } else { -1.0 } > 0.0);
    LobeSample {
        wi,
        weight: if lit { weight } else { Vec3::ZERO },
        pdf: if lit {
            if reflects { mirrored } else { transmitted }
        } else {
            0.0
        },
        eta: if reflects { 1.0 } else { eta },
    }
}
