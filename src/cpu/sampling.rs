//! Twin of `shaders/sampling.wgsl`: sample positions on the unit square.

use glam::{UVec2, UVec4, Vec2};

use super::rng::{hash4, unit_float};
use crate::pack::GRID;

pub fn sample_square(pattern: u32, side: u32, index: u32, group: u32, key: UVec2) -> Vec2 {
    if pattern == GRID {
        return grid_sample(side, index);
    }
    random_sample(index, group, key)
}

pub fn grid_sample(side: u32, index: u32) -> Vec2 {
    let cell = 1.0 / side as f32;
    Vec2::new(
        ((index % side) as f32 + 0.5) * cell,
        ((index / side) as f32 + 0.5) * cell,
    )
}

pub fn random_sample(index: u32, group: u32, key: UVec2) -> Vec2 {
    let bits = hash4(UVec4::new(key.x, key.y, group, index));
    Vec2::new(unit_float(bits.x), unit_float(bits.y))
}

pub fn sample_key(pixel: UVec2, seed: u32, purpose: u32) -> UVec2 {
    let bits = hash4(UVec4::new(pixel.x, pixel.y, seed, purpose));
    UVec2::new(bits.x, bits.y)
}
