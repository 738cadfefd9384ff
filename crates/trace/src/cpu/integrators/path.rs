//! Twin of `shaders/integrators/path.wgsl`. Functions update the path state in place; copies of its 300 bytes took 11 %
//! of the render time.

use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

use crate::cpu::alpha::{RAY_BSDF, alpha_accepts, is_occluded_alpha};
use crate::cpu::dielectric::{dielectric_sample, transmittance};
use crate::cpu::differential::{Differential, HitDifferential};
use crate::cpu::diffuse::diffuse_sample;
use crate::cpu::emitter::{emitter_pdf, sample_emitter, select_emitter};
use crate::cpu::environment::{environment_eval, environment_mis};
use crate::cpu::geometry::{
    closest_hit, fetch_hit_primitive, hit_differential, is_occluded, material_of, skip_camera_invisible, surface_of,
};
use crate::cpu::lanes::{Real, Vector2, Word, WordVector2, WordVector4};
use crate::cpu::light_choice::{EmitterSelection, light_tree_pdf, light_tree_select};
use crate::cpu::light_sample::power_heuristic;
use crate::cpu::lobe::{LobeSample, vector_from_lobe, vector_to_lobe};
use crate::cpu::math::{dot, max, min, normalize};
use crate::cpu::mesh::HitPrimitive;
use crate::cpu::metal::metal_fresnel;
use crate::cpu::modified_phong::modified_phong_sample;
use crate::cpu::path::{Path, mirrored_path, pass_through_path, reflected_path, refracted_path};
use crate::cpu::pixel::{Layers, camera_sample};
use crate::cpu::primitive::Tangents;
use crate::cpu::principled::{PrincipledLobes, principled_sample};
use crate::cpu::ray::{Hit, Ray};
use crate::cpu::rng::{hash4, unit_float};
use crate::cpu::scattering::{
    NO_LOBES, absorption_after, albedo, bounded, direction_allowed, facet_frame, facet_sample, flipped, has_facets,
    has_inside, is_delta, is_transmissive, lit_normal, local_wo, material_for_view, mixture_at, plain_reflection,
    reflection, shaded_normal,
};
use crate::cpu::sequence::sobol_bits;
use crate::cpu::shadow_ray::ShadowRay;
use crate::cpu::surface::{Surface, largest};
use crate::cpu::texture::evaluate_material;
use crate::cpu::thin::thin_reflectance;
use crate::cpu::vertices::with_vertex_colors;
use crate::records::{
    BACKGROUND, DIFFUSE, EMITTER, ENVIRONMENT_INVISIBLE, ENVIRONMENT_MAP, GLASS, INFINITE_T, INSTANCE, MAX_ALPHA_SKIPS,
    METAL, Material, NO_INDEX, NO_PRIMITIVE, OPAQUE, PHONG, PRINCIPLED, Packed, RANDOM, ROUGH_GLASS, THIN,
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
    pub albedo_recorded: bool,
    pub prev_position: Vec3,
    pub prev_normal: Vec3,
    pub skipped_distance: f32,
    pub skips: u32,
}

#[inline(never)] // compiled once, for `pixel_radiance` and the wavefront
pub fn begin_path(scene: &Packed, pixel: UVec2, sample: u32) -> PathState {
    let start = camera_sample(scene, pixel, sample);
    let mut path = Path {
        ray: start.ray,
        differential: start.differential,
        throughput: Vec3::ONE,
        depth: 0,
        branch: 0,
        origin_prim: NO_PRIMITIVE,
        inside_prim: NO_PRIMITIVE,
    };
    let mut skipped_distance = 0.0;
    if scene.specialization.camera_invisible != 0 {
        path = skip_camera_invisible(scene, path);
        skipped_distance = dot(path.ray.origin - start.ray.origin, path.ray.direction);
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
        albedo_recorded: false,
        prev_position: Vec3::ZERO,
        prev_normal: Vec3::ZERO,
        skipped_distance,
        skips: 0,
    }
}

#[inline(always)]
pub fn advance(scene: &Packed, state: &mut PathState, pixel: UVec2) {
    let path = &state.path;
    let hit = closest_hit(scene, path.ray, path.origin_prim, path.inside_prim);
    if let Some(ray) = shade(scene, state, hit, pixel) {
        let occluded = is_shadow_ray_occluded(scene, &ray, pixel, state.sample);
        add_radiance(scene, state, ray.contribution, !occluded, ray.bounces);
    }
}

