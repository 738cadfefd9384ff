//! Twin of `shaders/cylinder.wgsl`.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::ellipsoid::longitude;
use super::lanes::{Real, Vector2, Vector3, constant, select};
use super::math::{max, min};
use super::ray::{Ray, vector_to_local};
use super::solid::{interval_occludes, levels_on_surface, nearest_end};
use crate::records::{INFINITE_T, Primitive};

#[inline(always)]
pub fn cylinder_levels<V: Vector3>(q: &Primitive, from_anchor: V) -> <V::Real as Real>::Vec2 {
    let (x, y, z) = (from_anchor.x(), from_anchor.y(), from_anchor.z());
    let side = x * (x - q.middle.x * 2.0) + y * (y - q.middle.y * 2.0) + q.level;
    let top = z - (q.middle.z + 1.0);
    let bottom = constant(q.middle.z - 1.0) - z;
    Vector2::new(side, max(top, bottom))
}

#[inline(always)]
pub fn cylinder_interval<V: Vector3>(o: V, d: V, levels: <V::Real as Real>::Vec2) -> <V::Real as Real>::Vec2 {
    let (side_level, cap_level) = (levels.x(), levels.y());
    let a = d.x() * d.x() + d.y() * d.y();
    let b = o.x() * d.x() + o.y() * d.y();
    let moment = o.x() * d.y() - o.y() * d.x();
    let zero = a.splat(0.0);
    let infinite = a.splat(INFINITE_T);
    let is_near = side_level.lt(a.splat(1.0));
    let discriminant = select(a - moment * moment, b * b - a * side_level, is_near);
    let root = max(discriminant, zero).sqrt();
    let sum = select(-b - root, root - b, b.lt(zero));
    let s0 = side_level / sum;
    let s1 = sum / a;
    let is_parallel = a.eq(zero);
    let misses_side = !(side_level.le(zero) & b.eq(zero));
    let misses = (is_parallel & misses_side) | (!is_parallel & !discriminant.ge(zero));
    let near_side = select(min(s0, s1), -infinite, is_parallel);
    let far_side = select(max(s0, s1), infinite, is_parallel);
    let is_above = o.z().gt(zero);
    let opposite_level = constant(-2.0) - cap_level;
    let upper = select(opposite_level, cap_level, is_above);
    let lower = select(cap_level, opposite_level, is_above);
    let slope = select(d.z(), a.splat(1e-30), d.z().eq(zero));
    let s2 = -upper / slope;
    let s3 = lower / slope;
    let near = max(near_side, min(s2, s3));
    let far = min(far_side, max(s2, s3));
    Vector2::new(select(near, infinite, misses), select(far, -infinite, misses))
}

#[inline(always)]
pub fn intersect_cylinder<V: Vector3>(
    q: &Primitive,
    from_inside: <V::Real as Real>::Mask,
    ray: Ray<V>,
    limit: V::Real,
) -> V::Real {
    let from_anchor = vector_to_local(q, ray.origin - ray.origin.broadcast(q.anchor));
    let d = vector_to_local(q, ray.direction);
    let raw_levels = cylinder_levels(q, from_anchor);
    let on_surface = levels_on_surface(raw_levels, limit.splat(0.0));
    let levels = Vector2::select(raw_levels, on_surface, from_inside);
    let o = from_anchor - from_anchor.broadcast(q.middle);
    nearest_end(cylinder_interval(o, d, levels), limit)
}

#[inline(always)]
pub fn cylinder_occludes<V: Vector3>(
    o: V,
    d: V,
    levels: <V::Real as Real>::Vec2,
    t_max: V::Real,
) -> <V::Real as Real>::Mask {
    interval_occludes(cylinder_interval(o, d, levels), t_max)
}

pub fn is_on_cap(local: Vec3) -> bool {
    local.z * local.z > local.x * local.x + local.y * local.y
}

pub fn cap_side(local: Vec3) -> f32 {
    if local.z > 0.0 { 1.0 } else { -1.0 }
}

pub fn cylinder_gradient(local: Vec3) -> Vec3 {
    if is_on_cap(local) {
        Vec3::new(0.0, 0.0, cap_side(local))
    } else {
        Vec3::new(local.x, local.y, 0.0)
    }
}

