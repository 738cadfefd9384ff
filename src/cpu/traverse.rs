//! Which primitives a ray meets: the same results as `shaders/scene.wgsl` and `shaders/traverse.wgsl`.

use std::ops::Range;

use glam::Vec3;

use super::ellipsoid::intersect_ellipsoid;
use super::plane::intersect_plane;
use super::ray::{Hit, Ray, closer};
use super::rectangle::intersect_rectangle;
use super::shadow::{Block, Cone, cone_to_light, may_block, shadow_bits};
use super::triangle::intersect_triangle;
use crate::pack::{ELLIPSOID, FAR, Light, NOTHING, PLANE, Packed, Primitive, RECTANGLE, TRIANGLE};

pub fn closest_hit(scene: &Packed, ray: Ray) -> Hit {
    let s = &scene.specialization;
    let mut hit = Hit {
        t: FAR,
        primitive: NOTHING,
    };
    let mut i = 0;
    let mut nearest = |intersect: fn(&Primitive, Ray, f32) -> f32, count: u32| {
        for q in &scene.primitives[i as usize..(i + count) as usize] {
            hit = closer(hit, intersect(q, ray, hit.t), i);
            i += 1;
        }
    };
    nearest(intersect_rectangle, s.rectangles);
    nearest(intersect_triangle, s.triangles);
    nearest(intersect_ellipsoid, s.ellipsoids);
    nearest(intersect_plane, s.planes);
    hit
}

pub fn hidden_samples(scene: &Packed, p: Vec3, light: &Light, block: Block) -> u32 {
    let s = &scene.specialization;
    let cone = cone_to_light(light, p);
    let triangles = s.rectangles + s.triangles;
    let ellipsoids = triangles + s.ellipsoids;
    hidden_by(scene, RECTANGLE, 0..s.blocking_rectangles, &cone, light, block)
        | hidden_by(
            scene,
            TRIANGLE,
            s.rectangles..s.rectangles + s.blocking_triangles,
            &cone,
            light,
            block,
        )
        | hidden_by(
            scene,
            ELLIPSOID,
            triangles..triangles + s.blocking_ellipsoids,
            &cone,
            light,
            block,
        )
        | hidden_by(
            scene,
            PLANE,
            ellipsoids..ellipsoids + s.blocking_planes,
            &cone,
            light,
            block,
        )
}

#[inline(always)] // compiled for each kind
fn hidden_by(scene: &Packed, kind: u32, range: Range<u32>, cone: &Cone, light: &Light, block: Block) -> u32 {
    let range = range.start as usize..range.end as usize;
    let mut bits = 0;
    for (q, sphere) in scene.primitives[range.clone()].iter().zip(&scene.bounds[range]) {
        if may_block(sphere, cone) {
            bits |= shadow_bits(kind, q, cone.apex, light, block);
        }
    }
    bits
}
