//! Twin of `shaders/principled.wgsl`.

use std::f32::consts::{FRAC_1_PI, LOG2_E};

use glam::{Vec2, Vec3};

use super::ggx::{ggx_albedo, ggx_d, ggx_g1, ggx_g2, ggx_pdf, ggx_sample};
use super::lanes::{Condition, MaterialFields, Real, Vector2, Vector3, Vector4, constant, select};
use super::lobe::LobeSample;
use super::math::{dot, exp2, max, min, normalize, power};
use super::specular::{fresnel, refracted_cosine, refracted_direction};
use super::surface::largest;
use super::warp::{disk_sample, frame_around, vector_around};
use crate::records::{
    COAT_F0, LOBE_ANISOTROPY, LOBE_COAT, LOBE_SHEEN, LOBE_SPECULAR, LOBE_TRANSMISSION, MIN_SHEEN_ROUGHNESS,
    SMALLEST_ALPHA,
};

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrincipledLobes<F: Real = f32> {
    pub diffuse: F::Vec3,
    pub alpha: F::Vec2,
    pub f0: F::Vec3,
    pub f90: F::Vec3,
    pub glass: F,
    pub transmission_tint: F::Vec3,
    pub glass_f0: F::Vec3,
    pub glass_f90: F,
    pub f0_ior: F,
    pub ratio: F,
    pub eta: F,
    pub thin: F::Mask,
    pub coat: F,
    pub coat_alpha: F,
    pub coat_normal: F::Vec3,
    pub sheen: F::Vec3,
    pub sheen_alpha: F,
    pub lobe_probs: F::Vec4,
}

