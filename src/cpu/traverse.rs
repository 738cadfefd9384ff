//! Which primitives a ray meets: the same results as `shaders/traverse.wgsl`.

use glam::Vec3;

use super::ellipsoid::intersect_ellipsoid;
use super::plane::intersect_plane;
use super::ray::{Hit, Ray, closer};
use super::rectangle::intersect_rectangle;
use super::shadow::{Block, shadow_bits};
use super::triangle::intersect_triangle;
use crate::pack::{ELLIPSOID, FAR, Light, NOTHING, PLANE, Packed, Primitive, RECTANGLE, TRIANGLE};

pub fn closest_hit(scene: &Packed, ray: Ray) -> Hit {
    let kinds = Kinds::of(scene);
    let mut hit = Hit {
        t: FAR,
        primitive: NOTHING,
    };
    let mut nearest = |intersect: fn(&Primitive, Ray, f32) -> f32, primitives: &[Primitive], first: usize| {
        for (i, q) in (first as u32..).zip(primitives) {
            hit = closer(hit, intersect(q, ray, hit.t), i);
        }
        first + primitives.len()
    };
    let first = nearest(intersect_rectangle, kinds.rectangles, 0);
    let first = nearest(intersect_triangle, kinds.triangles, first);
    let first = nearest(intersect_ellipsoid, kinds.ellipsoids, first);
    nearest(intersect_plane, kinds.planes, first);
    hit
}

pub fn hidden_samples(scene: &Packed, p: Vec3, light: &Light, block: Block) -> u32 {
    let kinds = Kinds::of(scene);
    let s = &scene.specialization;
    let mut bits = 0;
    for q in &kinds.rectangles[..s.blocking_rectangles as usize] {
        bits |= shadow_bits(RECTANGLE, q, p, light, block);
    }
    for q in &kinds.triangles[..s.blocking_triangles as usize] {
        bits |= shadow_bits(TRIANGLE, q, p, light, block);
    }
    for q in kinds.ellipsoids {
        bits |= shadow_bits(ELLIPSOID, q, p, light, block);
    }
    for q in &kinds.planes[..s.blocking_planes as usize] {
        bits |= shadow_bits(PLANE, q, p, light, block);
    }
    bits
}

/// The primitives, by kind.
struct Kinds<'a> {
    rectangles: &'a [Primitive],
    triangles: &'a [Primitive],
    ellipsoids: &'a [Primitive],
    planes: &'a [Primitive],
}

impl Kinds<'_> {
    fn of(scene: &Packed) -> Kinds<'_> {
        let s = &scene.specialization;
        let (rectangles, rest) = scene.primitives.split_at(s.rectangles as usize);
        let (triangles, rest) = rest.split_at(s.triangles as usize);
        let (ellipsoids, planes) = rest.split_at(s.ellipsoids as usize);
        Kinds {
            rectangles,
            triangles,
            ellipsoids,
            planes,
        }
    }
}
