//! Twin of `shaders/rng.wgsl`: counter-based random numbers.

use super::lanes::{Word, WordVector4};

#[inline(always)]
pub fn hash4<V: WordVector4>(key: V) -> V {
    let [x, y, z, w] = key.words();
    let (a, c) = (x.splat(1_664_525), x.splat(1_013_904_223));
    let mut x = x.wrapping_mul(a).wrapping_add(c);
    let mut y = y.wrapping_mul(a).wrapping_add(c);
    let mut z = z.wrapping_mul(a).wrapping_add(c);
    let mut w = w.wrapping_mul(a).wrapping_add(c);
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    (x, y, z, w) = (x ^ (x >> 16), y ^ (y >> 16), z ^ (z >> 16), w ^ (w >> 16));
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    V::from_words([x, y, z, w])
}

#[inline(always)]
pub fn unit_float<W: Word>(bits: W) -> W::Real {
    (bits >> 8).to_real() * 5.960_464_5e-8
}
