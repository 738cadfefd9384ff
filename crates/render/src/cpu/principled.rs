//! Twin of `shaders/principled.wgsl`.

use glam::{Vec2, Vec3, Vec3Swizzles as _, Vec4};

use super::ggx::{ggx_albedo, ggx_d, ggx_g1, ggx_g2, ggx_pdf, ggx_sample};
use super::lobe::LobeSample;
use super::math::{dot, exp2, max, min, normalize, power};
use super::specular::{fresnel, refracted_cosine, refracted_direction};
use super::surface::largest;
use super::warp::{disk_sample, frame_around, vector_around};
use crate::records::{
    COAT_F0, LOBE_ANISOTROPY, LOBE_COAT, LOBE_SHEEN, LOBE_SPECULAR, LOBE_TRANSMISSION, MIN_SHEEN_ROUGHNESS, Material,
    SMALLEST_ALPHA,
};

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrincipledLobes {
    pub diffuse: Vec3,
    pub alpha: Vec2,
    pub f0: Vec3,
    pub f90: Vec3,
    pub glass: f32,
    pub transmission_tint: Vec3,
    pub glass_f0: Vec3,
    pub glass_f90: f32,
    pub f0_ior: f32,
    pub ratio: f32,
    pub eta: f32,
    pub thin: bool,
    pub coat: f32,
    pub coat_alpha: f32,
    pub coat_normal: Vec3,
    pub sheen: Vec3,
    pub sheen_alpha: f32,
    pub lobe_probs: Vec4,
}

