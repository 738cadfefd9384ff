//! Queries of a batch of rays on the primitives outside of the BVH. Rectangles are tested against several rays at a
//! time.

use fearless_simd::prelude::*;
use fearless_simd::u32x8;

use super::super::lanes::{Real, select};
use super::super::linear_primitives::{closest_of_kind, is_occluded_by_kind};
use super::super::path::Path;
use super::super::ray::{Hit, Ray, no_hit, standalone_prim};
use super::super::shadow_ray::ShadowRay;
use super::QueuedShadowRay;
use super::rectangles::{intersect_rectangle, rectangle_occludes};
use super::rows::{F, LANES, Row, Rows3, V, get3, load3, set3};
use crate::records::{INFINITE_T, NO_INDEX, Packed, RECTANGLE};

/// Rays of up to [`LANES`] paths.
#[derive(Default)]
pub struct RayRows {
    count: usize,
    origin: Rows3,
    direction: Rows3,
    /// Primitives outside of meshes that the rays start on, as in [`Path`].
    origin_prim: [u32; LANES],
    inside_prim: [u32; LANES],
}

/// Hits of rays with primitives outside of meshes.
pub struct HitRows {
    pub t: Row,
    pub primitive: [u32; LANES],
}

impl HitRows {
    /// Returns the hit of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Hit {
        Hit {
            t: self.t[lane],
            primitive: self.primitive[lane],
            ..no_hit()
        }
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, hit: Hit) {
        self.t[lane] = hit.t;
        self.primitive[lane] = hit.primitive;
    }
}

impl RayRows {
    /// Arranges the next rays of paths.
    #[inline(always)]
    pub fn set<'a>(&mut self, paths: impl Iterator<Item = &'a Path>) {
        self.count = 0;
        for (lane, path) in paths.enumerate() {
            set3(&mut self.origin, lane, path.ray.origin);
            set3(&mut self.direction, lane, path.ray.direction);
            self.origin_prim[lane] = standalone_prim(path.origin_prim);
            self.inside_prim[lane] = standalone_prim(path.inside_prim);
            self.count += 1;
        }
    }

    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> (V<S>, V<S>) {
        (load3(simd, &self.origin), load3(simd, &self.direction))
    }

    /// Returns the closest hits, like `closest_primitive`.
    #[inline(always)]
    pub fn closest<S: Simd>(&self, simd: S, scene: &Packed) -> HitRows {
        let (origin, direction) = self.load(simd);
        let origin_prim = u32x8::simd_from(simd, self.origin_prim);
        let mut hits = HitRows {
            t: [INFINITE_T; LANES],
            primitive: [NO_INDEX; LANES],
        };
        for (kind, range) in scene.kinds() {
            if kind == RECTANGLE {
                let mut t = F::simd_from(simd, hits.t);
                let mut primitive = u32x8::simd_from(simd, hits.primitive);
                for i in range {
                    let (is_hit, distance) = intersect_rectangle(simd, &scene.primitives[i], origin, direction, t);
                    let index = u32x8::simd_from(simd, i as u32);
                    let is_hit = is_hit & !origin_prim.simd_eq(index);
                    t = select(t, distance, is_hit);
                    primitive = is_hit.select(index, primitive);
                }
                (hits.t, hits.primitive) = (t.into(), primitive.into());
                continue;
            }
            for lane in 0..self.count {
                let ray = Ray {
                    origin: get3(&self.origin, lane),
                    direction: get3(&self.direction, lane),
                };
                let (origin_prim, inside_prim) = (self.origin_prim[lane], self.inside_prim[lane]);
                let before = hits.get(lane);
                let hit = closest_of_kind(scene, kind, range.clone(), before, ray, origin_prim, inside_prim);
                hits.set(lane, hit);
            }
        }
        hits
    }
}

/// Up to [`LANES`] shadow rays.
#[derive(Default)]
pub struct ShadowRayRows {
    origin: Rows3,
    to_light: Rows3,
    t_max: Row,
    /// Primitives outside of meshes at the start.
    origin_prim: [u32; LANES],
    target_prim: [u32; LANES],
}

impl ShadowRayRows {
    #[inline(always)]
    pub fn set(&mut self, rays: &[QueuedShadowRay]) {
        for (lane, QueuedShadowRay { ray, .. }) in rays.iter().enumerate() {
            set3(&mut self.origin, lane, ray.origin);
            set3(&mut self.to_light, lane, ray.to_light);
            self.t_max[lane] = ray.t_max;
            self.origin_prim[lane] = standalone_prim(ray.exclude_front);
            self.target_prim[lane] = ray.target_prim;
        }
    }

    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> (V<S>, V<S>, F<S>) {
        (
            load3(simd, &self.origin),
            load3(simd, &self.to_light),
            F::simd_from(simd, self.t_max),
        )
    }

    /// Returns the mask of the rays that a primitive occludes, like `is_occluded_by_primitives`.
    #[inline(always)]
    pub fn occluded<S: Simd>(&self, simd: S, scene: &Packed, rays: &[QueuedShadowRay]) -> u64 {
        let (origin, to_light, t_max) = self.load(simd);
        let (origin_prim, target_prim) = (
            u32x8::simd_from(simd, self.origin_prim),
            u32x8::simd_from(simd, self.target_prim),
        );
        let mut occluded = 0;
        for (kind, range) in scene.shadow_casters() {
            if kind == RECTANGLE {
                let mut is_occluded = t_max.lt(t_max);
                for i in range {
                    let index = u32x8::simd_from(simd, i as u32);
                    let is_excluded = origin_prim.simd_eq(index) | target_prim.simd_eq(index);
                    let occludes = rectangle_occludes(simd, &scene.primitives[i], origin, to_light, t_max);
                    is_occluded = is_occluded | (occludes & !is_excluded);
                }
                occluded |= is_occluded.to_bitmask();
                continue;
            }
            for (lane, QueuedShadowRay { ray, .. }) in rays.iter().enumerate() {
                if occluded >> lane & 1 == 0 && is_occluded(scene, kind, range.clone(), ray) {
                    occluded |= 1 << lane;
                }
            }
        }
        occluded
    }
}

fn is_occluded(scene: &Packed, kind: u32, range: std::ops::Range<usize>, ray: &ShadowRay) -> bool {
    let surface = ray.surface();
    is_occluded_by_kind(scene, kind, range, &surface, ray.to_light, ray.t_max, ray.target_prim)
}
