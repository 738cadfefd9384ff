// Reconstruction filters by importance sampling: samples follow the filter's magnitude and are weighted by the filter's
// sign, so that a pixel needs no samples of neighboring pixels. Ernst, Stamminger and Greiner, "Filter Importance
// Sampling", IEEE Symposium on Interactive Ray Tracing, 2006. `crates/render/src/pack/filter.rs` builds the bins.

// Returns the bin of a uniform number. Bins run symmetrically outwards from the center.
fn filter_bin(u: f32, bins: u32) -> u32 {
    let bin = u32(max(abs(2.0 * u - 1.0) * f32(bins), 0.0)); // NaN: 0
    return select(bins - 1u, bin, bin < bins);
}

// Returns the offset of a uniform number in its bin `low..high`.
fn filter_offset(u: f32, bin: u32, bins: u32, low: f32, high: f32) -> f32 {
    let v = 2.0 * u - 1.0;
    let distance = low + (high - low) * (abs(v) * f32(bins) - f32(bin));
    return select(distance, -distance, v < 0.0);
}
