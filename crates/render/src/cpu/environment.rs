//! Twin of `shaders/environment.wgsl`.

use glam::{UVec2, UVec4, Vec2, Vec3};

use super::emitter::LightSample;
use super::equirect::{EnvironmentCell, cell_towards, column_after, direction_in_cell, normal_bin};
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
pub struct EnvironmentPoint {
    pub column: u32,
    pub row: u32,
    pub position: Vec2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub index: u32,
    pub width: f32,
    pub position: f32,
}

pub fn environment_texel(scene: &Packed, row: u32, column: u32) -> Vec3 {
    let start = (scene.environment.texels + 3 * (row * scene.environment.width + column)) as usize;
    Vec3::new(
        f32::from_bits(scene.textures.texels[start]),
        f32::from_bits(scene.textures.texels[start + 1]),
        f32::from_bits(scene.textures.texels[start + 2]),
    )
}

pub fn environment_float(scene: &Packed, index: u32) -> f32 {
    f32::from_bits(scene.textures.texels[index as usize])
}

pub fn block_distributions(scene: &Packed, normal: Vec3) -> u32 {
    let environment = &scene.environment;
    let rows = (environment.height >> (environment.shifts >> 8)) + 1;
    environment.blocks + rows * ENVIRONMENT_BLOCKS + normal_bin(normal) * (rows + 1) * (ENVIRONMENT_BLOCKS + 1)
}

pub fn interval_at(scene: &Packed, distribution: u32, u: f32, digits: f32) -> Interval {
    let bounds = &scene.textures.texels[distribution as usize..][..ENVIRONMENT_BLOCKS as usize + 1];
    let bound = |entry: u32| f32::from_bits(bounds[entry as usize]);
    let mut entry = 0;
    entry += if u >= bound(entry + 16) { 16 } else { 0 };
    entry += if u >= bound(entry + 8) { 8 } else { 0 };
    entry += if u >= bound(entry + 4) { 4 } else { 0 };
    entry += if u >= bound(entry + 2) { 2 } else { 0 };
    entry += if u >= bound(entry + 1) { 1 } else { 0 };
    let low = bound(entry);
    let width = bound(entry + 1) - low;
    let position = ((u - low) + digits * 5.960_464_5e-8) / width;
    Interval {
        index: entry,
        width,
        position: min(position, 0.999_999_94),
    }
}

pub fn interval_width(scene: &Packed, distribution: u32, index: u32) -> f32 {
    environment_float(scene, distribution + index + 1) - environment_float(scene, distribution + index)
}

pub fn environment_eval(scene: &Packed, direction: Vec3, normal: Vec3) -> EnvironmentEval {
    let environment = &scene.environment;
    let d = Vec3::new(
        dot(environment.x, direction),
        dot(environment.y, direction),
        dot(environment.z, direction),
    );
    let cell = cell_towards(d, environment.width, environment.height);
    environment_at(scene, cell, normal)
}

pub fn environment_at(scene: &Packed, cell: EnvironmentCell, normal: Vec3) -> EnvironmentEval {
    let environment = &scene.environment;
    let next_column = column_after(cell.column, environment.width);
    let a = environment_texel(scene, cell.row, cell.column);
    let b = environment_texel(scene, cell.row, next_column);
    let c = environment_texel(scene, cell.row + 1, cell.column);
    let e = environment_texel(scene, cell.row + 1, next_column);
    let upper = a + (b - a) * cell.x;
    let lower = c + (e - c) * cell.x;
    let sum = a + b + c + e;
    let row = cell.row >> (environment.shifts >> 8);
    let column = cell.column >> (environment.shifts & 255);
    let rows = block_distributions(scene, normal);
    let columns = rows + (row + 1) * (ENVIRONMENT_BLOCKS + 1);
    let probability = interval_width(scene, rows, row) * interval_width(scene, columns, column) * environment.density;
    let inverse = environment_float(scene, environment.blocks + row * ENVIRONMENT_BLOCKS + column);
    EnvironmentEval {
        radiance: upper + (lower - upper) * cell.y,
        pdf: (sum.x + sum.y + sum.z) * inverse * probability,
    }
}

pub fn environment_mis(eval: EnvironmentEval, pdf: f32) -> Vec3 {
    let weight = if pdf > 0.0 { power_heuristic(pdf, eval.pdf) } else { 1.0 };
    eval.radiance * weight
}

pub fn environment_point(scene: &Packed, normal: Vec3, u: Vec2) -> EnvironmentPoint {
    let bits = hash4(UVec4::new(u.x.to_bits(), u.y.to_bits(), 0, 0));
    let rows = block_distributions(scene, normal);
    let row = interval_at(scene, rows, u.y, unit_float(bits.y));
    let columns = rows + (row.index + 1) * (ENVIRONMENT_BLOCKS + 1);
    let column = interval_at(scene, columns, u.x, unit_float(bits.x));
    let environment = &scene.environment;
    let (width, height) = (environment.width, environment.height);
    let row_shift = environment.shifts >> 8;
    let column_shift = environment.shifts & 255;
    let remaining = UVec2::new(
        width - (column.index << column_shift),
        height + 1 - (row.index << row_shift),
    );
    let size = remaining.min(UVec2::new(1 << column_shift, 1 << row_shift));
    let x = column.position * size.x as f32;
    let y = row.position * size.y as f32;
    let cell = UVec2::new(x as u32, y as u32);
    let cell_index =
        (row.index << row_shift) * width + size.y * (column.index << column_shift) + cell.y * size.x + cell.x;
    let entry = (environment.cells + 2 * cell_index) as usize;
    let own_cell = ((row.index << row_shift) + cell.y) * 65_536 + (column.index << column_shift) + cell.x;
    let selected_cell = if bits.z < scene.textures.texels[entry] {
        own_cell
    } else {
        scene.textures.texels[entry + 1]
    };
    EnvironmentPoint {
        column: selected_cell & 65_535,
        row: selected_cell >> 16,
        position: Vec2::new(x - cell.x as f32, y - cell.y as f32),
    }
}

pub fn sample_environment(scene: &Packed, light: &Light, normal: Vec3, u: Vec2) -> LightSample {
    let environment = &scene.environment;
    let point = environment_point(scene, normal, u);
    let d = direction_in_cell(
        point.column,
        point.row,
        point.position,
        environment.width,
        environment.height,
    );
    let direction = normalize(environment.x * d.x + environment.y * d.y + environment.z * d.z);
    let eval = environment_eval(scene, direction, normal);
    LightSample {
        to: direction,
        radiance: eval.radiance,
        pdf: eval.pdf,
        is_delta: false,
        t_max: light.t_max,
        primitive: NO_INDEX,
    }
}
