//! Twin of `shaders/disk.wgsl`.

use super::lanes::{Real, Vector2, Vector3, select};
use super::math::dot;
use super::ray::{Ray, crosses_plane, plane_distance, scaled_crossing};
use crate::records::Primitive;

#[inline(always)]
pub fn intersect_disk<V: Vector3>(q: &Primitive, ray: Ray<V>, limit: V::Real) -> V::Real {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - ray.origin.broadcast(q.anchor);
    let x = dot(p.broadcast(q.x), p);
    let y = dot(p.broadcast(q.y), p);
    let inside = (x * x + y * y).le(t.splat(1.0));
    select(limit, t, t.gt(t.splat(0.0)) & t.lt(limit) & inside)
}

#[inline(always)]
pub fn disk_occludes<V: Vector3>(o: V, d: V, t_max: V::Real) -> <V::Real as Real>::Mask {
    let p = scaled_crossing(o, d);
    crosses_plane(o, d, t_max) & (p.x() * p.x() + p.y() * p.y()).le(d.z() * d.z())
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3, Vec3};

    use super::*;
    use crate::records::primitive;
    use crate::records::{DISK, INFINITE_T};

    /// Returns the distance from (x, y, 5) down to a disk of radius 2 around (1, 1, 3).
    fn from_above(x: f32, y: f32) -> f32 {
        let columns = DMat3::from_cols(DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z);
        let disk = primitive(DISK, DVec3::new(1.0, 1.0, 3.0), columns, 0, 0);
        let ray = Ray {
            origin: Vec3::new(x, y, 5.0),
            direction: Vec3::NEG_Z,
        };
        intersect_disk(&disk, ray, INFINITE_T)
    }

    #[test]
    fn hits_are_inside_the_circle() {
        for (x, y) in [(1.0, 1.0), (2.99, 1.0), (1.0, -0.99), (2.41, 2.41)] {
            assert_eq!(from_above(x, y), 2.0, "{x} {y}");
        }
        for (x, y) in [(3.01, 1.0), (1.0, -1.01), (2.42, 2.42), (-0.9, -0.9)] {
            assert_eq!(from_above(x, y), INFINITE_T, "{x} {y}");
        }
    }

    #[test]
    fn segments_that_cross_the_disk_are_occluded() {
        let occludes = |x: f32, y: f32, t_max| disk_occludes(Vec3::new(x, y, 1.0), Vec3::new(0.0, 0.0, -3.0), t_max);
        assert!(occludes(0.0, 0.0, 1.0) && occludes(0.7, -0.7, 1.0) && occludes(-1.0, 0.0, 1.0));
        assert!(!occludes(0.72, 0.72, 1.0) && !occludes(1.01, 0.0, 1.0));
        assert!(!occludes(0.0, 0.0, 0.3), "ends above the disk");
        let slanted = |x: f32| disk_occludes(Vec3::new(x, 0.0, 1.0), Vec3::new(2.0, 0.0, -2.0), 1.0);
        assert!(slanted(-0.1) && !slanted(0.1), "the segment crosses the plane at x + 1");
    }
}
