//! Closest-hit and occlusion queries over the primitives outside of the BVH, with the results of `shaders/buffers.wgsl`
//! and `shaders/linear_primitives.wgsl`.

use std::ops::Range;

use glam::Vec3;

use super::primitive::intersect;
use super::ray::{Hit, Ray, closer, no_hit, standalone_prim};
use super::shadow::{SampleBlock, ShadowFrustum, light_frustum, may_block, occludes_segment, occlusion_mask};
use super::surface::Surface;
use crate::records::{Light, Packed, Primitive, with_primitive_kind};

pub fn closest_primitive(scene: &Packed, ray: Ray, origin_prim: u32, inside_prim: u32) -> Hit {
    let mut hit = no_hit();
    for (kind, range) in scene.kinds() {
        with_primitive_kind!(kind, |kind| for i in range {
            let t = intersect(kind, &scene.primitives[i], i as u32 == inside_prim, ray, hit.t);
            hit = closer(hit, t, i as u32, origin_prim);
        });
    }
    hit
}

pub fn occluded_by_primitives(scene: &Packed, surface: &Surface, light: &Light, block: SampleBlock) -> u32 {
    let frustum = light_frustum(light, surface.ray_origin);
    let mut bits = 0;
    for (kind, range) in scene.shadow_casters() {
        bits |= with_primitive_kind!(kind, |kind| occluded_by(
            scene, kind, range, surface, &frustum, light, block
        ));
    }
    bits
}

pub fn is_occluded_by_primitives(
    scene: &Packed,
    surface: &Surface,
    to_light: Vec3,
    t_max: f32,
    target_prim: u32,
) -> bool {
    for (kind, range) in scene.shadow_casters() {
        with_primitive_kind!(kind, |kind| for i in range {
            let q = &scene.primitives[i];
            if is_occluded_by_primitive(kind, q, i as u32, surface, to_light, t_max, target_prim) {
                return true;
            }
        });
    }
    false
}

#[inline(always)] // compiled for each kind
pub fn is_occluded_by_primitive(
    kind: u32,
    q: &Primitive,
    i: u32,
    surface: &Surface,
    to_light: Vec3,
    t_max: f32,
    target_prim: u32,
) -> bool {
    let is_inside = i == standalone_prim(surface.exclude_back);
    (i != standalone_prim(surface.exclude_front)) & (i != target_prim)
        && occludes_segment(kind, q, surface.ray_origin, is_inside, to_light, t_max)
}

#[inline(always)] // compiled for each kind
fn occluded_by(
    scene: &Packed,
    kind: u32,
    range: Range<usize>,
    surface: &Surface,
    frustum: &ShadowFrustum,
    light: &Light,
    block: SampleBlock,
) -> u32 {
    let mut bits = 0;
    for i in range {
        let (q, sphere) = (&scene.primitives[i], &scene.bounds[i]);
        let i = i as u32;
        if (i != standalone_prim(surface.exclude_front)) & may_block(sphere, frustum) {
            bits |= occlusion_mask(
                kind,
                q,
                frustum.apex,
                i == standalone_prim(surface.exclude_back),
                light,
                block,
            );
        }
    }
    bits
}
