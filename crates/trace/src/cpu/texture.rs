//! Twin of `shaders/texture.wgsl`.

use glam::{Vec2, Vec3};

use super::differential::HitDifferential;
use super::ewa;
use super::footprint::{Footprint, footprint_ellipse, texture_footprint, wrap_u, wrap_v};
use super::geometry::footprint_of;
use super::lobe::direction_turn;
use super::math::{floor, log2, max};
use super::mesh::HitPrimitive;
use super::normal_map::mapped_normal;
use super::procedural::procedural_share;
use super::ray::Hit;
use super::surface::Surface;
use super::vertices::footprint_in_set;

use super::texel::{gaussian_weight, level_size, near_coordinate, unpacked_color, wrapped_index};
use crate::records::{
    ANISOTROPY_CHANNEL, CLEARCOAT_CHANNEL, CLEARCOAT_ROUGHNESS_CHANNEL, EWA, FLOAT, FOR_AMBIENT, FOR_ANISOTROPY,
    FOR_CLEARCOAT, FOR_CLEARCOAT_NORMAL, FOR_CLEARCOAT_ROUGHNESS, FOR_DIFFUSE, FOR_DIRECTION, FOR_EMISSION,
    FOR_METALLIC, FOR_NORMAL, FOR_OPACITY, FOR_ROUGHNESS, FOR_SHEEN, FOR_SHEEN_ROUGHNESS, FOR_SPECULAR,
    FOR_SPECULAR_WEIGHT, FOR_TINT, FOR_TRANSMISSION, LINES, Lookup, METALLIC_CHANNEL, Material, NEAREST,
    OPACITY_CHANNEL, PRINCIPLED, Packed, ROUGHNESS_CHANNEL, SHEEN_ROUGHNESS_CHANNEL, SPECULAR_WEIGHT_CHANNEL,
    TRANSMISSION_CHANNEL, TRILINEAR, Texture,
};

pub fn texture_color(scene: &Packed, t: &Texture, surface: Footprint) -> Vec3 {
    let f = texture_footprint(t, surface);
    let factor = if t.kind <= LINES {
        Vec3::splat(procedural_share(t.kind, t.parameter, f))
    } else if t.kind == NEAREST {
        nearest_color(scene, t, f.uv)
    } else if t.kind == EWA {
        ewa::color(scene, t, f)
    } else {
        linear_color(scene, t, f)
    };
    t.first + (t.second - t.first) * factor
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    pub start: u32,
    pub width: u32,
    pub height: u32,
}

pub fn level_of(scene: &Packed, t: &Texture, i: u32) -> Level {
    Level {
        start: scene.textures.texels[(t.texels + i) as usize],
        width: level_size(t.width, i),
        height: level_size(t.height, i),
    }
}

pub fn load_texel(scene: &Packed, t: &Texture, level: Level, x: i32, y: i32) -> Vec3 {
    let i = wrapped_index(y, level.height, wrap_v(t)) * level.width + wrapped_index(x, level.width, wrap_u(t));
    if t.format == FLOAT {
        let texel = (level.start + 3 * i) as usize;
        return Vec3::from_slice(bytemuck::cast_slice(&scene.textures.texels[texel..texel + 3]));
    }
    unpacked_color(scene.textures.texels[(level.start + i) as usize], t.format)
}

pub fn nearest_color(scene: &Packed, t: &Texture, uv: Vec2) -> Vec3 {
    let level = level_of(scene, t, 0);
    let x = floor(near_coordinate(uv.x, wrap_u(t)) * level.width as f32);
    let y = floor(near_coordinate(uv.y, wrap_v(t)) * level.height as f32);
    load_texel(scene, t, level, x as i32, y as i32)
}

pub fn level_of_length(t: &Texture, length: f32) -> f32 {
    let coarsest = (t.levels - 1) as f32;
    let level = max(log2(max(length, 1.0)), 0.0);
    if (length < 1e9) & (level < coarsest) {
        level
    } else {
        coarsest
    }
}

