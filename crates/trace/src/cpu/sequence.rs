//! Twin of `shaders/sequence.wgsl`.

use glam::{UVec2, Vec2};

use super::lanes::{Real, Vector2, Word, WordVector2};
use super::rng::unit_float;

#[inline(always)]
pub fn sobol_sample<W: Word>(index: W, key: W::UVec2) -> <W::Real as Real>::Vec2 {
    let bits = sobol_bits(index, key);
    Vector2::new(unit_float(bits.x()), unit_float(bits.y()))
}

#[inline(always)]
pub fn sobol_bits<W: Word>(index: W, key: W::UVec2) -> W::UVec2 {
    let i = shuffled_index(index, key.x() ^ key.y());
    let x = scramble(i, key.x()).reverse_bits();
    let y = scramble(sobol_reversed(i), key.y()).reverse_bits();
    W::UVec2::new(x, y)
}

#[inline(always)]
pub fn sobol_reversed<W: Word>(i: W) -> W {
    let mut x = i;
    x = x ^ ((x >> 1) & 0x5555_5555);
    x = x ^ ((x >> 2) & 0x3333_3333);
    x = x ^ ((x >> 4) & 0x0f0f_0f0f);
    x = x ^ ((x >> 8) & 0x00ff_00ff);
    x ^ (x >> 16)
}

#[inline(always)]
pub fn scramble<W: Word>(digits: W, seed: W) -> W {
    let mut x = digits.wrapping_add(seed);
    x = x ^ x.wrapping_mul(x.splat(0x6c50_b47c));
    x = x ^ x.wrapping_mul(x.splat(0xb82f_1e52));
    x = x ^ x.wrapping_mul(x.splat(0xc7af_e638));
    x ^ x.wrapping_mul(x.splat(0x8d22_f6e6))
}

#[inline(always)]
pub fn shuffled_index<W: Word>(index: W, seed: W) -> W {
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
