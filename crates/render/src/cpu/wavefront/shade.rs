//! The stage that shades the hits of a batch of paths. Hits on opaque diffuse surfaces are shaded in SIMD lanes, with
//! the bits of the scalar function [`shade`]. That function shades all other hits.

use std::ops::AddAssign;

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x8, u32x8};
use glam::{UVec2, Vec2, Vec3};

use super::super::differential::Differential;
use super::super::diffuse::{angles_at, diffuse_pdf, diffuse_sample};
use super::super::emitter::{LightSample, sample_emitter, select_emitter};
use super::super::geometry::{
    fetch_hit_primitive, group_word, hit_differential, instance_of, is_on_mesh, material_of, surface_of,
};
use super::super::integrators::path::{PathState, add_radiance, decision, decision_set, shade};
use super::super::lanes::{Lanes2, Lanes3, Real, Vector3, Word, constant, select};
use super::super::light_choice::{EmitterSelection, light_tree_select};
use super::super::light_sample::{power_heuristic, solid_angle_pdf};
use super::super::math::{dot, min, normalize};
use super::super::mesh::HitPrimitive;
use super::super::path::Path;
use super::super::primitive::is_solid;
use super::super::ray::{Hit, Ray};
use super::super::rng::{hash4, unit_float};
use super::super::samples::LEVEL;
use super::super::scattering::bounded;
use super::super::shadow_ray::ShadowRay;
use super::super::surface::{Surface, largest};
use super::super::texture::evaluate_material;
use super::super::vertices::with_vertex_colors;
use super::QueuedShadowRay;
use super::rows::{F, LANES, Row, Rows3, V, get3, load3, set3, splat3, store3};
use super::surfaces::{EvaluatedHits, FaceHits, FlatHits, LaneSurfaces};
use crate::records::{
    DIFFUSE, ENVIRONMENT_MAP, FOR_ROUGHNESS, INFINITE_T, INSTANCE, Light, Material, NO_COLORS, NO_SHADOW, OPAQUE,
    Packed, RECTANGLE,
};

/// Hits to shade in lanes.
#[derive(Default)]
pub struct ShadingQueues {
    /// Hits on flat primitives.
    flat: Vec<QueuedHit>,
    /// Hits on triangles of meshes.
    faces: Vec<QueuedHit>,
    /// Hits whose surfaces and materials are evaluated one by one.
    evaluated: Vec<QueuedHit>,
}

/// Numbers of hits shaded in lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneHits {
    /// Hits on flat primitives.
    pub flat: usize,
    /// Hits on triangles of meshes.
    pub faces: usize,
    /// Hits on solids, and on materials with textures or vertex colors. Their surfaces are evaluated one by one.
    pub evaluated: usize,
}

impl AddAssign for LaneHits {
    fn add_assign(&mut self, other: LaneHits) {
        self.flat += other.flat;
        self.faces += other.faces;
        self.evaluated += other.evaluated;
    }
}

/// A hit, with the indices of its path and its material.
#[derive(Clone, Copy)]
struct QueuedHit {
    path: u32,
    material: u32,
    hit: Hit,
}

/// Shades the hits of the active paths, like [`shade`], and queues their shadow rays. Returns the numbers of hits
/// shaded in lanes.
pub fn shade_hits(
    scene: &Packed,
    paths: &mut [PathState],
    pixels: &[UVec2],
    active: &[u32],
    hits: &[Hit],
    shadow_rays: &mut Vec<QueuedShadowRay>,
    queues: &mut ShadingQueues,
) -> LaneHits {
    shadow_rays.clear();
    queues.flat.clear();
    queues.faces.clear();
    queues.evaluated.clear();
    let has_lanes = scene.specialization.absorption == 0;
    for (&path, &hit) in active.iter().zip(hits) {
        let state = &mut paths[path as usize];
        let found = if has_lanes {
            lane_material(scene, state, hit)
        } else {
            None
        };
        if let Some((surface, material)) = found {
            if state.path.depth >= scene.specialization.bounces {
                state.ended = true;
                continue;
            }
            let queue = match surface {
                SurfaceKind::Flat => &mut queues.flat,
                SurfaceKind::Face => &mut queues.faces,
                SurfaceKind::Evaluated => &mut queues.evaluated,
            };
            queue.push(QueuedHit { path, material, hit });
        } else if let Some(ray) = shade(scene, state, hit, pixels[path as usize]) {
            shadow_rays.push(QueuedShadowRay { path, ray });
        }
    }
    let lane_hits = LaneHits {
        flat: queues.flat.len(),
        faces: queues.faces.len(),
        evaluated: queues.evaluated.len(),
    };
    if lane_hits != LaneHits::default() {
        dispatch!(*LEVEL, simd => {
            let mut batch = Batch { scene, paths, pixels, shadow_rays };
            batch.shade_flat(simd, &queues.flat);
            batch.shade_faces(simd, &queues.faces);
            batch.shade_evaluated(simd, &queues.evaluated);
        });
    }
    lane_hits
}