pub fn principled_mixture(
    material: &Material,
    wo: Vec3,
    outside: bool,
    coat_normal: Vec3,
    lobes: u32,
    energy: Vec3,
) -> PrincipledLobes {
    let mut m = PrincipledLobes::default();
    let rough = max(material.roughness * material.roughness, SMALLEST_ALPHA);
    m.alpha = Vec2::new(rough, rough);
    if lobes & LOBE_ANISOTROPY != 0 {
        m.alpha.x = rough + (1.0 - rough) * (material.anisotropy * material.anisotropy);
    }
    let volume = (material.thin == 0) & (material.transmission > 0.0);
    m.thin = material.thin != 0;
    m.eta = match (volume, outside) {
        (false, _) => 1.0,
        (true, true) => 1.0 / material.ior,
        (true, false) => material.ior,
    };
    let mut layer_throughput = 1.0;
    m.coat_normal = coat_normal;
    let has_layers = outside | !volume;
    let mut coat_share = 0.0;
    if lobes & LOBE_COAT != 0 {
        let cosine = dot(wo, coat_normal);
        m.coat_alpha = max(
            material.clearcoat_roughness * material.clearcoat_roughness,
            SMALLEST_ALPHA,
        );
        m.coat = if has_layers & (cosine > 0.0) {
            material.clearcoat
        } else {
            0.0
        };
        let reflected = ggx_albedo(m.coat_alpha, max(cosine, 0.0));
        coat_share = min(m.coat * (COAT_F0 * reflected.x + reflected.y), 1.0);
        layer_throughput = 1.0 - coat_share;
    }
    let mut sheen_share = 0.0;
    if lobes & LOBE_SHEEN != 0 {
        let roughness = max(material.sheen_roughness, MIN_SHEEN_ROUGHNESS);
        m.sheen_alpha = roughness * roughness;
        let albedo = sheen_albedo(roughness, wo.z);
        m.sheen = material.sheen * (if has_layers { layer_throughput } else { 0.0 } / max(albedo, 1.0));
        let bounded = min(albedo, 1.0);
        sheen_share = luminance(m.sheen) * albedo;
        layer_throughput *= if has_layers {
            max(1.0 - largest(material.sheen) * bounded, 0.0)
        } else {
            1.0
        };
    }
    let base = material.diffuse;
    let dielectric = 1.0 - material.metallic;
    let diffuse_weight = dielectric * (1.0 - material.transmission);
    let ratio = (material.ior - 1.0) / (material.ior + 1.0);
    let mut reflected = Vec3::ZERO;
    let mut inner = Vec3::ZERO;
    let mut albedo_factors = Vec2::ZERO;
    let mut compensation = 0.0;
    if lobes & (LOBE_SPECULAR | LOBE_TRANSMISSION) != 0 {
        albedo_factors = ggx_albedo(m.alpha.y, wo.z);
        let mut lower_bound = 1.005;
        if lobes & LOBE_ANISOTROPY != 0 && material.aniso_table != 0 {
            albedo_factors = energy.xy();
            lower_bound = 1.0;
        }
        compensation = max(1.0 / max(albedo_factors.x + albedo_factors.y, 1e-3) - lower_bound, 0.0);
        let inner_f0 = bounded_color(material.specular * (ratio * ratio)) * material.specular_weight;
        let inner_f90 = material.specular_weight * min(50.0 * (ratio * ratio), 1.0);
        let inner_gain = Vec3::ONE + inner_f0 * compensation;
        let metal_gain = (Vec3::ONE + base * compensation) * (material.metallic * layer_throughput);
        m.f0 = inner_f0 * inner_gain * (diffuse_weight * layer_throughput) + base * metal_gain;
        m.f90 = inner_gain * (inner_f90 * (diffuse_weight * layer_throughput)) + metal_gain;
        reflected = m.f0 * albedo_factors.x + m.f90 * albedo_factors.y;
        inner = (inner_f0 * albedo_factors.x + Vec3::splat(inner_f90 * albedo_factors.y)) * inner_gain;
    }
    m.diffuse = base * (diffuse_weight * layer_throughput * max(1.0 - largest(inner), 0.0));
    let mut glass_weight = 0.0;
    if lobes & LOBE_TRANSMISSION != 0 {
        let f0_ior = ratio * ratio;
        m.f0_ior = if m.thin { 2.0 * f0_ior / (1.0 + f0_ior) } else { f0_ior };
        m.glass_f0 = bounded_color(material.specular * m.f0_ior) * material.specular_weight;
        m.glass_f90 = material.specular_weight;
        m.ratio = if outside | m.thin {
            1.0 / material.ior
        } else {
            material.ior
        };
        let glass_albedo = max(energy.z, 1e-3);
        let gain = match (transmits_straight(&m), m.thin) {
            (true, _) => 1.0,
            (_, true) => 1.0 + compensation,
            (_, false) => 1.0 / glass_albedo,
        };
        let glass = dielectric * material.transmission * layer_throughput;
        m.glass = glass * gain;
        m.transmission_tint = base * m.glass;
        let mirrored = min(
            luminance(m.glass_f0 * albedo_factors.x + Vec3::splat(m.glass_f90 * albedo_factors.y)),
            1.0,
        );
        glass_weight = glass * (luminance(base) * (1.0 - mirrored) + mirrored);
    }
    let weights = Vec4::new(luminance(m.diffuse), luminance(reflected), glass_weight, coat_share);
    let sum = weights.x + weights.y + weights.z + weights.w + sheen_share;
    m.lobe_probs = if sum > 1e-30 {
        weights * (1.0 / max(sum, 1e-30))
    } else {
        Vec4::X
    };
    m
}

pub fn bounded_color(color: Vec3) -> Vec3 {
    Vec3::new(min(color.x, 1.0), min(color.y, 1.0), min(color.z, 1.0))
}

pub fn luminance(color: Vec3) -> f32 {
    0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z
}

pub fn sheen_probability(m: &PrincipledLobes) -> f32 {
    max(
        1.0 - (m.lobe_probs.x + m.lobe_probs.y + m.lobe_probs.z + m.lobe_probs.w),
        0.0,
    )
}

pub fn schlick(f0: Vec3, f90: Vec3, cosine: f32) -> Vec3 {
    let x = 1.0 - min(cosine, 1.0);
    let x2 = x * x;
    f0 + (f90 - f0) * (x2 * x2 * x)
}

pub fn glass_fresnel(m: &PrincipledLobes, cosine: f32) -> Vec3 {
    let c = min(max(cosine, 1e-6), 1.0);
    let cosine_t = refracted_cosine(c, m.ratio);
    let one_side = fresnel(c, cosine_t, m.ratio);
    let exact = if m.thin {
        2.0 * one_side / (1.0 + one_side)
    } else {
        one_side
    };
    let x = (exact - m.f0_ior) / max(1.0 - m.f0_ior, 1e-6);
    let f = m.glass_f0 + (Vec3::splat(m.glass_f90) - m.glass_f0) * x;
    if cosine_t == 0.0 {
        Vec3::ONE
    } else {
        bounded_color(Vec3::new(max(f.x, 0.0), max(f.y, 0.0), max(f.z, 0.0)))
    }
}

