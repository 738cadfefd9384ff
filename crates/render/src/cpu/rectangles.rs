//! Rectangles, eight of which are tested against a ray at a time, with the results of `rectangle.rs`.

use std::ops::Range;

use bytemuck::cast_ref;
use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8};
use glam::Vec3;

use super::ray::{Hit, Ray, closer, standalone_prim};
use super::shadow_ray::ShadowRay;
use crate::records::{Packed, Primitive};

/// Number of rectangles per group.
pub const LANES: usize = 8;

/// Up to eight rectangles as a structure of arrays. Unused lanes are zero, so that a ray's distance is NaN there.
#[derive(Clone, Copy, Debug)]
pub struct Rectangles<S: Simd> {
    anchor: [f32x8<S>; 3],
    x: [f32x8<S>; 3],
    y: [f32x8<S>; 3],
    z: [f32x8<S>; 3],
}

impl<S: Simd> Rectangles<S> {
    /// Arranges one to eight rectangles.
    #[inline(always)]
    pub fn new(simd: S, rectangles: &[Primitive]) -> Rectangles<S> {
        Rectangles {
            anchor: transposed(simd, rectangles, 0),
            x: transposed(simd, rectangles, 1),
            y: transposed(simd, rectangles, 2),
            z: transposed(simd, rectangles, 3),
        }
    }

    /// Returns the distances, and the mask of the rectangles hit nearer than `limit`, like
    /// [`intersect_rectangle`](super::rectangle::intersect_rectangle).
    #[inline(always)]
    pub fn intersect(&self, simd: S, ray: Ray, limit: f32) -> (u32, f32x8<S>) {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let Rectangles { anchor, x, y, z } = *self;
        let from_ray = [anchor[0] - o[0], anchor[1] - o[1], anchor[2] - o[2]];
        let t = dot(z, from_ray) / dot_with(z, d);
        let p = [
            t * d[0] + o[0] - anchor[0],
            t * d[1] + o[1] - anchor[1],
            t * d[2] + o[2] - anchor[2],
        ];
        let one = f32x8::splat(simd, 1.0);
        let inside = dot(x, p).abs().simd_le(one) & dot(y, p).abs().simd_le(one);
        let hits = inside & t.simd_gt(f32x8::splat(simd, 0.0)) & t.simd_lt(f32x8::splat(simd, limit));
        (hits.to_bitmask() as u32, t)
    }

    /// Returns the mask of the rectangles that occlude the segment from `p` along `t_max * to_light`, like
    /// [`occludes_segment`](super::shadow::occludes_segment).
    #[inline(always)]
    pub fn occlude(&self, simd: S, p: Vec3, to_light: Vec3, t_max: f32) -> u32 {
        let (p, to_light) = (p.to_array(), to_light.to_array());
        let Rectangles { anchor, x, y, z } = *self;
        let from_anchor = [
            f32x8::splat(simd, p[0]) - anchor[0],
            f32x8::splat(simd, p[1]) - anchor[1],
            f32x8::splat(simd, p[2]) - anchor[2],
        ];
        let o = [dot(x, from_anchor), dot(y, from_anchor), dot(z, from_anchor)];
        let d = [dot_with(x, to_light), dot_with(y, to_light), dot_with(z, to_light)];
        let (depth, height) = (d[2].abs(), o[2].abs());
        let crosses = (o[2] * d[2]).simd_lt(f32x8::splat(simd, 0.0)) & height.simd_lt(depth * t_max);
        let inside =
            (o[0] * depth + height * d[0]).abs().simd_le(depth) & (o[1] * depth + height * d[1]).abs().simd_le(depth);
        (crosses & inside).to_bitmask() as u32
    }
}

/// Returns the first three components of a row of up to eight rectangles.
#[inline(always)]
fn transposed<S: Simd>(simd: S, rectangles: &[Primitive], row: usize) -> [f32x8<S>; 3] {
    let mut vectors = [f32x4::splat(simd, 0.0); LANES];
    for (vector, rectangle) in vectors.iter_mut().zip(rectangles) {
        let rows: &[[f32; 4]; 5] = cast_ref(rectangle);
        *vector = f32x4::simd_from(simd, rows[row]);
    }
    let [a, b, c, d, e, f, g, h] = vectors;
    let [x, y, z] = components(a, b, c, d);
    let [x_2, y_2, z_2] = components(e, f, g, h);
    [x.combine(x_2), y.combine(y_2), z.combine(z_2)]
}

#[inline(always)]
fn components<S: Simd>(a: f32x4<S>, b: f32x4<S>, c: f32x4<S>, d: f32x4<S>) -> [f32x4<S>; 3] {
    let (low, high) = (a.zip_low(c), b.zip_low(d));
    [
        low.zip_low(high),
        low.zip_high(high),
        a.zip_high(c).zip_low(b.zip_high(d)),
    ]
}

