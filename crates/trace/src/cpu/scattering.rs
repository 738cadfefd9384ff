//! Twin of `shaders/scattering.wgsl`.

use glam::{Vec2, Vec3, Vec4};

use super::dielectric::{eta_of, refracts_inwards};
use super::diffuse::{angles_at, diffuse_eval, diffuse_pdf, rough_diffuse_eval};
use super::energy::{principled_energy, single_scatter_albedo_aniso, single_scatter_albedo_glass};
use super::lobe::{LobeSample, facet_alpha, facet_loss, is_polished, lobe_frame, vector_to_lobe};
use super::math::{dot, max, min};
use super::mesh::{HitPrimitive, face_direction_allowed};
use super::metal::{metal_eval, metal_fresnel, metal_pdf, metal_sample};
use super::modified_phong::{modified_phong_eval, modified_phong_pdf, phong_factors};
use super::path::{is_specular, usable_normal};
use super::phong::is_lit;
use super::primitive::Tangents;
use super::principled::{PrincipledLobes, principled_eval, principled_mixture, principled_pdf};
use super::rough_dielectric::{rough_dielectric_eval, rough_dielectric_pdf, rough_dielectric_sample};
use super::surface::Surface;
use super::thin::{thin_eval, thin_pdf, thin_sample};
use super::warp::frame_around;
use crate::records::{
    DIFFUSE, GLASS, INSTANCE, LOBE_COAT, METAL, MICROFACET_KINDS, Material, NO_INDEX, PHONG, PRINCIPLED, Packed,
    ROUGH_GLASS, THIN, TRANSMISSIVE_KINDS,
};

/// Placeholder for the lobes of materials that are not [`PRINCIPLED`].
pub static NO_LOBES: PrincipledLobes = PrincipledLobes {
    diffuse: Vec3::ZERO,
    alpha: Vec2::ZERO,
    f0: Vec3::ZERO,
    f90: Vec3::ZERO,
    glass: 0.0,
    transmission_tint: Vec3::ZERO,
    glass_f0: Vec3::ZERO,
    glass_f90: 0.0,
    f0_ior: 0.0,
    ratio: 0.0,
    eta: 0.0,
    thin: false,
    coat: 0.0,
    coat_alpha: 0.0,
    coat_normal: Vec3::ZERO,
    sheen: Vec3::ZERO,
    sheen_alpha: 0.0,
    lobe_probs: Vec4::ZERO,
};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflection {
    pub value: Vec3,
    pub pdf: f32,
}

#[inline(always)]
pub fn plain_reflection(surface: &Surface, material: &Material, wi: Vec3) -> Reflection {
    let angles = angles_at(surface.shading_normal, surface.wo, wi);
    if material.kind == PHONG {
        return Reflection {
            value: modified_phong_eval(material, angles),
            pdf: modified_phong_pdf(material, angles),
        };
    }
    Reflection {
        value: if material.roughness > 0.0 {
            rough_diffuse_eval(material, angles)
        } else {
            diffuse_eval(material, angles)
        },
        pdf: diffuse_pdf(angles),
    }
}

#[inline(always)]
pub fn reflection(
    scene: &Packed,
    prim: &HitPrimitive,
    surface: &Surface,
    material: &Material,
    mixture: &PrincipledLobes,
    wi: Vec3,
) -> Reflection {
    let frame = Tangents {
        u: surface.du,
        v: surface.dv,
    };
    let mut result = if has_facets(material) {
        let wo = vector_to_lobe(frame, surface.shading_normal, surface.wo);
        facet_reflection(material, wo, vector_to_lobe(frame, surface.shading_normal, wi))
    } else if material.kind == PRINCIPLED {
        let lobes = scene.specialization.lobes;
        let local = vector_to_lobe(frame, surface.shading_normal, wi);
        let wo = local_wo(surface);
        Reflection {
            value: principled_eval(mixture, wo, local, lobes),
            pdf: principled_pdf(mixture, wo, local, lobes),
        }
    } else {
        plain_reflection(surface, material, wi)
    };
    if !direction_allowed(scene, prim, surface, material, wi) {
        result.value = Vec3::ZERO;
    }
    result
}