pub fn glass_probability(m: &PrincipledLobes, cosine: f32) -> f32 {
    min(luminance(glass_fresnel(m, cosine)), 1.0)
}

pub fn transmits_straight(m: &PrincipledLobes) -> bool {
    is_flat(m.alpha) | (!m.thin & ((m.eta - 1.0).abs() < 1e-3))
}

pub fn is_flat(alpha: Vec2) -> bool {
    max(alpha.x, alpha.y) <= SMALLEST_ALPHA
}

pub fn facets_eval(alpha: Vec2, wo: Vec3, wi: Vec3, half: Vec3) -> f32 {
    ggx_d(alpha, half) * ggx_g2(alpha, wo, wi) / (4.0 * max(wo.z, 1e-6))
}

pub fn half_between(wo: Vec3, wi: Vec3) -> Vec3 {
    let sum = wo + wi;
    sum * (1.0 / max(dot(sum, sum), 1e-20).sqrt())
}

pub fn refracting_half(wo: Vec3, wi: Vec3, eta: f32) -> Vec3 {
    let sum = wo * eta + wi;
    let unit = sum * (1.0 / max(dot(sum, sum), 1e-20).sqrt());
    if unit.z > 0.0 { unit } else { -unit }
}

pub fn refracting_density(wo: Vec3, wi: Vec3, half: Vec3, eta: f32) -> f32 {
    let o = dot(wo, half);
    let i = dot(wi, half);
    let sum = eta * o + i;
    let density = i.abs() / max(sum * sum, 1e-20);
    if (o > 0.0) & (i < 0.0) { density } else { 0.0 }
}

pub fn principled_eval(m: &PrincipledLobes, wo: Vec3, wi: Vec3, lobes: u32) -> Vec3 {
    let mut value = m.diffuse * (max(wi.z, 0.0) * std::f32::consts::FRAC_1_PI);
    if (lobes & LOBE_SPECULAR != 0) && (wi.z > 0.0) & !is_flat(m.alpha) {
        let half = half_between(wo, wi);
        value += schlick(m.f0, m.f90, max(dot(wo, half), 0.0)) * facets_eval(m.alpha, wo, wi, half);
    }
    if lobes & LOBE_TRANSMISSION != 0 && !transmits_straight(m) {
        value += glass_eval(m, wo, wi);
    }
    if (lobes & LOBE_COAT != 0) && (wi.z > 0.0) & (m.coat > 0.0) {
        value += Vec3::splat(coat_eval(m, wo, wi));
    }
    if (lobes & LOBE_SHEEN != 0) && wi.z > 0.0 {
        value += m.sheen * (sheen_lobe(m.sheen_alpha, wo, wi) * wi.z);
    }
    value
}

pub fn glass_eval(m: &PrincipledLobes, wo: Vec3, wi: Vec3) -> Vec3 {
    let above = wi.z > 0.0;
    if above | m.thin {
        let up = Vec3::new(wi.x, wi.y, wi.z.abs());
        let half = half_between(wo, up);
        let reflected = glass_fresnel(m, dot(wo, half));
        let factor = if above {
            reflected * m.glass
        } else {
            m.transmission_tint * (Vec3::ONE - reflected)
        };
        return factor * facets_eval(m.alpha, wo, up, half);
    }
    let half = refracting_half(wo, wi, m.eta);
    let reflected = glass_fresnel(m, dot(wo, half));
    let visible = ggx_pdf(m.alpha, wo, half) * ggx_g1(m.alpha, wi);
    let density = visible * refracting_density(wo, wi, half, m.eta) * (m.eta * m.eta);
    m.transmission_tint * (Vec3::ONE - reflected) * density
}

pub fn glass_pdf(m: &PrincipledLobes, wo: Vec3, wi: Vec3) -> f32 {
    let above = wi.z > 0.0;
    if above | m.thin {
        let half = half_between(wo, Vec3::new(wi.x, wi.y, wi.z.abs()));
        let chance = glass_probability(m, dot(wo, half));
        return mirrored_pdf(m.alpha, wo, half) * if above { chance } else { 1.0 - chance };
    }
    let half = refracting_half(wo, wi, m.eta);
    let chance = glass_probability(m, dot(wo, half));
    ggx_pdf(m.alpha, wo, half) * refracting_density(wo, wi, half, m.eta) * (1.0 - chance)
}

