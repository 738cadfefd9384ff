//! The stage that lets camera rays pass through surfaces that the camera does not see.

use fearless_simd::dispatch;
use fearless_simd::prelude::*;

use super::super::geometry::{closest_hit, is_on_mesh, skip_camera_invisible};
use super::super::integrators::path::PathState;
use super::super::math::dot;
use super::super::ray::Hit;
use super::super::samples::LEVEL;
use super::rows::{LANES, Row};
use super::shade::material_index;
use super::surfaces::FaceHits;
use crate::records::{CULL_BACKFACE, NO_INDEX, Packed};

/// Lets each camera ray whose closest hit is invisible to the camera continue behind it, like `begin_path`, and updates
/// the hit.
pub fn pass_invisible_hits(scene: &Packed, paths: &mut [PathState], hits: &mut [Hit]) {
    dispatch!(*LEVEL, simd => pass_in_lanes(simd, scene, paths, hits))
}

#[inline(always)]
fn pass_in_lanes<S: Simd>(simd: S, scene: &Packed, paths: &mut [PathState], hits: &mut [Hit]) {
    let mut faces = FaceHits::new();
    let mut of_lane = [0; LANES];
    let mut count = 0;
    for i in 0..=hits.len() {
        if i < hits.len() {
            let hit = hits[i];
            if hit.primitive == NO_INDEX {
                continue;
            }
            let culling = scene.materials[material_index(scene, hit) as usize].camera_culling;
            if culling == CULL_BACKFACE && is_on_mesh(hit) {
                faces.set(scene, count, paths[i].path.ray, hit);
                of_lane[count] = i;
                count += 1;
            } else if culling != 0 {
                pass(scene, &mut paths[i], &mut hits[i]);
            }
        }
        if count == LANES || i == hits.len() {
            let sides: Row = faces.surfaces(simd, scene.environment.shadow_epsilon).side.into();
            for (&i, _) in of_lane[..count].iter().zip(sides).filter(|(_, side)| *side <= 0.0) {
                pass(scene, &mut paths[i], &mut hits[i]);
            }
            count = 0;
        }
    }
}

/// Continues a camera ray behind all invisible surfaces, and finds its closest hit.
fn pass(scene: &Packed, state: &mut PathState, hit: &mut Hit) {
    let start = state.path.ray;
    state.path = skip_camera_invisible(scene, state.path);
    let path = &state.path;
    state.skipped_distance = dot(path.ray.origin - start.origin, path.ray.direction);
    *hit = closest_hit(scene, path.ray, path.origin_prim, path.inside_prim);
}