/// The kind of surface of a hit, which selects the hit's queue.
#[derive(Clone, Copy)]
enum SurfaceKind {
    Flat,
    Face,
    Evaluated,
}

/// Returns the kind of surface and the material index of a hit, if the hit can be shaded in lanes.
#[inline(always)]
fn lane_material(scene: &Packed, state: &PathState, hit: Hit) -> Option<(SurfaceKind, u32)> {
    let (surface, index) = if is_on_mesh(hit) {
        let material = group_word(scene, instance_of(scene, hit), hit.slot) & !NO_SHADOW;
        (SurfaceKind::Face, material)
    } else {
        let q = scene.primitives.get(hit.primitive as usize)?;
        let surface = match is_solid(q.kind) {
            false => SurfaceKind::Flat,
            true => SurfaceKind::Evaluated,
        };
        (surface, q.material)
    };
    // Only the scalar `shade` records layers.
    if scene.specialization.layers != 0 && (state.path.depth == 0 || !state.albedo_recorded) {
        return None;
    }
    let material = &scene.materials[index as usize];
    if !is_opaque_diffuse(material) {
        return None;
    }
    if material.lookups.y == 0 && material.vertex_colors == NO_COLORS {
        return Some((surface, index));
    }
    let mut lookups = (0..material.lookups.y).map(|i| &scene.textures.lookups[(material.lookups.x + i) as usize]);
    let has_constant_roughness = lookups.all(|lookup| lookup.purposes & FOR_ROUGHNESS == 0);
    has_constant_roughness.then_some((SurfaceKind::Evaluated, index))
}

/// Returns true for diffuse materials that have no roughness, emission or alpha.
#[inline(always)]
fn is_opaque_diffuse(material: &Material) -> bool {
    let is_smooth = !(material.roughness > 0.0);
    let is_emissive = material.density > 0.0;
    material.kind == DIFFUSE && is_smooth && !is_emissive && material.alpha_mode == OPAQUE
}

/// Returns a hit's primitive, its surface with the shading normal, and the diffuse reflectance, like the first part of
/// [`shade`].
fn evaluate(scene: &Packed, path: &Path, hit: Hit) -> (HitPrimitive, Surface, Vec3) {
    let s = &scene.specialization;
    let prim = fetch_hit_primitive(scene, hit);
    let mut surface = surface_of(scene, &prim, hit, path.ray);
    let material = material_of(scene, &prim);
    if (s.lookups == 0) & (s.vertex_colors == 0) {
        return (prim, surface, material.diffuse);
    }
    let hit_diff = hit_differential(scene, &prim, hit, surface, path.ray, path.differential);
    let mut shading = evaluate_material(scene, &prim, hit, material, surface, hit_diff, s.lookups);
    if s.vertex_colors != 0 {
        shading.material = with_vertex_colors(scene, &shading.material, hit);
    }
    surface.shading_normal = shading.normal;
    (prim, surface, bounded(shading.material).diffuse)
}

/// The paths of a batch, and the queue of their shadow rays.
struct Batch<'a> {
    scene: &'a Packed,
    paths: &'a mut [PathState],
    pixels: &'a [UVec2],
    shadow_rays: &'a mut Vec<QueuedShadowRay>,
}

/// Path states before a bounce, with the diffuse reflectance at each hit.
#[derive(Default)]
struct PathRows {
    throughput: Rows3,
    eta2: Row,
    diffuse: Rows3,
    pixel_x: [u32; LANES],
    pixel_y: [u32; LANES],
    sample: [u32; LANES],
    depth: [u32; LANES],
    exclude_front: [UVec2; LANES],
    exclude_back: [UVec2; LANES],
}