#[inline(always)] // a call copies the material twice
pub fn bounded(original: Material) -> Material {
    let mut material = original;
    let clamped = |color: Vec3| color.map(|x| if x > 1.0 { 1.0 } else { x });
    if (original.kind == DIFFUSE) | (original.kind == PRINCIPLED) {
        material.diffuse = clamped(original.diffuse);
    }
    material.tint = clamped(original.tint);
    material.roughness = min(original.roughness, 1.0);
    if original.kind == PRINCIPLED {
        material.sheen = clamped(original.sheen);
        material.sheen_roughness = min(original.sheen_roughness, 1.0);
        material.anisotropy = min(original.anisotropy, 1.0);
        material.metallic = min(original.metallic, 1.0);
        material.transmission = min(original.transmission, 1.0);
        material.clearcoat = min(original.clearcoat, 1.0);
        material.clearcoat_roughness = min(original.clearcoat_roughness, 1.0);
        material.specular_weight = min(original.specular_weight, 1.0);
    }
    material
}

#[inline(always)]
pub fn shaded_normal(surface: Surface, material: &Material, normal: Vec3) -> Vec3 {
    if is_delta(material) {
        let usable = usable_normal(surface, normal);
        let refracts = (material.kind == GLASS) | (material.kind == ROUGH_GLASS);
        if refracts && !refracts_inwards(&surface, material, usable) {
            return surface.normal;
        }
        return usable;
    }
    if has_facets(material) | (material.kind == PRINCIPLED) {
        return usable_normal(surface, normal);
    }
    normal
}

pub fn albedo(material: &Material) -> Vec3 {
    if material.kind == PHONG {
        let factors = phong_factors(material);
        return factors.diffuse + factors.specular;
    }
    match material.kind {
        DIFFUSE | PRINCIPLED => material.diffuse,
        METAL => metal_fresnel(material, 1.0),
        ROUGH_GLASS | THIN => material.tint,
        _ => Vec3::ZERO,
    }
}

#[inline(always)]
pub fn has_inside(material: &Material) -> bool {
    let is_volume = (material.kind == PRINCIPLED) & (material.thin == 0) & (material.transmission > 0.0);
    (material.kind == GLASS) | (material.kind == ROUGH_GLASS) | is_volume
}

#[inline(always)]
pub fn is_delta(material: &Material) -> bool {
    is_specular(material) || has_facets(material) && is_polished(material)
}

#[inline(always)]
pub fn has_facets(material: &Material) -> bool {
    (MICROFACET_KINDS >> material.kind) & 1 != 0
}

#[inline(always)]
pub fn facet_frame(scene: &Packed, surface: Surface, material: &Material) -> Tangents {
    if scene.specialization.anisotropic != 0 {
        return lobe_frame(&surface, material.rotation);
    }
    frame_around(surface.shading_normal)
}

#[inline(always)] // a call copies the material
pub fn material_for_view(scene: &Packed, surface: &Surface, original: Material) -> Material {
    let mut material = original;
    let frame = Tangents {
        u: surface.du,
        v: surface.dv,
    };
    let wo = vector_to_lobe(frame, surface.shading_normal, surface.wo);
    if material.kind == ROUGH_GLASS {
        material.ior = 1.0 / eta_of(surface, &original);
    }
    if material.energy != NO_INDEX {
        material.loss = if material.kind == ROUGH_GLASS {
            1.0 / single_scatter_albedo_glass(scene, &material, facet_alpha(&material), wo, surface.side) - 1.0
        } else if material.aniso_table != 0 {
            1.0 / single_scatter_albedo_aniso(scene, &material, facet_alpha(&material), wo, 0) - 1.0
        } else {
            facet_loss(facet_alpha(&material), wo)
        };
    }
    material
}