/// The part of [`advance`] after the closest hit: ends the path or samples its next ray. Returns the shadow ray, if
/// any. It must be traced before the next hit is shaded.
#[inline(never)] // compiled once, for `advance` and the wavefront
pub fn shade(scene: &Packed, state: &mut PathState, hit: Hit, pixel: UVec2) -> Option<ShadowRay> {
    let s = &scene.specialization;
    let path = state.path;
    if hit.primitive == NO_INDEX {
        let environment_light = if s.environment_flags & ENVIRONMENT_MAP != 0 {
            environment_mis(
                environment_eval(scene, path.ray.direction, state.prev_normal),
                state.pdf,
            )
        } else {
            scene.environment.radiance
        };
        leave_scene(scene, state, environment_light);
        return None;
    }
    let prim = fetch_hit_primitive(scene, hit);
    let mut surface = surface_of(scene, &prim, hit, path.ray);
    let hit_diff = hit_differential(scene, &prim, hit, surface, path.ray, path.differential);
    let textured;
    let microfacets;
    let (mut material, normal, coat_normal) = if (s.lookups == 0) & (s.vertex_colors == 0) {
        let normal = surface.shading_normal;
        (material_of(scene, &prim), normal, normal)
    } else {
        let mut shading = evaluate_material(
            scene,
            &prim,
            hit,
            material_of(scene, &prim),
            surface,
            hit_diff,
            s.lookups,
        );
        if s.vertex_colors != 0 {
            shading.material = with_vertex_colors(scene, &shading.material, hit);
        }
        textured = bounded(shading.material);
        (&textured, shading.normal, shading.coat_normal)
    };
    if s.alpha_surfaces != 0
        && !alpha_accepts(
            scene,
            material,
            pixel,
            state.sample,
            path.depth,
            RAY_BSDF,
            hit,
            surface.side,
        )
    {
        continue_through(scene, state, surface, hit_diff, hit.t);
        return None;
    }
    if s.absorption != 0 {
        let inside = has_inside(material) & (surface.side < 0.0) & (material.alpha_mode == OPAQUE);
        let absorption = if inside { material.absorption } else { state.absorption };
        state.path.throughput *= transmittance(absorption, hit.t + state.skipped_distance);
    }
    if s.emissive != 0 {
        add_emission(scene, state, &prim, hit, surface, material, true);
    }
    surface.shading_normal = shaded_normal(surface, material, normal);
    let distance = hit.t + state.skipped_distance;
    state.skipped_distance = 0.0;
    let principled_lobes;
    let mixture = if material.kind == PRINCIPLED {
        let frame = facet_frame(scene, surface, material);
        surface.du = frame.u;
        surface.dv = frame.v;
        principled_lobes = mixture_at(scene, &surface, material, coat_normal);
        &principled_lobes
    } else {
        &NO_LOBES
    };
    if s.layers != 0 {
        record_first_hit_layers(scene, state, surface, material, distance);
    }
    if (path.depth >= s.bounces) | (material.kind == EMITTER) {
        state.ended = true;
        return None;
    }
    let mut shadow_ray = None;
    let seed = scene.camera.seed;
    let key = hash4(UVec4::new(pixel.x, pixel.y, seed, 1 + 2 * path.depth));
    let decision_key = hash4(UVec4::new(pixel.x, pixel.y, seed, 2 + 2 * path.depth));
    let mut choices = UVec2::ZERO;
    if (s.materials & !(1 << DIFFUSE | 1 << EMITTER) != 0) | (s.rr_depth < s.bounces) {
        choices = decision_set(scene, UVec2::new(decision_key.z, decision_key.w), state.sample);
    }
    if is_delta(material) {
        sample_delta_bsdf(scene, state, surface, hit_diff, material, unit_float(choices.x));
    } else {
        if s.tlas_kinds & (1 << INSTANCE) != 0 {
            surface.ray_origin += surface.terminator_offset;
        }
        if has_facets(material) {
            let frame = facet_frame(scene, surface, material);
            surface.du = frame.u;
            surface.dv = frame.v;
            microfacets = material_for_view(scene, &surface, *material);
            material = &microfacets;
        }
        if s.emitters != 0 {
            let mut bits = UVec2::ZERO;
            if s.emitters > 1 {
                bits = decision_set(scene, UVec2::new(decision_key.x, decision_key.y), state.sample);
            }
            let mut selection = EmitterSelection {
                emitter: select_emitter(scene, bits),
                density: 0.0,
            };
            if s.light_tree != 0 {
                let normal = lit_normal(&surface, material);
                let level_key = UVec2::new(decision_key.x, decision_key.y);
                selection = light_tree_select(
                    scene,
                    selection.emitter,
                    surface.ray_origin,
                    normal,
                    level_key,
                    state.sample,
                );
            }
            let u = decision(scene, UVec2::new(key.x, key.y), state.sample);
            shadow_ray = sample_direct_light(scene, state, &prim, &surface, material, mixture, selection, u);
        }
        let u = decision(scene, UVec2::new(key.z, key.w), state.sample);
        sample_bsdf(
            scene,
            state,
            &prim,
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
    let has_throughput = largest(state.path.throughput) > 0.0;
    state.ended |= !has_throughput;
    shadow_ray
}

/// Ends a path whose ray hits nothing, and adds the light of the environment.
#[inline(always)]
pub fn leave_scene(scene: &Packed, state: &mut PathState, environment_light: Vec3) {
    let s = &scene.specialization;
    let depth = state.path.depth;
    state.ended = true;
    let is_environment_visible = ((s.alpha == 0) & (s.environment_flags & ENVIRONMENT_INVISIBLE == 0)) | (depth > 0);
    let environment_light = match s.environment_flags & BACKGROUND != 0 && depth == 0 {
        true => scene.environment.background,
        false => environment_light,
    };
    let contribution = state.path.throughput * environment_light;
    add_radiance(scene, state, contribution, is_environment_visible, depth);
}

/// Returns true if the geometry occludes a shadow ray.
pub fn is_shadow_ray_occluded(scene: &Packed, ray: &ShadowRay, pixel: UVec2, sample: u32) -> bool {
    let surface = ray.surface();
    if scene.specialization.alpha_surfaces == 0 {
        return is_occluded(scene, false, &surface, ray.to_light, ray.t_max, ray.target_prim);
    }
    is_occluded_alpha(
        scene,
        false,
        &surface,
        ray.to_light,
        ray.t_max,
        ray.target_prim,
        pixel,
        sample,
        ray.bounces,
    )
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
pub fn decision_set<W: Word>(scene: &Packed, key: W::UVec2, sample: W) -> W::UVec2 {
    if scene.specialization.pixel_pattern == RANDOM {
        let bits = hash4(W::UVec4::from_words([key.x(), key.y(), sample, sample.splat(0)]));
        let [x, y, ..] = bits.words();
        return W::UVec2::new(x, y);
    }
    sobol_bits(sample, key)
}

#[inline(always)]
pub fn decision<W: Word>(scene: &Packed, key: W::UVec2, sample: W) -> <W::Real as Real>::Vec2 {
    let bits = decision_set(scene, key, sample);
    Vector2::new(unit_float(bits.x()), unit_float(bits.y()))
}

#[inline(always)]
pub fn add_radiance(scene: &Packed, state: &mut PathState, contribution: Vec3, is_enabled: bool, bounces: u32) {
    let s = &scene.specialization;
    let mut radiance = if is_enabled { contribution } else { Vec3::ZERO };
    if s.max_indirect != 0 && bounces > 1 {
        let scale = f32::from_bits(s.max_indirect) / max(largest(contribution), 1e-30);
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
pub fn add_emission(
    scene: &Packed,
    state: &mut PathState,
    prim: &HitPrimitive,
    hit: Hit,
    surface: Surface,
    material: &Material,
    is_hit: bool,
) {
    let one_sided = material.kind == EMITTER;
    let is_emissive = (material.density > 0.0) & (!one_sided | (surface.side > 0.0));
    if !(is_hit & is_emissive) {
        return;
    }
    let mut weight = 1.0;
    let mut uses_mis = (state.pdf > 0.0) & (scene.specialization.emitters != 0);
    let mut density = material.density;
    if scene.specialization.light_tree != 0 {
        density = light_tree_pdf(scene, hit, uses_mis, state.prev_position, state.prev_normal);
        uses_mis &= density > 0.0;
    }
    if uses_mis {
        let mut ray = state.path.ray;
        let mut from_previous = hit;
        if scene.specialization.alpha_surfaces != 0 {
            ray.origin -= ray.direction * state.skipped_distance;
            from_previous.t += state.skipped_distance;
        }
        let light_pdf = emitter_pdf(prim, from_previous, density, ray, surface.normal);
        weight = power_heuristic(state.pdf, light_pdf);
    }
    let contribution = state.path.throughput * material.emission * weight;
    add_radiance(scene, state, contribution, true, state.path.depth)
}

pub fn continue_through(scene: &Packed, state: &mut PathState, surface: Surface, hit_diff: HitDifferential, t: f32) {
    state.path = pass_through_path(state.path, surface, hit_diff);
    if scene.specialization.camera_invisible != 0 && state.path.depth == 0 {
        let start = state.path.ray;
        state.path = skip_camera_invisible(scene, state.path);
        state.skipped_distance += dot(state.path.ray.origin - start.origin, start.direction);
    }
    state.skipped_distance += t;
    state.skips += 1;
    state.ended |= state.skips > MAX_ALPHA_SKIPS;
}

#[inline(always)]
pub fn record_first_hit_layers(
    scene: &Packed,
    state: &mut PathState,
    surface: Surface,
    material: &Material,
    distance: f32,
) {
    if state.path.depth == 0 {
        state.layers.emission.w = 1.0;
        let distance = if scene.specialization.noise != 0 { distance } else { 0.0 };
        state.layers.normal = (surface.shading_normal * surface.side).extend(distance);
    }
    if !state.albedo_recorded & !is_delta(material) {
        state.layers.albedo = (state.path.throughput * albedo(material)).extend(0.0);
        state.albedo_recorded = true;
    }
}

#[inline(always)]
pub fn sample_delta_bsdf(
    scene: &Packed,
    state: &mut PathState,
    surface: Surface,
    hit_diff: HitDifferential,
    material: &Material,
    random: f32,
) {
    state.pdf = 0.0;
    let mut path = if (material.kind == GLASS) | (material.kind == ROUGH_GLASS) {
        let glass_sample = dielectric_sample(state.path, surface, hit_diff, material, random);
        state.eta2 = state.eta2 * glass_sample.eta * glass_sample.eta;
        if scene.specialization.absorption != 0 && glass_sample.is_transmitted {
            state.absorption = if surface.side > 0.0 {
                material.absorption
            } else {
                Vec3::ZERO
            };
        }
        glass_sample.path
    } else if material.kind == THIN {
        let cosine = dot(surface.wo, surface.shading_normal);
        if random >= thin_reflectance(material.ior, cosine) {
            let throughput = state.path.throughput * material.tint;
            refracted_path(state.path, surface, hit_diff, throughput, 1.0, cosine, cosine)
        } else {
            reflected_path(state.path, surface, hit_diff, state.path.throughput)
        }
    } else {
        let mut continued = mirrored_path(state.path, surface, hit_diff, material).primary;
        if material.kind == METAL {
            let cosine = dot(surface.wo, surface.shading_normal);
            continued.throughput = state.path.throughput * metal_fresnel(material, cosine);
        }
        continued
    };
    path.ray.direction = normalize(path.ray.direction);
    state.path = path;
}

#[expect(clippy::too_many_arguments, reason = "a twin has the arguments of its WGSL function")]
#[inline(always)]
fn sample_direct_light(
    scene: &Packed,
    state: &mut PathState,
    prim: &HitPrimitive,
    surface: &Surface,
    material: &Material,
    mixture: &PrincipledLobes,
    selection: EmitterSelection,
    u: Vec2,
) -> Option<ShadowRay> {
    let light = sample_emitter(scene, selection, surface.ray_origin, lit_normal(surface, material), u);
    let reflected = reflection(scene, prim, surface, material, mixture, normalize(light.to));
    let mut contribution = state.path.throughput * reflected.value * light.radiance * (1.0 / light.pdf);
    let flipped_surface;
    let mut exit_surface = surface;
    let mut to_light = light.to;
    let mut absorption = state.absorption;
    if is_transmissive(material) & (dot(surface.normal, to_light) < 0.0) {
        flipped_surface = flipped(scene, surface);
        exit_surface = &flipped_surface;
        to_light = light.to
            + if light.t_max < 2.0 {
                surface.ray_origin - exit_surface.ray_origin
            } else {
                Vec3::ZERO
            };
        absorption = absorption_after(absorption, surface, material);
    }
    if scene.specialization.absorption != 0 {
        contribution *= transmittance(absorption, light.t_max * dot(light.to, light.to).sqrt());
    }
    contribution *= if light.is_delta {
        1.0
    } else {
        power_heuristic(light.pdf, reflected.pdf)
    };
    let max_component = largest(contribution);
    let bounces = state.path.depth + 1;
    if !(max_component > 0.0 && max_component < INFINITE_T) {
        add_radiance(scene, state, contribution, false, bounces);
        return None;
    }
    Some(ShadowRay {
        origin: exit_surface.ray_origin,
        to_light,
        t_max: light.t_max,
        exclude_front: exit_surface.exclude_front,
        exclude_back: exit_surface.exclude_back,
        target_prim: light.primitive,
        contribution,
        bounces,
    })
}

#[expect(clippy::too_many_arguments, reason = "a twin has the arguments of its WGSL function")]
#[inline(always)]
pub fn sample_bsdf(
    scene: &Packed,
    state: &mut PathState,
    prim: &HitPrimitive,
    surface: &Surface,
    material: &Material,
    mixture: &PrincipledLobes,
    u: Vec2,
    random: f32,
) {
    if has_facets(material) {
        let frame = Tangents {
            u: surface.du,
            v: surface.dv,
        };
        let wo = vector_to_lobe(frame, surface.shading_normal, surface.wo);
        let lobe_sample = facet_sample(material, wo, u, random);
        apply_lobe_sample(scene, state, prim, surface, material, lobe_sample);
    } else if material.kind == PRINCIPLED {
        let lobe_sample = principled_sample(mixture, local_wo(surface), u, random, scene.specialization.lobes);
        apply_lobe_sample(scene, state, prim, surface, material, lobe_sample);
    } else {
        let wi = if material.kind == PHONG {
            modified_phong_sample(material, surface.shading_normal, surface.wo, u, random)
        } else {
            diffuse_sample(surface.shading_normal, u)
        };
        let reflected = plain_reflection(surface, material, wi);
        let value = if direction_allowed(scene, prim, surface, material, wi) {
            reflected.value
        } else {
            Vec3::ZERO
        };
        let factor = value * if reflected.pdf > 0.0 { 1.0 / reflected.pdf } else { 0.0 };
        state.path = Path {
            ray: Ray {
                origin: surface.ray_origin,
                direction: wi,
            },
            differential: Differential::default(),
            throughput: state.path.throughput * factor,
            depth: state.path.depth + 1,
            branch: 0,
            origin_prim: surface.exclude_front,
            inside_prim: surface.exclude_back,
        };
        state.pdf = reflected.pdf;
    }
    if scene.specialization.light_tree != 0 {
        state.prev_position = surface.ray_origin;
    }
    if (scene.specialization.light_tree != 0) | (scene.specialization.environment_flags & ENVIRONMENT_MAP != 0) {
        state.prev_normal = lit_normal(surface, material);
    }
}

#[inline(always)]
pub fn apply_lobe_sample(
    scene: &Packed,
    state: &mut PathState,
    prim: &HitPrimitive,
    surface: &Surface,
    material: &Material,
    lobe_sample: LobeSample,
) {
    let frame = Tangents {
        u: surface.du,
        v: surface.dv,
    };
    let wi = normalize(vector_from_lobe(frame, surface.shading_normal, lobe_sample.wi));
    let is_allowed = direction_allowed(scene, prim, surface, material, wi);
    let weight = if is_allowed { lobe_sample.weight } else { Vec3::ZERO };
    let flipped_surface;
    let mut exit_surface = surface;
    if lobe_sample.wi.z < 0.0 {
        flipped_surface = flipped(scene, surface);
        exit_surface = &flipped_surface;
        state.eta2 = state.eta2 * lobe_sample.eta * lobe_sample.eta;
        state.absorption = absorption_after(state.absorption, surface, material);
    }
    state.path = Path {
        ray: Ray {
            origin: exit_surface.ray_origin,
            direction: wi,
        },
        differential: Differential::default(),
        throughput: state.path.throughput * weight,
        depth: state.path.depth + 1,
        branch: 0,
        origin_prim: exit_surface.exclude_front,
        inside_prim: exit_surface.exclude_back,
    };
    state.pdf = lobe_sample.pdf;
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