#[inline(always)]
pub fn principled_mixture<F: Real, M: MaterialFields<Real = F>>(
    material: &M,
    wo: F::Vec3,
    outside: F::Mask,
    coat_normal: F::Vec3,
    lobes: u32,
    energy: F::Vec3,
) -> PrincipledLobes<F> {
    let zero = wo.z().splat(0.0);
    let one = zero.splat(1.0);
    let (zeros, ones) = (F::Vec3::repeat(zero), F::Vec3::repeat(one));
    let (transmission, ior, metallic) = (material.transmission(), material.ior(), material.metallic());
    let rough = max(material.roughness() * material.roughness(), zero.splat(SMALLEST_ALPHA));
    let mut alpha_u = rough;
    if lobes & LOBE_ANISOTROPY != 0 {
        let anisotropy = material.anisotropy();
        alpha_u = rough + (constant(1.0) - rough) * (anisotropy * anisotropy);
    }
    let thin = material.is_thin();
    let volume = !thin & transmission.gt(zero);
    let mut m = PrincipledLobes {
        diffuse: zeros,
        alpha: Vector2::new(alpha_u, rough),
        f0: zeros,
        f90: zeros,
        glass: zero,
        transmission_tint: zeros,
        glass_f0: zeros,
        glass_f90: zero,
        f0_ior: zero,
        ratio: zero,
        eta: select(one, select(ior, constant(1.0) / ior, outside), volume),
        thin,
        coat: zero,
        coat_alpha: zero,
        coat_normal,
        sheen: zeros,
        sheen_alpha: zero,
        lobe_probs: Vector4::new(one, zero, zero, zero),
    };
    let mut layer_throughput = one;
    let has_layers = outside | !volume;
    let mut coat_share = zero;
    if lobes & LOBE_COAT != 0 {
        let cosine = dot(wo, coat_normal);
        let roughness = material.clearcoat_roughness();
        m.coat_alpha = max(roughness * roughness, zero.splat(SMALLEST_ALPHA));
        m.coat = select(zero, material.clearcoat(), has_layers & cosine.gt(zero));
        let reflected = ggx_albedo(m.coat_alpha, max(cosine, zero));
        coat_share = min(m.coat * (constant(COAT_F0) * reflected.x() + reflected.y()), one);
        layer_throughput = constant(1.0) - coat_share;
    }
    let mut sheen_share = zero;
    if lobes & LOBE_SHEEN != 0 {
        let roughness = max(material.sheen_roughness(), zero.splat(MIN_SHEEN_ROUGHNESS));
        m.sheen_alpha = roughness * roughness;
        let albedo = sheen_albedo(roughness, wo.z());
        m.sheen = material.sheen() * (select(zero, layer_throughput, has_layers) / max(albedo, one));
        let bounded = min(albedo, one);
        sheen_share = luminance(m.sheen) * albedo;
        let transmitted = max(constant(1.0) - largest(material.sheen()) * bounded, zero);
        layer_throughput = layer_throughput * select(one, transmitted, has_layers);
    }
    let base = material.diffuse();
    let dielectric = constant(1.0) - metallic;
    let diffuse_weight = dielectric * (constant(1.0) - transmission);
    let ratio = (ior - 1.0) / (ior + 1.0);
    let mut reflected = zeros;
    let mut inner = zeros;
    let mut albedo_factors: F::Vec2 = Vector2::new(zero, zero);
    let mut compensation = zero;
    if lobes & (LOBE_SPECULAR | LOBE_TRANSMISSION) != 0 {
        albedo_factors = ggx_albedo(m.alpha.y(), wo.z());
        let mut lower_bound = zero.splat(1.005);
        if lobes & LOBE_ANISOTROPY != 0 {
            let has_table = material.has_aniso_table();
            albedo_factors = Vector2::select(albedo_factors, Vector2::new(energy.x(), energy.y()), has_table);
            lower_bound = select(lower_bound, one, has_table);
        }
        let albedo = max(albedo_factors.x() + albedo_factors.y(), zero.splat(1e-3));
        compensation = max(constant(1.0) / albedo - lower_bound, zero);
        let weight = material.specular_weight();
        let inner_f0 = bounded_color(material.specular() * (ratio * ratio)) * weight;
        let inner_f90 = weight * min(constant(50.0) * (ratio * ratio), one);
        let inner_gain = ones + inner_f0 * compensation;
        let metal_gain = (ones + base * compensation) * (metallic * layer_throughput);
        m.f0 = inner_f0 * inner_gain * (diffuse_weight * layer_throughput) + base * metal_gain;
        m.f90 = inner_gain * (inner_f90 * (diffuse_weight * layer_throughput)) + metal_gain;
        reflected = m.f0 * albedo_factors.x() + m.f90 * albedo_factors.y();
        inner = (inner_f0 * albedo_factors.x() + F::Vec3::repeat(inner_f90 * albedo_factors.y())) * inner_gain;
    }
    m.diffuse = base * (diffuse_weight * layer_throughput * max(constant(1.0) - largest(inner), zero));
    let mut glass_weight = zero;
    if lobes & LOBE_TRANSMISSION != 0 {
        let f0_ior = ratio * ratio;
        m.f0_ior = select(f0_ior, constant(2.0) * f0_ior / (constant(1.0) + f0_ior), thin);
        m.glass_f0 = bounded_color(material.specular() * m.f0_ior) * material.specular_weight();
        m.glass_f90 = material.specular_weight();
        m.ratio = select(ior, constant(1.0) / ior, outside | thin);
        let glass_albedo = max(energy.z(), zero.splat(1e-3));
        let rough_gain = select(constant(1.0) / glass_albedo, constant(1.0) + compensation, thin);
        let gain = select(rough_gain, one, transmits_straight(&m));
        let glass = dielectric * transmission * layer_throughput;
        m.glass = glass * gain;
        m.transmission_tint = base * m.glass;
        let mirror = m.glass_f0 * albedo_factors.x() + F::Vec3::repeat(m.glass_f90 * albedo_factors.y());
        let mirrored = min(luminance(mirror), one);
        glass_weight = glass * (luminance(base) * (constant(1.0) - mirrored) + mirrored);
    }
    let (diffuse_share, specular_share) = (luminance(m.diffuse), luminance(reflected));
    let sum = diffuse_share + specular_share + glass_weight + coat_share + sheen_share;
    let has_lobes = sum.gt(zero.splat(1e-30));
    let inverse = constant(1.0) / max(sum, zero.splat(1e-30));
    m.lobe_probs = Vector4::new(
        select(one, diffuse_share * inverse, has_lobes),
        select(zero, specular_share * inverse, has_lobes),
        select(zero, glass_weight * inverse, has_lobes),
        select(zero, coat_share * inverse, has_lobes),
    );
    m
}

