//! The stage that finds out which shadow rays of a batch are occluded.

use fearless_simd::{Simd, dispatch};
use glam::UVec2;

use super::super::bvh::{is_occluded_by_primitive_item, item_pad, shadow_mesh_ray};
use super::super::integrators::path::{PathState, is_shadow_ray_occluded};
use super::super::samples::LEVEL;
use super::super::slab::{box_interval, interval_hits, slabs};
use super::super::traversal::{MeshRay, Nearest, RAYS, RaySource, trace};
use super::QueuedShadowRay;
use super::linear::LinearPrimitives;
use super::scratch::{RayLane, Scratch};
use crate::records::{CASTS_SHADOW, INSTANCE, NO_INDEX, Packed};

/// Finds out which shadow rays are occluded, like `is_shadow_ray_occluded`.
pub fn occluded_rays(
    scene: &Packed,
    paths: &[PathState],
    pixels: &[UVec2],
    rays: &[QueuedShadowRay],
    occluded: &mut Vec<bool>,
    scratch: &mut Scratch,
) {
    occluded.clear();
    if scene.specialization.alpha_surfaces != 0 {
        // The ray continues from hit to hit.
        occluded.extend(rays.iter().map(|QueuedShadowRay { path, ray }| {
            let i = *path as usize;
            is_shadow_ray_occluded(scene, ray, pixels[i], paths[i].sample)
        }));
        return;
    }
    dispatch!(*LEVEL, simd => find(simd, scene, rays, occluded, scratch))
}

#[inline(always)]
fn find<S: Simd>(simd: S, scene: &Packed, rays: &[QueuedShadowRay], occluded: &mut Vec<bool>, scratch: &mut Scratch) {
    let primitives = LinearPrimitives::new(simd, scene);
    for QueuedShadowRay { ray, .. } in rays {
        occluded.push(primitives.is_occluded(simd, ray));
    }
    if scene.specialization.tlas_kinds != 0 {
        scratch.clear();
        let mut rays = Rays {
            scene,
            rays,
            occluded,
            next: 0,
            lanes: &mut scratch.lanes,
        };
        trace::<S, true>(simd, &mut scratch.stacks, &mut rays);
    }
}

/// The shadow rays, which traverse the BVH of the scene item by item, up to any hit.
struct Rays<'a, 'o> {
    scene: &'a Packed,
    rays: &'a [QueuedShadowRay],
    occluded: &'o mut [bool],
    /// The next position in `rays`.
    next: usize,
    lanes: &'o mut [RayLane; RAYS],
}

impl<'a, S: Simd> RaySource<'a, S> for Rays<'a, '_> {
    #[inline(always)]
    fn next(&mut self, simd: S, lane: usize, traced: Option<(&MeshRay<'a>, Nearest)>) -> Option<MeshRay<'a>> {
        let scene = self.scene;
        let lane = &mut self.lanes[lane];
        if let (Some((_, found)), Some(position)) = (traced, lane.position) {
            self.occluded[position] |= found.slot != NO_INDEX;
        }
        loop {
            if let Some(position) = lane.position
                && !self.occluded[position]
            {
                let ray = &self.rays[position].ray;
                let surface = ray.surface();
                while let Some(i) = lane.items.next(simd, scene, ray.t_max) {
                    let item = &scene.bvh.items[i];
                    let interval = box_interval(item.low, item.high, lane.slabs);
                    if item.kind & CASTS_SHADOW == 0 || !interval_hits(interval, ray.t_max) {
                        continue;
                    }
                    let (to_light, t_max) = (ray.to_light, ray.t_max);
                    if item.kind & 0xff == INSTANCE {
                        return Some(shadow_mesh_ray(scene, item.index, &surface, to_light, t_max));
                    }
                    if is_occluded_by_primitive_item(scene, item, &surface, to_light, t_max, ray.target_prim) {
                        self.occluded[position] = true;
                        break;
                    }
                }
            }
            let position = self.next;
            let ray = &self.rays.get(position)?.ray;
            self.next += 1;
            lane.position = Some(position);
            lane.slabs = slabs(ray.origin, ray.to_light, item_pad(scene, ray.origin));
            lane.items.start(scene, lane.slabs);
        }
    }
}
