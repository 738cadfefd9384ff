//! Which primitives a ray meets: the same results as `shaders/scene.wgsl` and `shaders/traverse.wgsl`.

use std::ops::Range;

use super::ellipsoid::intersect_ellipsoid;
use super::plane::intersect_plane;
use super::ray::{Hit, Ray, closer};
use super::rectangle::intersect_rectangle;
use super::shadow::{Block, Cone, cone_to_light, may_block, shadow_bits};
use super::surface::Surface;
use super::triangle::intersect_triangle;
use crate::pack::{ELLIPSOID, FAR, Light, NOTHING, PLANE, Packed, Primitive, RECTANGLE, TRIANGLE};

pub fn closest_hit(scene: &Packed, ray: Ray, left: u32, wall: u32) -> Hit {
    let s = &scene.specialization;
    let mut hit = Hit {
        t: FAR,
        primitive: NOTHING,
    };
    let mut i = 0;
    let mut nearest = |intersect: fn(&Primitive, bool, Ray, f32) -> f32, count: u32| {
        for q in &scene.primitives[i as usize..(i + count) as usize] {
            hit = closer(hit, intersect(q, i == wall, ray, hit.t), i, left);
            i += 1;
        }
    };
    nearest(|q, _, ray, limit| intersect_rectangle(q, ray, limit), s.rectangles);
    nearest(|q, _, ray, limit| intersect_triangle(q, ray, limit), s.triangles);
    nearest(intersect_ellipsoid, s.ellipsoids);
    nearest(|q, _, ray, limit| intersect_plane(q, ray, limit), s.planes);
    hit
}

pub fn hidden_samples(scene: &Packed, surface: Surface, light: &Light, block: Block) -> u32 {
    let s = &scene.specialization;
    let cone = cone_to_light(light, surface.start);
    let triangles = s.rectangles..s.rectangles + s.blocking_triangles;
    let round = s.rectangles + s.triangles;
    let ellipsoids = round..round + s.blocking_ellipsoids;
    let endless = round + s.ellipsoids;
    let planes = endless..endless + s.blocking_planes;
    hidden_by(scene, RECTANGLE, 0..s.blocking_rectangles, surface, &cone, light, block)
        | hidden_by(scene, TRIANGLE, triangles, surface, &cone, light, block)
        | hidden_by(scene, ELLIPSOID, ellipsoids, surface, &cone, light, block)
        | hidden_by(scene, PLANE, planes, surface, &cone, light, block)
}

#[inline(always)] // compiled for each kind
fn hidden_by(
    scene: &Packed,
    kind: u32,
    range: Range<u32>,
    surface: Surface,
    cone: &Cone,
    light: &Light,
    block: Block,
) -> u32 {
    let mut bits = 0;
    for i in range {
        let (q, sphere) = (&scene.primitives[i as usize], &scene.bounds[i as usize]);
        if (i != surface.above) & may_block(sphere, cone) {
            bits |= shadow_bits(kind, q, cone.apex, i == surface.below, light, block);
        }
    }
    bits
}
