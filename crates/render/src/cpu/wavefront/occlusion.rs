//! The stage that finds out which shadow rays of a batch are occluded.

use fearless_simd::{Simd, dispatch};
use glam::UVec2;

use super::super::bvh::{FEW_ITEMS, is_occluded_by_primitive_item, item_pad, shadow_mesh_ray};
use super::super::integrators::path::{PathState, is_shadow_ray_occluded};
use super::super::samples::LEVEL;
use super::super::shadow_ray::ShadowRay;
use super::super::slab::{box_interval, interval_hits, slabs};
use super::super::traversal::{BatchMesh, Line, MeshRay, Nearest, RAYS, RaySource, trace};
use super::QueuedShadowRay;
use super::linear::LinearPrimitives;
use super::meshes::BatchMeshes;
use super::scratch::{QueuedRay, RayLane, Scratch};
use crate::records::{CASTS_SHADOW, INSTANCE, NO_INDEX, Packed};

/// Finds out which shadow rays are occluded, like `is_shadow_ray_occluded`.
pub fn occluded_rays(
    scene: &Packed,
    paths: &[PathState],
    pixels: &[UVec2],
    rays: &[QueuedShadowRay],
    occluded: &mut Vec<bool>,
    scratch: &mut Scratch,
    meshes: &BatchMeshes,
) {
    occluded.clear();
    // With alpha, a ray continues from hit to hit.
    if scene.specialization.alpha_surfaces != 0 || meshes.are_missing(scene) {
        occluded.extend(rays.iter().map(|QueuedShadowRay { path, ray }| {
            let i = *path as usize;
            is_shadow_ray_occluded(scene, ray, pixels[i], paths[i].sample)
        }));
        return;
    }
    dispatch!(*LEVEL, simd => find(simd, scene, rays, occluded, scratch, meshes))
}

#[inline(always)]
fn find<S: Simd>(
    simd: S,
    scene: &Packed,
    rays: &[QueuedShadowRay],
    occluded: &mut Vec<bool>,
    scratch: &mut Scratch,
    meshes: &BatchMeshes,
) {
    scratch.clear();
    let has_bvh = scene.specialization.tlas_kinds != 0;
    let primitives = LinearPrimitives::new(simd, scene);
    for QueuedShadowRay { ray, .. } in rays {
        let mut is_occluded = primitives.is_occluded(simd, ray);
        if has_bvh && !is_occluded {
            is_occluded = queue_ray(scene, ray, occluded.len() as u32, &mut scratch.queue);
        }
        occluded.push(is_occluded);
    }
    if !scratch.queue.is_empty() {
        let mut rays = Rays {
            scene,
            meshes,
            rays,
            occluded,
            queue: scratch.queue.iter(),
            lanes: &mut scratch.lanes,
        };
        trace::<S, true>(simd, &mut scratch.stacks, &mut rays);
    }
}

/// Queues a ray for the instances whose boxes it hits, or for the BVH of the scene. Returns true if a primitive among
/// few items occludes the ray.
#[inline(always)]
fn queue_ray(scene: &Packed, ray: &ShadowRay, position: u32, queue: &mut Vec<QueuedRay>) -> bool {
    if scene.bvh.items.len() > FEW_ITEMS {
        queue.push(QueuedRay {
            position,
            instance: NO_INDEX,
            near: 0.0,
        });
        return false;
    }
    let slabs = slabs(ray.origin, ray.to_light, item_pad(scene, ray.origin));
    for item in &scene.bvh.items {
        let interval = box_interval(item.low, item.high, slabs);
        if item.kind & CASTS_SHADOW == 0 || !interval_hits(interval, ray.t_max) {
            continue;
        }
        if item.kind & 0xff == INSTANCE {
            queue.push(QueuedRay {
                position,
                instance: item.index,
                near: interval.x,
            });
        } else if is_occluded_by_primitive_item(scene, item, &ray.surface(), ray.to_light, ray.t_max, ray.target_prim) {
            return true;
        }
    }
    false
}

/// The shadow rays, which traverse the BVH of the scene item by item, up to any hit.
struct Rays<'a, 'o> {
    scene: &'a Packed,
    meshes: &'a BatchMeshes,
    rays: &'a [QueuedShadowRay],
    occluded: &'o mut [bool],
    queue: std::slice::Iter<'a, QueuedRay>,
    lanes: &'o mut [RayLane; RAYS],
}

impl<'a, S: Simd> RaySource<'a, S> for Rays<'a, '_> {
    #[inline(always)]
    fn next(&mut self, simd: S, lane: usize, traced: Option<(&Line, Nearest)>) -> Option<(&'a BatchMesh, MeshRay)> {
        let scene = self.scene;
        let lane = &mut self.lanes[lane];
        if let Some((_, found)) = traced {
            self.occluded[lane.position] |= found.slot != NO_INDEX;
        }
        loop {
            if lane.in_bvh && !self.occluded[lane.position] {
                let ray = &self.rays[lane.position].ray;
                let surface = ray.surface();
                let (to_light, t_max) = (ray.to_light, ray.t_max);
                while let Some(i) = lane.items.next(simd, scene, t_max) {
                    let item = &scene.bvh.items[i];
                    let interval = box_interval(item.low, item.high, lane.slabs);
                    if item.kind & CASTS_SHADOW == 0 || !interval_hits(interval, t_max) {
                        continue;
                    }
                    if item.kind & 0xff == INSTANCE {
                        let ray = shadow_mesh_ray(scene, item.index, &surface, to_light, t_max);
                        return Some((self.meshes.of_instance(scene, item.index), ray));
                    }
                    if is_occluded_by_primitive_item(scene, item, &surface, to_light, t_max, ray.target_prim) {
                        self.occluded[lane.position] = true;
                        break;
                    }
                }
            }
            let queued = self.queue.next()?;
            lane.position = queued.position as usize;
            lane.in_bvh = queued.instance == NO_INDEX;
            let ray = &self.rays[lane.position].ray;
            if lane.in_bvh {
                lane.slabs = slabs(ray.origin, ray.to_light, item_pad(scene, ray.origin));
                lane.items.start(lane.slabs);
            } else if !self.occluded[lane.position] {
                let mesh_ray = shadow_mesh_ray(scene, queued.instance, &ray.surface(), ray.to_light, ray.t_max);
                return Some((self.meshes.of_instance(scene, queued.instance), mesh_ray));
            }
        }
    }
}