/// One light sample per path.
struct LightRows {
    to_light: Rows3,
    radiance: Rows3,
    pdf: Row,
    is_delta: Row,
    t_max: Row,
    primitive: [u32; LANES],
}

impl LightRows {
    /// Creates the rows. `light` is the only light, if any: all of its samples have the same `t_max` and `primitive`.
    fn new(light: Option<&Light>) -> LightRows {
        LightRows {
            to_light: Default::default(),
            radiance: Default::default(),
            pdf: Default::default(),
            is_delta: Default::default(),
            t_max: [light.map_or(0.0, |light| light.t_max); LANES],
            primitive: [light.map_or(0, |light| light.primitive); LANES],
        }
    }

    fn set(&mut self, lane: usize, light: LightSample) {
        set3(&mut self.to_light, lane, light.to);
        set3(&mut self.radiance, lane, light.radiance);
        self.pdf[lane] = light.pdf;
        self.is_delta[lane] = if light.is_delta { 1.0 } else { 0.0 };
        self.t_max[lane] = light.t_max;
        self.primitive[lane] = light.primitive;
    }
}

/// Returns the only light of the scene, if it can be sampled in lanes.
fn only_light(scene: &Packed) -> Option<&Light> {
    let s = &scene.specialization;
    let [emitter] = scene.lighting.emitters[..] else {
        return None;
    };
    let is_plain = s.light_tree == 0 && s.emission_textures == 0 && s.alpha_surfaces == 0 && emitter.instance == 0;
    let light = scene.lighting.lights.get(emitter.index as usize)?;
    (is_plain && light.kind == RECTANGLE).then_some(light)
}