/// The rectangles outside of the BVH, arranged once for a batch of rays.
pub struct RectangleGroups<S: Simd> {
    first: usize,
    groups: Vec<Rectangles<S>>,
}

impl<S: Simd> RectangleGroups<S> {
    /// Arranges a range of a scene's primitives, all rectangles.
    #[inline(always)]
    pub fn new(simd: S, scene: &Packed, range: Range<usize>) -> RectangleGroups<S> {
        let mut groups = Vec::with_capacity(range.len().div_ceil(LANES));
        for rectangles in scene.primitives[range.clone()].chunks(LANES) {
            groups.push(Rectangles::new(simd, rectangles));
        }
        RectangleGroups {
            first: range.start,
            groups,
        }
    }

    /// Returns the closest hit nearer than `hit`, like `closest_primitive`.
    #[inline(always)]
    pub fn closest(&self, simd: S, mut hit: Hit, ray: Ray, origin_prim: u32) -> Hit {
        let mut first = self.first;
        for group in &self.groups {
            let (mut hits, t) = group.intersect(simd, ray, hit.t);
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize;
                hits &= hits - 1;
                hit = closer(hit, t[lane], (first + lane) as u32, origin_prim);
            }
            first += LANES;
        }
        hit
    }

    /// Returns true if a rectangle before `end` occludes the segment, except the primitive at its start and
    /// `target_prim`.
    #[inline(always)]
    pub fn is_occluded(&self, simd: S, end: usize, ray: &ShadowRay) -> bool {
        let mut first = self.first;
        for group in &self.groups {
            let mut occluding = group.occlude(simd, ray.origin, ray.to_light, ray.t_max);
            for excluded in [standalone_prim(ray.exclude_front), ray.target_prim] {
                let lane = excluded.wrapping_sub(first as u32);
                if (lane as usize) < LANES {
                    occluding &= !(1 << lane);
                }
            }
            if end < first + LANES {
                occluding &= (1 << end.saturating_sub(first)) - 1;
            }
            if occluding != 0 {
                return true;
            }
            first += LANES;
        }
        false
    }
}

#[inline(always)]
fn dot<S: Simd>(a: [f32x8<S>; 3], b: [f32x8<S>; 3]) -> f32x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn dot_with<S: Simd>(a: [f32x8<S>; 3], b: [f32; 3]) -> f32x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::cpu::rectangle::intersect_rectangle;
    use crate::cpu::shadow::occludes_segment;
    use crate::cpu::traversal::levels;
    use crate::pack::primitive;
    use crate::records::{INFINITE_T, RECTANGLE};

    struct Random(u64);

    impl Random {
        /// Returns a number from -1 to 1; often a small multiple of 1/2, so that rays meet edges and planes exactly.
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
    fn groups_equal_single_rectangles() {
        let random = &mut Random(1);
        let (mut hits, mut occluded, mut tests) = (0, 0, 0);
        for i in 0..2000 {
            let rectangles: Vec<Primitive> = (0..1 + i % LANES)
                .map(|_| {
                    let edges = [random.vector(), random.vector()];
                    let columns = DMat3::from_cols(edges[0], edges[1], edges[0].cross(edges[1]) + DVec3::Z * 1e-3);
                    primitive(RECTANGLE, random.vector(), columns, 0, 0)
                })
                .collect();
            let [origin, direction] = [random.vector().as_vec3(), random.vector().as_vec3()];
            let (ray, limit) = (Ray { origin, direction }, [INFINITE_T, 0.7][i % 2]);
            for level in levels() {
                let (mask, t, occluding) = dispatch!(level, simd => {
                    let group = Rectangles::new(simd, &rectangles);
                    let (mask, t) = group.intersect(simd, ray, limit);
                    let t: [f32; LANES] = t.into();
                    (mask, t, group.occlude(simd, origin, direction, limit))
                });
                assert_eq!((mask | occluding) >> rectangles.len(), 0, "unused lanes");
                for (lane, q) in rectangles.iter().enumerate() {
                    let found = if mask >> lane & 1 == 1 { t[lane] } else { limit };
                    assert_eq!(found.to_bits(), intersect_rectangle(q, ray, limit).to_bits());
                    let expected = occludes_segment(RECTANGLE, q, origin, false, direction, limit);
                    assert_eq!(occluding >> lane & 1 == 1, expected);
                    tests += 1;
                }
            }
            hits += mask_count(&rectangles, ray, limit);
            occluded += rectangles
                .iter()
                .filter(|q| occludes_segment(RECTANGLE, q, origin, false, direction, limit))
                .count();
        }
        assert!(
            hits > 200 && occluded > 200 && tests > 10_000,
            "{hits} {occluded} {tests}"
        );
    }

    fn mask_count(rectangles: &[Primitive], ray: Ray, limit: f32) -> usize {
        let hits = rectangles.iter().filter(|q| intersect_rectangle(q, ray, limit) < limit);
        hits.count()
    }
}