#[inline(always)]
pub fn facet_reflection(material: &Material, wo: Vec3, wi: Vec3) -> Reflection {
    let (value, pdf) = match material.kind {
        METAL => (metal_eval(material, wo, wi), metal_pdf(material, wo, wi)),
        ROUGH_GLASS => (
            rough_dielectric_eval(material, wo, wi),
            rough_dielectric_pdf(material, wo, wi),
        ),
        _ => (thin_eval(material, wo, wi), thin_pdf(material, wo, wi)),
    };
    Reflection { value, pdf }
}

#[inline(always)]
pub fn facet_sample(material: &Material, wo: Vec3, u: Vec2, random: f32) -> LobeSample {
    match material.kind {
        METAL => metal_sample(material, wo, u),
        ROUGH_GLASS => rough_dielectric_sample(material, wo, u, random),
        _ => thin_sample(material, wo, u, random),
    }
}

pub fn local_wo(surface: &Surface) -> Vec3 {
    let frame = Tangents {
        u: surface.du,
        v: surface.dv,
    };
    let wo = vector_to_lobe(frame, surface.shading_normal, surface.wo);
    Vec3::new(wo.x, wo.y, max(wo.z, 1e-6))
}

pub fn mixture_at(scene: &Packed, surface: &Surface, material: &Material, coat_normal: Vec3) -> PrincipledLobes {
    let s = &scene.specialization;
    let mut coat = Vec3::Z;
    if (s.lobes & LOBE_COAT != 0) & (s.normal_maps == 1) {
        let frame = Tangents {
            u: surface.du,
            v: surface.dv,
        };
        coat = vector_to_lobe(frame, surface.shading_normal, usable_normal(*surface, coat_normal));
    }
    let wo = local_wo(surface);
    let energy = principled_energy(scene, material, wo, surface.side);
    principled_mixture(material, wo, surface.side > 0.0, coat, s.lobes, energy)
}

#[inline(always)]
pub fn direction_allowed(
    scene: &Packed,
    prim: &HitPrimitive,
    surface: &Surface,
    material: &Material,
    wi: Vec3,
) -> bool {
    let mut lit = is_lit(surface, wi);
    if scene.specialization.tlas_kinds & (1 << INSTANCE) != 0 {
        lit &= face_direction_allowed(prim, surface, wi);
    }
    if is_transmissive(material) {
        let behind = (dot(surface.shading_normal, wi) < 0.0) & (dot(surface.smooth_normal, wi) < 0.0);
        lit |= behind & (dot(surface.normal, wi) < 0.0);
    }
    lit
}

#[inline(always)]
pub fn is_transmissive(material: &Material) -> bool {
    let transmits = (TRANSMISSIVE_KINDS >> material.kind) & 1 != 0;
    transmits | ((material.kind == PRINCIPLED) & (material.transmission > 0.0))
}

#[inline(always)]
pub fn lit_normal(surface: &Surface, material: &Material) -> Vec3 {
    if !is_transmissive(material) {
        surface.shading_normal
    } else {
        Vec3::ZERO
    }
}

pub fn flipped(scene: &Packed, surface: &Surface) -> Surface {
    let mut result = *surface;
    result.ray_origin = surface.position - (surface.ray_origin - surface.position);
    if scene.specialization.tlas_kinds & (1 << INSTANCE) != 0 {
        result.ray_origin += surface.terminator_offset;
    }
    result.exclude_front = surface.exclude_back;
    result.exclude_back = surface.exclude_front;
    result
}

pub fn absorption_after(before: Vec3, surface: &Surface, material: &Material) -> Vec3 {
    if !has_inside(material) {
        before
    } else if surface.side > 0.0 {
        material.absorption
    } else {
        Vec3::ZERO
    }
}
