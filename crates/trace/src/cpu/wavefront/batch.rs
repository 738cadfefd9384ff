//! Shading of queued hits in SIMD lanes.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::UVec2;

use super::super::differential::Differential;
use super::super::integrators::path::{PathState, add_emission, add_radiance};
use super::super::lanes::{MaterialFields, Real};
use super::super::math::normalize;
use super::super::metal::metal_fresnel;
use super::super::path::{Path, usable_normal};
use super::super::ray::Ray;
use super::super::shadow_ray::ShadowRay;
use super::QueuedShadowRay;
use super::bounce::{NextRows, PathRows, PointRows, RandomLanes, ShadowRows};
use super::environment::leave_to_environment;
use super::hit_materials::{HitMaterials, evaluate};
use super::lights::LightRows;
use super::materials::{Diffuse, Directions, Facets, Principled, ScatterResult};
use super::rows::{F, LANES, Rows3, V, get3, load3, set3, store3};
use super::shade::{IS_OPTIMIZED, MaterialKind, QueuedHit, ShadingQueues, SurfaceKind};
use super::smooth::{smooth_normal, smooth_rays};
use super::surfaces::{FaceHits, FlatHits, LaneSurfaces, ScalarHits};
use crate::records::{ENVIRONMENT_MAP, INSTANCE, LOBE_TRANSMISSION, Packed};

/// The paths of a batch, and the queue of their shadow rays.
pub struct Batch<'a> {
    pub scene: &'a Packed,
    pub paths: &'a mut [PathState],
    pub pixels: &'a [UVec2],
    pub shadow_rays: &'a mut Vec<QueuedShadowRay>,
}

impl Batch<'_> {
    /// Ends the paths that hit nothing, and shades all queued hits. Only one loop contains the code for all kinds, so
    /// that it is compiled only once.
    #[inline(always)]
    pub fn shade_queues<S: Simd>(&mut self, simd: S, queues: &ShadingQueues) {
        let scene = self.scene;
        simd.vectorize(
            #[inline(always)]
            || leave_to_environment(simd, scene, self.paths, queues.missed()),
        );
        let epsilon = scene.environment.shadow_epsilon;
        let (mut flat, mut faces, mut evaluated) = (FlatHits::new(), FaceHits::new(), ScalarHits::default());
        let mut lights = LightRows::new(scene);
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
                    SurfaceKind::Flat => simd.vectorize(
                        #[inline(always)]
                        || flat.surfaces(simd, epsilon),
                    ),
                    SurfaceKind::Face => simd.vectorize(
                        #[inline(always)]
                        || faces.surfaces(simd, epsilon),
                    ),
                    SurfaceKind::Evaluated => simd.vectorize(
                        #[inline(always)]
                        || evaluated.surfaces(simd, scene.specialization.anisotropic != 0),
                    ),
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
        let random = simd.vectorize(
            #[inline(always)]
            || RandomLanes::of(simd, scene, rows, material_kind),
        );
        prepare(simd, scene, &mut surface, material_kind, materials);
        let normal_to_light = surface.lit_normal();
        let throughput = load3(simd, &rows.throughput);
        let mut light = None;
        if s.emitters != 0 && material_kind.smooth().is_none() {
            let choices = random.light_choices(scene);
            light = Some(simd.vectorize(
                #[inline(always)]
                || lights.sample(simd, choices, surface.ray_origin, normal_to_light, hits.len()),
            ));
        }
        let directions = Directions {
            throughput,
            to_light: light.as_ref().map(|light| normalize(light.to_light)),
            u: random.direction_choice(scene),
            random: random.lobe,
        };
        let result = scatter(simd, scene, &surface, material_kind, materials, directions);

        let origin_behind = surface.origin_behind(has_terminator_offset(scene, material_kind));
        let mut shadow = ShadowRows {
            to_lights: lights.to_light,
            ..ShadowRows::default()
        };
        if let (Some(light), Some(reflections)) = (&light, &result.reflections) {
            shadow.set_contributions(light, throughput, reflections);
            if let Some(transmits) = surface.transmits {
                let distances = f32x8::simd_from(simd, lights.t_max);
                shadow.move_behind(&surface, origin_behind, transmits, light.to_light, distances);
            }
        }
        let next = simd.vectorize(
            #[inline(always)]
            || NextRows::of(simd, scene, rows, &random, &result.next_rays),
        );
        let mut albedos = Rows3::default();
        if s.layers != 0 {
            albedos = store3(throughput * albedo(simd, material_kind, materials));
        }
        let points = PointRows {
            sides: surface.side.into(),
            normals: store3(surface.shading_normal),
            normals_to_light: store3(normal_to_light),
            origins: store3(surface.ray_origin),
            origins_behind: store3(origin_behind),
            albedos,
        };
        for (lane, queued) in hits.iter().enumerate() {
            self.record_layers(lane, queued, material_kind, &points);
            if light.is_some() {
                self.queue_shadow_ray(lane, queued, rows, lights, &shadow, &points);
            }
            self.continue_path(lane, queued, rows, material_kind, &next, &points);
        }
    }

    /// Records the layers of the first hit, like the scalar `record_first_hit_layers`.
    #[inline(always)]
    fn record_layers(&mut self, lane: usize, queued: &QueuedHit, material_kind: MaterialKind, points: &PointRows) {
        let s = &self.scene.specialization;
        if s.layers == 0 {
            return;
        }
        let state = &mut self.paths[queued.path as usize];
        if state.path.depth == 0 {
            state.layers.emission.w = 1.0;
            let distance = match s.noise != 0 {
                true => queued.hit.t + state.skipped_distance,
                false => 0.0,
            };
            state.layers.normal = (get3(&points.normals, lane) * points.sides[lane]).extend(distance);
        }
        if !state.albedo_recorded && material_kind.smooth().is_none() {
            state.layers.albedo = get3(&points.albedos, lane).extend(0.0);
            state.albedo_recorded = true;
        }
    }

    #[inline(always)]
    fn queue_shadow_ray(
        &mut self,
        lane: usize,
        queued: &QueuedHit,
        rows: &PathRows,
        lights: &LightRows,
        shadow: &ShadowRows,
        points: &PointRows,
    ) {
        let contribution = get3(&shadow.contributions, lane);
        let bounces = rows.depth[lane] + 1;
        if shadow.queued >> lane & 1 == 0 {
            let state = &mut self.paths[queued.path as usize];
            add_radiance(self.scene, state, contribution, false, bounces);
            return;
        }
        let exit = points.exit(rows, lane, shadow.behind);
        self.shadow_rays.push(QueuedShadowRay {
            path: queued.path,
            ray: ShadowRay {
                origin: exit.origin,
                to_light: get3(&shadow.to_lights, lane),
                t_max: lights.t_max[lane],
                exclude_front: exit.exclude_front,
                exclude_back: exit.exclude_back,
                target_prim: lights.primitive[lane],
                contribution,
                bounces,
            },
        });
    }

    #[inline(always)]
    fn continue_path(
        &mut self,
        lane: usize,
        queued: &QueuedHit,
        rows: &PathRows,
        material_kind: MaterialKind,
        next: &NextRows,
        points: &PointRows,
    ) {
        let s = &self.scene.specialization;
        let state = &mut self.paths[queued.path as usize];
        let exit = points.exit(rows, lane, next.behind);
        state.path = Path {
            ray: Ray {
                origin: exit.origin,
                direction: get3(&next.directions, lane),
            },
            differential: Differential::default(),
            throughput: get3(&next.throughputs, lane),
            depth: rows.depth[lane] + 1,
            branch: 0,
            origin_prim: exit.exclude_front,
            inside_prim: exit.exclude_back,
        };
        state.pdf = next.pdfs[lane];
        state.eta2 = next.eta2[lane];
        state.skipped_distance = 0.0;
        state.ended |= next.survivors >> lane & 1 == 0;
        if material_kind.smooth().is_some() {
            return;
        }
        if s.light_tree != 0 {
            state.prev_position = get3(&points.origins, lane);
        }
        if s.light_tree != 0 || s.environment_flags & ENVIRONMENT_MAP != 0 {
            state.prev_normal = get3(&points.normals_to_light, lane);
        }
    }
}

