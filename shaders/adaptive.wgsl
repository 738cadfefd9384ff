// Adaptive sampling: what is known of a pixel's variance, and how many samples it gets by what its neighbours are like.

// The moments of a pixel after another sample, of which `sum` is the sum before: xyz the sum of squared deviations from
// the mean, w the number of samples. By Welford's update ("Note on a Method for Calculating Corrected Sums of Squares and
// Products", Technometrics 4(3), 1962), for weighted samples.
fn moments_with(moments: vec4f, sum: vec4f, sample: vec4f) -> vec4f {
    return moments + vec4f(squared_deviation(sum, sample), 1.0);
}

// What a sample adds to the sum of squared deviations; not below 0, which weights of either sign would make of it.
fn squared_deviation(sum: vec4f, sample: vec4f) -> vec3f {
    let before = sample.rgb - mean_of(sum) * sample.w;
    let after = sample.rgb - mean_of(sum + sample) * sample.w;
    let product = before * after;
    return select(product, vec3f(0.0), product < vec3f(0.0));
}

fn mean_of(sum: vec4f) -> vec3f {
    return select(vec3f(0.0), sum.rgb / sum.w, abs(sum.w) > 0.0);
}

// The variance of a pixel's value, if its samples were independent.
fn variance_of_mean(sum: vec4f, moments: vec4f) -> vec3f {
    let n = moments.w;
    let scale = n / ((n - 1.0) * sum.w * sum.w);
    return moments.rgb * scale;
}

// The square of a pixel's standard error as displayed: the mean over the channels, each magnified by the slope of the
// display curve, x to the power 1/2.2, where x is from 0.01 to 1.
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

// A first look at a pixel after another sample: y the sum over samples and channels of squared deviations, z the sum
// over samples of their squares.
fn pilot_add(shading: vec4f, sum: vec4f, sample: vec4f) -> vec4f {
    let deviation = squared_deviation(sum, sample);
    let total = deviation.x + deviation.y + deviation.z;
    return vec4f(shading.x, shading.y + total, shading.z + total * total, shading.w);
}

// A first look at its end: x the square of the standard error that the pixel then has as displayed, w one pixel.
fn pilot_finish(shading: vec4f, sum: vec4f, moments: vec4f) -> vec4f {
    return vec4f(display_variance(sum, moments), shading.y, shading.z, 1.0);
}

// The samples of a pixel, at most so many, by the sum of its neighbours' first looks of `first` samples each: twice as
// many until their mean square error would be small enough, as far as there is evidence for it. y y / z is the number
// of samples that the estimate rests on: one where a single sample differs, all of them where half do.
fn samples_wanted(looks: vec4f, first: u32, squared_error: f32, most: u32) -> u32 {
    if !(looks.w > 0.0) | !(squared_error > 0.0) {
        return most;
    }
    let variance = looks.x / looks.w * f32(first);
    var count = first;
    while count < most {
        let enough = variance <= squared_error * f32(count);
        let evident = looks.y * looks.y >= looks.z * (EFFECTIVE_SAMPLES_PER_DOUBLING * (f32(2u * count / first) - 1.0));
        if enough | !evident {
            break;
        }
        count *= 2u;
    }
    return select(count, most, count > most);
}