pub fn linear_color(scene: &Packed, t: &Texture, f: Footprint) -> Vec3 {
    let size = Vec2::new(t.width as f32, t.height as f32);
    let dx = f.dx * size;
    let dy = f.dy * size;
    let longest = max(dx.x * dx.x + dx.y * dx.y, dy.x * dy.x + dy.y * dy.y).sqrt();
    let lod = if t.kind == TRILINEAR {
        level_of_length(t, longest)
    } else {
        0.0
    };
    let finer = floor(lod);
    let blend = lod - finer;
    let mut color = Vec3::ZERO;
    for i in 0..if blend > 0.0 { 2 } else { 1 } {
        let sampled = bilinear_color(scene, t, level_of(scene, t, finer as u32 + i), f.uv);
        color = if i == 0 {
            sampled
        } else {
            color + (sampled - color) * blend
        };
    }
    color
}

pub fn bilinear_color(scene: &Packed, t: &Texture, level: Level, uv: Vec2) -> Vec3 {
    let x = near_coordinate(uv.x, wrap_u(t)) * level.width as f32 - 0.5;
    let y = near_coordinate(uv.y, wrap_v(t)) * level.height as f32 - 0.5;
    let x0 = floor(x);
    let y0 = floor(y);
    let rows = [0, 1].map(|i| {
        let left = load_texel(scene, t, level, x0 as i32, y0 as i32 + i);
        let right = load_texel(scene, t, level, x0 as i32 + 1, y0 as i32 + i);
        left + (right - left) * (x - x0)
    });
    rows[0] + (rows[1] - rows[0]) * (y - y0)
}

pub fn ewa_color(scene: &Packed, t: &Texture, f: Footprint) -> Vec3 {
    let size = Vec2::new(t.width as f32, t.height as f32);
    let minor = footprint_ellipse(f.dx * size, f.dy * size, t.parameter).minor;
    let lod = level_of_length(t, 0.45 * minor);
    let finer = floor(lod);
    let blend = max(4.0 * (lod - finer) - 3.0, 0.0);
    let coarsest = lod >= (t.levels - 1) as f32;
    let dx = if coarsest { Vec2::ZERO } else { f.dx };
    let dy = if coarsest { Vec2::ZERO } else { f.dy };
    let mut color = Vec3::ZERO;
    for i in 0..if blend > 0.0 { 2 } else { 1 } {
        let sampled = ewa_level_color(scene, t, level_of(scene, t, finer as u32 + i), f.uv, dx, dy);
        color = if i == 0 {
            sampled
        } else {
            color + (sampled - color) * blend
        };
    }
    color
}

pub fn ewa_level_color(scene: &Packed, t: &Texture, level: Level, uv: Vec2, dx: Vec2, dy: Vec2) -> Vec3 {
    let size = Vec2::new(level.width as f32, level.height as f32);
    let q = size / Vec2::new(t.width as f32, t.height as f32);
    let edges = Vec2::new(
        if level.width == 1 { 0.0 } else { size.x },
        if level.height == 1 { 0.0 } else { size.y },
    );
    let ellipse = footprint_ellipse(dx * edges, dy * edges, t.parameter);
    let m = ellipse.m;
    let min_increase = 1.0 - ellipse.minor * ellipse.minor;
    let xx = m.x + max((4.0 * (q.x * q.x) - 1.0) / 3.0, min_increase);
    let yy = m.z + max((4.0 * (q.y * q.y) - 1.0) / 3.0, min_increase);
    let slope = m.y / yy;
    let half_width2 = xx - m.y * slope;
    let x = near_coordinate(uv.x, wrap_u(t)) * size.x - 0.5;
    let y = near_coordinate(uv.y, wrap_v(t)) * size.y - 0.5;
    let half_height = yy.sqrt();
    let first_row = -(floor(half_height - y) as i32);
    let last_row = floor(y + half_height) as i32;
    let mut base = Vec3::ZERO;
    let mut sum = Vec3::ZERO;
    let mut total = 0.0;
    for row in first_row..=last_row {
        let h = row as f32 - y;
        let row_r2 = h * h / yy;
        let middle = x + h * slope;
        let half = (half_width2 * max(1.0 - row_r2, 0.0)).sqrt();
        let last = floor(middle + half) as i32;
        for column in -(floor(half - middle) as i32)..=last {
            let w = column as f32 - middle;
            let weight = max(gaussian_weight(row_r2 + w * w / half_width2), 0.0);
            let color = load_texel(scene, t, level, column, row);
            base = if total == 0.0 { color } else { base };
            sum += (color - base) * weight;
            total += weight;
        }
    }
    base + sum * if total > 0.0 { 1.0 / total } else { 0.0 }
}