#[inline(always)]
pub fn bounded_color<V: Vector3>(color: V) -> V {
    let one = color.x().splat(1.0);
    V::new(min(color.x(), one), min(color.y(), one), min(color.z(), one))
}

#[inline(always)]
pub fn luminance<V: Vector3>(color: V) -> V::Real {
    constant(0.2126) * color.x() + constant(0.7152) * color.y() + constant(0.0722) * color.z()
}

#[inline(always)]
pub fn sheen_probability<F: Real>(m: &PrincipledLobes<F>) -> F {
    let p = m.lobe_probs;
    max(constant(1.0) - (p.x() + p.y() + p.z() + p.w()), p.x().splat(0.0))
}

#[inline(always)]
pub fn schlick<V: Vector3>(f0: V, f90: V, cosine: V::Real) -> V {
    let x = constant(1.0) - min(cosine, cosine.splat(1.0));
    let x2 = x * x;
    f0 + (f90 - f0) * (x2 * x2 * x)
}

#[inline(always)]
pub fn glass_fresnel<F: Real>(m: &PrincipledLobes<F>, cosine: F) -> F::Vec3 {
    let (zero, one) = (cosine.splat(0.0), cosine.splat(1.0));
    let c = min(max(cosine, cosine.splat(1e-6)), one);
    let cosine_t = refracted_cosine(c, m.ratio);
    let one_side = fresnel(c, cosine_t, m.ratio);
    let exact = select(one_side, constant(2.0) * one_side / (constant(1.0) + one_side), m.thin);
    let x = (exact - m.f0_ior) / max(constant(1.0) - m.f0_ior, cosine.splat(1e-6));
    let f = m.glass_f0 + (F::Vec3::repeat(m.glass_f90) - m.glass_f0) * x;
    let bounded = bounded_color(F::Vec3::new(max(f.x(), zero), max(f.y(), zero), max(f.z(), zero)));
    Vector3::select(bounded, F::Vec3::repeat(one), cosine_t.eq(zero))
}

#[inline(always)]
pub fn glass_probability<F: Real>(m: &PrincipledLobes<F>, cosine: F) -> F {
    min(luminance(glass_fresnel(m, cosine)), cosine.splat(1.0))
}

#[inline(always)]
pub fn transmits_straight<F: Real>(m: &PrincipledLobes<F>) -> F::Mask {
    is_flat(m.alpha) | (!m.thin & (m.eta - 1.0).abs().lt(m.eta.splat(1e-3)))
}

#[inline(always)]
pub fn is_flat<V: Vector2>(alpha: V) -> <V::Real as Real>::Mask {
    max(alpha.x(), alpha.y()).le(alpha.x().splat(SMALLEST_ALPHA))
}

#[inline(always)]
pub fn facets_eval<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, wi: V, half: V) -> V::Real {
    ggx_d(alpha, half) * ggx_g2(alpha, wo, wi) / (constant(4.0) * max(wo.z(), wo.z().splat(1e-6)))
}

#[inline(always)]
pub fn half_between<V: Vector3>(wo: V, wi: V) -> V {
    let sum = wo + wi;
    let length2 = dot(sum, sum);
    sum * (constant(1.0) / max(length2, length2.splat(1e-20)).sqrt())
}

#[inline(always)]
pub fn refracting_half<V: Vector3>(wo: V, wi: V, eta: V::Real) -> V {
    let sum = wo * eta + wi;
    let unit = sum * (constant(1.0) / max(dot(sum, sum), eta.splat(1e-20)).sqrt());
    V::select(-unit, unit, unit.z().gt(eta.splat(0.0)))
}

