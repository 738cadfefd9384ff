//! Twin of `shaders/triangle.wgsl`.

use super::lanes::{Real, Vector2, Vector3, select};
use super::math::dot;
use super::ray::{Ray, crosses_plane, plane_distance, scaled_crossing};
use crate::records::Primitive;

#[inline(always)]
pub fn intersect_triangle<V: Vector3>(q: &Primitive, ray: Ray<V>, limit: V::Real) -> V::Real {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - ray.origin.broadcast(q.anchor);
    let x = dot(p.broadcast(q.x), p);
    let y = dot(p.broadcast(q.y), p);
    let zero = t.splat(0.0);
    let inside = x.ge(zero) & y.ge(zero) & (x + y).le(t.splat(1.0));
    select(limit, t, t.gt(zero) & t.lt(limit) & inside)
}

#[inline(always)]
pub fn triangle_occludes<V: Vector3>(o: V, d: V, t_max: V::Real) -> <V::Real as Real>::Mask {
    let p = scaled_crossing(o, d);
    let (x, y, zero) = (p.x(), p.y(), t_max.splat(0.0));
    crosses_plane(o, d, t_max) & x.ge(zero) & y.ge(zero) & (x + y).le(d.z().abs())
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3, Vec3};

    use super::*;
    use crate::cpu::primitive::primitive_normal;
    use crate::records::primitive;
    use crate::records::{INFINITE_T, TRIANGLE};

    const CORNERS: [DVec3; 3] = [
        DVec3::new(1.0, 1.0, 2.0),
        DVec3::new(3.0, 1.0, 2.0),
        DVec3::new(1.0, 4.0, 2.0),
    ];

    fn triangle() -> Primitive {
        let [v0, v1, v2] = CORNERS;
        let normal = (v1 - v0).cross(v2 - v1).normalize();
        primitive(TRIANGLE, v0, DMat3::from_cols(v1 - v0, v2 - v0, normal), 0, 0)
    }

    /// Returns the distance from (x, y, 5) down to the triangle.
    fn from_above(x: f32, y: f32) -> f32 {
        let ray = Ray {
            origin: Vec3::new(x, y, 5.0),
            direction: Vec3::NEG_Z,
        };
        intersect_triangle(&triangle(), ray, INFINITE_T)
    }

    #[test]
    fn hits_are_inside_the_edges() {
        for inside in [(1.01, 1.01), (2.9, 1.01), (1.01, 3.9), (1.9, 2.4), (1.5, 2.0)] {
            let found = from_above(inside.0, inside.1);
            assert!((found - 3.0).abs() < 1e-6, "{inside:?}: {found}");
        }
        for outside in [(0.99, 2.0), (2.0, 0.99), (2.1, 2.6), (3.0, 4.0)] {
            assert_eq!(from_above(outside.0, outside.1), INFINITE_T, "{outside:?}");
        }
    }

    #[test]
    fn counter_clockwise_corners_face_the_viewer() {
        assert_eq!(primitive_normal(&triangle(), Vec3::ZERO), Vec3::Z);
    }

    #[test]
    fn segments_that_cross_the_triangle_are_occluded() {
        let occludes = |x: f32, y: f32| triangle_occludes(Vec3::new(x, y, 1.0), Vec3::new(0.0, 0.0, -3.0), 1.0);
        assert!(occludes(0.01, 0.01) && occludes(0.45, 0.5) && occludes(0.9, 0.05));
        assert!(!occludes(-0.01, 0.5) && !occludes(0.5, -0.01) && !occludes(0.55, 0.5));
        assert!(
            !triangle_occludes(Vec3::new(0.2, 0.2, 1.0), Vec3::new(0.0, 0.0, -3.0), 0.3),
            "ends above the triangle"
        );
    }
}