pub fn channel_of(color: Vec3, lookup: &Lookup, slot: u32) -> f32 {
    let channel = (lookup.channels >> (2 * slot)) & 3;
    match channel {
        1 => color.y,
        2 => color.z,
        _ => color.x,
    }
}

#[inline(always)] // a call copies the material twice
pub fn with_principled(before: Material, color: Vec3, lookup: &Lookup) -> Material {
    let mut m = before;
    if lookup.purposes & FOR_SHEEN != 0 {
        m.sheen = color;
    }
    if lookup.purposes & FOR_DIRECTION != 0 {
        m.rotation += direction_turn(color);
    }
    for (parameter, purpose, slot) in [
        (&mut m.metallic, FOR_METALLIC, METALLIC_CHANNEL),
        (&mut m.anisotropy, FOR_ANISOTROPY, ANISOTROPY_CHANNEL),
        (&mut m.specular_weight, FOR_SPECULAR_WEIGHT, SPECULAR_WEIGHT_CHANNEL),
        (&mut m.transmission, FOR_TRANSMISSION, TRANSMISSION_CHANNEL),
        (&mut m.clearcoat, FOR_CLEARCOAT, CLEARCOAT_CHANNEL),
        (
            &mut m.clearcoat_roughness,
            FOR_CLEARCOAT_ROUGHNESS,
            CLEARCOAT_ROUGHNESS_CHANNEL,
        ),
        (&mut m.sheen_roughness, FOR_SHEEN_ROUGHNESS, SHEEN_ROUGHNESS_CHANNEL),
        (&mut m.opacity, FOR_OPACITY, OPACITY_CHANNEL),
    ] {
        if lookup.purposes & purpose != 0 {
            *parameter = channel_of(color, lookup, slot);
        }
    }
    m
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluatedMaterial {
    pub material: Material,
    pub normal: Vec3,
    pub coat_normal: Vec3,
}

pub fn evaluate_material(
    scene: &Packed,
    prim: &HitPrimitive,
    hit: Hit,
    material: &Material,
    surface: Surface,
    hit_diff: HitDifferential,
    lookups: u32,
) -> EvaluatedMaterial {
    let mut shading = EvaluatedMaterial {
        material: *material,
        normal: surface.shading_normal,
        coat_normal: surface.shading_normal,
    };
    if lookups == 0 {
        return shading;
    }
    let footprint = footprint_of(prim, hit, surface, hit_diff);
    for i in 0..lookups {
        if i < material.lookups.y {
            let lookup = &scene.textures.lookups[(material.lookups.x + i) as usize];
            let t = &scene.textures.records[lookup.texture as usize];
            let set_footprint = footprint_in_set(scene, footprint, prim, hit, hit_diff, lookup.uv_set);
            let color = texture_color(scene, t, set_footprint);
            let purposes = lookup.purposes;
            if purposes & FOR_AMBIENT != 0 {
                shading.material.ambient = color;
            }
            if purposes & FOR_DIFFUSE != 0 {
                shading.material.diffuse = color;
            }
            if purposes & FOR_SPECULAR != 0 {
                shading.material.specular = color;
            }
            if purposes & FOR_TINT != 0 {
                shading.material.tint = color;
            }
            if purposes & FOR_EMISSION != 0 {
                shading.material.emission = color;
            }
            if purposes & FOR_ROUGHNESS != 0 {
                shading.material.roughness = channel_of(color, lookup, ROUGHNESS_CHANNEL);
            }
            if shading.material.kind == PRINCIPLED {
                shading.material = with_principled(shading.material, color, lookup);
                if purposes & FOR_CLEARCOAT_NORMAL != 0 {
                    shading.coat_normal = mapped_normal(surface, t, color);
                }
            }
            if purposes & FOR_NORMAL != 0 {
                shading.normal = mapped_normal(surface, t, color);
            }
        }
    }
    shading
}
