//! Twin of `shaders/adaptive.wgsl`.

use glam::{Vec3, Vec4, Vec4Swizzles};

use super::math::{max, min, power};
use crate::film;
use crate::records::{EFFECTIVE_SAMPLES_PER_MULTIPLE, MULTIPLES_PER_EFFECTIVE_SAMPLE};

pub fn moments_with(moments: Vec4, sum: Vec4, sample: Vec4) -> Vec4 {
    moments + squared_deviation(sum, sample).extend(1.0)
}

pub fn squared_deviation(sum: Vec4, sample: Vec4) -> Vec3 {
    let before = sample.xyz() - mean_of(sum) * sample.w;
    let after = sample.xyz() - mean_of(sum + sample) * sample.w;
    let product = before * after;
    Vec3::select(product.cmplt(Vec3::ZERO), Vec3::ZERO, product)
}

pub fn layer_moments_with(moments: Vec4, layer: Vec4, weight_sum: f32, sample: Vec4, weight: f32) -> Vec4 {
    let before = sample - layer_mean(layer, weight_sum) * weight;
    let after = sample - layer_mean(layer + sample, weight_sum + weight) * weight;
    let product = before * after;
    moments + Vec4::select(product.cmplt(Vec4::ZERO), Vec4::ZERO, product)
}

pub fn layer_mean(layer: Vec4, weight_sum: f32) -> Vec4 {
    if weight_sum.abs() > 0.0 {
        layer / weight_sum
    } else {
        Vec4::ZERO
    }
}

pub fn mean_of(sum: Vec4) -> Vec3 {
    if sum.w.abs() > 0.0 {
        sum.xyz() / sum.w
    } else {
        Vec3::ZERO
    }
}

pub fn variance_of_mean(sum: Vec4, moments: Vec4) -> Vec3 {
    film::variance_of_mean(sum, moments)
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

pub fn pilot_add(pilot: Vec4, sum: Vec4, sample: Vec4) -> Vec4 {
    let deviation = squared_deviation(sum, sample);
    let total = deviation.x + deviation.y + deviation.z;
    Vec4::new(pilot.x, pilot.y + total, pilot.z + total * total, pilot.w)
}

pub fn pilot_finish(pilot: Vec4, sum: Vec4, moments: Vec4) -> Vec4 {
    Vec4::new(display_variance(sum, moments), pilot.y, pilot.z, 1.0)
}

pub fn samples_wanted(pilot_sum: Vec4, pilot_samples: u32, squared_error: f32, max_samples: u32) -> u32 {
    // Not `x <= 0.0`, which is false for NaN.
    if !(pilot_sum.w > 0.0) | !(squared_error > 0.0) {
        return max_samples;
    }
    let variance = pilot_sum.x / pilot_sum.w * pilot_samples as f32;
    let mut count = pilot_samples;
    while count < max_samples {
        let is_enough = variance <= squared_error * count as f32;
        let is_reliable = pilot_sum.y * pilot_sum.y
            >= pilot_sum.z * (EFFECTIVE_SAMPLES_PER_MULTIPLE * ((2 * count / pilot_samples) as f32 - 1.0));
        if is_enough | !is_reliable {
            break;
        }
        count *= 2;
    }
    count.min(max_samples)
}

pub fn proportional_samples(
    pilot_sum: Vec4,
    pilot_samples: u32,
    step: u32,
    squared_error: f32,
    max_samples: u32,
) -> u32 {
    // Not `x <= 0.0`, which is false for NaN.
    if !(pilot_sum.w > 0.0) | !(squared_error > 0.0) {
        return max_samples;
    }
    let wanted = (pilot_sum.x / pilot_sum.w / squared_error).sqrt() - 1.0;
    if !(wanted > 0.0) {
        return pilot_samples.min(max_samples);
    }
    let limit = pilot_sum.y / pilot_sum.z * pilot_sum.y * MULTIPLES_PER_EFFECTIVE_SAMPLE;
    let multiple = if wanted < limit { wanted } else { limit };
    let steps = multiple * pilot_samples as f32 / step as f32;
    if steps >= max_samples as f32 {
        return max_samples;
    }
    let whole = if steps > 0.0 { steps as u32 } else { 0 };
    let count = pilot_samples + (whole + u32::from((whole as f32) < steps)) * step;
    count.min(max_samples)
}
