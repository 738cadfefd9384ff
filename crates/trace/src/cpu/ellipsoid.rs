//! Twin of `shaders/ellipsoid.wgsl`: the unit sphere of local space.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::lanes::{Real, Vector3, constant, select};
use super::math::{atan2, cross, dot, max, min};
use super::ray::{Ray, vector_to_local};
use crate::records::Primitive;

#[inline(always)]
pub fn ellipsoid_level<V: Vector3>(q: &Primitive, from_anchor: V) -> V::Real {
    dot(from_anchor, from_anchor - from_anchor.broadcast(q.middle * 2.0)) + q.level
}

#[inline(always)]
pub fn ellipsoid_discriminant<V: Vector3>(o: V, d: V, start_level: V::Real) -> V::Real {
    let a = dot(d, d);
    let b = dot(o, d);
    let moment = cross(o, d);
    let is_near = start_level.lt(start_level.splat(1.0));
    select(a - dot(moment, moment), b * b - a * start_level, is_near)
}

pub fn longitude(local: Vec3) -> f32 {
    let turn = atan2(local.y, local.x) * (0.5 * FRAC_1_PI);
    if turn < 0.0 { turn + 1.0 } else { turn }
}

#[inline(always)]
pub fn intersect_ellipsoid<V: Vector3>(
    q: &Primitive,
    from_inside: <V::Real as Real>::Mask,
    ray: Ray<V>,
    limit: V::Real,
) -> V::Real {
    let from_anchor = vector_to_local(q, ray.origin - ray.origin.broadcast(q.anchor));
    let o = from_anchor - from_anchor.broadcast(q.middle);
    let d = vector_to_local(q, ray.direction);
    let a = dot(d, d);
    let b = dot(o, d);
    let zero = b.splat(0.0);
    let start_level = select(ellipsoid_level(q, from_anchor), zero, from_inside);
    let discriminant = ellipsoid_discriminant(o, d, start_level);
    let root = max(discriminant, zero).sqrt();
    let sum = select(-b - root, root - b, b.lt(zero));
    let t0 = start_level / sum;
    let t1 = sum / a;
    let near = min(t0, t1);
    let t = select(max(t0, t1), near, near.gt(zero));
    select(limit, t, discriminant.ge(zero) & t.gt(zero) & t.lt(limit))
}

