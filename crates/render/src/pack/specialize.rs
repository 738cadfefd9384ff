//! Specialization of a kernel to a scene's features, so that unused features cost nothing.

use glam::{UVec4, Vec3};

use super::emitters::PackedEmitters;
use super::environment_map::EnvironmentMap;
use super::materials::Appearances;
use super::{
    Counts, DIFFUSE, FOR_ANISOTROPY, FOR_EMISSION, FOR_ROUGHNESS, GRID, HALTON, INSTANCE, JITTERED, Light,
    MICROFACET_KINDS, Material, NO_COLORS, OPAQUE, PRINCIPLED, RANDOM, ROTATED_GRID, SOBOL, SPECULAR_KINDS, SPOT,
    Specialization,
};
use wgray_scene::{self as scene, Pattern, Projection, Reflection, Samples, Scene};
use wgray_trace::cpu::lobe::is_polished;
use wgray_trace::records::{LOBES, Lobe, PackedBvh};

/// Minimum number of pilot samples per pixel, after which adaptive sampling estimates the error.
const MIN_PILOT_SAMPLES: u32 = 16;

/// The parts of a scene that determine the specialization.
pub(super) struct Parts<'a> {
    pub scene: &'a Scene,
    pub appearances: &'a Appearances,
    pub materials: &'a [Material],
    /// Number of area lights (rectangles), which come first.
    pub area_lights: usize,
    pub lights: &'a [Light],
    pub emitters: &'a PackedEmitters,
    pub environment_map: &'a EnvironmentMap,
    pub bvh: &'a PackedBvh,
    pub counts: &'a Counts,
    pub filter_bins: usize,
}

impl Parts<'_> {
    pub fn specialization(&self) -> Specialization {
        with_camera_features(&self.without_camera(), &self.scene.camera)
    }

    fn without_camera(&self) -> Specialization {
        let Parts {
            scene,
            appearances,
            materials,
            area_lights,
            lights,
            ..
        } = *self;
        let (pixels, light_samples) = (scene.render.pixel_samples, scene.render.light_samples);
        let adaptive = scene.render.adaptive;
        let is_path = scene.render.integrator.follows_paths();
        let (lookups, specular_lookups) = appearances.lookups(scene.render.integrator);
        let has_vertex_colors = materials.iter().any(|material| material.vertex_colors != NO_COLORS)
            && self.bvh.meshes.iter().any(|mesh| !mesh.colors.is_empty());
        Specialization {
            primitives: self.kinds(|range| range.z),
            shadow_casters: self.kinds(|range| range.y),
            tlas_kinds: (self.bvh.items.iter()).fold(0, |bits, item| bits | 1 << (item.kind & 0xff)),
            lights: u32::from(area_lights > 0)
                | u32::from(lights.len() > area_lights) << 1
                | u32::from(lights.iter().any(|light| light.kind == SPOT)) << 2,
            camera_invisible: materials.iter().any(|material| material.camera_culling != 0).into(),
            pixel_pattern: pattern(pixels),
            pixel_side: side(pixels),
            pixel_samples: pixels.count,
            light_pattern: pattern(light_samples),
            light_side: side(light_samples),
            light_samples: light_samples.count,
            filter_bins: self.filter_bins as u32,
            pilot_samples: adaptive.map_or(pixels.count, |adaptive| {
                pilot_samples(pixels.count, adaptive.max_samples)
            }),
            smooth_noise: scene.render.integrator.has_smooth_noise().into(),
            squared_error: adaptive
                .map_or(0.0, |adaptive| (adaptive.error * adaptive.error) as f32)
                .to_bits(),
            exponent_bits: exponent_bits(&scene.materials, &materials[..scene.materials.len()]),
            bounces: match is_path || scene.materials.iter().any(is_specular) {
                true => scene.render.max_depth,
                false => 0,
            },
            differentials: (scene.render.ray_differentials && appearances.needs_footprints()).into(),
            lookups,
            specular_lookups,
            normal_maps: appearances.has_normal_maps().into(),
            uv_sets: appearances.lookups.iter().any(|lookup| lookup.uv_set != 0).into(),
            vertex_colors: has_vertex_colors.into(),
            texture_kinds: appearances.kinds(),
            texel_formats: appearances.formats(),
            ..match is_path {
                true => Specialization {
                    environment_flags: self.environment_map.bits(scene),
                    ..path_constants(scene, materials, appearances, self.emitters, lights)
                },
                false => Specialization::default(),
            }
        }
    }

    /// Returns the bits of kinds with a nonempty range in [`Counts`], up to `end`.
    fn kinds(&self, end: fn(UVec4) -> u32) -> u32 {
        let kinds = (0..).zip(self.counts.primitives);
        kinds.fold(0, |bits, (kind, range)| bits | u32::from(end(range) > range.x) << kind)
    }
}

/// Sets the constants that depend on the camera.
pub fn with_camera_features(specialization: &Specialization, camera: &scene::Camera) -> Specialization {
    Specialization {
        lens: camera.lens.is_some().into(),
        panoramic: (camera.projection == Projection::Panorama).into(),
        ..*specialization
    }
}

