//! Which primitives outside of the tree a ray meets: the same results as `shaders/buffers.wgsl` and `shaders/traverse.wgsl`.

use std::ops::Range;

use glam::Vec3;

use super::primitive::intersect;
use super::ray::{Hit, Ray, by_itself, closer, no_hit};
use super::shadow::{Block, Cone, cone_to_light, cuts, may_block, shadow_bits};
use super::surface::Surface;
use crate::records::{Light, Packed, Primitive, with_primitive_kind};

pub fn closest_primitive(scene: &Packed, ray: Ray, left: u32, wall: u32) -> Hit {
    let mut hit = no_hit();
    for (kind, range) in scene.kinds() {
        with_primitive_kind!(kind, |kind| for i in range {
            let t = intersect(kind, &scene.primitives[i], i as u32 == wall, ray, hit.t);
            hit = closer(hit, t, i as u32, left);
        });
    }
    hit
}

pub fn hidden_by_primitives(scene: &Packed, surface: &Surface, light: &Light, block: Block) -> u32 {
    let cone = cone_to_light(light, surface.start);
    let mut bits = 0;
    for (kind, range) in scene.shadow_casters() {
        bits |= with_primitive_kind!(kind, |kind| hidden_by(scene, kind, range, surface, &cone, light, block));
    }
    bits
}

pub fn is_hidden_by_primitives(scene: &Packed, surface: &Surface, to: Vec3, reach: f32, goal: u32) -> bool {
    for (kind, range) in scene.shadow_casters() {
        with_primitive_kind!(kind, |kind| for i in range {
            if is_cut(kind, &scene.primitives[i], i as u32, surface, to, reach, goal) {
                return true;
            }
        });
    }
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
