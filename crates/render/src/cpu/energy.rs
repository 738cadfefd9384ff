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
    let both = finer + (rougher - finer) * (row - i);
    both.x + (both.y - both.x) * (column - j)
}

pub fn single_scatter_albedo_aniso(scene: &Packed, material: &Material, alpha: Vec2, wo: Vec3, part: u32) -> f32 {
    let word = |i: u32| scene.textures.texels[i as usize];
    let start = material.aniso_table - 1;
    let rows = [word(start), word(start + 1)];
    let rough = min(max(material.roughness, 0.0), 1.0) * (rows[0] - 1) as f32;
    let long = min(max(material.anisotropy, 0.0), 1.0) * (rows[1] - 1) as f32;
    let position = aniso_table_position(alpha, wo);
    let line = position.x * (ANISO_LINES - 1) as f32;
    let column = position.y * (ANISO_COLUMNS - 1) as f32;
    let r = max(min(floor(rough), rows[0] as f32 - 2.0), 0.0);
    let s = max(min(floor(long), rows[1] as f32 - 2.0), 0.0);
    let i = min(floor(line), ANISO_LINES as f32 - 2.0);
    let j = min(floor(column), ANISO_COLUMNS as f32 - 2.0);
    let first = start + 2 + part * rows[0] * rows[1] * (ANISO_LINES * ANISO_COLUMNS);
    let value = |i: u32| f32::from_bits(word(i));
    let mut sum = 0.0;
    for k in 0..if rows[0] > 1 { 2 } else { 1 } {
        for l in 0..if rows[1] > 1 { 2 } else { 1 } {
            let row = (r as u32 + k) * rows[1] + s as u32 + l;
            let at = first + (row * ANISO_LINES + i as u32) * ANISO_COLUMNS + j as u32;
            let across = Vec2::new(value(at), value(at + 1));
            let along = Vec2::new(value(at + ANISO_COLUMNS), value(at + ANISO_COLUMNS + 1));
            let both = across + (along - across) * (line - i);
            let rougher = if k == 1 { rough - r } else { 1.0 - (rough - r) };
            let longer = if l == 1 { long - s } else { 1.0 - (long - s) };
            sum += (both.x + (both.y - both.x) * (column - j)) * (rougher * longer);
        }
    }
    sum
}

pub fn single_scatter_albedo_glass(scene: &Packed, material: &Material, alpha: Vec2, wo: Vec3, side: f32) -> f32 {
    if material.aniso_table != 0 {
        let behind = if material.kind == ROUGH_GLASS { 0 } else { 2 } + if side > 0.0 { 0 } else { 1 };
        return single_scatter_albedo_aniso(scene, material, alpha, wo, behind);
    }
    single_scatter_albedo(scene, material.energy, alpha, wo, side)
}

pub fn principled_energy(scene: &Packed, material: &Material, wo: Vec3, side: f32) -> Vec3 {
    let mut found = Vec3::ONE;
    let alpha = facet_alpha(material);
    if material.aniso_table != 0 {
        found.x = single_scatter_albedo_aniso(scene, material, alpha, wo, 0);
        found.y = single_scatter_albedo_aniso(scene, material, alpha, wo, 1);
    }
    if (material.thin == 0) & (material.transmission > 0.0) {
        found.z = single_scatter_albedo_glass(scene, material, alpha, wo, side);
    }
    found
}
