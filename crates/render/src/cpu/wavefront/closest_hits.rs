//! The stage that finds the closest hits of a batch of paths.

use fearless_simd::{Simd, dispatch};

use super::super::bvh::{closest_mesh_ray, closest_of_primitive, item_pad, mesh_hit};
use super::super::integrators::path::PathState;
use super::super::math::max;
use super::super::path::Path;
use super::super::ray::{Hit, standalone_prim};
use super::super::samples::LEVEL;
use super::super::slab::{box_interval, interval_hits, slabs};
use super::super::traversal::{MeshRay, Nearest, RAYS, RaySource, trace};
use super::linear::LinearPrimitives;
use super::scratch::{RayLane, Scratch};
use crate::records::{INSTANCE, NO_INDEX, Packed};

/// Finds the closest hits of the active paths, equal to `closest_hit`.
pub fn closest_hits(scene: &Packed, paths: &[PathState], active: &[u32], hits: &mut Vec<Hit>, scratch: &mut Scratch) {
    dispatch!(*LEVEL, simd => find(simd, scene, paths, active, hits, scratch))
}

#[inline(always)]
fn find<S: Simd>(
    simd: S,
    scene: &Packed,
    paths: &[PathState],
    active: &[u32],
    hits: &mut Vec<Hit>,
    scratch: &mut Scratch,
) {
    hits.clear();
    let has_bvh = scene.specialization.tlas_kinds != 0;
    let primitives = LinearPrimitives::new(simd, scene);
    for &i in active {
        let Path {
            ray,
            origin_prim,
            inside_prim,
            ..
        } = &paths[i as usize].path;
        let [origin_prim, inside_prim] = match has_bvh {
            true => [standalone_prim(*origin_prim), standalone_prim(*inside_prim)],
            false => [origin_prim.y, inside_prim.y],
        };
        hits.push(primitives.closest(simd, *ray, origin_prim, inside_prim));
    }
    if has_bvh {
        scratch.clear();
        let mut rays = Rays {
            scene,
            paths,
            active,
            hits,
            next: 0,
            lanes: &mut scratch.lanes,
        };
        trace::<S, false>(simd, &mut scratch.stacks, &mut rays);
    }
}

/// The rays of the active paths, which traverse the BVH of the scene item by item.
struct Rays<'a, 'h> {
    scene: &'a Packed,
    paths: &'a [PathState],
    active: &'a [u32],
    hits: &'h mut [Hit],
    /// The next position in `active`.
    next: usize,
    lanes: &'h mut [RayLane; RAYS],
}

impl<'a, S: Simd> RaySource<'a, S> for Rays<'a, '_> {
    #[inline(always)]
    fn next(&mut self, simd: S, lane: usize, traced: Option<(&MeshRay<'a>, Nearest)>) -> Option<MeshRay<'a>> {
        let scene = self.scene;
        let lane = &mut self.lanes[lane];
        if let (Some((ray, found)), Some(position)) = (traced, lane.position)
            && found.slot != NO_INDEX
        {
            self.hits[position] = mesh_hit(&ray.mesh, lane.instance, &ray.line, found);
        }
        loop {
            if let Some(position) = lane.position {
                let Path {
                    ray,
                    origin_prim,
                    inside_prim,
                    ..
                } = &self.paths[self.active[position] as usize].path;
                let hit = &mut self.hits[position];
                while let Some(i) = lane.items.next(simd, scene, hit.t) {
                    let item = &scene.bvh.items[i];
                    let interval = box_interval(item.low, item.high, lane.slabs);
                    if !interval_hits(interval, hit.t) {
                        continue;
                    }
                    if item.kind & 0xff == INSTANCE {
                        lane.instance = item.index;
                        let start = max(interval.x, 0.0);
                        return Some(closest_mesh_ray(scene, *hit, item.index, *ray, start, *origin_prim));
                    }
                    *hit = closest_of_primitive(scene, *hit, item, *ray, interval.x, *origin_prim, *inside_prim);
                }
            }
            let position = self.next;
            let ray = self.paths[*self.active.get(position)? as usize].path.ray;
            self.next += 1;
            lane.position = Some(position);
            lane.slabs = slabs(ray.origin, ray.direction, item_pad(scene, ray.origin));
            lane.items.start(scene, lane.slabs);
        }
    }
}