pub fn cylinder_gradient_derivative(local: Vec3, d: Vec3) -> Vec3 {
    if is_on_cap(local) {
        Vec3::ZERO
    } else {
        Vec3::new(d.x, d.y, 0.0)
    }
}

pub fn cylinder_height(q: &Primitive, from_anchor: Vec3) -> f32 {
    let levels = cylinder_levels(q, from_anchor);
    if is_on_cap(from_anchor - q.middle) {
        levels.y
    } else {
        0.5 * levels.x
    }
}

pub fn cylinder_uv(local: Vec3) -> Vec2 {
    if is_on_cap(local) {
        Vec2::new(0.5 * local.x + 0.5, 0.5 * (local.y * cap_side(local)) + 0.5)
    } else {
        Vec2::new(longitude(local), 0.5 * local.z + 0.5)
    }
}

pub fn cylinder_uv_derivative(local: Vec3, d: Vec3) -> Vec2 {
    if is_on_cap(local) {
        Vec2::new(0.5 * d.x, 0.5 * (d.y * cap_side(local)))
    } else {
        let du = (local.x * d.y - local.y * d.x) / max(local.x * local.x + local.y * local.y, 1e-12);
        Vec2::new(du * (0.5 * FRAC_1_PI), 0.5 * d.z)
    }
}

pub fn cylinder_tangent(local: Vec3) -> Vec3 {
    if is_on_cap(local) {
        Vec3::new(2.0, 0.0, 0.0)
    } else {
        Vec3::new(-local.y, local.x, 0.0) * TAU
    }
}

