//! Twin of `shaders/integrators/path.wgsl`: the integrator `path`. Its functions are parts of one: a path's state stays where it is.

use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

use crate::cpu::dielectric::{dielectric_sample, refracts_inwards, transmittance};
use crate::cpu::differential::{Arrival, Differential};
use crate::cpu::diffuse::{angles_at, diffuse_eval, diffuse_pdf, diffuse_sample, rough_diffuse_eval};
use crate::cpu::emitter::{chosen_emitter, emitter_pdf, sample_emitter};
use crate::cpu::geometry::{arrival_of, closest_hit, is_hidden, material_of, spot_of, surface_of};
use crate::cpu::light_sample::power_heuristic;
use crate::cpu::math::{dot, max, min, normalize};
use crate::cpu::mesh::{Spot, face_lets_pass};
use crate::cpu::modified_phong::{modified_phong_eval, modified_phong_pdf, modified_phong_sample, phong_factors};
use crate::cpu::path::{Path, is_specular, mirrored_path, usable_normal};
use crate::cpu::phong::is_lit;
use crate::cpu::pixel::{Layers, camera_sample};
use crate::cpu::ray::{Hit, Ray};
use crate::cpu::rng::{hash4, unit_float};
use crate::cpu::sequence::sobol_bits;
use crate::cpu::surface::{Surface, largest};
use crate::cpu::texture::appearance;
use crate::pack::{DIFFUSE, EMITTER, Emitter, FAR, GLASS, INSTANCE, Material, NOTHING, NOWHERE, PHONG, Packed, RANDOM};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathState {
    pub path: Path,
    pub radiance: Vec3,
    pub pdf: f32,
    pub eta2: f32,
    pub absorption: Vec3,
    pub sample: u32,
    pub weight: f32,
    pub ended: bool,
    pub layers: Layers,
    pub described: bool,
}

#[inline(always)]
pub fn begin_path(scene: &Packed, pixel: UVec2, sample: u32) -> PathState {
    let start = camera_sample(scene, pixel, sample);
    PathState {
        path: Path {
            ray: start.ray,
            differential: start.differential,
            throughput: Vec3::ONE,
            depth: 0,
            branch: 0,
            left: NOWHERE,
            wall: NOWHERE,
        },
        radiance: Vec3::ZERO,
        pdf: 0.0,
        eta2: 1.0,
        absorption: Vec3::ZERO,
        sample,
        weight: start.weight,
        ended: false,
        layers: Layers::default(),
        described: false,
    }
}

#[inline(always)]
pub fn advance(scene: &Packed, before: PathState, pixel: UVec2) -> PathState {
    let s = &scene.specialization;
    let mut state = before;
    let path = before.path;
    let hit = closest_hit(scene, path.ray, path.left, path.wall);
    if hit.primitive == NOTHING {
        state.ended = true;
        let shown = (s.alpha == 0) | (path.depth > 0);
        let found = path.throughput * scene.environment.radiance;
        return with_radiance(scene, state, found, shown, path.depth);
    }
    let spot = spot_of(scene, hit);
    let mut surface = surface_of(scene, &spot, hit, path.ray);
    let at = arrival_of(scene, &spot, hit, surface, path.ray, path.differential);
    let looked;
    let (material, normal) = if s.lookups == 0 {
        (material_of(scene, &spot), surface.shading_normal)
    } else {
        let look = appearance(scene, &spot, hit, material_of(scene, &spot), surface, at, s.lookups);
        looked = bounded(look.material);
        (&looked, look.normal)
    };
    if s.absorption != 0 {
        let inside = (material.kind == GLASS) & (surface.side < 0.0);
        let absorption = if inside { material.absorption } else { state.absorption };
        state.path.throughput *= transmittance(absorption, hit.t);
    }
    if s.shines != 0 {
        state = with_emission(scene, state, &spot, hit, surface, material, true);
    }
    surface.shading_normal = shaded_normal(surface, material, normal);
    if s.layers != 0 {
        state = described(state, surface, material);
    }
    if (path.depth >= s.bounces) | (material.kind == EMITTER) {
        state.ended = true;
        return state;
    }
    let seed = scene.camera.seed;
    let key = hash4(UVec4::new(pixel.x, pixel.y, seed, 1 + 2 * path.depth));
    let other_key = hash4(UVec4::new(pixel.x, pixel.y, seed, 2 + 2 * path.depth));
    let mut choices = UVec2::ZERO;
    if (s.materials & !(1 << DIFFUSE | 1 << EMITTER) != 0) | (s.rr_depth < s.bounces) {
        choices = decision_set(scene, UVec2::new(other_key.z, other_key.w), state.sample);
    }
    if is_specular(material) {
        state = scattered_specularly(scene, state, surface, at, material, unit_float(choices.x));
    } else {
        if s.in_tree & (1 << INSTANCE) != 0 {
            surface.start += surface.bulge;
        }
        if s.emitters != 0 {
            let mut bits = UVec2::ZERO;
            if s.emitters > 1 {
                bits = decision_set(scene, UVec2::new(other_key.x, other_key.y), state.sample);
            }
            let u = decision(scene, UVec2::new(key.x, key.y), state.sample);
            state = with_light(
                scene,
                state,
                &spot,
                &surface,
                material,
                chosen_emitter(scene, bits),
                u,
                true,
            );
        }
        let u = decision(scene, UVec2::new(key.z, key.w), state.sample);
        state = scattered(scene, state, &spot, &surface, material, u, unit_float(choices.x));
    }
    if s.rr_depth < s.bounces {
        state = with_roulette(scene, state, unit_float(choices.y));
    }
    let carries = largest(state.path.throughput) > 0.0;
    state.ended |= !carries;
    state
}