#[inline(always)]
pub fn refracting_density<V: Vector3>(wo: V, wi: V, half: V, eta: V::Real) -> V::Real {
    let o = dot(wo, half);
    let i = dot(wi, half);
    let zero = eta.splat(0.0);
    let sum = eta * o + i;
    let density = i.abs() / max(sum * sum, eta.splat(1e-20));
    select(zero, density, o.gt(zero) & i.lt(zero))
}

#[inline(always)]
pub fn principled_eval<F: Real>(m: &PrincipledLobes<F>, wo: F::Vec3, wi: F::Vec3, lobes: u32) -> F::Vec3 {
    let zero = wi.z().splat(0.0);
    let above = wi.z().gt(zero);
    let mut value = m.diffuse * (max(wi.z(), zero) * FRAC_1_PI);
    if lobes & LOBE_SPECULAR != 0 {
        let reflects = above & !is_flat(m.alpha);
        if reflects.any() {
            let half = half_between(wo, wi);
            let reflected = schlick(m.f0, m.f90, max(dot(wo, half), zero)) * facets_eval(m.alpha, wo, wi, half);
            value = Vector3::select(value, value + reflected, reflects);
        }
    }
    if lobes & LOBE_TRANSMISSION != 0 {
        let scatters = !transmits_straight(m);
        if scatters.any() {
            value = Vector3::select(value, value + glass_eval(m, wo, wi), scatters);
        }
    }
    if lobes & LOBE_COAT != 0 {
        let coated = above & m.coat.gt(zero);
        if coated.any() {
            value = Vector3::select(value, value + F::Vec3::repeat(coat_eval(m, wo, wi)), coated);
        }
    }
    if lobes & LOBE_SHEEN != 0 && above.any() {
        let sheen = m.sheen * (sheen_lobe(m.sheen_alpha, wo, wi) * wi.z());
        value = Vector3::select(value, value + sheen, above);
    }
    value
}

#[inline(always)]
pub fn glass_eval<F: Real>(m: &PrincipledLobes<F>, wo: F::Vec3, wi: F::Vec3) -> F::Vec3 {
    let zero = wi.z().splat(0.0);
    let ones = F::Vec3::repeat(zero.splat(1.0));
    let above = wi.z().gt(zero);
    let has_mirrored_half = above | m.thin;
    let mut value = F::Vec3::repeat(zero);
    if has_mirrored_half.any() {
        let up = F::Vec3::new(wi.x(), wi.y(), wi.z().abs());
        let half = half_between(wo, up);
        let reflected = glass_fresnel(m, dot(wo, half));
        let factor = Vector3::select(m.transmission_tint * (ones - reflected), reflected * m.glass, above);
        value = factor * facets_eval(m.alpha, wo, up, half);
    }
    if (!has_mirrored_half).any() {
        let half = refracting_half(wo, wi, m.eta);
        let reflected = glass_fresnel(m, dot(wo, half));
        let visible = ggx_pdf(m.alpha, wo, half) * ggx_g1(m.alpha, wi);
        let density = visible * refracting_density(wo, wi, half, m.eta) * (m.eta * m.eta);
        let refracted = m.transmission_tint * (ones - reflected) * density;
        value = Vector3::select(refracted, value, has_mirrored_half);
    }
    value
}

#[inline(always)]
pub fn glass_pdf<F: Real>(m: &PrincipledLobes<F>, wo: F::Vec3, wi: F::Vec3) -> F {
    let above = wi.z().gt(wi.z().splat(0.0));
    let has_mirrored_half = above | m.thin;
    let mut pdf = wi.z().splat(0.0);
    if has_mirrored_half.any() {
        let half = half_between(wo, F::Vec3::new(wi.x(), wi.y(), wi.z().abs()));
        let chance = glass_probability(m, dot(wo, half));
        pdf = mirrored_pdf(m.alpha, wo, half) * select(constant(1.0) - chance, chance, above);
    }
    if (!has_mirrored_half).any() {
        let half = refracting_half(wo, wi, m.eta);
        let chance = glass_probability(m, dot(wo, half));
        let refracted = ggx_pdf(m.alpha, wo, half) * refracting_density(wo, wi, half, m.eta) * (constant(1.0) - chance);
        pdf = select(refracted, pdf, has_mirrored_half);
    }
    pdf
}

