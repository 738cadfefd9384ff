//! Twin of `shaders/adaptive.wgsl`: what is known of a pixel's variance, and when its displayed value is known well enough.

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::math::{max, min, power};

pub fn moments_with(moments: Vec4, sum: Vec4, sample: Vec4) -> Vec4 {
    let before = sample.xyz() - mean_of(sum) * sample.w;
    let after = sample.xyz() - mean_of(sum + sample) * sample.w;
    moments + (before * after).extend(1.0)
}

pub fn mean_of(sum: Vec4) -> Vec3 {
    if sum.w == 0.0 { Vec3::ZERO } else { sum.xyz() / sum.w }
}

pub fn variance_of_mean(sum: Vec4, moments: Vec4) -> Vec3 {
    let n = moments.w;
    let scale = n / ((n - 1.0) * sum.w * sum.w);
    moments.xyz() * scale
}

pub fn display_variance(sum: Vec4, moments: Vec4) -> f32 {
    let mean = mean_of(sum);
    let variance = variance_of_mean(sum, moments);
    let x = variance.x * display_slope_squared(mean.x);
    let y = variance.y * display_slope_squared(mean.y);
    let z = variance.z * display_slope_squared(mean.z);
    (x + y + z) * 0.333_333_34
}

pub fn display_slope_squared(value: f32) -> f32 {
    let x = min(max(value, 0.01), 1.0);
    let slope = 0.454_545_47 * power(x, 0.454_545_47) / x;
    slope * slope
}
