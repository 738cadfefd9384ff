//! Twin of `shaders/rng.wgsl`: counter-based random numbers.

use glam::UVec4;

pub fn hash4(key: UVec4) -> UVec4 {
    let [mut x, mut y, mut z, mut w] = key
        .to_array()
        .map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    [x, y, z, w] = [x, y, z, w].map(|v| v ^ (v >> 16));
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    UVec4::new(x, y, z, w)
}

pub fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 * 5.960_464_5e-8
}