/// Returns the number of pilot samples of adaptive sampling: complete rounds with at least as many samples as a
/// variance estimate requires, but at most `max`.
fn pilot_samples(round: u32, max: u32) -> u32 {
    MIN_PILOT_SAMPLES.next_multiple_of(round).max(round).min(max)
}

fn pattern(samples: Samples) -> u32 {
    match samples.pattern {
        Pattern::Grid => GRID,
        Pattern::Random => RANDOM,
        Pattern::RotatedGrid => ROTATED_GRID,
        Pattern::Jittered => JITTERED,
        Pattern::Halton => HALTON,
        Pattern::Sobol => SOBOL,
    }
}

/// Returns the grid's side for patterns with cells, else the number of samples.
fn side(samples: Samples) -> u32 {
    if samples.pattern.needs_square() {
        samples.count.isqrt()
    } else {
        samples.count
    }
}

fn is_specular(material: &scene::Material) -> bool {
    match material.reflection {
        Reflection::Phong { .. } | Reflection::Diffuse { .. } => false,
        Reflection::Mirror { .. } | Reflection::Glass { .. } => true,
        Reflection::Conductor { .. } | Reflection::Dielectric { .. } => true,
        Reflection::Principled(_) => false,
    }
}

/// Returns the bit length of the largest shininess if all values are integers up to 4096, for which repeated squaring
/// is faster than the general power; else 0.
fn exponent_bits(validated: &[scene::Material], packed: &[Material]) -> u32 {
    let all_integers = validated.iter().all(|material| {
        if let Reflection::Phong { shininess, .. } = &material.reflection {
            return shininess.fract() == 0.0 && *shininess <= 4096.0;
        }
        true
    });
    let largest = packed.iter().map(|material| material.exponent).max().unwrap_or(1);
    if all_integers {
        u32::BITS - largest.leading_zeros()
    } else {
        0
    }
}

fn delta_kinds(materials: &[Material], appearances: &Appearances) -> u32 {
    let may_be_delta = |material: &&Material| {
        let textured = appearances.has_lookup(material, FOR_ROUGHNESS);
        let faceted = MICROFACET_KINDS >> material.kind & 1 != 0;
        SPECULAR_KINDS >> material.kind & 1 != 0 || faceted && (textured || is_polished(material))
    };
    materials
        .iter()
        .filter(may_be_delta)
        .fold(0, |bits, material| bits | 1 << material.kind)
}

/// Returns the constants of the integrator `path`.
fn path_constants(
    scene: &Scene,
    materials: &[Material],
    appearances: &Appearances,
    packed: &PackedEmitters,
    lights: &[Light],
) -> Specialization {
    let any = |test: fn(&Material) -> bool| u32::from(materials.iter().any(test));
    let has_lookup = |purpose: u32| u32::from(appearances.any_material_has_lookup(purpose));
    let emitters = &packed.lighting.emitters;
    let meshes_emit = emitters.iter().any(|emitter| emitter.instance != 0)
        || packed.lighting.nodes.iter().any(|node| node.instance != UVec4::ZERO);
    Specialization {
        materials: materials.iter().fold(0, |bits, material| bits | 1 << material.kind),
        rough: any(|material| material.kind == DIFFUSE && material.roughness > 0.0) | has_lookup(FOR_ROUGHNESS),
        delta_kinds: delta_kinds(materials, appearances),
        anisotropic: any(|material| material.anisotropy > 0.0) | has_lookup(FOR_ANISOTROPY),
        lobes: lobes(materials, appearances),
        alpha_surfaces: any(|material| material.alpha_mode != OPAQUE),
        absorption: any(|material| material.absorption != Vec3::ZERO),
        emissive: any(|material| material.density > 0.0),
        emitters: emitters.len().min(2) as u32,
        light_tree: (!packed.lighting.nodes.is_empty()).into(),
        emitter_kinds: lights
            .iter()
            .fold(u32::from(meshes_emit) << INSTANCE, |bits, light| bits | 1 << light.kind),
        emission_textures: has_lookup(FOR_EMISSION),
        rr_depth: scene.render.rr_depth,
        max_indirect: scene.render.clamp.map_or(0, |clamp| (clamp as f32).to_bits()),
        alpha: scene.render.alpha.into(),
        layers: scene.render.alpha.into(),
        noise: 0,
        ..Specialization::default()
    }
}

fn lobes(materials: &[Material], appearances: &Appearances) -> u32 {
    let mut principled = materials
        .iter()
        .filter(|material| material.kind == PRINCIPLED)
        .peekable();
    if principled.peek().is_none() {
        return 0;
    }
    let principled: Vec<&Material> = principled.collect();
    let has_lobe = |lobe: &&Lobe| {
        principled.iter().any(|material| (lobe.is_in)(material)) || appearances.any_material_has_lookup(lobe.purposes)
    };
    LOBES.iter().filter(has_lobe).fold(0, |bits, lobe| bits | lobe.bit)
}
