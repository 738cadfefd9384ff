//! Shading of queued hits in SIMD lanes.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};
use glam::{UVec2, Vec3};

use super::super::differential::Differential;
use super::super::integrators::path::{PathState, add_emission, add_radiance, decision, decision_set};
use super::super::lanes::{Lanes2, MaterialFields, Real, Vector3, Word, constant, select};
use super::super::light_sample::power_heuristic;
use super::super::math::{dot, min, normalize};
use super::super::metal::metal_fresnel;
use super::super::path::{Path, usable_normal};
use super::super::ray::Ray;
use super::super::rng::{hash4, unit_float};
use super::super::shadow_ray::ShadowRay;
use super::super::surface::largest;
use super::QueuedShadowRay;
use super::environment::leave_to_environment;
use super::hit_materials::{HitMaterials, evaluate};
use super::lights::{LightChoices, LightRows, only_light};
use super::materials::{Diffuse, Directions, Facets, Principled};
use super::rows::{F, LANES, Row, Rows3, get3, load3, set3, splat3, store3};
use super::shade::{IS_OPTIMIZED, MaterialKind, QueuedHit, ShadingQueues, SurfaceKind};
use super::smooth::{smooth_normal, smooth_rays};
use super::surfaces::{FaceHits, FlatHits, LaneSurfaces, ScalarHits};
use crate::records::{ENVIRONMENT_MAP, INFINITE_T, INSTANCE, LOBE_TRANSMISSION, Packed};

/// The paths of a batch, and the queue of their shadow rays.
pub struct Batch<'a> {
    pub scene: &'a Packed,
    pub paths: &'a mut [PathState],
    pub pixels: &'a [UVec2],
    pub shadow_rays: &'a mut Vec<QueuedShadowRay>,
}

/// Path states before a bounce.
#[derive(Default)]
struct PathRows {
    throughput: Rows3,
    eta2: Row,
    pixel_x: [u32; LANES],
    pixel_y: [u32; LANES],
    sample: [u32; LANES],
    depth: [u32; LANES],
    exclude_front: [UVec2; LANES],
    exclude_back: [UVec2; LANES],
}

/// Records the layers of the first hit, like `record_first_hit_layers`. `albedo` includes the throughput; [`None`] for a
/// smooth material.
#[inline(always)]
fn record_layers(scene: &Packed, state: &mut PathState, normal: Vec3, albedo: Option<Vec3>, t: f32) {
    if state.path.depth == 0 {
        state.layers.emission.w = 1.0;
        let has_distance = scene.specialization.noise != 0;
        let distance = if has_distance { t + state.skipped_distance } else { 0.0 };
        state.layers.normal = normal.extend(distance);
    }
    if let Some(albedo) = albedo
        && !state.albedo_recorded
    {
        state.layers.albedo = albedo.extend(0.0);
        state.albedo_recorded = true;
    }
}

