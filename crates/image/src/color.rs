//! The transfer function of sRGB (IEC 61966-2-1:1999, sections 5.2 and 5.3). The 32-bit version of the kernels is in
//! `cpu/texel.rs` of wgray-render.

/// Converts an sRGB-encoded value to a linear value; both are in 0 ... 1.
pub fn srgb_to_linear(x: f64) -> f64 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

/// Converts a linear value to an sRGB-encoded value; both are in 0 ... 1.
pub fn linear_to_srgb(x: f64) -> f64 {
    if x <= 0.003_130_8 {
        x * 12.92
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}
