//! What a kernel is told of a scene's materials: which there are, and what of them it needs not compute.

use glam::{UVec4, Vec3};

use super::appearance::Appearances;
use super::emitters::Shining;
use super::{
    DIFFUSE, FACET_KINDS, FOR_ANISOTROPY, FOR_COAT, FOR_EMISSION, FOR_METALLIC, FOR_ROUGHNESS, FOR_SHEEN,
    FOR_TRANSMISSION, FOR_WEIGHT, INSTANCE, LOBE_ANISOTROPY, LOBE_COAT, LOBE_SHEEN, LOBE_SPECULAR, LOBE_TRANSMISSION,
    Light, Material, OPAQUE, PRINCIPLED, SPECULAR_KINDS, Specialization,
};
use crate::cpu::lobe::is_polished;
use wgray_scene::{self as scene, Reflection, Scene};

pub(super) fn is_specular(material: &scene::Material) -> bool {
    match material.reflection {
        Reflection::Phong { .. } | Reflection::Diffuse { .. } => false,
        Reflection::Mirror { .. } | Reflection::Glass { .. } => true,
        Reflection::Conductor { .. } | Reflection::Dielectric { .. } => true,
        Reflection::Principled(_) => false,
    }
}

/// Bits of the largest shininess, if all are whole numbers so small that squaring beats the general power.
pub(super) fn exponent_bits(described: &[scene::Material], packed: &[Material]) -> u32 {
    let whole = described.iter().all(|material| {
        if let Reflection::Phong { shininess, .. } = &material.reflection {
            return shininess.fract() == 0.0 && *shininess <= 4096.0;
        }
        true
    });
    let largest = packed.iter().map(|material| material.exponent).max().unwrap_or(1);
    if whole { u32::BITS - largest.leading_zeros() } else { 0 }
}

/// Bits of the kinds of materials that may mirror or refract alone.
fn delta_kinds(materials: &[Material], appearances: &Appearances) -> u32 {
    let may = |material: &&Material| {
        let textured = appearances.has_lookup(material, FOR_ROUGHNESS);
        let faceted = FACET_KINDS >> material.kind & 1 != 0;
        SPECULAR_KINDS >> material.kind & 1 != 0 || faceted && (textured || is_polished(material))
    };
    materials
        .iter()
        .filter(may)
        .fold(0, |bits, material| bits | 1 << material.kind)
}

/// What the integrator `path` takes as constants, of itself.
pub(super) fn of_paths(
    scene: &Scene,
    materials: &[Material],
    appearances: &Appearances,
    shining: &Shining,
    lights: &[Light],
) -> Specialization {
    let any = |test: fn(&Material) -> bool| u32::from(materials.iter().any(test));
    let has_lookup = |purpose: u32| u32::from(appearances.have_lookup(purpose));
    let emitters = &shining.emitters;
    let meshes_shine = emitters.iter().any(|emitter| emitter.instance != 0)
        || shining.nodes.iter().any(|node| node.instance != UVec4::ZERO);
    Specialization {
        materials: materials.iter().fold(0, |bits, material| bits | 1 << material.kind),
        rough: any(|material| material.kind == DIFFUSE && material.roughness > 0.0) | has_lookup(FOR_ROUGHNESS),
        delta_kinds: delta_kinds(materials, appearances),
        anisotropic: any(|material| material.anisotropy > 0.0) | has_lookup(FOR_ANISOTROPY),
        lobes: lobes(materials, appearances),
        sees_through: any(|material| material.alpha_mode != OPAQUE),
        absorption: any(|material| material.absorption != Vec3::ZERO),
        shines: any(|material| material.density > 0.0),
        emitters: emitters.len().min(2) as u32,
        light_tree: (!shining.nodes.is_empty()).into(),
        emitter_kinds: lights.iter().fold(u32::from(meshes_shine) << INSTANCE, |bits, light| {
            bits | 1 << light.kind
        }),
        emission_textures: has_lookup(FOR_EMISSION),
        rr_depth: scene.render.rr_depth,
        most_indirect: scene.render.clamp.map_or(0, |clamp| (clamp as f32).to_bits()),
        alpha: scene.render.alpha.into(),
        layers: scene.render.alpha.into(),
        ..Specialization::default()
    }
}

/// The lobes that any principled material has.
fn lobes(materials: &[Material], appearances: &Appearances) -> u32 {
    let principled = || materials.iter().filter(|material| material.kind == PRINCIPLED);
    let lobe = |lobe: u32, textured: u32, has: fn(&Material) -> bool| {
        let there = principled().any(has) || principled().next().is_some() && appearances.have_lookup(textured);
        if there { lobe } else { 0 }
    };
    lobe(LOBE_SPECULAR, FOR_METALLIC | FOR_WEIGHT, |m| {
        m.metallic > 0.0 || m.specular_weight > 0.0
    }) | lobe(LOBE_TRANSMISSION, FOR_TRANSMISSION, |m| m.transmission > 0.0)
        | lobe(LOBE_COAT, FOR_COAT, |m| m.clearcoat > 0.0)
        | lobe(LOBE_SHEEN, FOR_SHEEN, |m| m.sheen != Vec3::ZERO)
        | lobe(LOBE_ANISOTROPY, FOR_ANISOTROPY, |m| m.anisotropy > 0.0)
}
