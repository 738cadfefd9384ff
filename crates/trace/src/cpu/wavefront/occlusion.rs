//! The stage that determines which shadow rays of a batch are occluded.

use fearless_simd::dispatch;
use fearless_simd::prelude::*;
use glam::UVec2;

use super::super::bvh::{FEW_ITEMS, is_occluded_by_primitive_item, item_pad, shadow_mesh_ray};
use super::super::decoded_bvhs::decoded_mesh;
use super::super::integrators::path::{PathState, is_shadow_ray_occluded};
use super::super::samples::LEVEL;
use super::super::slab::{box_interval, interval_hits, slabs};
use super::super::traversal::{Next, RAYS, RaySource, Traced, trace};
use super::QueuedShadowRay;
use super::items::ItemStep;
use super::linear::ShadowRayRows;
use super::rows::{LANES, lane_mask, lanes_of, splat3};
use super::scratch::{QueuedRay, RayLane, Scratch};
use crate::bvh::DecodedNode;
use crate::records::{CASTS_SHADOW, INSTANCE, NO_INDEX, Packed};

/// Determines which shadow rays are occluded, like `is_shadow_ray_occluded`.
pub fn occluded_rays(
    scene: &Packed,
    paths: &[PathState],
    pixels: &[UVec2],
    rays: &[QueuedShadowRay],
    occluded: &mut Vec<bool>,
    scratch: &mut Scratch,
) {
    occluded.clear();
    // Rays are traced one by one if they may continue through surfaces with alpha, or if the meshes are too large to be
    // decoded.
    if scene.specialization.alpha_surfaces != 0 || !scratch.is_decoded {
        occluded.extend(rays.iter().map(|QueuedShadowRay { path, ray }| {
            let i = *path as usize;
            is_shadow_ray_occluded(scene, ray, pixels[i], paths[i].sample)
        }));
        return;
    }
    dispatch!(*LEVEL, simd => occluded_rays_in_lanes(simd, scene, rays, occluded, scratch))
}

#[inline(always)]
fn occluded_rays_in_lanes<S: Simd>(
    simd: S,
    scene: &Packed,
    rays: &[QueuedShadowRay],
    occluded: &mut Vec<bool>,
    scratch: &mut Scratch,
) {
    scratch.clear();
    let has_bvh = scene.specialization.tlas_kinds != 0;
    let mut rows = ShadowRayRows::default();
    for rays in rays.chunks(LANES) {
        rows.set(rays);
        let mut is_occluded = rows.occluded(simd, scene);
        if has_bvh {
            is_occluded |= queue_rays(
                simd,
                scene,
                rays,
                &rows,
                is_occluded,
                occluded.len(),
                &mut scratch.queue,
            );
        }
        occluded.extend((0..rays.len()).map(|lane| is_occluded >> lane & 1 == 1));
    }
    if !scratch.queue.is_empty() {
        let mut rays = Rays {
            scene,
            nodes: scene.bvh.decoded.get().map_or(&[], Vec::as_slice),
            rays,
            occluded,
            queue: scratch.queue.iter(),
            lanes: &mut scratch.lanes,
        };
        trace::<S, true>(simd, &mut scratch.stacks, &mut rays);
    }
}

/// Queues each unoccluded ray: in a scene with few items for the instances whose boxes the ray hits, else for the BVH
/// of the scene. Returns the mask of the rays that primitives among the few items occlude. `first` is the position of
/// the first ray in the batch.
#[inline(always)]
fn queue_rays<S: Simd>(
    simd: S,
    scene: &Packed,
    rays: &[QueuedShadowRay],
    rows: &ShadowRayRows,
    already_occluded: u64,
    first: usize,
    queue: &mut Vec<QueuedRay>,
) -> u64 {
    let mut unoccluded = !already_occluded & lane_mask(rays.len());
    let mut push = |lane: usize, instance| {
        queue.push(QueuedRay {
            position: (first + lane) as u32,
            instance,
            near: 0.0,
        });
    };
    if scene.bvh.items.len() > FEW_ITEMS {
        for lane in 0..rays.len() {
            if unoccluded >> lane & 1 == 1 {
                push(lane, NO_INDEX);
            }
        }
        return 0;
    }
    let (origin, to_light, t_max) = rows.load(simd);
    let slabs = slabs(origin, to_light, item_pad(scene, origin));
    let mut occluded = 0;
    for item in &scene.bvh.items {
        if item.kind & CASTS_SHADOW == 0 {
            continue;
        }
        let interval = box_interval(splat3(simd, item.low), splat3(simd, item.high), slabs);
        let lanes = interval_hits(interval, t_max).to_bitmask() & unoccluded;
        for lane in lanes_of(lanes) {
            let ray = &rays[lane].ray;
            if item.kind & 0xff == INSTANCE {
                push(lane, item.index);
            } else if is_occluded_by_primitive_item(
                scene,
                item,
                &ray.surface(),
                ray.to_light,
                ray.t_max,
                ray.target_prim,
            ) {
                occluded |= 1 << lane;
                unoccluded &= !(1 << lane);
            }
        }
    }
    occluded
}

/// The queued shadow rays. A ray traverses a single instance, or the BVH of the scene item by item, up to any hit.
struct Rays<'a, 'o> {
    scene: &'a Packed,
    nodes: &'a [DecodedNode],
    rays: &'a [QueuedShadowRay],
    occluded: &'o mut [bool],
    queue: std::slice::Iter<'a, QueuedRay>,
    lanes: &'o mut [RayLane; RAYS],
}

impl<'a, S: Simd> RaySource<'a, S> for Rays<'a, '_> {
    #[inline(always)]
    fn next(&mut self, simd: S, lane: usize, traced: Option<Traced>) -> Next<'a> {
        let scene = self.scene;
        let lane = &mut self.lanes[lane];
        if let Some(traced) = traced {
            self.occluded[lane.position] |= traced.best.slot != NO_INDEX;
        }
        if lane.in_bvh && !self.occluded[lane.position] {
            let ray = &self.rays[lane.position].ray;
            let surface = ray.surface();
            let (to_light, t_max) = (ray.to_light, ray.t_max);
            match lane.items.step::<S, false>(simd, self.nodes, t_max) {
                ItemStep::Found(i, _) => {
                    let item = &scene.bvh.items[i];
                    if item.kind & CASTS_SHADOW == 0 {
                        return Next::Wait;
                    }
                    if item.kind & 0xff == INSTANCE {
                        let ray = shadow_mesh_ray(scene, item.index, &surface, to_light, t_max);
                        return Next::trace(decoded_mesh(scene, item.index), ray);
                    }
                    self.occluded[lane.position] =
                        is_occluded_by_primitive_item(scene, item, &surface, to_light, t_max, ray.target_prim);
                    return Next::Wait;
                }
                ItemStep::Node => return Next::Wait,
                ItemStep::End => {}
            }
        }
        let Some(queued) = self.queue.next() else {
            return Next::Done;
        };
        lane.position = queued.position as usize;
        lane.in_bvh = queued.instance == NO_INDEX;
        let ray = &self.rays[lane.position].ray;
        if lane.in_bvh {
            let slabs = slabs(ray.origin, ray.to_light, item_pad(scene, ray.origin));
            lane.items.start(slabs);
            return Next::Wait;
        }
        if self.occluded[lane.position] {
            return Next::Wait;
        }
        let mesh_ray = shadow_mesh_ray(scene, queued.instance, &ray.surface(), ray.to_light, ray.t_max);
        Next::trace(decoded_mesh(scene, queued.instance), mesh_ray)
    }
}
