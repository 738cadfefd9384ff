//! Twin of `shaders/denoise.wgsl`.

use super::lanes::{Real, constant};
use super::math::{max, min};
use crate::records::{DENOISE_COLOR_SCALE, DENOISE_MIN_VARIANCE};

#[inline(always)]
pub fn color_distance<F: Real>(squared: F, p: F, q: F, limit: F) -> F {
    (squared - noise_of(p, q)) / (constant(DENOISE_COLOR_SCALE) * (p + min(q, limit)) + DENOISE_MIN_VARIANCE)
}

#[inline(always)]
pub fn feature_distance<F: Real>(squared: F, p: F, q: F, scale: F) -> F {
    (squared - noise_of(p, q)) * scale
}

#[inline(always)]
pub fn noise_of<F: Real>(p: F, q: F) -> F {
    p + min(p, q)
}

#[inline(always)]
pub fn denoise_weight<F: Real>(distance: F) -> F {
    let x = max(constant(1.0) - constant(0.25) * distance, distance.splat(0.0));
    let squared = x * x;
    squared * squared
}
