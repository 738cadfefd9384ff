//! Twin of `shaders/environment.wgsl`.

use glam::{UVec4, Vec2, Vec3};

use super::emitter::LightSample;
use super::equirect::{EnvironmentCell, cell_towards, column_after, direction_in_cell, normal_bin};
use super::lanes::{Real, Vector2, Vector3, Word};
use super::light_sample::power_heuristic;
use super::math::{dot, min, normalize};
use super::rng::{hash4, unit_float};
use crate::records::{ENVIRONMENT_BLOCKS, Light, NO_INDEX, Packed};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentEval<V: Vector3 = Vec3> {
    pub radiance: V,
    pub pdf: V::Real,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentPoint {
    pub column: u32,
    pub row: u32,
    pub position: Vec2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockCell<F: Real = f32> {
    pub entry: F::Word,
    pub cell: F::Word,
    pub position: F::Vec2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellCorners<V: Vector3 = Vec3> {
    pub a: V,
    pub b: V,
    pub c: V,
    pub e: V,
}

#[inline(always)]
pub fn environment_texel(scene: &Packed, row: u32, column: u32) -> Vec3 {
    let start = (scene.environment.texels + 3 * (row * scene.environment.width + column)) as usize;
    Vec3::new(
        f32::from_bits(scene.textures.texels[start]),
        f32::from_bits(scene.textures.texels[start + 1]),
        f32::from_bits(scene.textures.texels[start + 2]),
    )
}

#[inline(always)]
pub fn environment_float(scene: &Packed, index: u32) -> f32 {
    f32::from_bits(scene.textures.texels[index as usize])
}

#[inline(always)]
pub fn block_distributions<W: Word>(scene: &Packed, bin: W) -> W {
    let environment = &scene.environment;
    let rows = (environment.height >> (environment.shifts >> 8)) + 1;
    let first = bin.splat(environment.blocks + rows * ENVIRONMENT_BLOCKS);
    first.wrapping_add(bin.wrapping_mul(bin.splat((rows + 1) * (ENVIRONMENT_BLOCKS + 1))))
}

#[inline(always)]
pub fn interval_at(scene: &Packed, distribution: u32, u: f32) -> u32 {
    let bounds = &scene.textures.texels[distribution as usize..][..ENVIRONMENT_BLOCKS as usize + 1];
    let bound = |entry: u32| f32::from_bits(bounds[entry as usize]);
    let mut entry = 0;
    entry += if u >= bound(entry + 16) { 16 } else { 0 };
    entry += if u >= bound(entry + 8) { 8 } else { 0 };
    entry += if u >= bound(entry + 4) { 4 } else { 0 };
    entry += if u >= bound(entry + 2) { 2 } else { 0 };
    entry += if u >= bound(entry + 1) { 1 } else { 0 };
    entry
}

#[inline(always)]
pub fn interval_position<F: Real>(low: F, high: F, u: F, digits: F) -> F {
    min(
        ((u - low) + digits * 5.960_464_5e-8) / (high - low),
        u.splat(0.999_999_94),
    )
}

#[inline(always)]
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
    let corners = CellCorners {
        a: environment_texel(scene, cell.row, cell.column),
        b: environment_texel(scene, cell.row, next_column),
        c: environment_texel(scene, cell.row + 1, cell.column),
        e: environment_texel(scene, cell.row + 1, next_column),
    };
    let rows = block_distributions(scene, normal_bin(normal));
    let block = block_terms(scene, rows, cell.row, cell.column);
    cell_eval(scene, corners, cell.x, cell.y, block.x, block.y)
}

#[inline(always)]
pub fn block_terms(scene: &Packed, distributions: u32, cell_row: u32, cell_column: u32) -> Vec2 {
    let environment = &scene.environment;
    let row = cell_row >> (environment.shifts >> 8);
    let column = cell_column >> (environment.shifts & 255);
    let columns = distributions + (row + 1) * (ENVIRONMENT_BLOCKS + 1);
    let probability = interval_width(scene, distributions, row) * interval_width(scene, columns, column);
    let inverse = environment_float(scene, environment.blocks + row * ENVIRONMENT_BLOCKS + column);
    Vec2::new(probability, inverse)
}

#[inline(always)]
pub fn cell_eval<V: Vector3>(
    scene: &Packed,
    corners: CellCorners<V>,
    x: V::Real,
    y: V::Real,
    probability: V::Real,
    inverse: V::Real,
) -> EnvironmentEval<V> {
    let CellCorners { a, b, c, e } = corners;
    let upper = a + (b - a) * x;
    let lower = c + (e - c) * x;
    let sum = a + b + c + e;
    let pdf = (sum.x() + sum.y() + sum.z()) * inverse * (probability * scene.environment.density);
    EnvironmentEval {
        radiance: upper + (lower - upper) * y,
        pdf,
    }
}

pub fn environment_mis(eval: EnvironmentEval, pdf: f32) -> Vec3 {
    let weight = if pdf > 0.0 { power_heuristic(pdf, eval.pdf) } else { 1.0 };
    eval.radiance * weight
}

pub fn environment_point(scene: &Packed, normal: Vec3, u: Vec2) -> EnvironmentPoint {
    let bits = hash4(UVec4::new(u.x.to_bits(), u.y.to_bits(), 0, 0));
    let rows = block_distributions(scene, normal_bin(normal));
    let row = interval_at(scene, rows, u.y);
    let columns = rows + (row + 1) * (ENVIRONMENT_BLOCKS + 1);
    let column = interval_at(scene, columns, u.x);
    let bound = |entry| environment_float(scene, entry);
    let x = interval_position(
        bound(columns + column),
        bound(columns + column + 1),
        u.x,
        unit_float(bits.x),
    );
    let y = interval_position(bound(rows + row), bound(rows + row + 1), u.y, unit_float(bits.y));
    let own = block_cell(scene, row, column, Vec2::new(x, y));
    let cell = selected_cell(scene, own.entry, own.cell, bits.z);
    EnvironmentPoint {
        column: cell & 65_535,
        row: cell >> 16,
        position: own.position,
    }
}

#[inline(always)]
pub fn selected_cell(scene: &Packed, entry: u32, cell: u32, bits: u32) -> u32 {
    let entry = &scene.textures.texels[entry as usize..][..2];
    if bits < entry[0] { cell } else { entry[1] }
}

#[inline(always)]
pub fn block_cell<W: Word>(scene: &Packed, row: W, column: W, position: <W::Real as Real>::Vec2) -> BlockCell<W::Real> {
    let environment = &scene.environment;
    let (width, height) = (environment.width, environment.height);
    let row_shift = environment.shifts >> 8;
    let column_shift = environment.shifts & 255;
    let first_row = row << row_shift;
    let first_column = column << column_shift;
    let zero = position.x().splat(0.0);
    let columns = min(
        row.splat(width).wrapping_sub(first_column).to_real(),
        zero.splat((1u32 << column_shift) as f32),
    );
    let rows = min(
        row.splat(height + 1).wrapping_sub(first_row).to_real(),
        zero.splat((1u32 << row_shift) as f32),
    );
    let x = position.x() * columns;
    let y = position.y() * rows;
    let (cell_x, cell_y) = (x.to_word(), y.to_word());
    let index = first_row
        .wrapping_mul(row.splat(width))
        .wrapping_add(rows.to_word().wrapping_mul(first_column))
        .wrapping_add(cell_y.wrapping_mul(columns.to_word()))
        .wrapping_add(cell_x);
    let cell = (first_row.wrapping_add(cell_y) << 16)
        .wrapping_add(first_column)
        .wrapping_add(cell_x);
    BlockCell {
        entry: row.splat(environment.cells).wrapping_add(index << 1),
        cell,
        position: Vector2::new(x - cell_x.to_real(), y - cell_y.to_real()),
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