#[inline(always)]
pub fn ellipsoid_occludes<V: Vector3>(o: V, d: V, start_level: V::Real, t_max: V::Real) -> <V::Real as Real>::Mask {
    let a = dot(d, d);
    let b = dot(o, d);
    let zero = b.splat(0.0);
    let end_level = start_level + t_max * (constant(2.0) * b + t_max * a);
    let crosses_twice = b.lt(zero) & (-b).lt(t_max * a) & ellipsoid_discriminant(o, d, start_level).ge(zero);
    (start_level.lt(zero) ^ end_level.lt(zero)) | (start_level.gt(zero) & crosses_twice)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_1_SQRT_2;

    use glam::{DMat3, DVec3};

    use super::*;
    use crate::cpu::math::normalize;
    use crate::cpu::primitive::primitive_normal;
    use crate::cpu::ray::point_to_local;
    use crate::records::primitive;
    use crate::records::{ELLIPSOID, INFINITE_T};

    fn ellipsoid(center: DVec3, axes: DMat3) -> Primitive {
        primitive(ELLIPSOID, center, axes, 0, 0)
    }

    fn unit_sphere() -> Primitive {
        ellipsoid(DVec3::ZERO, DMat3::IDENTITY)
    }

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
        Ray {
            origin: origin.into(),
            direction: normalize(direction.into()),
        }
    }

    #[test]
    fn the_unit_sphere_is_hit_at_45_degrees() {
        let q = unit_sphere();
        let ray = ray([-3.0, 0.0, FRAC_1_SQRT_2], [1.0, 0.0, 0.0]);
        let t = intersect_ellipsoid(&q, false, ray, INFINITE_T);
        assert!((t - (3.0 - FRAC_1_SQRT_2)).abs() < 1e-6, "{t}");
        let normal = primitive_normal(&q, point_to_local(&q, ray.origin + ray.direction * t));
        assert!(
            (normal - Vec3::new(-FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2)).length() < 1e-6,
            "{normal}"
        );
    }

    /// Tests that hits lie on the quadric |M (p - c)|^2 = 1, and that normals are its gradients.
    #[test]
    fn hits_of_an_ellipsoid_lie_on_its_quadric() {
        let center = DVec3::new(0.5, 0.4, 0.4);
        let axes = DMat3::from_cols_array(&[0.3, 0.1, 0.0, -0.1, 0.3, 0.0, 0.0, 0.0, 0.4]);
        let q = ellipsoid(center, axes);
        let quadric = |p: DVec3| (axes.inverse() * (p - center)).length_squared() - 1.0;
        for target in [[0.5, 0.4, 0.4], [0.6, 0.3, 0.55], [0.3, 0.5, 0.2], [0.65, 0.5, 0.6]] {
            let origin = Vec3::new(0.0, -3.0, 1.3);
            let ray = ray(origin.into(), (Vec3::from(target) - origin).into());
            let t = intersect_ellipsoid(&q, false, ray, INFINITE_T);
            assert!(t < INFINITE_T, "the ray to {target:?}, inside the ellipsoid, misses");
            let p = ray.origin + ray.direction * t;
            assert!(quadric(p.as_dvec3()).abs() < 1e-5, "{}", quadric(p.as_dvec3()));
            let step = 1e-4;
            let slope = |e: DVec3| quadric(p.as_dvec3() + e * step) - quadric(p.as_dvec3() - e * step);
            let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize();
            let normal = primitive_normal(&q, point_to_local(&q, p)).as_dvec3();
            assert!(gradient.distance(normal) < 1e-4, "{gradient} {normal}");
        }
    }

    #[test]
    fn rays_from_inside_hit_the_far_side() {
        let t = intersect_ellipsoid(
            &unit_sphere(),
            false,
            ray([0.25, 0.0, 0.0], [1.0, 0.0, 0.0]),
            INFINITE_T,
        );
        assert_eq!(t, 0.75);
        let t = intersect_ellipsoid(
            &unit_sphere(),
            false,
            ray([0.25, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            INFINITE_T,
        );
        assert_eq!(t, 1.25);
    }

    #[test]
    fn grazing_rays_hit_or_miss_precisely() {
        let hit_at_height = |z: f32| {
            intersect_ellipsoid(
                &unit_sphere(),
                false,
                ray([-1000.0, 0.0, z], [1.0, 0.0, 0.0]),
                INFINITE_T,
            )
        };
        assert!(
            (hit_at_height(0.999_999) - 1000.0).abs() < 0.01,
            "{}",
            hit_at_height(0.999_999)
        );
        assert_eq!(hit_at_height(1.000_001), INFINITE_T);
    }

    #[test]
    fn hits_behind_the_origin_or_beyond_the_limit_are_misses() {
        let q = unit_sphere();
        assert_eq!(
            intersect_ellipsoid(&q, false, ray([3.0, 0.0, 0.0], [1.0, 0.0, 0.0]), INFINITE_T),
            INFINITE_T
        );
        assert_eq!(
            intersect_ellipsoid(&q, false, ray([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 1.5),
            1.5
        );
        assert_eq!(
            intersect_ellipsoid(&q, false, ray([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 2.5),
            2.0
        );
    }

    #[test]
    fn segments_that_cross_the_surface_are_occluded() {
        let occludes = |o: [f32; 3], d: [f32; 3], t_max| {
            let o = Vec3::from(o);
            ellipsoid_occludes(o, d.into(), dot(o, o) - 1.0, t_max)
        };
        assert!(occludes([-2.0, 0.0, 0.0], [4.0, 0.0, 0.0], 1.0), "through");
        assert!(occludes([-2.0, 0.0, 0.0], [4.0, 0.0, 0.0], 0.5), "into");
        assert!(
            occludes([-2.0, 0.0, 0.0], [4.0, 0.0, 0.0], 0.7),
            "into, past the middle"
        );
        assert!(
            occludes([-1.0, 0.0, 0.0], [4.0, 0.0, 0.0], 0.2),
            "from the surface into"
        );
        assert!(occludes([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], 1.0), "out of");
        assert!(!occludes([-2.0, 0.0, 0.0], [4.0, 0.0, 0.0], 0.24), "ends before");
        assert!(!occludes([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], 0.24), "stays inside");
        assert!(!occludes([-2.0, 0.0, 1.001], [4.0, 0.0, 0.0], 1.0), "passes by");
        assert!(!occludes([2.0, 0.0, 0.0], [4.0, 0.0, 0.0], 1.0), "leads away");
    }
}