impl Batch<'_> {
    #[inline(always)]
    fn shade_flat<S: Simd>(&mut self, simd: S, queue: &[QueuedHit]) {
        let mut rows = FlatHits::new();
        let mut lights = LightRows::new(only_light(self.scene));
        for hits in queue.chunks(LANES) {
            let mut paths = PathRows::default();
            for (lane, queued) in hits.iter().enumerate() {
                rows.set(self.scene, lane, self.paths[queued.path as usize].path.ray, queued.hit);
                self.gather(&mut paths, lane, queued);
                set3(
                    &mut paths.diffuse,
                    lane,
                    self.scene.materials[queued.material as usize].diffuse,
                );
                let prim_id = UVec2::new(queued.hit.instance, queued.hit.primitive);
                (paths.exclude_front[lane], paths.exclude_back[lane]) = (prim_id, prim_id);
            }
            let surfaces = rows.surfaces(simd, self.scene.environment.shadow_epsilon);
            self.shade(simd, hits, &paths, &mut lights, surfaces);
        }
    }

    #[inline(always)]
    fn shade_faces<S: Simd>(&mut self, simd: S, queue: &[QueuedHit]) {
        let mut rows = FaceHits::new();
        let mut lights = LightRows::new(only_light(self.scene));
        for hits in queue.chunks(LANES) {
            let mut paths = PathRows::default();
            for (lane, queued) in hits.iter().enumerate() {
                rows.set(self.scene, lane, self.paths[queued.path as usize].path.ray, queued.hit);
                self.gather(&mut paths, lane, queued);
                set3(
                    &mut paths.diffuse,
                    lane,
                    self.scene.materials[queued.material as usize].diffuse,
                );
                let prim_id = UVec2::new(queued.hit.instance, queued.hit.primitive);
                (paths.exclude_front[lane], paths.exclude_back[lane]) = (prim_id, prim_id);
            }
            let surfaces = rows.surfaces(simd, self.scene.environment.shadow_epsilon);
            self.shade(simd, hits, &paths, &mut lights, surfaces);
        }
    }

    #[inline(always)]
    fn shade_evaluated<S: Simd>(&mut self, simd: S, queue: &[QueuedHit]) {
        let mut rows = EvaluatedHits::default();
        let mut lights = LightRows::new(only_light(self.scene));
        for hits in queue.chunks(LANES) {
            let mut paths = PathRows::default();
            for (lane, queued) in hits.iter().enumerate() {
                let path = &self.paths[queued.path as usize].path;
                let (prim, surface, diffuse) = evaluate(self.scene, path, queued.hit);
                rows.set(lane, &surface, &prim);
                self.gather(&mut paths, lane, queued);
                set3(&mut paths.diffuse, lane, diffuse);
                paths.exclude_front[lane] = surface.exclude_front;
                paths.exclude_back[lane] = surface.exclude_back;
            }
            self.shade(simd, hits, &paths, &mut lights, rows.surfaces(simd));
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

    /// Samples lights and the next rays, like the part of [`shade`] after emission is added.
    #[inline(always)]
    fn shade<S: Simd>(
        &mut self,
        simd: S,
        hits: &[QueuedHit],
        rows: &PathRows,
        lights: &mut LightRows,
        mut surface: LaneSurfaces<S>,
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
        let decision_key = if has_roulette || s.emitters > 1 || s.light_tree != 0 {
            hash4([x, y, seed, (depth << 1) + 2])
        } else {
            key
        };
        if s.tlas_kinds & (1 << INSTANCE) != 0 {
            surface.ray_origin = surface.ray_origin + surface.terminator_offset;
        }
        let diffuse = clamped(load3(simd, &rows.diffuse), s.lookups != 0 || s.vertex_colors != 0);
        let throughput = load3(simd, &rows.throughput);
        let origins = store3(surface.ray_origin);
        let normals = store3(surface.shading_normal);

        let mut contributions = Rows3::default();
        let mut queued_mask = 0;
        if s.emitters != 0 {
            let u = decision(scene, Lanes2 { x: key[0], y: key[1] }, sample);
            let (to_light, radiance, pdf, is_delta);
            if let Some(light) = only_light(scene) {
                (to_light, radiance, pdf) = rectangle_samples(simd, light, surface.ray_origin, u);
                is_delta = zero.lt(zero); // false in all lanes
                lights.to_light = store3(to_light);
            } else {
                let mut bits = Lanes2 { x, y };
                if s.emitters > 1 {
                    let key = Lanes2 {
                        x: decision_key[0],
                        y: decision_key[1],
                    };
                    bits = decision_set(scene, key, sample);
                }
                let (bits_x, bits_y): ([u32; LANES], [u32; LANES]) = (bits.x.into(), bits.y.into());
                let (key_x, key_y): ([u32; LANES], [u32; LANES]) = (decision_key[0].into(), decision_key[1].into());
                let (u_x, u_y): (Row, Row) = (u.x.into(), u.y.into());
                for lane in 0..hits.len() {
                    let (p, normal) = (get3(&origins, lane), get3(&normals, lane));
                    let mut selection = EmitterSelection {
                        emitter: select_emitter(scene, UVec2::new(bits_x[lane], bits_y[lane])),
                        density: 0.0,
                    };
                    if s.light_tree != 0 {
                        let key = UVec2::new(key_x[lane], key_y[lane]);
                        selection = light_tree_select(scene, selection.emitter, p, normal, key, rows.sample[lane]);
                    }
                    let u = Vec2::new(u_x[lane], u_y[lane]);
                    lights.set(lane, sample_emitter(scene, selection, p, normal, u));
                }
                to_light = load3(simd, &lights.to_light);
                radiance = load3(simd, &lights.radiance);
                pdf = f32x8::simd_from(simd, lights.pdf);
                is_delta = f32x8::simd_from(simd, lights.is_delta).gt(zero);
            }
            let reflected = reflections(&surface, diffuse, normalize(to_light));
            let mut contribution = throughput * reflected.value * radiance * (constant(1.0) / pdf);
            contribution = contribution * select(power_heuristic(pdf, reflected.pdf), one, is_delta);
            let max_component = largest(contribution);
            queued_mask = (max_component.gt(zero) & max_component.lt(zero.splat(INFINITE_T))).to_bitmask();
            contributions = store3(contribution);
        }

        let u = decision(scene, Lanes2 { x: key[2], y: key[3] }, sample);
        let wi = diffuse_sample(surface.shading_normal, u);
        let reflected = reflections(&surface, diffuse, wi);
        let inverse_pdf = select(zero, constant(1.0) / reflected.pdf, reflected.pdf.gt(zero));
        let mut continued = throughput * (reflected.value * inverse_pdf);
        let mut survives = zero.le(zero); // true in all lanes
        if has_roulette {
            let choices = decision_set(
                scene,
                Lanes2 {
                    x: decision_key[2],
                    y: decision_key[3],
                },
                sample,
            );
            let first_depth = x.splat(s.rr_depth);
            let in_roulette = (depth + 1).simd_ge(first_depth);
            let chance = min(largest(continued) / f32x8::simd_from(simd, rows.eta2), one);
            let random = unit_float(choices.y);
            survives = !(in_roulette & random.ge(chance));
            continued = Vector3::select(continued, continued * (constant(1.0) / chance), in_roulette);
        }
        let survives = (survives & largest(continued).gt(zero)).to_bitmask();

        let (directions, throughputs) = (store3(wi), store3(continued));
        let pdfs: Row = reflected.pdf.into();
        let has_light_tree = s.light_tree != 0;
        let has_previous_normal = has_light_tree || s.environment_flags & ENVIRONMENT_MAP != 0;
        for (lane, queued) in hits.iter().enumerate() {
            let state = &mut self.paths[queued.path as usize];
            let (exclude_front, exclude_back) = (rows.exclude_front[lane], rows.exclude_back[lane]);
            let origin = get3(&origins, lane);
            let bounces = rows.depth[lane] + 1;
            if s.emitters != 0 {
                let contribution = get3(&contributions, lane);
                if queued_mask >> lane & 1 != 0 {
                    self.shadow_rays.push(QueuedShadowRay {
                        path: queued.path,
                        ray: ShadowRay {
                            origin,
                            to_light: get3(&lights.to_light, lane),
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
            state.path = Path {
                ray: Ray {
                    origin,
                    direction: get3(&directions, lane),
                },
                differential: Differential::default(),
                throughput: get3(&throughputs, lane),
                depth: bounces,
                branch: 0,
                origin_prim: exclude_front,
                inside_prim: exclude_back,
            };
            state.pdf = pdfs[lane];
            state.skipped_distance = 0.0;
            state.ended |= survives >> lane & 1 == 0;
            if has_light_tree {
                state.prev_position = origin;
            }
            if has_previous_normal {
                state.prev_normal = get3(&normals, lane);
            }
        }
    }
}

/// Values of [`Reflection`](super::super::scattering::Reflection) in lanes.
struct Reflections<S: Simd> {
    value: V<S>,
    pdf: F<S>,
}

/// Returns the reflection of light from `wi`, like `reflection` for diffuse materials.
#[inline(always)]
fn reflections<S: Simd>(surface: &LaneSurfaces<S>, diffuse: V<S>, wi: V<S>) -> Reflections<S> {
    // The pdf does not depend on the direction to the previous vertex, for which `wi` is passed.
    let pdf = diffuse_pdf(angles_at(surface.shading_normal, wi, wi));
    Reflections {
        value: Vector3::select(
            splat3(pdf.simd, Vec3::ZERO),
            diffuse * pdf,
            surface.direction_allowed(wi),
        ),
        pdf,
    }
}

/// Clamps the colors of textured materials to at most 1, like `bounded`.
#[inline(always)]
fn clamped<S: Simd>(color: V<S>, is_textured: bool) -> V<S> {
    if !is_textured {
        return color;
    }
    let one = color.x.splat(1.0);
    let clamp = |x: F<S>| select(x, one, x.gt(one));
    Lanes3 {
        x: clamp(color.x),
        y: clamp(color.y),
        z: clamp(color.z),
    }
}

/// Returns the vectors to light samples, their radiance and their pdfs, like `sample_light` for rectangles.
#[inline(always)]
fn rectangle_samples<S: Simd>(simd: S, light: &Light, p: V<S>, u: Lanes2<F<S>>) -> (V<S>, V<S>, F<S>) {
    let vector = |v| splat3(simd, v);
    let (x, y) = (u.x * 2.0 - 1.0, u.y * 2.0 - 1.0);
    let normal = vector(light.normal);
    let to_light = (vector(light.center) - p * x.splat(light.finite)) + vector(light.u) * x + vector(light.v) * y;
    let pdf = solid_angle_pdf(x.splat(light.density), to_light, normal);
    let mut radiance = vector(light.color);
    if light.sides == 1 {
        let behind = dot(normal, to_light).ge(x.splat(0.0));
        radiance = Vector3::select(radiance, vector(Vec3::ZERO), behind);
    }
    (to_light, radiance, pdf)
}
