//! The transfer function of sRGB (IEC 61966-2-1:1999, sections 5.2 and 5.3). `cpu/texel.rs` has that of the kernels, in
//! 32 bits.

/// Returns the linear value of an encoded one, both from 0 to 1.
pub fn srgb_to_linear(x: f64) -> f64 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

/// Returns the encoded value of a linear one, both from 0 to 1.
pub fn linear_to_srgb(x: f64) -> f64 {
    if x <= 0.003_130_8 {
        x * 12.92
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}
