//! Twin of `shaders/alpha.wgsl`: surfaces with alpha.

use glam::{UVec2, UVec4, Vec2, Vec3};

use super::footprint::Footprint;
use super::geometry::{closest_hit, fetch_hit_primitive, material_of, surface_of};
use super::math::{dot, min};
use super::mesh::HitPrimitive;
use super::ray::{Hit, Ray};
use super::rng::{hash4, unit_float};
use super::surface::Surface;
use super::texture::{channel_of, texture_color};
use super::vertices::{uv_in_set, with_vertex_colors};
use crate::records::{FOR_OPACITY, MASK, MAX_ALPHA_SKIPS, Material, NO_INDEX, OPACITY_CHANNEL, OPAQUE, Packed};

pub const RAY_BSDF: u32 = 0;
pub const RAY_SHADOW: u32 = 1;

#[expect(clippy::too_many_arguments, reason = "a twin has the arguments of its WGSL function")]
pub fn alpha_accepts(
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
    let purpose_key = key.y.wrapping_add(2 * bounce).wrapping_add(purpose);
    let side_index = hit.primitive.wrapping_mul(2).wrapping_add(face);
    let bits = hash4(UVec4::new(key.x, purpose_key, hit.instance, side_index));
    unit_float(bits.x) < material.opacity
}

pub fn with_opacity_at(scene: &Packed, before: &Material, prim: &HitPrimitive, hit: Hit, uv: Vec2) -> Material {
    let mut material = *before;
    for i in 0..material.lookups.y {
        let lookup = &scene.textures.lookups[(material.lookups.x + i) as usize];
        if lookup.purposes & FOR_OPACITY != 0 {
            let footprint = Footprint {
                uv: uv_in_set(scene, uv, prim, hit, lookup.uv_set),
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

pub fn opacity_at(scene: &Packed, before: &Material, prim: &HitPrimitive, hit: Hit, uv: Vec2) -> f32 {
    let material = with_opacity_at(scene, before, prim, hit, uv);
    match material.alpha_mode {
        OPAQUE => 1.0,
        MASK if material.opacity >= material.cutoff => 1.0,
        MASK => 0.0,
        _ => min(material.opacity, 1.0),
    }
}

#[expect(clippy::too_many_arguments, reason = "a twin has the arguments of its WGSL function")]
pub fn is_occluded_alpha(
    scene: &Packed,
    already_occluded: bool,
    surface: &Surface,
    to_light: Vec3,
    t_max: f32,
    target_prim: u32,
    pixel: UVec2,
    sample: u32,
    bounce: u32,
) -> bool {
    if already_occluded {
        return true;
    }
    let distance = dot(to_light, to_light).sqrt();
    let mut ray = Ray {
        origin: surface.ray_origin,
        direction: to_light * (1.0 / distance),
    };
    let mut origin_prim = surface.exclude_front;
    let mut inside_prim = surface.exclude_back;
    let mut remaining = distance * t_max;
    for _ in 0..=MAX_ALPHA_SKIPS {
        let hit = closest_hit(scene, ray, origin_prim, inside_prim);
        if (hit.primitive == NO_INDEX) | !matches!(hit.t.partial_cmp(&remaining), Some(std::cmp::Ordering::Less)) {
            return false;
        }
        let prim = fetch_hit_primitive(scene, hit);
        let skipped = surface_of(scene, &prim, hit, ray);
        let material = with_opacity_at(scene, material_of(scene, &prim), &prim, hit, skipped.uv);
        let is_target = (hit.instance == 0) & (hit.primitive == target_prim);
        if !is_target & alpha_accepts(scene, &material, pixel, sample, bounce, RAY_SHADOW, hit, skipped.side) {
            return true;
        }
        remaining -= hit.t;
        ray.origin = skipped.position - (skipped.ray_origin - skipped.position);
        origin_prim = skipped.exclude_back;
        inside_prim = skipped.exclude_front;
    }
    true
}

pub fn skip_transparent(scene: &Packed, ray: Ray, first: Hit) -> Hit {
    let mut hit = first;
    let mut continued = ray;
    let mut distance = 0.0;
    for _ in 0..MAX_ALPHA_SKIPS {
        if hit.primitive == NO_INDEX {
            break;
        }
        let prim = fetch_hit_primitive(scene, hit);
        let surface = surface_of(scene, &prim, hit, continued);
        let material = with_opacity_at(scene, material_of(scene, &prim), &prim, hit, surface.uv);
        let min_opacity = if material.alpha_mode == MASK {
            material.cutoff
        } else {
            0.5
        };
        if (material.alpha_mode == OPAQUE) | (material.opacity >= min_opacity) {
            break;
        }
        distance += hit.t;
        continued.origin = surface.position - (surface.ray_origin - surface.position);
        hit = closest_hit(scene, continued, surface.exclude_back, surface.exclude_front);
    }
    hit.t += distance;
    hit
}
