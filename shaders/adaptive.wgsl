// Adaptive sampling: what is known of a pixel's variance, and when its displayed value is known well enough.

// The moments of a pixel after another sample, of which `sum` is the sum before: xyz the sum of squared deviations from
// the mean, w the number of samples. By Welford's update ("Note on a Method for Calculating Corrected Sums of Squares and
// Products", Technometrics 4(3), 1962), for weighted samples.
fn moments_with(moments: vec4f, sum: vec4f, sample: vec4f) -> vec4f {
    let before = sample.rgb - mean_of(sum) * sample.w;
    let after = sample.rgb - mean_of(sum + sample) * sample.w;
    return moments + vec4f(before * after, 1.0);
}

fn mean_of(sum: vec4f) -> vec3f {
    return select(sum.rgb / sum.w, vec3f(0.0), sum.w == 0.0);
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
