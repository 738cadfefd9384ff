// Reconstruction filters by importance sampling: samples lie where the filter is large and have its sign as weight, so
// that a pixel needs no samples of its neighbours. Ernst, Stamminger and Greiner, "Filter Importance Sampling", IEEE
// Symposium on Interactive Ray Tracing, 2006. `crates/render/src/pack/filter.rs` makes the table of a filter's bins.

// The bin of a uniform number: bins go from the pixel's centre outwards, the same to both sides.
fn filter_bin(u: f32, bins: u32) -> u32 {
    let bin = u32(max(abs(2.0 * u - 1.0) * f32(bins), 0.0)); // not a number: 0
    return select(bins - 1u, bin, bin < bins);
}

// How far from the centre the uniform number is, in its bin from `low` to `high`.
fn filter_offset(u: f32, bin: u32, bins: u32, low: f32, high: f32) -> f32 {
    let v = 2.0 * u - 1.0;
    let distance = low + (high - low) * (abs(v) * f32(bins) - f32(bin));
    return select(distance, -distance, v < 0.0);
}