pub fn coat_eval(m: &PrincipledLobes, wo: Vec3, wi: Vec3) -> f32 {
    let o = to_frame_around(m.coat_normal, wo);
    let i = to_frame_around(m.coat_normal, wi);
    let alpha = Vec2::splat(m.coat_alpha);
    if is_flat(alpha) | (o.z <= 0.0) | (i.z <= 0.0) {
        return 0.0;
    }
    let half = half_between(o, i);
    let f = schlick(Vec3::splat(COAT_F0), Vec3::ONE, max(dot(o, half), 0.0));
    m.coat * f.x * facets_eval(alpha, o, i, half)
}

pub fn to_frame_around(n: Vec3, v: Vec3) -> Vec3 {
    let frame = frame_around(n);
    Vec3::new(dot(frame.u, v), dot(frame.v, v), dot(n, v))
}

pub fn principled_pdf(m: &PrincipledLobes, wo: Vec3, wi: Vec3, lobes: u32) -> f32 {
    let mut pdf = m.lobe_probs.x * (max(wi.z, 0.0) * std::f32::consts::FRAC_1_PI);
    if (lobes & LOBE_SPECULAR != 0) && (wi.z > 0.0) & !is_flat(m.alpha) {
        pdf += m.lobe_probs.y * mirrored_pdf(m.alpha, wo, half_between(wo, wi));
    }
    if lobes & LOBE_TRANSMISSION != 0 && (m.lobe_probs.z > 0.0) & !transmits_straight(m) {
        pdf += m.lobe_probs.z * glass_pdf(m, wo, wi);
    }
    if lobes & LOBE_COAT != 0 {
        let o = to_frame_around(m.coat_normal, wo);
        let i = to_frame_around(m.coat_normal, wi);
        let alpha = Vec2::splat(m.coat_alpha);
        if (m.lobe_probs.w > 0.0) & (i.z > 0.0) & !is_flat(alpha) {
            pdf += m.lobe_probs.w * mirrored_pdf(alpha, o, half_between(o, i));
        }
    }
    if lobes & LOBE_SHEEN != 0 {
        pdf += if wi.z > 0.0 {
            sheen_probability(m) * 0.159_154_94
        } else {
            0.0
        };
    }
    pdf
}

pub fn mirrored_pdf(alpha: Vec2, wo: Vec3, half: Vec3) -> f32 {
    let cosine = dot(wo, half);
    if cosine > 0.0 {
        ggx_pdf(alpha, wo, half) / (4.0 * max(cosine, 1e-6))
    } else {
        0.0
    }
}

pub fn no_sample() -> LobeSample {
    LobeSample {
        wi: Vec3::Z,
        weight: Vec3::ZERO,
        pdf: 0.0,
        eta: 1.0,
    }
}

