// Noise estimates: variance; adaptive sampling: sample counts from neighbors' pilot samples.

// Returns a pixel's moments after a sample; `sum` is the weighted sum before the sample. xyz are sums of squared
// deviations from the mean, w the sample count. Weighted update by Welford ("Note on a Method for Calculating Corrected
// Sums of Squares and Products", Technometrics 4(3), 1962).
fn moments_with(moments: vec4f, sum: vec4f, sample: vec4f) -> vec4f {
    return moments + vec4f(squared_deviation(sum, sample), 1.0);
}

// Returns the increment of the squared deviations, clamped at 0, since weights of mixed sign can make it negative.
fn squared_deviation(sum: vec4f, sample: vec4f) -> vec3f {
    let before = sample.rgb - mean_of(sum) * sample.w;
    let after = sample.rgb - mean_of(sum + sample) * sample.w;
    let product = before * after;
    return select(product, vec3f(0.0), product < vec3f(0.0));
}

// Returns the moments of a layer after a sample. `layer` and `weight_sum` are the weighted sums before the sample,
// `sample` is weighted.
fn layer_moments_with(moments: vec4f, layer: vec4f, weight_sum: f32, sample: vec4f, weight: f32) -> vec4f {
    let before = sample - layer_mean(layer, weight_sum) * weight;
    let after = sample - layer_mean(layer + sample, weight_sum + weight) * weight;
    let product = before * after;
    return moments + select(product, vec4f(0.0), product < vec4f(0.0));
}

fn layer_mean(layer: vec4f, weight_sum: f32) -> vec4f {
    return select(vec4f(0.0), layer / weight_sum, abs(weight_sum) > 0.0);
}

fn mean_of(sum: vec4f) -> vec3f {
    return select(vec3f(0.0), sum.rgb / sum.w, abs(sum.w) > 0.0);
}

// Returns the variance of the mean of independent samples.
fn variance_of_mean(sum: vec4f, moments: vec4f) -> vec3f {
    let n = moments.w;
    let scale = n / ((n - 1.0) * sum.w * sum.w);
    return moments.rgb * scale;
}

// Returns the squared standard error as displayed: the mean over the channels, scaled by the squared slope of the
// display curve x^(1/2.2), x in 0.01..1.
fn display_variance(sum: vec4f, moments: vec4f) -> f32 {
    let mean = mean_of(sum);
    let variance = variance_of_mean(sum, moments);
    let x = variance.x * display_slope_squared(mean.x);
    let y = variance.y * display_slope_squared(mean.y);
    let z = variance.z * display_slope_squared(mean.z);
    return (x + y + z) * 0.33333334;
}

fn display_slope_squared(value: f32) -> f32 {
    let x = min(max(value, 0.01), 1.0);
    let slope = 0.45454547 * power(x, 0.45454547) / x;
    return slope * slope;
}

// Adds a sample to the pilot statistics. A sample contributes the sum of the squared deviations of its channels to y,
// and the square of this sum to z.
fn pilot_add(pilot: vec4f, sum: vec4f, sample: vec4f) -> vec4f {
    let deviation = squared_deviation(sum, sample);
    let total = deviation.x + deviation.y + deviation.z;
    return vec4f(pilot.x, pilot.y + total, pilot.z + total * total, pilot.w);
}

// Completes the pilot statistics: x is the squared standard error as displayed, w the number of pixels.
fn pilot_finish(pilot: vec4f, sum: vec4f, moments: vec4f) -> vec4f {
    return vec4f(display_variance(sum, moments), pilot.y, pilot.z, 1.0);
}

// For noise at edges: returns the sample count that the neighbors' pilot statistics require, from `pilot_samples`
// samples each. Doubles the count until the mean squared error is small enough, as long as the variance is reliable.
// y^2 / z is the effective number of samples behind the variance: about 1 if one outlier causes nearly all of it, and
// the full count if all deviations from the mean are equally large.
fn samples_wanted(pilot_sum: vec4f, pilot_samples: u32, squared_error: f32, max_samples: u32) -> u32 {
    if !(pilot_sum.w > 0.0) | !(squared_error > 0.0) {
        return max_samples;
    }
    let variance = pilot_sum.x / pilot_sum.w * f32(pilot_samples);
    var count = pilot_samples;
    while count < max_samples {
        let is_enough = variance <= squared_error * f32(count);
        let is_reliable = pilot_sum.y * pilot_sum.y >= pilot_sum.z * (EFFECTIVE_SAMPLES_PER_MULTIPLE * (f32(2u * count / pilot_samples) - 1.0));
        if is_enough | !is_reliable {
            break;
        }
        count *= 2u;
    }
    return select(count, max_samples, count > max_samples);
}

// Like `samples_wanted`, for neighboring pixels with similar noise. Samples in proportion to the standard deviation
// minimize the mean squared error of the image (Neyman, "On the Two Different Aspects of the Representative Method",
// Journal of the Royal Statistical Society 97(4), 1934): if the standard error is k times the target, the count is k
// times the pilot samples. The samples after the pilot samples are rounded up to a multiple of `step`.
fn proportional_samples(pilot_sum: vec4f, pilot_samples: u32, step: u32, squared_error: f32, max_samples: u32) -> u32 {
    if !(pilot_sum.w > 0.0) | !(squared_error > 0.0) {
        return max_samples;
    }
    // In multiples of the pilot samples.
    let wanted = sqrt(pilot_sum.x / pilot_sum.w / squared_error) - 1.0;
    if !(wanted > 0.0) {
        return select(pilot_samples, max_samples, pilot_samples > max_samples);
    }
    let limit = pilot_sum.y / pilot_sum.z * pilot_sum.y * MULTIPLES_PER_EFFECTIVE_SAMPLE;
    let steps = select(limit, wanted, wanted < limit) * f32(pilot_samples) / f32(step);
    if steps >= f32(max_samples) {
        return max_samples;
    }
    let whole = u32(select(0.0, steps, steps > 0.0));
    let count = pilot_samples + (whole + select(0u, 1u, f32(whole) < steps)) * step;
    return select(count, max_samples, count > max_samples);
}
