//! Closest-hit and occlusion queries of a batch of rays over the primitives outside of the BVH. Each primitive is
//! tested against [`LANES`] rays at a time.

use fearless_simd::prelude::*;
use fearless_simd::u32x8;

use super::super::lanes::{Real, select};
use super::super::path::Path;
use super::super::primitive::intersect;
use super::super::ray::{Hit, Ray, no_hit, standalone_prim};
use super::super::shadow::occludes_segment;
use super::QueuedShadowRay;
use super::rows::{F, LANES, Row, Rows3, V, load3, set3};
use crate::records::{INFINITE_T, NO_INDEX, Packed, with_primitive_kind};

/// Rays of up to [`LANES`] paths.
#[derive(Default)]
pub struct RayRows {
    origin: Rows3,
    direction: Rows3,
    /// For each ray, the primitive outside of meshes that it starts on and cannot hit again, as in [`Path`].
    origin_prim: [u32; LANES],
    /// Solids that the rays start on and pass through, as in [`Path`].
    inside_prim: [u32; LANES],
}

/// Closest hits of up to [`LANES`] rays with primitives outside of meshes.
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
    /// Stores the next ray of each path in a lane.
    #[inline(always)]
    pub fn set<'a>(&mut self, paths: impl Iterator<Item = &'a Path>) {
        for (lane, path) in paths.enumerate() {
            set3(&mut self.origin, lane, path.ray.origin);
            set3(&mut self.direction, lane, path.ray.direction);
            self.origin_prim[lane] = standalone_prim(path.origin_prim);
            self.inside_prim[lane] = standalone_prim(path.inside_prim);
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
        let inside_prim = u32x8::simd_from(simd, self.inside_prim);
        let ray = Ray { origin, direction };
        let mut t = F::simd_from(simd, hits.t);
        let mut primitive = u32x8::simd_from(simd, hits.primitive);
        for (kind, range) in scene.kinds() {
            with_primitive_kind!(kind, |kind| for i in range {
                let index = u32x8::simd_from(simd, i as u32);
                let from_inside = inside_prim.simd_eq(index);
                let distance = intersect(kind, &scene.primitives[i], from_inside, ray, t);
                let is_nearer = distance.lt(t) & !origin_prim.simd_eq(index);
                t = select(t, distance, is_nearer);
                primitive = is_nearer.select(index, primitive);
            });
        }
        (hits.t, hits.primitive) = (t.into(), primitive.into());
        hits
    }
}

/// Up to [`LANES`] shadow rays.
#[derive(Default)]
pub struct ShadowRayRows {
    origin: Rows3,
    to_light: Rows3,
    t_max: Row,
    /// Primitives outside of meshes that the segments start on.
    origin_prim: [u32; LANES],
    /// Solids that the segments start on, as `exclude_back` in [`Surface`](super::super::surface::Surface).
    inside_prim: [u32; LANES],
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
            self.inside_prim[lane] = standalone_prim(ray.exclude_back);
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
    pub fn occluded<S: Simd>(&self, simd: S, scene: &Packed) -> u64 {
        let (origin, to_light, t_max) = self.load(simd);
        let (origin_prim, target_prim) = (
            u32x8::simd_from(simd, self.origin_prim),
            u32x8::simd_from(simd, self.target_prim),
        );
        let inside_prim = u32x8::simd_from(simd, self.inside_prim);
        let mut is_occluded = t_max.lt(t_max); // false in all lanes
        for (kind, range) in scene.shadow_casters() {
            with_primitive_kind!(kind, |kind| for i in range {
                let index = u32x8::simd_from(simd, i as u32);
                let is_excluded = origin_prim.simd_eq(index) | target_prim.simd_eq(index);
                let from_inside = inside_prim.simd_eq(index);
                let q = &scene.primitives[i];
                let occludes = occludes_segment(kind, q, origin, from_inside, to_light, t_max);
                is_occluded |= occludes & !is_excluded;
            });
        }
        is_occluded.to_bitmask()
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::cpu::traversal::levels;
    use crate::records::PRIMITIVE_KINDS;
    use crate::records::primitive;

    struct Random(u64);

    impl Random {
        /// Returns a number from -1 to 1. Half of the numbers are multiples of 1/2, so that rays hit edges and planes
        /// exactly.
        fn number(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let number = (self.0 >> 32) as f64 / f64::from(1u32 << 31) - 1.0;
            if self.0 >> 20 & 1 == 0 {
                (2.0 * number).round() / 2.0
            } else {
                number
            }
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.number(), self.number(), self.number())
        }
    }

    #[test]
    fn lanes_are_bit_identical_to_single_rays() {
        for kind in 0..PRIMITIVE_KINDS.len() as u32 {
            let (hits, occluded) = test_kind(kind);
            assert!(
                hits > 500 && occluded > 500,
                "kind {kind}: {hits} hits, {occluded} occluded"
            );
        }
    }

    /// Compares lanes with single rays, and returns the numbers of hits and of occluded segments.
    fn test_kind(kind: u32) -> (usize, usize) {
        let random = &mut Random(1);
        let (mut hits, mut occluded) = (0, 0);
        for i in 0..2000 {
            let edges = [random.vector(), random.vector()];
            let columns = DMat3::from_cols(edges[0], edges[1], edges[0].cross(edges[1]) + DVec3::Z * 1e-3);
            let q = &primitive(kind, random.vector(), columns, 0, 0);
            let limit = [INFINITE_T, 0.7][i % 2];
            let rays = [(); LANES].map(|()| Ray {
                origin: random.vector().as_vec3(),
                direction: random.vector().as_vec3(),
            });
            let inside_mask = random.0 >> 40 & 0xff;
            let (mut origins, mut directions) = (Rows3::default(), Rows3::default());
            for (lane, ray) in rays.iter().enumerate() {
                set3(&mut origins, lane, ray.origin);
                set3(&mut directions, lane, ray.direction);
            }
            for level in levels() {
                let (t, occluded_mask) = dispatch!(level, simd => {
                    let (origin, direction) = (load3(simd, &origins), load3(simd, &directions));
                    let limit: F<_> = SimdBase::splat(simd, limit);
                    let from_inside = SimdMask::from_bitmask(simd, inside_mask);
                    let t = intersect(kind, q, from_inside, Ray { origin, direction }, limit);
                    let occludes = occludes_segment(kind, q, origin, from_inside, direction, limit);
                    let t: Row = t.into();
                    (t, occludes.to_bitmask())
                });
                for (lane, ray) in rays.into_iter().enumerate() {
                    let from_inside = inside_mask >> lane & 1 == 1;
                    let expected = intersect(kind, q, from_inside, ray, limit);
                    assert_eq!(t[lane].to_bits(), expected.to_bits(), "kind {kind}");
                    let is_occluded = occludes_segment(kind, q, ray.origin, from_inside, ray.direction, limit);
                    assert_eq!(occluded_mask >> lane & 1 == 1, is_occluded, "kind {kind}");
                    hits += usize::from(expected < limit);
                    occluded += usize::from(is_occluded);
                }
            }
        }
        (hits, occluded)
    }
}
