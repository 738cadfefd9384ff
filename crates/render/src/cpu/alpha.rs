//! Twin of `shaders/alpha.wgsl`: surfaces that rays pass by their alpha.

use glam::{UVec2, UVec4, Vec2, Vec3};

use super::footprint::Footprint;
use super::geometry::{closest_hit, material_of, spot_of, surface_of};
use super::math::{dot, min};
use super::mesh::Spot;
use super::ray::{Hit, Ray};
use super::rng::{hash4, unit_float};
use super::surface::Surface;
use super::texture::{channel_of, texture_color};
use super::vertices::{uv_in_set, with_vertex_colors};
use crate::records::{FOR_OPACITY, MASK, MOST_PASSED, Material, NO_INDEX, OPACITY_CHANNEL, OPAQUE, Packed};

pub const ONWARD: u32 = 0;
pub const TO_LIGHT: u32 = 1;

#[expect(clippy::too_many_arguments, reason = "the twin of a WGSL function has its arguments")]
pub fn is_there(
    scene: &Packed,
    material: &Material,
    pixel: UVec2,
    sample: u32,
    bounce: u32,
    purpose: u32,
    hit: Hit,
    side: f32,
) -> bool {
    if material.alpha_mode == OPAQUE {
        return true;
    }
    if material.alpha_mode == MASK {
        return material.opacity >= material.cutoff;
    }
    let key = hash4(UVec4::new(pixel.x, pixel.y, scene.camera.seed, sample));
    let face = u32::from(side > 0.0);
    let decision = key.y.wrapping_add(2 * bounce).wrapping_add(purpose);
    let place = hit.primitive.wrapping_mul(2).wrapping_add(face);
    let bits = hash4(UVec4::new(key.x, decision, hit.instance, place));
    unit_float(bits.x) < material.opacity
}

pub fn with_opacity_at(scene: &Packed, before: &Material, spot: &Spot, hit: Hit, uv: Vec2) -> Material {
    let mut material = *before;
    for i in 0..material.lookups.y {
        let lookup = &scene.textures.lookups[(material.lookups.x + i) as usize];
        if lookup.purposes & FOR_OPACITY != 0 {
            let footprint = Footprint {
                uv: uv_in_set(scene, uv, spot, hit, lookup.uv_set),
                dx: Vec2::ZERO,
                dy: Vec2::ZERO,
            };
            let color = texture_color(scene, &scene.textures.records[lookup.texture as usize], footprint);
            material.opacity = channel_of(color, lookup, OPACITY_CHANNEL);
        }
    }
    if scene.specialization.vertex_colors != 0 {
        material = with_vertex_colors(scene, &material, hit);
    }
    material
}

pub fn presence_at(scene: &Packed, before: &Material, spot: &Spot, hit: Hit, uv: Vec2) -> f32 {
    let material = with_opacity_at(scene, before, spot, hit, uv);
    match material.alpha_mode {
        OPAQUE => 1.0,
        MASK if material.opacity >= material.cutoff => 1.0,
        MASK => 0.0,
        _ => min(material.opacity, 1.0),
    }
}

#[expect(clippy::too_many_arguments, reason = "the twin of a WGSL function has its arguments")]
pub fn is_veiled(
    scene: &Packed,
    before: bool,
    surface: &Surface,
    to: Vec3,
    reach: f32,
    goal: u32,
    pixel: UVec2,
    sample: u32,
    bounce: u32,
) -> bool {
    if before {
        return true;
    }
    let way = dot(to, to).sqrt();
    let mut ray = Ray {
        origin: surface.start,
        direction: to * (1.0 / way),
    };
    let mut left = surface.above;
    let mut wall = surface.below;
    let mut rest = way * reach;
    for _ in 0..=MOST_PASSED {
        let hit = closest_hit(scene, ray, left, wall);
        if (hit.primitive == NO_INDEX) | !matches!(hit.t.partial_cmp(&rest), Some(std::cmp::Ordering::Less)) {
            return false;
        }
        let spot = spot_of(scene, hit);
        let met = surface_of(scene, &spot, hit, ray);
        let material = with_opacity_at(scene, material_of(scene, &spot), &spot, hit, met.uv);
        let is_goal = (hit.instance == 0) & (hit.primitive == goal);
        if !is_goal & is_there(scene, &material, pixel, sample, bounce, TO_LIGHT, hit, met.side) {
            return true;
        }
        rest -= hit.t;
        ray.origin = met.position - (met.start - met.position);
        left = met.below;
        wall = met.above;
    }
    true
}

pub fn first_seen(scene: &Packed, ray: Ray, met: Hit) -> Hit {
    let mut hit = met;
    let mut onward = ray;
    let mut way = 0.0;
    for _ in 0..MOST_PASSED {
        if hit.primitive == NO_INDEX {
            break;
        }
        let spot = spot_of(scene, hit);
        let surface = surface_of(scene, &spot, hit, onward);
        let material = with_opacity_at(scene, material_of(scene, &spot), &spot, hit, surface.uv);
        let least = if material.alpha_mode == MASK {
            material.cutoff
        } else {
            0.5
        };
        if (material.alpha_mode == OPAQUE) | (material.opacity >= least) {
            break;
        }
        way += hit.t;
        onward.origin = surface.position - (surface.start - surface.position);
        hit = closest_hit(scene, onward, surface.below, surface.above);
    }
    hit.t += way;
    hit
}