pub fn principled_sample(m: &PrincipledLobes, wo: Vec3, u: Vec2, random: f32, lobes: u32) -> LobeSample {
    let p = disk_sample(u);
    let mut wi = p.extend(max(1.0 - p.x * p.x - p.y * p.y, 0.0).sqrt());
    let mut is_delta = false;
    let mut weight = Vec3::ZERO;
    let mut eta = 1.0;
    let mut remaining = random - m.lobe_probs.x;
    if lobes & LOBE_SPECULAR != 0 {
        if (remaining >= 0.0) & (remaining < m.lobe_probs.y) {
            is_delta = is_flat(m.alpha);
            let half = if is_delta { Vec3::Z } else { ggx_sample(m.alpha, wo, u) };
            wi = half * (2.0 * dot(wo, half)) - wo;
            weight = schlick(m.f0, m.f90, wo.z) * (1.0 / m.lobe_probs.y);
            if wi.z <= 0.0 {
                return no_sample();
            }
        }
        remaining -= m.lobe_probs.y;
    }
    if lobes & LOBE_TRANSMISSION != 0 {
        if (remaining >= 0.0) & (remaining < m.lobe_probs.z) {
            is_delta = transmits_straight(m);
            let half = if is_delta { Vec3::Z } else { ggx_sample(m.alpha, wo, u) };
            let cosine = max(dot(wo, half), 1e-6);
            let reflected = glass_fresnel(m, cosine);
            let chance = glass_probability(m, cosine);
            let reflects = remaining < m.lobe_probs.z * chance;
            let mirrored = half * (2.0 * cosine) - wo;
            let cosine_t = refracted_cosine(cosine, m.eta);
            let refracted = refracted_direction(-wo, half, m.eta, cosine, cosine_t);
            let transmitted = if m.thin {
                Vec3::new(mirrored.x, mirrored.y, -mirrored.z)
            } else {
                refracted
            };
            wi = normalize(if reflects { mirrored } else { transmitted });
            eta = if reflects { 1.0 } else { m.eta };
            let transmitted_weight = m.transmission_tint * (Vec3::ONE - reflected) * (m.eta * m.eta);
            let probability = max(m.lobe_probs.z * if reflects { chance } else { 1.0 - chance }, 1e-30);
            weight = if reflects {
                reflected * m.glass
            } else {
                transmitted_weight
            } * (1.0 / probability);
            if wi.z * if reflects { 1.0 } else { -1.0 } <= 0.0 {
                return no_sample();
            }
        }
        remaining -= m.lobe_probs.z;
    }
    if lobes & LOBE_COAT != 0 {
        if (remaining >= 0.0) & (remaining < m.lobe_probs.w) {
            let alpha = Vec2::splat(m.coat_alpha);
            is_delta = is_flat(alpha);
            let o = to_frame_around(m.coat_normal, wo);
            let half = if is_delta { Vec3::Z } else { ggx_sample(alpha, o, u) };
            wi = vector_around(m.coat_normal, half * (2.0 * dot(o, half)) - o);
            let reflected = schlick(Vec3::splat(COAT_F0), Vec3::ONE, o.z) * (m.coat / m.lobe_probs.w);
            weight = if wi.z > 0.0 { reflected } else { Vec3::ZERO };
        }
        remaining -= m.lobe_probs.w;
    }
    if (lobes & LOBE_SHEEN != 0) && remaining >= 0.0 {
        let height = 1.0 - p.x * p.x - p.y * p.y;
        wi = (p * max(1.0 + height, 0.0).sqrt()).extend(max(height, 0.0));
        is_delta = false;
    }
    if is_delta {
        return LobeSample {
            wi,
            weight,
            pdf: 0.0,
            eta,
        };
    }
    let pdf = principled_pdf(m, wo, wi, lobes);
    let value = principled_eval(m, wo, wi, lobes);
    let factor = if pdf > 1e-30 { 1.0 / max(pdf, 1e-30) } else { 0.0 };
    LobeSample {
        wi,
        weight: value * factor,
        pdf,
        eta,
    }
}

pub fn sheen_lobe(alpha: f32, wo: Vec3, wi: Vec3) -> f32 {
    let half = half_between(wo, wi);
    let sine = min(half.x * half.x + half.y * half.y, 1.0).sqrt();
    let d = (2.0 + 1.0 / alpha) * power(sine, 1.0 / alpha) * 0.159_154_94;
    d / (4.0 * max(wi.z + wo.z - wi.z * wo.z, 1e-4))
}

pub fn sheen_albedo(roughness: f32, cosine: f32) -> f32 {
    let r = roughness;
    let q = 1.0 / r;
    let s = max(cosine, 0.0).sqrt();
    let p0 = 0.389_026_82 - 1.904_149_5 * r + 0.943_046_03 * r * r + 0.132_342_25 * q;
    let p1 = 1.077_997_7 - 1.356_616_1 * r + 0.205_053_67 * r * r - 0.262_595_7 * q;
    let p2 = -12.212_699 + 15.173_416 * r - 5.192_227 * r * r + 0.104_818_46 * q;
    let p3 = 29.434_828 - 40.606_533 * r + 16.015_73 * r * r - 2.291_067_8 * q;
    let p4 = -18.896_416 + 29.188_488 * r - 12.603_876 * r * r + 0.700_986_5 * q;
    let logarithm = p0 + s * (p1 + s * (p2 + s * (p3 + s * p4)));
    1.02 * exp2(logarithm * std::f32::consts::LOG2_E)
}
