//! Twin of `shaders/rectangle.wgsl`.

use super::lanes::{Real, Vector2, Vector3, select};
use super::math::dot;
use super::ray::{Ray, crosses_plane, plane_distance, scaled_crossing};
use crate::records::Primitive;

#[inline(always)]
pub fn intersect_rectangle<V: Vector3>(q: &Primitive, ray: Ray<V>, limit: V::Real) -> V::Real {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - ray.origin.broadcast(q.anchor);
    let x = dot(p.broadcast(q.x), p);
    let y = dot(p.broadcast(q.y), p);
    let one = t.splat(1.0);
    let inside = x.abs().le(one) & y.abs().le(one);
    select(limit, t, t.gt(t.splat(0.0)) & t.lt(limit) & inside)
}

#[inline(always)]
pub fn rectangle_occludes<V: Vector3>(o: V, d: V, t_max: V::Real) -> <V::Real as Real>::Mask {
    let p = scaled_crossing(o, d);
    let depth = d.z().abs();
    crosses_plane(o, d, t_max) & p.x().abs().le(depth) & p.y().abs().le(depth)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3, Vec3};

    use super::*;
    use crate::records::primitive;
    use crate::records::{INFINITE_T, RECTANGLE};

    /// Returns a rectangle in y = 1 with half edges (2, 0, 0) and (0, 0, 1).
    fn rectangle() -> Primitive {
        let columns = DMat3::from_cols(DVec3::X * 2.0, DVec3::Z, -DVec3::Y);
        primitive(RECTANGLE, DVec3::new(0.0, 1.0, 0.0), columns, 0, 0)
    }

    fn hit(origin: [f32; 3], direction: [f32; 3]) -> f32 {
        let ray = Ray {
            origin: origin.into(),
            direction: Vec3::from(direction).normalize(),
        };
        intersect_rectangle(&rectangle(), ray, INFINITE_T)
    }

    #[test]
    fn hits_are_inside_the_edges() {
        assert_eq!(hit([1.9, -2.0, 0.9], [0.0, 1.0, 0.0]), 3.0);
        assert_eq!(
            hit([2.1, -2.0, 0.9], [0.0, 1.0, 0.0]),
            INFINITE_T,
            "beside the first edge"
        );
        assert_eq!(
            hit([1.9, -2.0, 1.1], [0.0, 1.0, 0.0]),
            INFINITE_T,
            "beside the second edge"
        );
        assert_eq!(hit([1.9, 4.0, 0.9], [0.0, -1.0, 0.0]), 3.0, "from the other side");
        assert_eq!(
            hit([1.9, 4.0, 0.9], [0.0, 1.0, 0.0]),
            INFINITE_T,
            "away from the rectangle"
        );
        let slanted = hit([-1.0, 0.0, 0.0], [1.0, 1.0, 0.0]);
        assert!((slanted - 2.0f32.sqrt()).abs() < 1e-6, "{slanted}");
    }

    #[test]
    fn rays_parallel_to_the_plane_hit_nothing() {
        assert_eq!(hit([-5.0, 1.0, 0.0], [1.0, 0.0, 0.0]), INFINITE_T);
        assert_eq!(
            hit([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
            INFINITE_T,
            "from inside the rectangle"
        );
        assert_eq!(hit([-5.0, 1.5, 0.0], [1.0, 0.0, 0.0]), INFINITE_T, "above the plane");
    }

    #[test]
    fn grazing_rays_hit_where_they_cross_the_plane() {
        let found = hit([-1000.0, 0.0, 0.0], [1000.0, 1.0, 0.0]);
        assert!((f64::from(found) - 1_000_001f64.sqrt()).abs() < 0.01, "{found}");
        assert_eq!(
            hit([-1000.0, 0.0, 0.0], [1000.0, 0.99, 0.0]),
            INFINITE_T,
            "8 units beyond the far edge"
        );
    }

    #[test]
    fn segments_that_cross_the_rectangle_are_occluded() {
        let occludes = |o: [f32; 3], d: [f32; 3], t_max| rectangle_occludes(Vec3::from(o), Vec3::from(d), t_max);
        assert!(occludes([0.9, 0.9, 1.0], [0.0, 0.0, -2.0], 1.0));
        assert!(occludes([-0.9, -0.9, -1.0], [0.0, 0.0, 2.0], 1.0), "from below");
        assert!(!occludes([1.1, 0.9, 1.0], [0.0, 0.0, -2.0], 1.0), "beside");
        assert!(!occludes([0.9, 0.9, 1.0], [0.0, 0.0, -2.0], 0.4), "ends before");
        assert!(!occludes([0.9, 0.9, 1.0], [0.0, 0.0, 2.0], 1.0), "leads away");
        assert!(!occludes([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0), "in its plane");
    }
}