#[inline(always)]
pub fn coat_eval<F: Real>(m: &PrincipledLobes<F>, wo: F::Vec3, wi: F::Vec3) -> F {
    let zero = wi.z().splat(0.0);
    let o = to_frame_around(m.coat_normal, wo);
    let i = to_frame_around(m.coat_normal, wi);
    let alpha: F::Vec2 = Vector2::new(m.coat_alpha, m.coat_alpha);
    let unlit = is_flat(alpha) | o.z().le(zero) | i.z().le(zero);
    if !(!unlit).any() {
        return zero;
    }
    let half = half_between(o, i);
    let f = schlick(
        F::Vec3::repeat(zero.splat(COAT_F0)),
        F::Vec3::repeat(zero.splat(1.0)),
        max(dot(o, half), zero),
    );
    select(m.coat * f.x() * facets_eval(alpha, o, i, half), zero, unlit)
}

#[inline(always)]
pub fn to_frame_around<V: Vector3>(n: V, v: V) -> V {
    let frame = frame_around(n);
    V::new(dot(frame.u, v), dot(frame.v, v), dot(n, v))
}

#[inline(always)]
pub fn principled_pdf<F: Real>(m: &PrincipledLobes<F>, wo: F::Vec3, wi: F::Vec3, lobes: u32) -> F {
    let zero = wi.z().splat(0.0);
    let above = wi.z().gt(zero);
    let probabilities = m.lobe_probs;
    let mut pdf = probabilities.x() * (max(wi.z(), zero) * FRAC_1_PI);
    if lobes & LOBE_SPECULAR != 0 {
        let reflects = above & !is_flat(m.alpha);
        if reflects.any() {
            let reflected = probabilities.y() * mirrored_pdf(m.alpha, wo, half_between(wo, wi));
            pdf = select(pdf, pdf + reflected, reflects);
        }
    }
    if lobes & LOBE_TRANSMISSION != 0 {
        let scatters = probabilities.z().gt(zero) & !transmits_straight(m);
        if scatters.any() {
            pdf = select(pdf, pdf + probabilities.z() * glass_pdf(m, wo, wi), scatters);
        }
    }
    if lobes & LOBE_COAT != 0 {
        let o = to_frame_around(m.coat_normal, wo);
        let i = to_frame_around(m.coat_normal, wi);
        let alpha: F::Vec2 = Vector2::new(m.coat_alpha, m.coat_alpha);
        let coated = probabilities.w().gt(zero) & i.z().gt(zero) & !is_flat(alpha);
        if coated.any() {
            let reflected = probabilities.w() * mirrored_pdf(alpha, o, half_between(o, i));
            pdf = select(pdf, pdf + reflected, coated);
        }
    }
    if lobes & LOBE_SHEEN != 0 {
        pdf = pdf + select(zero, sheen_probability(m) * 0.159_154_94, above);
    }
    pdf
}

#[inline(always)]
pub fn mirrored_pdf<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, half: V) -> V::Real {
    let cosine = dot(wo, half);
    let pdf = ggx_pdf(alpha, wo, half) / (constant(4.0) * max(cosine, cosine.splat(1e-6)));
    select(cosine.splat(0.0), pdf, cosine.gt(cosine.splat(0.0)))
}

pub fn no_sample() -> LobeSample {
    LobeSample {
        wi: Vec3::Z,
        weight: Vec3::ZERO,
        pdf: 0.0,
        eta: 1.0,
    }
}

