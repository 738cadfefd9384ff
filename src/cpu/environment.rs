//! Twin of `shaders/environment.wgsl`: the image that surrounds the scene.

use glam::{UVec2, UVec4, Vec2, Vec3};

use super::emitter::LightSample;
use super::light_sample::{power_heuristic, whole_below};
use super::math::{dot, normalize};
use super::rng::{hash4, unit_float};
use super::surroundings::{cell_towards, column_after, direction_in_cell};
use crate::pack::{Light, NOTHING, Packed};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    pub radiance: Vec3,
    pub pdf: f32,
}

pub fn environment_texel(scene: &Packed, row: u32, column: u32) -> Vec3 {
    let at = (scene.environment.texels + 3 * (row * scene.environment.width + column)) as usize;
    Vec3::new(
        f32::from_bits(scene.texels[at]),
        f32::from_bits(scene.texels[at + 1]),
        f32::from_bits(scene.texels[at + 2]),
    )
}

pub fn arriving_from(scene: &Packed, direction: Vec3) -> Arriving {
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
    Arriving {
        radiance: upper + (lower - upper) * cell.y,
        pdf: (sum.x + sum.y + sum.z) * around.density,
    }
}

pub fn light_from_afar(scene: &Packed, direction: Vec3, pdf: f32) -> Vec3 {
    let arriving = arriving_from(scene, direction);
    let weight = if pdf > 0.0 {
        power_heuristic(pdf, arriving.pdf)
    } else {
        1.0
    };
    arriving.radiance * weight
}

pub fn sample_environment(scene: &Packed, light: &Light, u: Vec2) -> LightSample {
    let bits = UVec2::new((u.x * 16_777_216.0) as u32, (u.y * 16_777_216.0) as u32);
    let more = hash4(UVec4::new(bits.x, bits.y, 0, 0));
    let around = &scene.environment;
    let (width, height) = (around.width, around.height);
    let first = whole_below((bits.x << 8) | (more.x & 255), width * (height + 1));
    let at = (around.cells + 2 * first) as usize;
    let threshold = scene.texels[at];
    let chosen = if ((bits.y << 8) | ((more.x >> 8) & 255)) < threshold {
        first
    } else {
        scene.texels[at + 1]
    };
    let inside = Vec2::new(unit_float(more.y), unit_float(more.z));
    let row = chosen / width;
    let d = direction_in_cell(chosen - row * width, row, inside, width, height);
    let to = normalize(around.x * d.x + around.y * d.y + around.z * d.z);
    let arriving = arriving_from(scene, to);
    LightSample {
        to,
        radiance: arriving.radiance,
        pdf: arriving.pdf,
        is_delta: false,
        reach: light.reach,
        primitive: NOTHING,
    }
}
