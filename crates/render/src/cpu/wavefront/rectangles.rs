//! Rectangles, each of which is tested against eight rays at a time, with the results of `rectangle.rs`.

use fearless_simd::mask32x8;
use fearless_simd::prelude::*;

use super::super::lanes::{Lanes3, Real};
use super::super::math::dot;
use super::super::rectangle;
use super::rows::{F, V, splat3};
use crate::records::Primitive;

/// Returns the rays that hit a rectangle nearer than `limit`, and their distances, like
/// [`intersect_rectangle`](rectangle::intersect_rectangle).
#[inline(always)]
pub fn intersect_rectangle<S: Simd>(
    simd: S,
    q: &Primitive,
    origin: V<S>,
    direction: V<S>,
    limit: F<S>,
) -> (mask32x8<S>, F<S>) {
    let (anchor, x, y, z) = rows(simd, q);
    let t = dot(z, anchor - origin) / dot(z, direction);
    let p = origin + direction * t - anchor;
    let one = limit.splat(1.0);
    let inside = Real::abs(dot(x, p)).le(one) & Real::abs(dot(y, p)).le(one);
    (t.gt(limit.splat(0.0)) & t.lt(limit) & inside, t)
}

/// Returns the segments from `p` along `t_max * to_light` that a rectangle occludes, like
/// [`occludes_segment`](super::super::shadow::occludes_segment).
#[inline(always)]
pub fn rectangle_occludes<S: Simd>(simd: S, q: &Primitive, p: V<S>, to_light: V<S>, t_max: F<S>) -> mask32x8<S> {
    let (anchor, x, y, z) = rows(simd, q);
    let to_local = |v: V<S>| Lanes3 {
        x: dot(x, v),
        y: dot(y, v),
        z: dot(z, v),
    };
    rectangle::rectangle_occludes(to_local(p - anchor), to_local(to_light), t_max)
}

#[inline(always)]
fn rows<S: Simd>(simd: S, q: &Primitive) -> (V<S>, V<S>, V<S>, V<S>) {
    (
        splat3(simd, q.anchor),
        splat3(simd, q.x),
        splat3(simd, q.y),
        splat3(simd, q.z),
    )
}

#[cfg(test)]
mod tests {
    use fearless_simd::{dispatch, f32x8};
    use glam::{DMat3, DVec3};

    use super::super::rows::{LANES, Rows3, load3, set3};
    use super::*;
    use crate::cpu::ray::Ray;
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
    fn rays_in_lanes_equal_single_rays() {
        let random = &mut Random(1);
        let (mut hits, mut occluded) = (0, 0);
        for i in 0..2000 {
            let edges = [random.vector(), random.vector()];
            let columns = DMat3::from_cols(edges[0], edges[1], edges[0].cross(edges[1]) + DVec3::Z * 1e-3);
            let q = &primitive(RECTANGLE, random.vector(), columns, 0, 0);
            let limit = [INFINITE_T, 0.7][i % 2];
            let rays = [(); LANES].map(|()| Ray {
                origin: random.vector().as_vec3(),
                direction: random.vector().as_vec3(),
            });
            let (mut origins, mut directions) = (Rows3::default(), Rows3::default());
            for (lane, ray) in rays.iter().enumerate() {
                set3(&mut origins, lane, ray.origin);
                set3(&mut directions, lane, ray.direction);
            }
            for level in levels() {
                let (mask, t, occluding) = dispatch!(level, simd => {
                    let (origin, direction) = (load3(simd, &origins), load3(simd, &directions));
                    let limit: f32x8<_> = SimdBase::splat(simd, limit);
                    let (mask, t) = intersect_rectangle(simd, q, origin, direction, limit);
                    let t: [f32; LANES] = t.into();
                    let occluding = rectangle_occludes(simd, q, origin, direction, limit);
                    (mask.to_bitmask(), t, occluding.to_bitmask())
                });
                for (lane, ray) in rays.into_iter().enumerate() {
                    let found = if mask >> lane & 1 == 1 { t[lane] } else { limit };
                    let expected = rectangle::intersect_rectangle(q, ray, limit);
                    assert_eq!(found.to_bits(), expected.to_bits());
                    let is_occluded = occludes_segment(RECTANGLE, q, ray.origin, false, ray.direction, limit);
                    assert_eq!(occluding >> lane & 1 == 1, is_occluded);
                    hits += usize::from(expected < limit);
                    occluded += usize::from(is_occluded);
                }
            }
        }
        assert!(hits > 1000 && occluded > 1000, "{hits} {occluded}");
    }
}
