//! Twin of `shaders/sampling.wgsl`.

use glam::{UVec2, UVec4, Vec2};

use super::rng::{hash4, unit_float};
use super::sequence::{halton_sample, sobol_sample};
use crate::records::{GRID, HALTON, JITTERED, ROTATED_GRID, SOBOL};

pub fn sample_square(pattern: u32, side: u32, index: u32, group: u32, key: UVec2) -> Vec2 {
    if pattern == GRID {
        return grid_sample(side, index);
    }
    if pattern == ROTATED_GRID {
        return rotated_grid_sample(side, index);
    }
    if pattern == JITTERED {
        return jittered_sample(side, index, group, key);
    }
    if pattern == HALTON {
        return halton_sample(group.wrapping_mul(side).wrapping_add(index), key);
    }
    if pattern == SOBOL {
        return sobol_sample(group.wrapping_mul(side).wrapping_add(index), key);
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

pub fn rotated_grid_sample(side: u32, index: u32) -> Vec2 {
    let p = grid_sample(side, index) - 0.5;
    let x = 0.894_427_2 * p.x - 0.447_213_6 * p.y;
    let y = 0.447_213_6 * p.x + 0.894_427_2 * p.y;
    Vec2::new(wrap(x + 0.5), wrap(y + 0.5))
}

pub fn wrap(x: f32) -> f32 {
    let nonnegative = if x < 0.0 { x + 1.0 } else { x };
    if nonnegative >= 1.0 {
        nonnegative - 1.0
    } else {
        nonnegative
    }
}

pub fn jittered_sample(side: u32, index: u32, group: u32, key: UVec2) -> Vec2 {
    let bits = hash4(UVec4::new(key.x, key.y, group, index));
    let x = (((index % side) << 24) | (bits.x >> 8)) / side;
    let y = (((index / side) << 24) | (bits.y >> 8)) / side;
    Vec2::new(x as f32, y as f32) * 5.960_464_5e-8
}

pub fn random_sample(index: u32, group: u32, key: UVec2) -> Vec2 {
    let bits = hash4(UVec4::new(key.x, key.y, group, index));
    Vec2::new(unit_float(bits.x), unit_float(bits.y))
}

pub fn sample_key(pixel: UVec2, seed: u32, purpose: u32) -> UVec2 {
    let bits = hash4(UVec4::new(pixel.x, pixel.y, seed, purpose));
    UVec2::new(bits.x, bits.y)
}

pub fn decision_bits(pixel: UVec2, seed: u32, sample: u32, bounce: u32, purpose: u32) -> UVec4 {
    let key = sample_key(pixel, seed, purpose);
    hash4(UVec4::new(key.x, key.y, sample, bounce))
}
