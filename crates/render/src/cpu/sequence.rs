//! Twin of `shaders/sequence.wgsl`.

use glam::{UVec2, Vec2};

use super::rng::unit_float;

pub fn sobol_sample(index: u32, key: UVec2) -> Vec2 {
    let bits = sobol_bits(index, key);
    Vec2::new(unit_float(bits.x), unit_float(bits.y))
}

pub fn sobol_bits(index: u32, key: UVec2) -> UVec2 {
    let i = shuffled_index(index, key.x ^ key.y);
    let x = scramble(i, key.x).reverse_bits();
    let y = scramble(sobol_reversed(i), key.y).reverse_bits();
    UVec2::new(x, y)
}

pub fn sobol_reversed(i: u32) -> u32 {
    let mut x = i;
    x ^= (x >> 1) & 0x5555_5555;
    x ^= (x >> 2) & 0x3333_3333;
    x ^= (x >> 4) & 0x0f0f_0f0f;
    x ^= (x >> 8) & 0x00ff_00ff;
    x ^ (x >> 16)
}

pub fn scramble(digits: u32, seed: u32) -> u32 {
    let mut x = digits.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x
}

pub fn shuffled_index(index: u32, seed: u32) -> u32 {
    scramble(index.reverse_bits(), seed).reverse_bits()
}

pub fn halton_sample(index: u32, key: UVec2) -> Vec2 {
    let i = shuffled_index(index, key.x ^ key.y);
    let x = i.reverse_bits().wrapping_add(key.x);
    let y = (radical_inverse_3(i) + key.y % 14_348_907) % 14_348_907;
    Vec2::new(unit_float(x), y as f32 * 6.969_171_6e-8)
}

pub fn radical_inverse_3(i: u32) -> u32 {
    let mut remaining = i;
    let mut reversed = 0;
    for _ in 0..15 {
        reversed = reversed * 3 + remaining % 3;
        remaining /= 3;
    }
    reversed
}
