//! Twin of `shaders/environment.wgsl`.

use glam::{UVec2, UVec4, Vec2, Vec3};

use super::emitter::LightSample;
use super::equirect::{cell_towards, column_after, direction_in_cell, normal_bin};
use super::light_sample::power_heuristic;
use super::math::{dot, min, normalize};
use super::rng::{hash4, unit_float};
use crate::records::{ENVIRONMENT_BLOCKS, Light, NO_INDEX, Packed};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentEval {
    pub radiance: Vec3,
    pub pdf: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub index: u32,
    pub width: f32,
    pub position: f32,
}

pub fn environment_texel(scene: &Packed, row: u32, column: u32) -> Vec3 {
    let at = (scene.environment.texels + 3 * (row * scene.environment.width + column)) as usize;
    Vec3::new(
        f32::from_bits(scene.textures.texels[at]),
        f32::from_bits(scene.textures.texels[at + 1]),
        f32::from_bits(scene.textures.texels[at + 2]),
    )
}

pub fn environment_float(scene: &Packed, at: u32) -> f32 {
    f32::from_bits(scene.textures.texels[at as usize])
}

pub fn block_distributions(scene: &Packed, normal: Vec3) -> u32 {
    let around = &scene.environment;
    let rows = (around.height >> (around.shifts >> 8)) + 1;
    around.blocks + rows * ENVIRONMENT_BLOCKS + normal_bin(normal) * (rows + 1) * (ENVIRONMENT_BLOCKS + 1)
}

pub fn interval_at(scene: &Packed, distribution: u32, u: f32, digits: f32) -> Interval {
    let bounds = &scene.textures.texels[distribution as usize..][..ENVIRONMENT_BLOCKS as usize + 1];
    let bound = |at: u32| f32::from_bits(bounds[at as usize]);
    let mut at = 0;
    at += if u >= bound(at + 16) { 16 } else { 0 };
    at += if u >= bound(at + 8) { 8 } else { 0 };
    at += if u >= bound(at + 4) { 4 } else { 0 };
    at += if u >= bound(at + 2) { 2 } else { 0 };
    at += if u >= bound(at + 1) { 1 } else { 0 };
    let low = bound(at);
    let width = bound(at + 1) - low;
    let position = ((u - low) + digits * 5.960_464_5e-8) / width;
    Interval {
        index: at,
        width,
        position: min(position, 0.999_999_94),
    }
}

pub fn interval_width(scene: &Packed, distribution: u32, index: u32) -> f32 {
    environment_float(scene, distribution + index + 1) - environment_float(scene, distribution + index)
}

pub fn environment_eval(scene: &Packed, direction: Vec3, normal: Vec3) -> EnvironmentEval {
    let around = &scene.environment;
    let d = Vec3::new(
        dot(around.x, direction),
        dot(around.y, direction),
        dot(around.z, direction),
    );
    let cell = cell_towards(d, around.width, around.height);
    let next = column_after(cell.column, around.width);
    let a = environment_texel(scene, cell.row, cell.column);
    let b = environment_texel(scene, cell.row, next);
    let c = environment_texel(scene, cell.row + 1, cell.column);
    let e = environment_texel(scene, cell.row + 1, next);
    let upper = a + (b - a) * cell.x;
    let lower = c + (e - c) * cell.x;
    let sum = a + b + c + e;
    let row = cell.row >> (around.shifts >> 8);
    let column = cell.column >> (around.shifts & 255);
    let rows = block_distributions(scene, normal);
    let columns = rows + (row + 1) * (ENVIRONMENT_BLOCKS + 1);
    let probability = interval_width(scene, rows, row) * interval_width(scene, columns, column) * around.density;
    let inverse = environment_float(scene, around.blocks + row * ENVIRONMENT_BLOCKS + column);
    EnvironmentEval {
        radiance: upper + (lower - upper) * cell.y,
        pdf: (sum.x + sum.y + sum.z) * inverse * probability,
    }
}

pub fn environment_mis(scene: &Packed, direction: Vec3, pdf: f32, normal: Vec3) -> Vec3 {
    let eval = environment_eval(scene, direction, normal);
    let weight = if pdf > 0.0 { power_heuristic(pdf, eval.pdf) } else { 1.0 };
    eval.radiance * weight
}

pub fn sample_environment(scene: &Packed, light: &Light, normal: Vec3, u: Vec2) -> LightSample {
    let more = hash4(UVec4::new(u.x.to_bits(), u.y.to_bits(), 0, 0));
    let rows = block_distributions(scene, normal);
    let row = interval_at(scene, rows, u.y, unit_float(more.y));
    let columns = rows + (row.index + 1) * (ENVIRONMENT_BLOCKS + 1);
    let column = interval_at(scene, columns, u.x, unit_float(more.x));
    let around = &scene.environment;
    let (width, height) = (around.width, around.height);
    let down = around.shifts >> 8;
    let along = around.shifts & 255;
    let remaining = UVec2::new(width - (column.index << along), height + 1 - (row.index << down));
    let size = remaining.min(UVec2::new(1 << along, 1 << down));
    let x = column.position * size.x as f32;
    let y = row.position * size.y as f32;
    let cell = UVec2::new(x as u32, y as u32);
    let first = (row.index << down) * width + size.y * (column.index << along) + cell.y * size.x + cell.x;
    let at = (around.cells + 2 * first) as usize;
    let own = ((row.index << down) + cell.y) * 65_536 + (column.index << along) + cell.x;
    let chosen = if more.z < scene.textures.texels[at] {
        own
    } else {
        scene.textures.texels[at + 1]
    };
    let inside = Vec2::new(x - cell.x as f32, y - cell.y as f32);
    let d = direction_in_cell(chosen & 65_535, chosen >> 16, inside, width, height);
    let to = normalize(around.x * d.x + around.y * d.y + around.z * d.z);
    let eval = environment_eval(scene, to, normal);
    LightSample {
        to,
        radiance: eval.radiance,
        pdf: eval.pdf,
        is_delta: false,
        t_max: light.t_max,
        primitive: NO_INDEX,
    }
}
