//! Twin of `shaders/integrators/path.wgsl`: the integrator `path`. Functions update the path state in place; copies of its
//! 300 bytes took 11 % of a render's time.

use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

use crate::cpu::alpha::{ONWARD, is_there, is_veiled};
use crate::cpu::dielectric::{dielectric_sample, transmittance};
use crate::cpu::differential::{Arrival, Differential};
use crate::cpu::diffuse::diffuse_sample;
use crate::cpu::emitter::{chosen_emitter, emitter_pdf, sample_emitter};
use crate::cpu::environment::light_from_afar;
use crate::cpu::geometry::{arrival_of, closest_hit, is_hidden, material_of, seen_path, spot_of, surface_of};
use crate::cpu::light_choice::{Chosen, chosen_light, met_density};
use crate::cpu::light_sample::power_heuristic;
use crate::cpu::lobe::{LobeSample, vector_from_lobe, vector_to_lobe};
use crate::cpu::math::{dot, max, min, normalize};
use crate::cpu::mesh::Spot;
use crate::cpu::metal::metal_fresnel;
use crate::cpu::modified_phong::modified_phong_sample;
use crate::cpu::path::{Path, mirrored_path, passed_path, reflected_path, refracted_path};
use crate::cpu::pixel::{Layers, camera_sample};
use crate::cpu::primitive::Tangents;
use crate::cpu::principled::{Mixture, principled_sample};
use crate::cpu::ray::{Hit, Ray};
use crate::cpu::rng::{hash4, unit_float};
use crate::cpu::scattering::{
    NO_MIXTURE, absorption_behind, albedo, bounded, facet_frame, facet_sample, facets_of, has_facets, has_inside,
    is_delta, lets_light, lets_through, lit_normal, local_wo, mixture_at, plain_reflection, reflection, shaded_normal,
    turned_over,
};
use crate::cpu::sequence::sobol_bits;
use crate::cpu::surface::{Surface, largest};
use crate::cpu::texture::appearance;
use crate::cpu::thin::thin_reflectance;
use crate::cpu::vertices::with_vertex_colors;
use crate::records::{
    BACKGROUND, DIFFUSE, EMITTER, GLASS, IMAGE_AROUND, INFINITE_T, INSTANCE, METAL, MOST_PASSED, Material, NO_INDEX,
    NOWHERE, OPAQUE, PHONG, PRINCIPLED, Packed, RANDOM, ROUGH_GLASS, THIN, UNSEEN_AROUND,
};

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
    pub start: Vec3,
    pub start_normal: Vec3,
    pub way: f32,
    pub passed: u32,
}

#[inline(always)]
pub fn begin_path(scene: &Packed, pixel: UVec2, sample: u32) -> PathState {
    let start = camera_sample(scene, pixel, sample);
    let mut path = Path {
        ray: start.ray,
        differential: start.differential,
        throughput: Vec3::ONE,
        depth: 0,
        branch: 0,
        left: NOWHERE,
        wall: NOWHERE,
    };
    let mut way = 0.0;
    if scene.specialization.hidden != 0 {
        path = seen_path(scene, path);
        way = dot(path.ray.origin - start.ray.origin, path.ray.direction);
    }
    PathState {
        path,
        radiance: Vec3::ZERO,
        pdf: 0.0,
        eta2: 1.0,
        absorption: Vec3::ZERO,
        sample,
        weight: start.weight,
        ended: false,
        layers: Layers::default(),
        described: false,
        start: Vec3::ZERO,
        start_normal: Vec3::ZERO,
        way,
        passed: 0,
    }
}

