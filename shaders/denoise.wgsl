// Distances and weights of the denoiser. Non-local means with features: Rousselle, Manzi and Zwicker, "Robust Denoising
// using Feature and Color Information", Computer Graphics Forum 32(7), 2013, section 4.

// Returns the distance of two pixels' colors, in units of their variance: about 0 if the difference is noise. `squared`
// is the squared difference, `p` and `q` are the variances of the means of the pixels. A pixel with little noise limits
// the variance of q, which would otherwise explain any difference.
fn color_distance(squared: f32, p: f32, q: f32, limit: f32) -> f32 {
    return (squared - noise_of(p, q)) / (DENOISE_COLOR_SCALE * (p + min(q, limit)) + DENOISE_MIN_VARIANCE);
}

// Returns the distance of two pixels' features. `scale` is 1 / (tolerated squared difference).
fn feature_distance(squared: f32, p: f32, q: f32, scale: f32) -> f32 {
    return (squared - noise_of(p, q)) * scale;
}

// Returns the part of a squared difference that is due to noise. The smaller variance limits the share of q, so that a
// pixel with little noise is not averaged with pixels of much noise.
fn noise_of(p: f32, q: f32) -> f32 {
    return p + min(p, q);
}

// Returns the weight of a pixel at a distance: about exp(-distance), and 0 from distance 4 on.
fn denoise_weight(distance: f32) -> f32 {
    let x = max(1.0 - 0.25 * distance, 0.0);
    let squared = x * x;
    return squared * squared;
}