pub fn cylinder_bitangent(local: Vec3) -> Vec3 {
    if is_on_cap(local) {
        Vec3::new(0.0, 2.0 * cap_side(local), 0.0)
    } else {
        Vec3::new(0.0, 0.0, 2.0)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::cpu::math::normalize;
    use crate::cpu::primitive::{primitive_normal, solid_levels};
    use crate::cpu::ray::point_to_local;
    use crate::records::CYLINDER;
    use crate::records::primitive;

    fn cylinder(center: DVec3, radius: f64, height: f64) -> Primitive {
        let axes = DMat3::from_diagonal(DVec3::new(radius, radius, height / 2.0));
        primitive(CYLINDER, center, axes, 0, 0)
    }

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
        Ray {
            origin: origin.into(),
            direction: normalize(direction.into()),
        }
    }

    /// Returns the distance of the hit and the normal. The distance of a miss is `INFINITE_T`.
    fn hit(q: &Primitive, ray: Ray) -> (f32, Vec3) {
        let t = intersect_cylinder(q, false, ray, INFINITE_T);
        (
            t,
            primitive_normal(q, point_to_local(q, ray.origin + ray.direction * t)),
        )
    }

    #[test]
    fn the_side_and_both_caps_are_hit() {
        let q = cylinder(DVec3::new(1.0, 2.0, 3.0), 2.0, 6.0);
        for (origin, direction, t, normal) in [
            ([-4.0, 2.0, 3.0], [1.0, 0.0, 0.0], 3.0, Vec3::NEG_X),
            ([1.0, 9.0, 5.9], [0.0, -1.0, 0.0], 5.0, Vec3::Y),
            ([1.5, 2.5, 9.0], [0.0, 0.0, -1.0], 3.0, Vec3::Z),
            ([1.5, 2.5, -4.0], [0.0, 0.0, 1.0], 4.0, Vec3::NEG_Z),
            // From inside.
            ([1.0, 2.0, 3.0], [0.0, -1.0, 0.0], 2.0, Vec3::NEG_Y),
            ([1.0, 2.0, 3.0], [0.0, 0.0, 1.0], 3.0, Vec3::Z),
            // Just below the rim of the upper cap, and just inside the rim.
            ([-2.0, 2.0, 6.5], [1.0, 0.0, -1.0], 2.0f32.sqrt(), Vec3::NEG_X),
            ([-0.9, 2.0, 7.0], [1.0, 0.0, -1.0], 2.0f32.sqrt(), Vec3::Z),
        ] {
            let (found, n) = hit(&q, ray(origin, direction));
            assert!((found - t).abs() < 1e-5, "{origin:?} {direction:?}: {found}");
            assert!((n - normal).length() < 1e-5, "{origin:?} {direction:?}: {n}");
        }
    }

    #[test]
    fn rays_beside_and_beyond_a_cylinder_miss() {
        let q = cylinder(DVec3::ZERO, 1.0, 2.0);
        for (origin, direction) in [
            ([-4.0, 1.01, 0.0], [1.0, 0.0, 0.0]),
            ([-4.0, 0.0, 1.01], [1.0, 0.0, 0.0]),
            ([1.01, 0.0, 4.0], [0.0, 0.0, -1.0]),
            ([0.0, 0.0, 4.0], [0.0, 0.0, 1.0]),
            ([0.0, 0.0, -1.01], [0.0, 1.0, 0.0]),
            ([-3.0, 0.0, 2.5], [1.0, 0.0, -0.3]),
        ] {
            assert_eq!(
                hit(&q, ray(origin, direction)).0,
                INFINITE_T,
                "{origin:?} {direction:?}"
            );
        }
    }

    #[test]
    fn rays_from_the_surface_hit_the_far_end_of_the_chord() {
        let q = cylinder(DVec3::ZERO, 1.0, 2.0);
        for (origin, direction, t) in [
            ([1.0, 0.0, 0.5], [-1.0, 0.0, 0.0], 2.0),
            ([0.0, 0.3, 1.0], [0.0, 0.0, -1.0], 2.0),
            ([0.6, 0.8, 0.0], [-0.6, -0.8, 0.0], 2.0),
            ([0.0, 0.0, -1.0], [1.0, 0.0, 1.0], 2.0f32.sqrt()),
        ] {
            for offset in [-1e-6, 0.0, 1e-6] {
                let origin = Vec3::from(origin) * (1.0 + offset);
                let ray = Ray {
                    origin,
                    direction: normalize(direction.into()),
                };
                let found = intersect_cylinder(&q, true, ray, INFINITE_T);
                assert!((found - t).abs() < 1e-5, "{origin} {direction:?}: {found}");
            }
        }
    }

    #[test]
    fn a_huge_cylinder_is_precise_near_the_origin() {
        // Rays down to the side of a horizontal cylinder, and to the cap of a vertical cylinder.
        let pipe = primitive(
            CYLINDER,
            DVec3::NEG_Z * 1e6,
            DMat3::from_cols(DVec3::Z * 1e6, DVec3::X * 1e6, DVec3::Y * 1e6),
            0,
            0,
        );
        let tower = cylinder(DVec3::NEG_Z * 1e6, 1e6, 2e6);
        for q in [pipe, tower] {
            for height in [1.0, 1e-2, 1e-4] {
                let (t, normal) = hit(&q, ray([0.3, 0.2, height], [0.0, 0.0, -1.0]));
                assert!((t / height - 1.0).abs() < 1e-2, "{t} for {height}");
                assert!((normal - Vec3::Z).length() < 1e-5, "{normal}");
            }
        }
    }

    #[test]
    fn segments_that_cross_the_surface_are_occluded() {
        let q = cylinder(DVec3::ZERO, 1.0, 2.0);
        let occludes = |p: [f32; 3], d: [f32; 3], from_inside| {
            let levels = solid_levels(CYLINDER, &q, vector_to_local(&q, Vec3::from(p) - q.anchor), from_inside);
            cylinder_occludes(Vec3::from(p), Vec3::from(d), levels, 1.0)
        };
        assert!(occludes([-3.0, 0.0, 0.0], [6.0, 0.0, 0.0], false), "through");
        assert!(occludes([-3.0, 0.0, 0.0], [3.0, 0.0, 0.0], false), "into");
        assert!(occludes([0.0, 0.0, 0.0], [0.0, 0.0, 3.0], false), "out of");
        assert!(!occludes([-0.5, 0.0, 0.0], [1.0, 0.0, 0.5], false), "inside");
        assert!(!occludes([-3.0, 0.0, 0.0], [1.9, 0.0, 0.0], false), "ends before");
        assert!(!occludes([-3.0, 0.0, 1.1], [6.0, 0.0, 0.0], false), "above");
        assert!(!occludes([1.5, 0.0, 1.5], [3.0, 0.0, 3.0], false), "away");
        assert!(
            occludes([1.0, 0.0, 0.0], [-3.0, 0.0, 0.0], true),
            "from the surface inwards"
        );
        assert!(
            !occludes([1.0, 0.0, 0.0], [-1.5, 0.0, 0.0], true),
            "from the surface to the inside"
        );
    }
}
