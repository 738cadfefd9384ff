//! Twin of `shaders/plane.wgsl`.

use super::lanes::{Real, Vector3, select};
use super::ray::{Ray, crosses_plane, plane_distance};
use crate::records::Primitive;

#[inline(always)]
pub fn intersect_plane<V: Vector3>(q: &Primitive, ray: Ray<V>, limit: V::Real) -> V::Real {
    let t = plane_distance(q, ray);
    select(limit, t, t.gt(t.splat(0.0)) & t.lt(limit))
}

#[inline(always)]
pub fn plane_occludes<V: Vector3>(o: V, d: V, t_max: V::Real) -> <V::Real as Real>::Mask {
    crosses_plane(o, d, t_max)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3, Vec3};

    use super::*;
    use crate::records::primitive;
    use crate::records::{INFINITE_T, PLANE};

    /// Returns the distance of the hit with the plane z = 1.
    fn hit(origin: [f32; 3], direction: [f32; 3]) -> f32 {
        let plane = primitive(PLANE, DVec3::new(7.0, -3.0, 1.0), DMat3::IDENTITY, 0, 0);
        let ray = Ray {
            origin: origin.into(),
            direction: Vec3::from(direction).normalize(),
        };
        intersect_plane(&plane, ray, INFINITE_T)
    }

    #[test]
    fn the_plane_is_hit_from_both_sides_at_any_distance() {
        assert_eq!(hit([1e6, 0.0, 3.0], [0.0, 0.0, -1.0]), 2.0);
        assert_eq!(hit([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]), 2.0);
        assert!((hit([0.0, 0.0, 2.0], [1000.0, 0.0, -1.0]) - 1000.0005).abs() < 0.01);
    }

    #[test]
    fn rays_along_or_away_from_the_plane_miss() {
        assert_eq!(hit([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), INFINITE_T);
        assert_eq!(hit([0.0, 0.0, 3.0], [1.0, 0.0, 0.0]), INFINITE_T);
        assert_eq!(hit([0.0, 0.0, 3.0], [0.0, 0.0, 1.0]), INFINITE_T);
    }

    #[test]
    fn segments_that_cross_the_plane_are_occluded() {
        let down = Vec3::new(5.0, 0.0, -2.0);
        assert!(plane_occludes(Vec3::Z, down, 1.0) && plane_occludes(-Vec3::Z, -down, 1.0));
        assert!(!plane_occludes(Vec3::Z, down, 0.5) && !plane_occludes(Vec3::Z, -down, 1.0));
    }
}
