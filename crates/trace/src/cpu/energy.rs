//! Twin of `shaders/energy.wgsl`.

use glam::{Vec2, Vec3};

use super::lobe::{aniso_table_position, facet_alpha};
use super::math::{floor, max, min};
use crate::records::{ANISO_COLUMNS, ANISO_LINES, ENERGY_SIZE, Material, Packed, ROUGH_GLASS};

pub fn single_scatter_albedo(scene: &Packed, energy: u32, alpha: Vec2, wo: Vec3, side: f32) -> f32 {
    let last = (ENERGY_SIZE - 1) as f32;
    let square = 0.5 * (alpha.x * alpha.x + alpha.y * alpha.y);
    let row = min(square.sqrt().sqrt(), 1.0) * last;
    let column = min(max(wo.z, 0.0), 1.0) * last;
    let i = min(floor(row), last - 1.0);
    let j = min(floor(column), last - 1.0);
    let table = if side > 0.0 { 0 } else { ENERGY_SIZE * ENERGY_SIZE };
    let start = energy + table + i as u32 * ENERGY_SIZE + j as u32;
    let word = |i: u32| f32::from_bits(scene.textures.texels[i as usize]);
    let finer = Vec2::new(word(start), word(start + 1));
    let rougher = Vec2::new(word(start + ENERGY_SIZE), word(start + ENERGY_SIZE + 1));
    let pair = finer + (rougher - finer) * (row - i);
    pair.x + (pair.y - pair.x) * (column - j)
}

pub fn single_scatter_albedo_aniso(scene: &Packed, material: &Material, alpha: Vec2, wo: Vec3, part: u32) -> f32 {
    let word = |i: u32| scene.textures.texels[i as usize];
    let start = material.aniso_table - 1;
    let rows = [word(start), word(start + 1)];
    let roughness_row = min(max(material.roughness, 0.0), 1.0) * (rows[0] - 1) as f32;
    let anisotropy_row = min(max(material.anisotropy, 0.0), 1.0) * (rows[1] - 1) as f32;
    let position = aniso_table_position(alpha, wo);
    let line = position.x * (ANISO_LINES - 1) as f32;
    let column = position.y * (ANISO_COLUMNS - 1) as f32;
    let r = max(min(floor(roughness_row), rows[0] as f32 - 2.0), 0.0);
    let s = max(min(floor(anisotropy_row), rows[1] as f32 - 2.0), 0.0);
    let i = min(floor(line), ANISO_LINES as f32 - 2.0);
    let j = min(floor(column), ANISO_COLUMNS as f32 - 2.0);
    let first = start + 2 + part * rows[0] * rows[1] * (ANISO_LINES * ANISO_COLUMNS);
    let value = |i: u32| f32::from_bits(word(i));
    let mut sum = 0.0;
    for k in 0..if rows[0] > 1 { 2 } else { 1 } {
        for l in 0..if rows[1] > 1 { 2 } else { 1 } {
            let row = (r as u32 + k) * rows[1] + s as u32 + l;
            let entry = first + (row * ANISO_LINES + i as u32) * ANISO_COLUMNS + j as u32;
            let line_values = Vec2::new(value(entry), value(entry + 1));
            let next_values = Vec2::new(value(entry + ANISO_COLUMNS), value(entry + ANISO_COLUMNS + 1));
            let pair = line_values + (next_values - line_values) * (line - i);
            let roughness_weight = if k == 1 {
                roughness_row - r
            } else {
                1.0 - (roughness_row - r)
            };
            let anisotropy_weight = if l == 1 {
                anisotropy_row - s
            } else {
                1.0 - (anisotropy_row - s)
            };
            sum += (pair.x + (pair.y - pair.x) * (column - j)) * (roughness_weight * anisotropy_weight);
        }
    }
    sum
}

pub fn single_scatter_albedo_glass(scene: &Packed, material: &Material, alpha: Vec2, wo: Vec3, side: f32) -> f32 {
    if material.aniso_table != 0 {
        let part = if material.kind == ROUGH_GLASS { 0 } else { 2 } + if side > 0.0 { 0 } else { 1 };
        return single_scatter_albedo_aniso(scene, material, alpha, wo, part);
    }
    single_scatter_albedo(scene, material.energy, alpha, wo, side)
}

pub fn principled_energy(scene: &Packed, material: &Material, wo: Vec3, side: f32) -> Vec3 {
    let mut albedos = Vec3::ONE;
    let alpha = facet_alpha(material);
    if material.aniso_table != 0 {
        albedos.x = single_scatter_albedo_aniso(scene, material, alpha, wo, 0);
        albedos.y = single_scatter_albedo_aniso(scene, material, alpha, wo, 1);
    }
    if (material.thin == 0) & (material.transmission > 0.0) {
        albedos.z = single_scatter_albedo_glass(scene, material, alpha, wo, side);
    }
    albedos
}
