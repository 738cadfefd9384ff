//! Which primitives outside of the tree a ray meets: the same results as `shaders/buffers.wgsl` and `shaders/traverse.wgsl`.

use std::ops::Range;

use glam::Vec3;

use super::primitive::intersect;
use super::ray::{Hit, Ray, by_itself, closer, no_hit};
use super::shadow::{Block, Cone, cone_to_light, cuts, may_block, shadow_bits};
use super::surface::Surface;
use crate::records::{DISK, ELLIPSOID, Light, PLANE, Packed, Primitive, RECTANGLE, TRIANGLE};

/// Calls a function with each kind of primitives as a constant, so that it is compiled for each.
macro_rules! for_each_kind {
    ($ranges:expr, |$kind:ident, $range:ident| $body:expr) => {
        for (kind, $range) in $ranges {
            match kind {
                RECTANGLE => for_each_kind!(@ RECTANGLE, $kind, $body),
                TRIANGLE => for_each_kind!(@ TRIANGLE, $kind, $body),
                ELLIPSOID => for_each_kind!(@ ELLIPSOID, $kind, $body),
                PLANE => for_each_kind!(@ PLANE, $kind, $body),
                _ => for_each_kind!(@ DISK, $kind, $body),
            }
        }
    };
    (@ $value:ident, $kind:ident, $body:expr) => {{
        let $kind = $value;
        $body
    }};
}

pub fn closest_primitive(scene: &Packed, ray: Ray, left: u32, wall: u32) -> Hit {
    let mut hit = no_hit();
    for_each_kind!(scene.kinds(), |kind, range| for i in range {
        let t = intersect(kind, &scene.primitives[i], i as u32 == wall, ray, hit.t);
        hit = closer(hit, t, i as u32, left);
    });
    hit
}

pub fn hidden_by_primitives(scene: &Packed, surface: &Surface, light: &Light, block: Block) -> u32 {
    let cone = cone_to_light(light, surface.start);
    let mut bits = 0;
    for_each_kind!(scene.shadow_casters(), |kind, range| {
        bits |= hidden_by(scene, kind, range, surface, &cone, light, block);
    });
    bits
}

pub fn is_hidden_by_primitives(scene: &Packed, surface: &Surface, to: Vec3, reach: f32, goal: u32) -> bool {
    for_each_kind!(scene.shadow_casters(), |kind, range| for i in range {
        if is_cut(kind, &scene.primitives[i], i as u32, surface, to, reach, goal) {
            return true;
        }
    });
    false
}

#[inline(always)] // compiled for each kind
pub fn is_cut(kind: u32, q: &Primitive, i: u32, surface: &Surface, to: Vec3, reach: f32, goal: u32) -> bool {
    let is_wall = i == by_itself(surface.below);
    (i != by_itself(surface.above)) & (i != goal) && cuts(kind, q, surface.start, is_wall, to, reach)
}

#[inline(always)] // compiled for each kind
fn hidden_by(
    scene: &Packed,
    kind: u32,
    range: Range<usize>,
    surface: &Surface,
    cone: &Cone,
    light: &Light,
    block: Block,
) -> u32 {
    let mut bits = 0;
    for i in range {
        let (q, sphere) = (&scene.primitives[i], &scene.bounds[i]);
        let i = i as u32;
        if (i != by_itself(surface.above)) & may_block(sphere, cone) {
            bits |= shadow_bits(kind, q, cone.apex, i == by_itself(surface.below), light, block);
        }
    }
    bits
}