#[inline(always)]
pub fn principled_direction<F: Real>(
    m: &PrincipledLobes<F>,
    wo: F::Vec3,
    u: F::Vec2,
    random: F,
    lobes: u32,
) -> LobeSample<F> {
    let (zero, one) = (random.splat(0.0), random.splat(1.0));
    let up = wo.broadcast(Vec3::Z);
    let (zeros, ones) = (F::Vec3::repeat(zero), F::Vec3::repeat(one));
    let p = disk_sample(u);
    let mut wi = F::Vec3::new(
        p.x(),
        p.y(),
        max(constant(1.0) - p.x() * p.x() - p.y() * p.y(), zero).sqrt(),
    );
    let mut is_delta = zero.lt(zero); // false in all lanes
    let mut is_lost = is_delta;
    let mut weight = zeros;
    let mut eta = one;
    let mut remaining = random - m.lobe_probs.x();
    if lobes & LOBE_SPECULAR != 0 {
        let probability = m.lobe_probs.y();
        let is_selected = remaining.ge(zero) & remaining.lt(probability);
        if is_selected.any() {
            let is_mirror = is_flat(m.alpha);
            let half = Vector3::select(ggx_sample(m.alpha, wo, u), up, is_mirror);
            let mirrored = half * (constant(2.0) * dot(wo, half)) - wo;
            let reflected = schlick(m.f0, m.f90, wo.z()) * (constant(1.0) / probability);
            is_delta = is_delta | (is_selected & is_mirror);
            is_lost = is_lost | (is_selected & mirrored.z().le(zero));
            wi = Vector3::select(wi, mirrored, is_selected);
            weight = Vector3::select(weight, reflected, is_selected);
        }
        remaining = remaining - probability;
    }
    if lobes & LOBE_TRANSMISSION != 0 {
        let probability = m.lobe_probs.z();
        let is_selected = remaining.ge(zero) & remaining.lt(probability);
        if is_selected.any() {
            let is_straight = transmits_straight(m);
            let half = Vector3::select(ggx_sample(m.alpha, wo, u), up, is_straight);
            let cosine = max(dot(wo, half), zero.splat(1e-6));
            let reflected = glass_fresnel(m, cosine);
            let chance = glass_probability(m, cosine);
            let reflects = remaining.lt(probability * chance);
            let mirrored = half * (constant(2.0) * cosine) - wo;
            let cosine_t = refracted_cosine(cosine, m.eta);
            let refracted = refracted_direction(-wo, half, m.eta, cosine, cosine_t);
            let below = F::Vec3::new(mirrored.x(), mirrored.y(), -mirrored.z());
            let transmitted = Vector3::select(refracted, below, m.thin);
            let direction = normalize(Vector3::select(transmitted, mirrored, reflects));
            let transmitted_weight = m.transmission_tint * (ones - reflected) * (m.eta * m.eta);
            let share = max(
                probability * select(constant(1.0) - chance, chance, reflects),
                zero.splat(1e-30),
            );
            let selected_weight = Vector3::select(transmitted_weight, reflected * m.glass, reflects);
            is_delta = is_delta | (is_selected & is_straight);
            is_lost = is_lost | (is_selected & (direction.z() * select(-one, one, reflects)).le(zero));
            wi = Vector3::select(wi, direction, is_selected);
            eta = select(eta, select(m.eta, one, reflects), is_selected);
            weight = Vector3::select(weight, selected_weight * (constant(1.0) / share), is_selected);
        }
        remaining = remaining - probability;
    }
    if lobes & LOBE_COAT != 0 {
        let probability = m.lobe_probs.w();
        let is_selected = remaining.ge(zero) & remaining.lt(probability);
        if is_selected.any() {
            let alpha: F::Vec2 = Vector2::new(m.coat_alpha, m.coat_alpha);
            let is_mirror = is_flat(alpha);
            let o = to_frame_around(m.coat_normal, wo);
            let half = Vector3::select(ggx_sample(alpha, o, u), up, is_mirror);
            let mirrored = vector_around(m.coat_normal, half * (constant(2.0) * dot(o, half)) - o);
            let reflected = schlick(F::Vec3::repeat(zero.splat(COAT_F0)), ones, o.z()) * (m.coat / probability);
            is_delta = is_delta | (is_selected & is_mirror);
            wi = Vector3::select(wi, mirrored, is_selected);
            let selected_weight = Vector3::select(zeros, reflected, mirrored.z().gt(zero));
            weight = Vector3::select(weight, selected_weight, is_selected);
        }
        remaining = remaining - probability;
    }
    if lobes & LOBE_SHEEN != 0 {
        let is_selected = remaining.ge(zero);
        let height = constant(1.0) - p.x() * p.x() - p.y() * p.y();
        let q = p * max(constant(1.0) + height, zero).sqrt();
        wi = Vector3::select(wi, F::Vec3::new(q.x(), q.y(), max(height, zero)), is_selected);
        is_delta = is_delta & !is_selected;
    }
    let lost = no_sample();
    LobeSample {
        wi: Vector3::select(wi, wo.broadcast(lost.wi), is_lost),
        weight: Vector3::select(weight, wo.broadcast(lost.weight), is_lost),
        pdf: select(one, zero, is_delta | is_lost),
        eta: select(eta, zero.splat(lost.eta), is_lost),
    }
}