#[inline(always)]
fn has_terminator_offset(scene: &Packed, material_kind: MaterialKind) -> bool {
    scene.specialization.tlas_kinds & (1 << INSTANCE) != 0 && material_kind.smooth().is_none()
}

/// Completes the surfaces with what depends on their materials.
#[inline(always)]
fn prepare<S: Simd>(
    simd: S,
    scene: &Packed,
    surface: &mut LaneSurfaces<S>,
    material_kind: MaterialKind,
    materials: &mut HitMaterials,
) {
    let zero: F<S> = SimdBase::splat(simd, 0.0);
    if let Some(kind) = material_kind.smooth() {
        surface.shading_normal = smooth_normal(kind, &materials.lanes(simd), surface);
    } else if material_kind != MaterialKind::Diffuse {
        surface.shading_normal = usable_normal(*surface, surface.shading_normal);
    }
    surface.transmits = match material_kind {
        MaterialKind::Principled if scene.specialization.lobes & LOBE_TRANSMISSION != 0 => {
            Some(materials.lanes(simd).transmission().gt(zero))
        }
        MaterialKind::Dielectric => Some(zero.le(zero)), // true in all lanes
        _ => None,
    };
    if has_terminator_offset(scene, material_kind) {
        surface.ray_origin = surface.ray_origin + surface.terminator_offset;
    }
}

#[inline(always)]
fn scatter<S: Simd>(
    simd: S,
    scene: &Packed,
    surface: &LaneSurfaces<S>,
    material_kind: MaterialKind,
    materials: &mut HitMaterials,
    directions: Directions<S>,
) -> ScatterResult<S> {
    match material_kind {
        MaterialKind::Principled if IS_OPTIMIZED => {
            let material = materials.lanes(simd);
            simd.vectorize(
                #[inline(always)]
                || Principled::new(scene, &material, surface, &materials.energy).scatter(surface, directions),
            )
        }
        MaterialKind::Metal if IS_OPTIMIZED => simd.vectorize(
            #[inline(always)]
            || Facets::metal(simd, &mut materials.rows, surface).scatter(surface, directions),
        ),
        MaterialKind::Dielectric if IS_OPTIMIZED => simd.vectorize(
            #[inline(always)]
            || Facets::dielectric(materials.lanes(simd), surface).scatter(surface, directions),
        ),
        MaterialKind::Smooth(kind) if IS_OPTIMIZED => simd.vectorize(
            #[inline(always)]
            || smooth_rays(kind, &materials.lanes(simd), surface, directions),
        ),
        _ => Diffuse::new(&materials.lanes(simd)).scatter(surface, directions),
    }
}

/// Returns the albedos of the materials, like the scalar `albedo`.
#[inline(always)]
fn albedo<S: Simd>(simd: S, material_kind: MaterialKind, materials: &mut HitMaterials) -> V<S> {
    let material = materials.lanes(simd);
    match material_kind {
        MaterialKind::Metal => metal_fresnel(&material, SimdBase::splat(simd, 1.0)),
        MaterialKind::Diffuse | MaterialKind::Principled => material.diffuse(),
        MaterialKind::Dielectric | MaterialKind::Smooth(_) => material.tint(),
    }
}
