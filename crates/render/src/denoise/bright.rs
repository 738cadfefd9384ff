//! Pixels that are too bright to be averaged. Their variance explains any difference, so that every pixel around would get
//! an equal part of their light.

use glam::Vec3;

use super::window::{box_means, window};
use wgray_trace::film::{Film, mean};
use wgray_trace::records::{DENOISE_PATCH_RADIUS, DENOISE_RADIUS};

/// A pixel is bright from this binary logarithm of its ratio to the geometric mean of the pixels around it. With lower
/// values, some fireflies would stay; with higher values, visible emitters and highlights would brighten the pixels around
/// them.
const BRIGHT_EXCESS: f32 = 5.0;
/// The same for pixels near a bright pixel, because the reconstruction filter mixes its light with that of its neighbors.
const EDGE_EXCESS: f32 = 3.0;

/// Returns for each pixel whether it is much brighter than the pixels around it, or at the edge of such a pixel.
/// `is_known` returns false for pixels without a color.
pub fn bright_pixels(film: &Film, is_known: impl Fn(usize) -> bool) -> Vec<bool> {
    let (width, count) = (film.region.width() as usize, film.sums.len());
    let value = |i: usize| Vec3::from(mean(film.sums[i])).max_element();
    // Black pixels do not reveal the exposure.
    let is_visible = |i: usize| is_known(i) && value(i) > 0.0;
    let visible: Vec<f32> = (0..count).map(|i| f32::from(u8::from(is_visible(i)))).collect();
    let levels: Vec<f32> = (0..count)
        .map(|i| if is_visible(i) { level(value(i)) } else { 0.0 })
        .collect();
    let [level_means, visible_means] =
        [&levels, &visible].map(|values| box_means(values, width, DENOISE_RADIUS as usize));
    let excess = |i: usize| {
        if is_visible(i) {
            levels[i] - level_means[i] / visible_means[i]
        } else {
            0.0
        }
    };
    let is_bright = |i: usize| {
        excess(i) > EDGE_EXCESS
            && window(i, width, count, DENOISE_PATCH_RADIUS as usize).any(|j| excess(j) > BRIGHT_EXCESS)
    };
    (0..count).map(is_bright).collect()
}

/// Returns an approximate binary logarithm, linear between powers of two. It is computed from the bits of the number, so
/// that all machines agree.
fn level(value: f32) -> f32 {
    let exponent_bias = 1.0_f32.to_bits() as i32;
    (value.to_bits() as i32 - exponent_bias) as f32 / (1 << (f32::MANTISSA_DIGITS - 1)) as f32
}