#[inline(always)]
pub fn evaluated_sample<F: Real>(direction: LobeSample<F>, value: F::Vec3, pdf: F) -> LobeSample<F> {
    let zero = pdf.splat(0.0);
    let is_complete = direction.pdf.eq(zero);
    let lower_bound = zero.splat(1e-30);
    let factor = select(zero, constant(1.0) / max(pdf, lower_bound), pdf.gt(lower_bound));
    LobeSample {
        weight: Vector3::select(value * factor, direction.weight, is_complete),
        pdf: select(pdf, direction.pdf, is_complete),
        ..direction
    }
}

pub fn principled_sample(m: &PrincipledLobes, wo: Vec3, u: Vec2, random: f32, lobes: u32) -> LobeSample {
    let direction = principled_direction(m, wo, u, random, lobes);
    if direction.pdf == 0.0 {
        return direction;
    }
    let value = principled_eval(m, wo, direction.wi, lobes);
    evaluated_sample(direction, value, principled_pdf(m, wo, direction.wi, lobes))
}

#[inline(always)]
pub fn sheen_lobe<V: Vector3>(alpha: V::Real, wo: V, wi: V) -> V::Real {
    let half = half_between(wo, wi);
    let sine = min(half.x() * half.x() + half.y() * half.y(), alpha.splat(1.0)).sqrt();
    let exponent = constant(1.0) / alpha;
    let d = (constant(2.0) + exponent) * power(sine, exponent) * 0.159_154_94;
    d / (constant(4.0) * max(wi.z() + wo.z() - wi.z() * wo.z(), alpha.splat(1e-4)))
}

#[inline(always)]
pub fn sheen_albedo<F: Real>(roughness: F, cosine: F) -> F {
    let r = roughness;
    let q = constant(1.0) / r;
    let s = max(cosine, r.splat(0.0)).sqrt();
    let p0 = constant(0.389_026_82) - r * 1.904_149_5 + r * 0.943_046_03 * r + q * 0.132_342_25;
    let p1 = constant(1.077_997_7) - r * 1.356_616_1 + r * 0.205_053_67 * r - q * 0.262_595_7;
    let p2 = constant(-12.212_699) + r * 15.173_416 - r * 5.192_227 * r + q * 0.104_818_46;
    let p3 = constant(29.434_828) - r * 40.606_533 + r * 16.015_73 * r - q * 2.291_067_8;
    let p4 = constant(-18.896_416) + r * 29.188_488 - r * 12.603_876 * r + q * 0.700_986_5;
    let logarithm = p0 + s * (p1 + s * (p2 + s * (p3 + s * p4)));
    constant(1.02) * (logarithm * LOG2_E).map(exp2)
}