#[inline(always)]
pub fn path_value(state: &PathState) -> Vec4 {
    (state.radiance * state.weight).extend(state.weight)
}

pub fn path_layers(state: &PathState) -> Layers {
    let layers = state.layers;
    let weight = state.weight;
    Layers {
        emission: layers.emission * weight,
        direct: layers.direct * weight,
        indirect: layers.indirect * weight,
        albedo: layers.albedo * weight,
        normal: layers.normal * weight,
    }
}

#[inline(always)]
pub fn decision_set(scene: &Packed, key: UVec2, sample: u32) -> UVec2 {
    if scene.specialization.pixel_pattern == RANDOM {
        let bits = hash4(UVec4::new(key.x, key.y, sample, 0));
        return UVec2::new(bits.x, bits.y);
    }
    sobol_bits(sample, key)
}

#[inline(always)]
pub fn decision(scene: &Packed, key: UVec2, sample: u32) -> Vec2 {
    let bits = decision_set(scene, key, sample);
    Vec2::new(unit_float(bits.x), unit_float(bits.y))
}

#[inline(always)]
pub fn with_radiance(scene: &Packed, before: PathState, found: Vec3, taken: bool, bounces: u32) -> PathState {
    let s = &scene.specialization;
    let mut state = before;
    let mut radiance = if taken { found } else { Vec3::ZERO };
    if s.most_indirect != 0 && bounces > 1 {
        let scale = f32::from_bits(s.most_indirect) / max(largest(found), 1e-30);
        radiance *= min(scale, 1.0);
    }
    state.radiance += radiance;
    if s.layers != 0 {
        let layer = match bounces {
            0 => &mut state.layers.emission,
            1 => &mut state.layers.direct,
            _ => &mut state.layers.indirect,
        };
        *layer += radiance.extend(0.0);
    }
    state
}

#[inline(always)]
pub fn with_emission(
    scene: &Packed,
    state: PathState,
    spot: &Spot,
    hit: Hit,
    surface: Surface,
    material: &Material,
    met: bool,
) -> PathState {
    let one_sided = material.kind == EMITTER;
    let shines = (material.density > 0.0) & (!one_sided | (surface.side > 0.0));
    if !(met & shines) {
        return state;
    }
    let mut weight = 1.0;
    if (state.pdf > 0.0) & (scene.specialization.emitters != 0) {
        let other = emitter_pdf(spot, hit, material, state.path.ray, surface.normal);
        weight = power_heuristic(state.pdf, other);
    }
    let found = state.path.throughput * material.emission * weight;
    with_radiance(scene, state, found, true, state.path.depth)
}

#[inline(always)]
pub fn shaded_normal(surface: Surface, material: &Material, normal: Vec3) -> Vec3 {
    if is_specular(material) {
        let usable = usable_normal(surface, normal);
        if (material.kind == GLASS) && !refracts_inwards(&surface, material, usable) {
            return surface.normal;
        }
        return usable;
    }
    normal
}

pub fn bounded(found: Material) -> Material {
    let mut material = found;
    let bounded = |color: Vec3| color.map(|x| if x > 1.0 { 1.0 } else { x });
    if found.kind == DIFFUSE {
        material.diffuse = bounded(found.diffuse);
    }
    material.tint = bounded(found.tint);
    material.roughness = min(found.roughness, 1.0);
    material
}

#[inline(always)]
pub fn described(before: PathState, surface: Surface, material: &Material) -> PathState {
    let mut state = before;
    if state.path.depth == 0 {
        state.layers.emission.w = 1.0;
        state.layers.normal = (surface.shading_normal * surface.side).extend(0.0);
    }
    if !state.described & !is_specular(material) {
        state.layers.albedo = (state.path.throughput * albedo(material)).extend(0.0);
        state.described = true;
    }
    state
}

