//! Twin of `shaders/texel.wgsl`: texels of images.

use glam::Vec3;

use super::math::{exp2, floor, max, min, power};
use crate::records::{CLAMP, MIRRORED, SRGB8};

pub fn near_coordinate(u: f32, wrap: u32) -> f32 {
    let small = if u.abs() < 8_388_608.0 { u } else { 0.0 };
    let repeated = small - floor(small);
    let mirrored = small - 2.0 * floor(0.5 * small);
    let clamped = min(max(u, -8.0), 9.0);
    match wrap {
        MIRRORED => mirrored,
        CLAMP => clamped,
        _ => repeated,
    }
}

pub fn wrapped_index(i: i32, size: u32, wrap: u32) -> u32 {
    if (i as u32) < size {
        return i as u32; // most indices; saves a division
    }
    let n = size as i32;
    if wrap == CLAMP {
        return if i < 0 { 0 } else { i.min(n - 1) as u32 };
    }
    let period = if wrap == MIRRORED { 2 * n } else { n };
    let periods = floor((i as f32 + 0.5) / period as f32) as i32;
    let j = i - periods * period;
    if j >= n { (period - 1 - j) as u32 } else { j as u32 }
}

pub fn level_size(size: u32, level: u32) -> u32 {
    (size >> level).max(1)
}

pub fn unpacked_color(word: u32, format: u32) -> Vec3 {
    let unit = f32::from_bits(((word >> 27) + 95) << 23);
    let digits = Vec3::new(
        (word & 511) as f32,
        ((word >> 9) & 511) as f32,
        ((word >> 18) & 511) as f32,
    );
    let color = digits * unit / 255.0;
    if format == SRGB8 {
        return Vec3::new(
            srgb_to_linear(color.x),
            srgb_to_linear(color.y),
            srgb_to_linear(color.z),
        );
    }
    color
}

pub fn srgb_to_linear(x: f32) -> f32 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        power((x + 0.055) / 1.055, 2.4)
    }
}

pub fn gaussian_weight(r2: f32) -> f32 {
    exp2(r2 * (-2.0 * std::f32::consts::LOG2_E)) - 0.135_335_28
}
