//! Twin of `shaders/texture.wgsl`: colours from textures.

use glam::{Vec2, Vec3};

use super::differential::Arrival;
use super::footprint::{Footprint, footprint_ellipse, texture_footprint};
use super::geometry::footprint_of;
use super::math::{floor, log2, max};
use super::mesh::Spot;
use super::normal_map::mapped_normal;
use super::procedural::procedural_share;
use super::ray::Hit;
use super::surface::Surface;

use super::texel::{gaussian_weight, level_size, near_coordinate, unpacked_color, wrapped_index};
use crate::pack::{
    EWA, FLOAT, FOR_AMBIENT, FOR_DIFFUSE, FOR_EMISSION, FOR_NORMAL, FOR_ROUGHNESS, FOR_SPECULAR, FOR_TINT, LINES,
    Material, NEAREST, Packed, TEXTURE_NUMBER, TRILINEAR, Texture,
};

pub fn texture_color(scene: &Packed, t: &Texture, surface: Footprint) -> Vec3 {
    let f = texture_footprint(t, surface);
    let x = if t.kind <= LINES {
        Vec3::splat(procedural_share(t.kind, t.parameter, f))
    } else if t.kind == NEAREST {
        nearest_color(scene, t, f.uv)
    } else if t.kind == EWA {
        ewa_color(scene, t, f)
    } else {
        linear_color(scene, t, f)
    };
    t.first + (t.second - t.first) * x
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    pub start: u32,
    pub width: u32,
    pub height: u32,
}

pub fn level_of(scene: &Packed, t: &Texture, i: u32) -> Level {
    Level {
        start: scene.texels[(t.texels + i) as usize],
        width: level_size(t.width, i),
        height: level_size(t.height, i),
    }
}

pub fn load_texel(scene: &Packed, t: &Texture, level: Level, x: i32, y: i32) -> Vec3 {
    let i = wrapped_index(y, level.height, t.wrap) * level.width + wrapped_index(x, level.width, t.wrap);
    if t.format == FLOAT {
        let at = (level.start + 3 * i) as usize;
        return Vec3::from_slice(bytemuck::cast_slice(&scene.texels[at..at + 3]));
    }
    unpacked_color(scene.texels[(level.start + i) as usize], t.format)
}

pub fn nearest_color(scene: &Packed, t: &Texture, uv: Vec2) -> Vec3 {
    let level = level_of(scene, t, 0);
    let x = floor(near_coordinate(uv.x, t.wrap) * level.width as f32);
    let y = floor(near_coordinate(uv.y, t.wrap) * level.height as f32);
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
    let between = lod - finer;
    let mut color = Vec3::ZERO;
    for i in 0..if between > 0.0 { 2 } else { 1 } {
        let sampled = bilinear_color(scene, t, level_of(scene, t, finer as u32 + i), f.uv);
        color = if i == 0 {
            sampled
        } else {
            color + (sampled - color) * between
        };
    }
    color
}

pub fn bilinear_color(scene: &Packed, t: &Texture, level: Level, uv: Vec2) -> Vec3 {
    let x = near_coordinate(uv.x, t.wrap) * level.width as f32 - 0.5;
    let y = near_coordinate(uv.y, t.wrap) * level.height as f32 - 0.5;
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
    let between = max(4.0 * (lod - finer) - 3.0, 0.0);
    let coarsest = lod >= (t.levels - 1) as f32;
    let dx = if coarsest { Vec2::ZERO } else { f.dx };
    let dy = if coarsest { Vec2::ZERO } else { f.dy };
    let mut color = Vec3::ZERO;
    for i in 0..if between > 0.0 { 2 } else { 1 } {
        let sampled = ewa_level_color(scene, t, level_of(scene, t, finer as u32 + i), f.uv, dx, dy);
        color = if i == 0 {
            sampled
        } else {
            color + (sampled - color) * between
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
    let least = 1.0 - ellipse.minor * ellipse.minor;
    let xx = m.x + max((4.0 * (q.x * q.x) - 1.0) / 3.0, least);
    let yy = m.z + max((4.0 * (q.y * q.y) - 1.0) / 3.0, least);
    let slope = m.y / yy;
    let across = xx - m.y * slope;
    let x = near_coordinate(uv.x, t.wrap) * size.x - 0.5;
    let y = near_coordinate(uv.y, t.wrap) * size.y - 0.5;
    let reach = yy.sqrt();
    let first_row = -(floor(reach - y) as i32);
    let last_row = floor(y + reach) as i32;
    let mut base = Vec3::ZERO;
    let mut sum = Vec3::ZERO;
    let mut total = 0.0;
    for row in first_row..=last_row {
        let h = row as f32 - y;
        let along = h * h / yy;
        let middle = x + h * slope;
        let half = (across * max(1.0 - along, 0.0)).sqrt();
        let last = floor(middle + half) as i32;
        for column in -(floor(half - middle) as i32)..=last {
            let w = column as f32 - middle;
            let weight = max(gaussian_weight(along + w * w / across), 0.0);
            let color = load_texel(scene, t, level, column, row);
            base = if total == 0.0 { color } else { base };
            sum += (color - base) * weight;
            total += weight;
        }
    }
    base + sum * if total > 0.0 { 1.0 / total } else { 0.0 }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Appearance {
    pub material: Material,
    pub normal: Vec3,
}

pub fn appearance(
    scene: &Packed,
    spot: &Spot,
    hit: Hit,
    material: &Material,
    surface: Surface,
    at: Arrival,
    lookups: u32,
) -> Appearance {
    let mut look = Appearance {
        material: *material,
        normal: surface.shading_normal,
    };
    if lookups == 0 {
        return look;
    }
    let footprint = footprint_of(spot, hit, surface, at);
    for i in 0..lookups as usize {
        let lookup = material.lookups[i];
        if lookup != 0 {
            let t = &scene.textures[(lookup & TEXTURE_NUMBER) as usize];
            let color = texture_color(scene, t, footprint);
            if lookup & FOR_AMBIENT != 0 {
                look.material.ambient = color;
            }
            if lookup & FOR_DIFFUSE != 0 {
                look.material.diffuse = color;
            }
            if lookup & FOR_SPECULAR != 0 {
                look.material.specular = color;
            }
            if lookup & FOR_TINT != 0 {
                look.material.tint = color;
            }
            if lookup & FOR_EMISSION != 0 {
                look.material.emission = color;
            }
            if lookup & FOR_ROUGHNESS != 0 {
                look.material.roughness = color.x;
            }
            if lookup & FOR_NORMAL != 0 {
                look.normal = mapped_normal(surface, t, color);
            }
        }
    }
    look
}
