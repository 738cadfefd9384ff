//! Queries of a batch of rays on the primitives outside of the BVH, with rectangles arranged once for the batch.

use fearless_simd::Simd;

use super::super::linear_primitives::{closest_of_kind, is_occluded_by_kind};
use super::super::ray::{Hit, Ray, no_hit};
use super::super::rectangles::RectangleGroups;
use super::super::shadow_ray::ShadowRay;
use crate::records::{Packed, RECTANGLE};

/// The primitives outside of the BVH.
pub struct LinearPrimitives<'a, S: Simd> {
    scene: &'a Packed,
    rectangles: Option<RectangleGroups<S>>,
}

impl<'a, S: Simd> LinearPrimitives<'a, S> {
    #[inline(always)]
    pub fn new(simd: S, scene: &'a Packed) -> LinearPrimitives<'a, S> {
        let mut kinds = scene.kinds();
        let range = kinds.find(|(kind, _)| *kind == RECTANGLE).map(|(_, range)| range);
        LinearPrimitives {
            scene,
            rectangles: range.map(|range| RectangleGroups::new(simd, scene, range)),
        }
    }

    /// Returns the closest hit, like `closest_primitive`.
    #[inline(always)]
    pub fn closest(&self, simd: S, ray: Ray, origin_prim: u32, inside_prim: u32) -> Hit {
        let mut hit = no_hit();
        for (kind, range) in self.scene.kinds() {
            hit = match &self.rectangles {
                Some(rectangles) if kind == RECTANGLE => rectangles.closest(simd, hit, ray, origin_prim),
                _ => closest_of_kind(self.scene, kind, range, hit, ray, origin_prim, inside_prim),
            };
        }
        hit
    }

    /// Returns true if a primitive occludes the segment, like `is_occluded_by_primitives`.
    #[inline(always)]
    pub fn is_occluded(&self, simd: S, ray: &ShadowRay) -> bool {
        for (kind, range) in self.scene.shadow_casters() {
            let occluded = match &self.rectangles {
                Some(rectangles) if kind == RECTANGLE => rectangles.is_occluded(simd, range.end, ray),
                _ => is_occluded_by_kind(
                    self.scene,
                    kind,
                    range,
                    &ray.surface(),
                    ray.to_light,
                    ray.t_max,
                    ray.target_prim,
                ),
            };
            if occluded {
                return true;
            }
        }
        false
    }
}