#[inline(always)]
pub fn advance(scene: &Packed, state: &mut PathState, pixel: UVec2) {
    let s = &scene.specialization;
    let path = state.path;
    let hit = closest_hit(scene, path.ray, path.left, path.wall);
    if hit.primitive == NO_INDEX {
        state.ended = true;
        let shown = ((s.alpha == 0) & (s.surroundings & UNSEEN_AROUND == 0)) | (path.depth > 0);
        let arriving = if s.surroundings & IMAGE_AROUND != 0 {
            light_from_afar(scene, path.ray.direction, state.pdf, state.start_normal)
        } else {
            scene.environment.radiance
        };
        let arriving = match s.surroundings & BACKGROUND != 0 && path.depth == 0 {
            true => scene.environment.background,
            false => arriving,
        };
        let found = path.throughput * arriving;
        return with_radiance(scene, state, found, shown, path.depth);
    }
    let spot = spot_of(scene, hit);
    let mut surface = surface_of(scene, &spot, hit, path.ray);
    let at = arrival_of(scene, &spot, hit, surface, path.ray, path.differential);
    let looked;
    let faceted;
    let (mut material, normal, coat_normal) = if (s.lookups == 0) & (s.vertex_colors == 0) {
        let normal = surface.shading_normal;
        (material_of(scene, &spot), normal, normal)
    } else {
        let mut look = appearance(scene, &spot, hit, material_of(scene, &spot), surface, at, s.lookups);
        if s.vertex_colors != 0 {
            look.material = with_vertex_colors(scene, &look.material, hit);
        }
        looked = bounded(look.material);
        (&looked, look.normal, look.coat_normal)
    };
    if s.sees_through != 0
        && !is_there(
            scene,
            material,
            pixel,
            state.sample,
            path.depth,
            ONWARD,
            hit,
            surface.side,
        )
    {
        return past(scene, state, surface, at, hit.t);
    }
    if s.absorption != 0 {
        let inside = has_inside(material) & (surface.side < 0.0) & (material.alpha_mode == OPAQUE);
        let absorption = if inside { material.absorption } else { state.absorption };
        state.path.throughput *= transmittance(absorption, hit.t + state.way);
    }
    if s.shines != 0 {
        with_emission(scene, state, &spot, hit, surface, material, true);
    }
    surface.shading_normal = shaded_normal(surface, material, normal);
    state.way = 0.0;
    let mixed;
    let mixture = if material.kind == PRINCIPLED {
        let frame = facet_frame(scene, surface, material);
        surface.du = frame.u;
        surface.dv = frame.v;
        mixed = mixture_at(scene, &surface, material, coat_normal);
        &mixed
    } else {
        &NO_MIXTURE
    };
    if s.layers != 0 {
        described(state, surface, material);
    }
    if (path.depth >= s.bounces) | (material.kind == EMITTER) {
        state.ended = true;
        return;
    }
    let seed = scene.camera.seed;
    let key = hash4(UVec4::new(pixel.x, pixel.y, seed, 1 + 2 * path.depth));
    let other_key = hash4(UVec4::new(pixel.x, pixel.y, seed, 2 + 2 * path.depth));
    let mut choices = UVec2::ZERO;
    if (s.materials & !(1 << DIFFUSE | 1 << EMITTER) != 0) | (s.rr_depth < s.bounces) {
        choices = decision_set(scene, UVec2::new(other_key.z, other_key.w), state.sample);
    }
    if is_delta(material) {
        scattered_specularly(scene, state, surface, at, material, unit_float(choices.x));
    } else {
        if s.in_tree & (1 << INSTANCE) != 0 {
            surface.start += surface.bulge;
        }
        if has_facets(material) {
            let frame = facet_frame(scene, surface, material);
            surface.du = frame.u;
            surface.dv = frame.v;
            faceted = facets_of(scene, &surface, *material);
            material = &faceted;
        }
        if s.emitters != 0 {
            let mut bits = UVec2::ZERO;
            if s.emitters > 1 {
                bits = decision_set(scene, UVec2::new(other_key.x, other_key.y), state.sample);
            }
            let mut chosen = Chosen {
                emitter: chosen_emitter(scene, bits),
                density: 0.0,
            };
            if s.light_tree != 0 {
                let normal = lit_normal(&surface, material);
                let level_key = UVec2::new(other_key.x, other_key.y);
                chosen = chosen_light(scene, chosen.emitter, surface.start, normal, level_key, state.sample);
            }
            let u = decision(scene, UVec2::new(key.x, key.y), state.sample);
            with_light(scene, state, &spot, &surface, material, mixture, chosen, u, true, pixel);
        }
        let u = decision(scene, UVec2::new(key.z, key.w), state.sample);
        scattered(
            scene,
            state,
            &spot,
            &surface,
            material,
            mixture,
            u,
            unit_float(choices.x),
        );
    }
    if s.rr_depth < s.bounces {
        with_roulette(scene, state, unit_float(choices.y));
    }
    let carries = largest(state.path.throughput) > 0.0;
    state.ended |= !carries;
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
pub fn with_radiance(scene: &Packed, state: &mut PathState, found: Vec3, taken: bool, bounces: u32) {
    let s = &scene.specialization;
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
}

#[inline(always)]
pub fn with_emission(
    scene: &Packed,
    state: &mut PathState,
    spot: &Spot,
    hit: Hit,
    surface: Surface,
    material: &Material,
    met: bool,
) {
    let one_sided = material.kind == EMITTER;
    let shines = (material.density > 0.0) & (!one_sided | (surface.side > 0.0));
    if !(met & shines) {
        return;
    }
    let mut weight = 1.0;
    let mut weighs = (state.pdf > 0.0) & (scene.specialization.emitters != 0);
    let mut density = material.density;
    if scene.specialization.light_tree != 0 {
        density = met_density(scene, hit, weighs, state.start, state.start_normal);
        weighs &= density > 0.0;
    }
    if weighs {
        let mut ray = state.path.ray;
        let mut seen = hit;
        if scene.specialization.sees_through != 0 {
            ray.origin -= ray.direction * state.way;
            seen.t += state.way;
        }
        let other = emitter_pdf(spot, seen, density, ray, surface.normal);
        weight = power_heuristic(state.pdf, other);
    }
    let found = state.path.throughput * material.emission * weight;
    with_radiance(scene, state, found, true, state.path.depth)
}

pub fn past(scene: &Packed, state: &mut PathState, surface: Surface, at: Arrival, t: f32) {
    state.path = passed_path(state.path, surface, at);
    if scene.specialization.hidden != 0 && state.path.depth == 0 {
        let start = state.path.ray;
        state.path = seen_path(scene, state.path);
        state.way += dot(state.path.ray.origin - start.origin, start.direction);
    }
    state.way += t;
    state.passed += 1;
    state.ended |= state.passed > MOST_PASSED;
}

#[inline(always)]
pub fn described(state: &mut PathState, surface: Surface, material: &Material) {
    if state.path.depth == 0 {
        state.layers.emission.w = 1.0;
        state.layers.normal = (surface.shading_normal * surface.side).extend(0.0);
    }
    if !state.described & !is_delta(material) {
        state.layers.albedo = (state.path.throughput * albedo(material)).extend(0.0);
        state.described = true;
    }
}

#[inline(always)]
pub fn scattered_specularly(
    scene: &Packed,
    state: &mut PathState,
    surface: Surface,
    at: Arrival,
    material: &Material,
    random: f32,
) {
    state.pdf = 0.0;
    let mut path = if (material.kind == GLASS) | (material.kind == ROUGH_GLASS) {
        let passage = dielectric_sample(state.path, surface, at, material, random);
        state.eta2 = state.eta2 * passage.eta * passage.eta;
        if scene.specialization.absorption != 0 && passage.passes {
            state.absorption = if surface.side > 0.0 {
                material.absorption
            } else {
                Vec3::ZERO
            };
        }
        passage.path
    } else if material.kind == THIN {
        let cosine = dot(surface.wo, surface.shading_normal);
        if random >= thin_reflectance(material.ior, cosine) {
            let throughput = state.path.throughput * material.tint;
            refracted_path(state.path, surface, at, throughput, 1.0, cosine, cosine)
        } else {
            reflected_path(state.path, surface, at, state.path.throughput)
        }
    } else {
        let mut onward = mirrored_path(state.path, surface, at, material).onward;
        if material.kind == METAL {
            let cosine = dot(surface.wo, surface.shading_normal);
            onward.throughput = state.path.throughput * metal_fresnel(material, cosine);
        }
        onward
    };
    path.ray.direction = normalize(path.ray.direction);
    state.path = path;
}

#[expect(clippy::too_many_arguments, reason = "the twin of a WGSL function has its arguments")]
#[inline(always)]
pub fn with_light(
    scene: &Packed,
    state: &mut PathState,
    spot: &Spot,
    surface: &Surface,
    material: &Material,
    mixture: &Mixture,
    chosen: Chosen,
    u: Vec2,
    wanted: bool,
    pixel: UVec2,
) {
    let light = sample_emitter(scene, chosen, surface.start, lit_normal(surface, material), u);
    let reflected = reflection(scene, spot, surface, material, mixture, normalize(light.to));
    let mut found = state.path.throughput * reflected.value * light.radiance * (1.0 / light.pdf);
    let turned;
    let mut from_side = surface;
    let mut to = light.to;
    let mut absorption = state.absorption;
    if lets_through(material) & (dot(surface.normal, to) < 0.0) {
        turned = turned_over(scene, surface);
        from_side = &turned;
        to = light.to
            + if light.reach < 2.0 {
                surface.start - from_side.start
            } else {
                Vec3::ZERO
            };
        absorption = absorption_behind(absorption, surface, material);
    }
    if scene.specialization.absorption != 0 {
        found *= transmittance(absorption, light.reach * dot(light.to, light.to).sqrt());
    }
    found *= if light.is_delta {
        1.0
    } else {
        power_heuristic(light.pdf, reflected.pdf)
    };
    let most = largest(found);
    let dark = !(wanted && most > 0.0 && most < INFINITE_T);
    if scene.specialization.sees_through != 0 {
        let bounce = state.path.depth + 1;
        let (reach, goal) = (light.reach, light.primitive);
        let veiled = is_veiled(scene, dark, from_side, to, reach, goal, pixel, state.sample, bounce);
        return with_radiance(scene, state, found, !veiled, bounce);
    }
    let hidden = is_hidden(scene, dark, from_side, to, light.reach, light.primitive);
    with_radiance(scene, state, found, !hidden, state.path.depth + 1)
}

#[expect(clippy::too_many_arguments, reason = "the twin of a WGSL function has its arguments")]
#[inline(always)]
pub fn scattered(
    scene: &Packed,
    state: &mut PathState,
    spot: &Spot,
    surface: &Surface,
    material: &Material,
    mixture: &Mixture,
    u: Vec2,
    random: f32,
) {
    if has_facets(material) {
        let frame = Tangents {
            u: surface.du,
            v: surface.dv,
        };
        let wo = vector_to_lobe(frame, surface.shading_normal, surface.wo);
        let found = facet_sample(material, wo, u, random);
        scattered_by_lobe(scene, state, spot, surface, material, found);
    } else if material.kind == PRINCIPLED {
        let found = principled_sample(mixture, local_wo(surface), u, random, scene.specialization.lobes);
        scattered_by_lobe(scene, state, spot, surface, material, found);
    } else {
        let wi = if material.kind == PHONG {
            modified_phong_sample(material, surface.shading_normal, surface.wo, u, random)
        } else {
            diffuse_sample(surface.shading_normal, u)
        };
        let reflected = plain_reflection(surface, material, wi);
        let value = if lets_light(scene, spot, surface, material, wi) {
            reflected.value
        } else {
            Vec3::ZERO
        };
        let factor = value * if reflected.pdf > 0.0 { 1.0 / reflected.pdf } else { 0.0 };
        state.path = Path {
            ray: Ray {
                origin: surface.start,
                direction: wi,
            },
            differential: Differential::default(),
            throughput: state.path.throughput * factor,
            depth: state.path.depth + 1,
            branch: 0,
            left: surface.above,
            wall: surface.below,
        };
        state.pdf = reflected.pdf;
    }
    if scene.specialization.light_tree != 0 {
        state.start = surface.start;
    }
    if (scene.specialization.light_tree != 0) | (scene.specialization.surroundings & IMAGE_AROUND != 0) {
        state.start_normal = lit_normal(surface, material);
    }
}

#[inline(always)]
pub fn scattered_by_lobe(
    scene: &Packed,
    state: &mut PathState,
    spot: &Spot,
    surface: &Surface,
    material: &Material,
    found: LobeSample,
) {
    let frame = Tangents {
        u: surface.du,
        v: surface.dv,
    };
    let wi = normalize(vector_from_lobe(frame, surface.shading_normal, found.wi));
    let lit = lets_light(scene, spot, surface, material, wi);
    let weight = if lit { found.weight } else { Vec3::ZERO };
    let turned;
    let mut from_side = surface;
    if found.wi.z < 0.0 {
        turned = turned_over(scene, surface);
        from_side = &turned;
        state.eta2 = state.eta2 * found.eta * found.eta;
        state.absorption = absorption_behind(state.absorption, surface, material);
    }
    state.path = Path {
        ray: Ray {
            origin: from_side.start,
            direction: wi,
        },
        differential: Differential::default(),
        throughput: state.path.throughput * weight,
        depth: state.path.depth + 1,
        branch: 0,
        left: from_side.above,
        wall: from_side.below,
    };
    state.pdf = found.pdf;
}

#[inline(always)]
pub fn with_roulette(scene: &Packed, state: &mut PathState, random: f32) {
    if state.path.depth < scene.specialization.rr_depth {
        return;
    }
    let chance = min(largest(state.path.throughput) / state.eta2, 1.0);
    state.ended |= random >= chance;
    state.path.throughput *= 1.0 / chance;
}
