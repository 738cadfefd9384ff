//! Twin of `shaders/filter.wgsl`.

use super::math::max;

pub fn filter_bin(u: f32, bins: u32) -> u32 {
    let bin = max((2.0 * u - 1.0).abs() * bins as f32, 0.0) as u32;
    if bin < bins { bin } else { bins - 1 }
}

pub fn filter_offset(u: f32, bin: u32, bins: u32, low: f32, high: f32) -> f32 {
    let v = 2.0 * u - 1.0;
    let distance = low + (high - low) * (v.abs() * bins as f32 - bin as f32);
    if v < 0.0 { -distance } else { distance }
}