impl Batch<'_> {
    /// Ends the paths that hit nothing, and shades all queued hits. Only one loop contains the code for all kinds, so
    /// that it is compiled only once.
    #[inline(always)]
    pub fn shade_queues<S: Simd>(&mut self, simd: S, queues: &ShadingQueues) {
        let scene = self.scene;
        leave_to_environment(simd, scene, self.paths, queues.missed());
        let epsilon = scene.environment.shadow_epsilon;
        let (mut flat, mut faces, mut evaluated) = (FlatHits::new(), FaceHits::new(), ScalarHits::default());
        let mut lights = LightRows::new(only_light(scene));
        let mut materials = HitMaterials::default();
        for (material_kind, surface_kind, queue) in queues.filled() {
            for hits in queue.chunks(LANES) {
                let mut rows = PathRows::default();
                for (lane, queued) in hits.iter().enumerate() {
                    self.gather(&mut rows, lane, queued);
                    let state = &mut self.paths[queued.path as usize];
                    let path = &state.path;
                    match surface_kind {
                        SurfaceKind::Flat => flat.set(scene, lane, path.ray, queued.hit),
                        SurfaceKind::Face => faces.set(scene, lane, path.ray, queued.hit),
                        SurfaceKind::Evaluated => {
                            let hit = evaluate(scene, path, queued.hit);
                            if scene.specialization.emissive != 0 {
                                add_emission(scene, state, &hit.prim, queued.hit, hit.surface, &hit.material, true);
                            }
                            evaluated.set(lane, &hit.surface, &hit.prim, hit.coat_normal);
                            materials.set_evaluated(lane, &hit);
                            rows.exclude_front[lane] = hit.surface.exclude_front;
                            rows.exclude_back[lane] = hit.surface.exclude_back;
                            continue;
                        }
                    }
                    materials.set(scene, lane, queued.material);
                    let prim_id = UVec2::new(queued.hit.instance, queued.hit.primitive);
                    (rows.exclude_front[lane], rows.exclude_back[lane]) = (prim_id, prim_id);
                }
                let surfaces = match surface_kind {
                    SurfaceKind::Flat => flat.surfaces(simd, epsilon),
                    SurfaceKind::Face => faces.surfaces(simd, epsilon),
                    SurfaceKind::Evaluated => evaluated.surfaces(simd, scene.specialization.anisotropic != 0),
                };
                self.shade(simd, hits, &rows, &mut lights, surfaces, material_kind, &mut materials);
            }
        }
    }

    #[inline(always)]
    fn gather(&self, rows: &mut PathRows, lane: usize, queued: &QueuedHit) {
        let i = queued.path as usize;
        let state = &self.paths[i];
        set3(&mut rows.throughput, lane, state.path.throughput);
        rows.eta2[lane] = state.eta2;
        rows.pixel_x[lane] = self.pixels[i].x;
        rows.pixel_y[lane] = self.pixels[i].y;
        rows.sample[lane] = state.sample;
        rows.depth[lane] = state.path.depth;
    }

    /// Samples lights and the next rays, like the part of the scalar `shade` after emission is added.
    #[expect(clippy::too_many_arguments, reason = "the rows of the hits")]
    #[inline(always)]
    fn shade<S: Simd>(
        &mut self,
        simd: S,
        hits: &[QueuedHit],
        rows: &PathRows,
        lights: &mut LightRows,
        mut surface: LaneSurfaces<S>,
        material_kind: MaterialKind,
        materials: &mut HitMaterials,
    ) {
        let scene = self.scene;
        let s = &scene.specialization;
        let words = |words: &[u32; LANES]| u32x8::simd_from(simd, *words);
        let (x, y, depth, sample) = (
            words(&rows.pixel_x),
            words(&rows.pixel_y),
            words(&rows.depth),
            words(&rows.sample),
        );
        let seed = x.splat(scene.camera.seed);
        let key = hash4([x, y, seed, (depth << 1) + 1]);
        let zero: F<S> = SimdBase::splat(simd, 0.0);
        let one = zero.splat(1.0);
        let has_roulette = s.rr_depth < s.bounces;
        let is_diffuse = material_kind == MaterialKind::Diffuse;
        let decision_key = if has_roulette || !is_diffuse || s.emitters > 1 || s.light_tree != 0 {
            hash4([x, y, seed, (depth << 1) + 2])
        } else {
            key // not used
        };
        let smooth_kind = match material_kind {
            MaterialKind::Smooth(kind) if IS_OPTIMIZED => Some(kind),
            _ => None,
        };
        if let Some(kind) = smooth_kind {
            surface.shading_normal = smooth_normal(kind, &materials.lanes(simd), &surface);
        } else if !is_diffuse {
            surface.shading_normal = usable_normal(surface, surface.shading_normal);
        }
        surface.transmits = match material_kind {
            MaterialKind::Principled if s.lobes & LOBE_TRANSMISSION != 0 => {
                Some(materials.lanes(simd).transmission().gt(zero))
            }
            MaterialKind::Dielectric => Some(zero.le(zero)), // true in all lanes
            _ => None,
        };
        let has_offset = s.tlas_kinds & (1 << INSTANCE) != 0 && smooth_kind.is_none();
        if has_offset {
            surface.ray_origin = surface.ray_origin + surface.terminator_offset;
        }
        let normal_to_light = surface.lit_normal();
        let throughput = load3(simd, &rows.throughput);
        let (mut random, mut roulette_random) = (zero, zero);
        if has_roulette || !is_diffuse {
            let [.., x, y] = decision_key;
            let choices = decision_set(scene, Lanes2 { x, y }, sample);
            (random, roulette_random) = (unit_float(choices.x), unit_float(choices.y));
        }
        let has_lights = s.emitters != 0 && smooth_kind.is_none();
        let mut light = None;
        if has_lights {
            let tree_key = Lanes2 {
                x: decision_key[0],
                y: decision_key[1],
            };
            let choices = LightChoices {
                emitter: if s.emitters > 1 {
                    decision_set(scene, tree_key, sample)
                } else {
                    tree_key // not used
                },
                tree_key,
                sample,
                u: decision(scene, Lanes2 { x: key[0], y: key[1] }, sample),
            };
            light = Some(lights.sample(simd, scene, choices, surface.ray_origin, normal_to_light, hits.len()));
        }
        let directions = Directions {
            throughput,
            to_light: light.as_ref().map(|light| normalize(light.to_light)),
            u: decision(scene, Lanes2 { x: key[2], y: key[3] }, sample),
            random,
        };
        let result = match material_kind {
            MaterialKind::Principled if IS_OPTIMIZED => {
                let material = materials.lanes(simd);
                Principled::new(scene, &material, &surface, &materials.energy).scatter(&surface, directions)
            }
            MaterialKind::Metal if IS_OPTIMIZED => {
                Facets::metal(simd, &mut materials.rows, &surface).scatter(&surface, directions)
            }
            MaterialKind::Dielectric if IS_OPTIMIZED => {
                Facets::dielectric(materials.lanes(simd), &surface).scatter(&surface, directions)
            }
            MaterialKind::Smooth(kind) if IS_OPTIMIZED => {
                smooth_rays(kind, &materials.lanes(simd), &surface, directions)
            }
            _ => Diffuse::new(&materials.lanes(simd)).scatter(&surface, directions),
        };

        let (mut contributions, mut to_lights) = (Rows3::default(), lights.to_light);
        let (mut queued_mask, mut lit_behind) = (0, 0);
        let origin_behind = surface.origin_behind(has_offset);
        if let (Some(light), Some(reflected)) = (light, result.reflections) {
            if let Some(transmits) = surface.transmits {
                let to_light = light.to_light;
                let is_behind = transmits & dot(surface.normal, to_light).lt(zero);
                let zeros = splat3(simd, Vec3::ZERO);
                let is_finite = f32x8::simd_from(simd, lights.t_max).lt(zero.splat(2.0));
                let shift = Vector3::select(zeros, surface.ray_origin - origin_behind, is_finite);
                to_lights = store3(Vector3::select(to_light, to_light + shift, is_behind));
                lit_behind = is_behind.to_bitmask();
            }
            let mut contribution = throughput * reflected.value * light.radiance * (constant(1.0) / light.pdf);
            contribution = contribution * select(power_heuristic(light.pdf, reflected.pdf), one, light.is_delta);
            let max_component = largest(contribution);
            queued_mask = (max_component.gt(zero) & max_component.lt(zero.splat(INFINITE_T))).to_bitmask();
            contributions = store3(contribution);
        }
        let next = result.next_rays;
        let mut continued = next.throughput;
        let mut eta2 = f32x8::simd_from(simd, rows.eta2);
        let mut leaves_behind = 0;
        if let Some(transmitted) = next.transmitted {
            eta2 = select(eta2, eta2 * transmitted.eta * transmitted.eta, transmitted.mask);
            leaves_behind = transmitted.mask.to_bitmask();
        }
        let mut survives = zero.le(zero); // true in all lanes
        if has_roulette {
            let first_depth = x.splat(s.rr_depth);
            let in_roulette = (depth + 1).simd_ge(first_depth);
            let chance = min(largest(continued) / eta2, one);
            survives = !(in_roulette & roulette_random.ge(chance));
            continued = Vector3::select(continued, continued * (constant(1.0) / chance), in_roulette);
        }
        let survives = (survives & largest(continued).gt(zero)).to_bitmask();

        let mut albedos = Rows3::default();
        if s.layers != 0 {
            let material = materials.lanes(simd);
            let albedo = match material_kind {
                MaterialKind::Metal => metal_fresnel(&material, one),
                MaterialKind::Diffuse | MaterialKind::Principled => material.diffuse(),
                MaterialKind::Dielectric | MaterialKind::Smooth(_) => material.tint(),
            };
            albedos = store3(throughput * albedo);
        }
        let sides: Row = surface.side.into();
        let (origins, normals) = (store3(surface.ray_origin), store3(surface.shading_normal));
        let (origins_behind, normals_to_light) = (store3(origin_behind), store3(normal_to_light));
        let (directions, throughputs) = (store3(next.wi), store3(continued));
        let (pdfs, eta2): (Row, Row) = (next.pdf.into(), eta2.into());
        let has_light_tree = s.light_tree != 0;
        let has_previous_normal = has_light_tree || s.environment_flags & ENVIRONMENT_MAP != 0;
        for (lane, queued) in hits.iter().enumerate() {
            let state = &mut self.paths[queued.path as usize];
            // The origin of rays that leave on the side of the mask, and the primitives that they exclude.
            let exit = |behind_mask: u64| match behind_mask >> lane & 1 != 0 {
                true => (
                    get3(&origins_behind, lane),
                    rows.exclude_back[lane],
                    rows.exclude_front[lane],
                ),
                false => (get3(&origins, lane), rows.exclude_front[lane], rows.exclude_back[lane]),
            };
            let bounces = rows.depth[lane] + 1;
            if s.layers != 0 {
                let normal = get3(&normals, lane) * sides[lane];
                let albedo = smooth_kind.is_none().then(|| get3(&albedos, lane));
                record_layers(scene, state, normal, albedo, queued.hit.t);
            }
            if has_lights {
                let contribution = get3(&contributions, lane);
                if queued_mask >> lane & 1 != 0 {
                    let (origin, exclude_front, exclude_back) = exit(lit_behind);
                    self.shadow_rays.push(QueuedShadowRay {
                        path: queued.path,
                        ray: ShadowRay {
                            origin,
                            to_light: get3(&to_lights, lane),
                            t_max: lights.t_max[lane],
                            exclude_front,
                            exclude_back,
                            target_prim: lights.primitive[lane],
                            contribution,
                            bounces,
                        },
                    });
                } else {
                    add_radiance(scene, state, contribution, false, bounces);
                }
            }
            let (origin, origin_prim, inside_prim) = exit(leaves_behind);
            state.path = Path {
                ray: Ray {
                    origin,
                    direction: get3(&directions, lane),
                },
                differential: Differential::default(),
                throughput: get3(&throughputs, lane),
                depth: bounces,
                branch: 0,
                origin_prim,
                inside_prim,
            };
            state.pdf = pdfs[lane];
            state.eta2 = eta2[lane];
            state.skipped_distance = 0.0;
            state.ended |= survives >> lane & 1 == 0;
            if smooth_kind.is_some() {
                continue;
            }
            if has_light_tree {
                state.prev_position = get3(&origins, lane);
            }
            if has_previous_normal {
                state.prev_normal = get3(&normals_to_light, lane);
            }
        }
    }
}