pub fn albedo(material: &Material) -> Vec3 {
    if material.kind == PHONG {
        let factors = phong_factors(material);
        return factors.diffuse + factors.specular;
    }
    if material.kind == DIFFUSE {
        material.diffuse
    } else {
        Vec3::ZERO
    }
}

#[inline(always)]
pub fn scattered_specularly(
    scene: &Packed,
    before: PathState,
    surface: Surface,
    at: Arrival,
    material: &Material,
    random: f32,
) -> PathState {
    let mut state = before;
    state.pdf = 0.0;
    let mut path = if material.kind == GLASS {
        let passage = dielectric_sample(before.path, surface, at, material, random);
        state.eta2 = before.eta2 * passage.eta * passage.eta;
        if scene.specialization.absorption != 0 && passage.passes {
            state.absorption = if surface.side > 0.0 {
                material.absorption
            } else {
                Vec3::ZERO
            };
        }
        passage.path
    } else {
        mirrored_path(before.path, surface, at, material).onward
    };
    path.ray.direction = normalize(path.ray.direction);
    state.path = path;
    state
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflection {
    pub value: Vec3,
    pub pdf: f32,
}

#[inline(always)]
pub fn reflection(scene: &Packed, spot: &Spot, surface: &Surface, material: &Material, wi: Vec3) -> Reflection {
    let angles = angles_at(surface.shading_normal, surface.wo, wi);
    let (value, pdf) = if material.kind == PHONG {
        (
            modified_phong_eval(material, angles),
            modified_phong_pdf(material, angles),
        )
    } else if material.roughness > 0.0 {
        (rough_diffuse_eval(material, angles), diffuse_pdf(angles))
    } else {
        (diffuse_eval(material, angles), diffuse_pdf(angles))
    };
    let mut lit = is_lit(surface, wi);
    if scene.specialization.in_tree & (1 << INSTANCE) != 0 {
        lit &= face_lets_pass(spot, surface, wi);
    }
    Reflection {
        value: if lit { value } else { Vec3::ZERO },
        pdf,
    }
}

#[expect(clippy::too_many_arguments, reason = "the twin of a WGSL function has its arguments")]
#[inline(always)]
pub fn with_light(
    scene: &Packed,
    state: PathState,
    spot: &Spot,
    surface: &Surface,
    material: &Material,
    emitter: Emitter,
    u: Vec2,
    wanted: bool,
) -> PathState {
    let light = sample_emitter(scene, emitter, surface.start, u);
    let reflected = reflection(scene, spot, surface, material, normalize(light.to));
    let mut found = state.path.throughput * reflected.value * light.radiance * (1.0 / light.pdf);
    if scene.specialization.absorption != 0 {
        found *= transmittance(state.absorption, light.reach * dot(light.to, light.to).sqrt());
    }
    found *= if light.is_delta {
        1.0
    } else {
        power_heuristic(light.pdf, reflected.pdf)
    };
    let most = largest(found);
    let dark = !(wanted && most > 0.0 && most < FAR);
    let hidden = is_hidden(scene, dark, surface, light.to, light.reach, light.primitive);
    with_radiance(scene, state, found, !hidden, state.path.depth + 1)
}

#[inline(always)]
pub fn scattered(
    scene: &Packed,
    before: PathState,
    spot: &Spot,
    surface: &Surface,
    material: &Material,
    u: Vec2,
    random: f32,
) -> PathState {
    let mut state = before;
    let wi = if material.kind == PHONG {
        modified_phong_sample(material, surface.shading_normal, surface.wo, u, random)
    } else {
        diffuse_sample(surface.shading_normal, u)
    };
    let reflected = reflection(scene, spot, surface, material, wi);
    let factor = reflected.value * if reflected.pdf > 0.0 { 1.0 / reflected.pdf } else { 0.0 };
    state.path = Path {
        ray: Ray {
            origin: surface.start,
            direction: wi,
        },
        differential: Differential::default(),
        throughput: before.path.throughput * factor,
        depth: before.path.depth + 1,
        branch: 0,
        left: surface.above,
        wall: surface.below,
    };
    state.pdf = reflected.pdf;
    state
}

#[inline(always)]
pub fn with_roulette(scene: &Packed, before: PathState, random: f32) -> PathState {
    let mut state = before;
    if state.path.depth < scene.specialization.rr_depth {
        return state;
    }
    let chance = min(largest(state.path.throughput) / state.eta2, 1.0);
    state.ended |= random >= chance;
    state.path.throughput *= 1.0 / chance;
    state
}
