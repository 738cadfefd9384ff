//! The stage that finds the closest hits of a batch of paths.

use fearless_simd::dispatch;
use fearless_simd::prelude::*;

use super::super::bvh::{FEW_ITEMS, closest_mesh_ray, closest_of_primitive, item_pad, mesh_hit};
use super::super::decoded_bvhs::decoded_mesh;
use super::super::geometry::closest_hit;
use super::super::integrators::path::PathState;
use super::super::math::max;
use super::super::path::Path;
use super::super::prefetch::prefetch_triangle;
use super::super::ray::{Hit, nearer_hit};
use super::super::samples::LEVEL;
use super::super::slab::{box_interval, interval_hits, slabs};
use super::super::traversal::{Next, RAYS, RaySource, Traced, trace};
use super::items::ItemStep;
use super::linear::RayRows;
use super::rows::{F, LANES, Row, lane_mask, lanes_of, splat3};
use super::scratch::{QueuedRay, RayLane, Scratch};
use crate::bvh::DecodedNode;
use crate::records::{INSTANCE, NO_INDEX, Packed};

/// Finds the closest hit of each active path, like `closest_hit`.
pub fn closest_hits(scene: &Packed, paths: &[PathState], active: &[u32], hits: &mut Vec<Hit>, scratch: &mut Scratch) {
    if !scratch.is_decoded {
        hits.clear();
        hits.extend(active.iter().map(|i| {
            let path = &paths[*i as usize].path;
            closest_hit(scene, path.ray, path.origin_prim, path.inside_prim)
        }));
        return;
    }
    dispatch!(*LEVEL, simd => closest_hits_in_lanes(simd, scene, paths, active, hits, scratch))
}

#[inline(always)]
fn closest_hits_in_lanes<S: Simd>(
    simd: S,
    scene: &Packed,
    paths: &[PathState],
    active: &[u32],
    hits: &mut Vec<Hit>,
    scratch: &mut Scratch,
) {
    hits.clear();
    scratch.clear();
    let has_bvh = scene.specialization.tlas_kinds != 0;
    let has_few_items = scene.bvh.items.len() <= FEW_ITEMS;
    let mut rays = RayRows::default();
    for active in active.chunks(LANES) {
        rays.set(active.iter().map(|i| &paths[*i as usize].path));
        let mut found = rays.closest(simd, scene);
        let first = hits.len();
        if has_bvh && has_few_items {
            let (origin, direction) = rays.load(simd);
            let slabs = slabs(origin, direction, item_pad(scene, origin));
            for item in &scene.bvh.items {
                let interval = box_interval(splat3(simd, item.low), splat3(simd, item.high), slabs);
                let is_hit = interval_hits(interval, F::simd_from(simd, found.t));
                let lanes = is_hit.to_bitmask() & lane_mask(active.len());
                let near: Row = interval.x.into();
                for lane in lanes_of(lanes) {
                    if item.kind & 0xff == INSTANCE {
                        scratch.queue.push(QueuedRay {
                            position: (first + lane) as u32,
                            instance: item.index,
                            near: near[lane],
                        });
                        continue;
                    }
                    let Path {
                        ray,
                        origin_prim,
                        inside_prim,
                        ..
                    } = paths[active[lane] as usize].path;
                    let before = found.get(lane);
                    let hit = closest_of_primitive(scene, before, item, ray, near[lane], origin_prim, inside_prim);
                    found.set(lane, hit);
                }
            }
        }
        for lane in 0..active.len() {
            hits.push(found.get(lane));
            if has_bvh && !has_few_items {
                scratch.queue.push(QueuedRay {
                    position: (first + lane) as u32,
                    instance: NO_INDEX,
                    near: 0.0,
                });
            }
        }
    }
    if !scratch.queue.is_empty() {
        let mut rays = Rays {
            scene,
            nodes: scene.bvh.decoded.get().map_or(&[], Vec::as_slice),
            paths,
            active,
            hits,
            queue: scratch.queue.iter(),
            lanes: &mut scratch.lanes,
        };
        trace::<S, false>(simd, &mut scratch.stacks, &mut rays);
    }
}

/// The queued rays of the active paths. A ray traverses a single instance, or the BVH of the scene item by item.
struct Rays<'a, 'h> {
    scene: &'a Packed,
    nodes: &'a [DecodedNode],
    paths: &'a [PathState],
    active: &'a [u32],
    hits: &'h mut [Hit],
    queue: std::slice::Iter<'a, QueuedRay>,
    lanes: &'h mut [RayLane; RAYS],
}

impl<'a, S: Simd> RaySource<'a, S> for Rays<'a, '_> {
    #[inline(always)]
    fn next(&mut self, simd: S, lane: usize, traced: Option<Traced>) -> Next<'a> {
        let scene = self.scene;
        let lane = &mut self.lanes[lane];
        if let Some(traced) = traced
            && traced.best.slot != NO_INDEX
        {
            // Another lane may have traced the ray through another instance.
            let hit = &mut self.hits[lane.position];
            *hit = nearer_hit(*hit, mesh_hit(lane.instance, traced.best, traced.barycentric()));
            let mesh = scene.bvh.instances[lane.instance as usize].mesh;
            prefetch_triangle(&scene.bvh.meshes[mesh as usize], traced.best.slot);
        }
        if lane.in_bvh {
            let path = &self.paths[self.active[lane.position] as usize].path;
            let hit = &mut self.hits[lane.position];
            match lane.items.step::<S, true>(simd, self.nodes, hit.t) {
                ItemStep::Found(i, near) => {
                    let item = &scene.bvh.items[i];
                    if item.kind & 0xff == INSTANCE {
                        lane.instance = item.index;
                        let ray = closest_mesh_ray(scene, *hit, item.index, path.ray, near, path.origin_prim);
                        return Next::trace(decoded_mesh(scene, item.index), ray);
                    }
                    let (origin_prim, inside_prim) = (path.origin_prim, path.inside_prim);
                    *hit = closest_of_primitive(scene, *hit, item, path.ray, near, origin_prim, inside_prim);
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
        lane.instance = queued.instance;
        lane.in_bvh = queued.instance == NO_INDEX;
        let path = &self.paths[self.active[lane.position] as usize].path;
        if lane.in_bvh {
            let slabs = slabs(path.ray.origin, path.ray.direction, item_pad(scene, path.ray.origin));
            lane.items.start(slabs);
            return Next::Wait;
        }
        let (hit, start) = (self.hits[lane.position], max(queued.near, 0.0));
        let ray = closest_mesh_ray(scene, hit, lane.instance, path.ray, start, path.origin_prim);
        Next::trace(decoded_mesh(scene, lane.instance), ray)
    }
}
