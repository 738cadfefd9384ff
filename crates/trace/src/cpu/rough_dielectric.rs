//! Twin of `shaders/rough_dielectric.wgsl`: the rough material `dielectric`.

use super::ggx::{ggx_d, ggx_g1, ggx_length, ggx_pdf, ggx_sample};
use super::lanes::{MaterialFields, Real, Vector3, constant, select};
use super::lobe::{LobeSample, facet_alpha, facet_eval, facet_pdf, facet_weight, half_vector};
use super::math::{dot, max, normalize};
use super::specular::{fresnel, refracted_cosine};

#[inline(always)]
pub fn dielectric_gain<F: Real, M: MaterialFields<Real = F>>(material: &M) -> F {
    constant(1.0) + material.loss()
}

#[inline(always)]
pub fn refracting_normal<F: Real, M: MaterialFields<Real = F>>(material: &M, wo: F::Vec3, wi: F::Vec3) -> F::Vec3 {
    let sum = wo + wi * material.ior();
    let length2 = dot(sum, sum);
    let unit = sum * (constant(1.0) / max(length2, length2.splat(1e-20)).sqrt());
    let (zero, one) = (length2.splat(0.0), length2.splat(1.0));
    unit * select(-one, one, unit.z().gt(zero))
}

#[inline(always)]
pub fn rough_dielectric_eval<F: Real, M: MaterialFields<Real = F>>(material: &M, wo: F::Vec3, wi: F::Vec3) -> F::Vec3 {
    let alpha = facet_alpha(material);
    let ior = material.ior();
    let (zero, smallest) = (ior.splat(0.0), ior.splat(1e-6));
    let zeros = F::Vec3::repeat(zero);
    let eta = constant(1.0) / ior;
    let above = wi.z().gt(zero);
    let m = Vector3::select(refracting_normal(material, wo, wi), half_vector(wo, wi), above);
    let o = dot(wo, m);
    let i = dot(wi, m);
    let reflected = fresnel(max(o, smallest), refracted_cosine(max(o, smallest), eta), eta);
    let mirrored = F::Vec3::repeat(reflected * facet_eval(alpha, wo, wi));
    let transmits = o.gt(zero) & i.lt(zero) & wi.z().lt(zero);
    let d = o + ior * i;
    let visible = constant(2.0) / max(wo.z() + ggx_length(alpha, wo), ior.splat(1e-30)) * ggx_g1(alpha, wi);
    let btdf = (constant(1.0) - reflected) * ggx_d(alpha, m) * visible * o * -i / max(d * d, ior.splat(1e-30));
    let refracted = Vector3::select(zeros, material.tint() * btdf, transmits);
    let value = Vector3::select(refracted, mirrored, above) * dielectric_gain(material);
    Vector3::select(zeros, value, wo.z().gt(zero))
}

#[inline(always)]
pub fn rough_dielectric_pdf<F: Real, M: MaterialFields<Real = F>>(material: &M, wo: F::Vec3, wi: F::Vec3) -> F {
    let alpha = facet_alpha(material);
    let ior = material.ior();
    let (zero, smallest) = (ior.splat(0.0), ior.splat(1e-6));
    let eta = constant(1.0) / ior;
    let above = wi.z().gt(zero);
    let m = Vector3::select(refracting_normal(material, wo, wi), half_vector(wo, wi), above);
    let o = dot(wo, m);
    let i = dot(wi, m);
    let reflected = fresnel(max(o, smallest), refracted_cosine(max(o, smallest), eta), eta);
    let mirrored = reflected * facet_pdf(alpha, wo, wi);
    let transmits = o.gt(zero) & i.lt(zero) & wi.z().lt(zero);
    let d = o + ior * i;
    let transmitted =
        (constant(1.0) - reflected) * ggx_pdf(alpha, wo, m) * (ior * ior) * -i / max(d * d, ior.splat(1e-30));
    let pdf = select(select(zero, transmitted, transmits), mirrored, above);
    select(zero, pdf, wo.z().gt(zero))
}

#[inline(always)]
pub fn rough_dielectric_sample<F: Real, M: MaterialFields<Real = F>>(
    material: &M,
    wo: F::Vec3,
    u: F::Vec2,
    random: F,
) -> LobeSample<F> {
    let alpha = facet_alpha(material);
    let ior = material.ior();
    let (zero, one) = (ior.splat(0.0), ior.splat(1.0));
    let eta = constant(1.0) / ior;
    let m = ggx_sample(alpha, wo, u);
    let o = max(dot(wo, m), ior.splat(1e-6));
    let t = refracted_cosine(o, eta);
    let reflected = fresnel(o, t, eta);
    let reflects = random.lt(reflected);
    let gain = dielectric_gain(material);
    let reflected_wi = m * (constant(2.0) * o) - wo;
    let refracted_wi = m * (eta * o - t) - wo * eta;
    let wi = normalize(Vector3::select(refracted_wi, reflected_wi, reflects));
    let d = o - ior * t;
    let normal_pdf = ggx_pdf(alpha, wo, m);
    let mirrored = normal_pdf * reflected * 0.25 / o;
    let transmitted = normal_pdf * (constant(1.0) - reflected) * (ior * ior) * t / max(d * d, ior.splat(1e-30));
    let transmitted_weight = material.tint() * (ggx_g1(alpha, wi) * (eta * eta));
    let mirrored_weight = F::Vec3::repeat(facet_weight(alpha, wo, wi));
    let weight = Vector3::select(transmitted_weight, mirrored_weight, reflects) * gain;
    let lit = wo.z().gt(zero) & (wi.z() * select(-one, one, reflects)).gt(zero);
    LobeSample {
        wi,
        weight: Vector3::select(F::Vec3::repeat(zero), weight, lit),
        pdf: select(zero, select(transmitted, mirrored, reflects), lit),
        eta: select(eta, one, reflects),
    }
}
