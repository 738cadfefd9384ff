//! A decoded image: named channels, each in the value type of the file.

#[cfg_attr(not(feature = "formats"), path = "no_exr.rs")]
mod exr;
mod read;

use std::ops::Range;
use std::sync::Arc;

pub use read::Unreadable;

/// Interpretation of the values of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Values encoded for display, 0 to 1: PNG, JPEG, WebP.
    Display {
        /// Bits per value: 8 or 16.
        bits: u8,
    },
    /// Unbounded linear values: OpenEXR, Radiance.
    Linear,
}

/// An image in memory.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Number of columns, at least 1.
    pub width: u32,
    /// Number of rows, at least 1.
    pub height: u32,
    /// Position of the first pixel; (0, 0) unless the file specifies it.
    pub position: (i32, i32),
    /// Interpretation of the values.
    pub kind: Kind,
    /// Channels in file order, with unique names and a value for each pixel.
    pub channels: Vec<Channel>,
}

/// A named channel.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Name, such as `R`, `A` or `normal.X`.
    pub name: String,
    /// Values; the channels of a gray image share a plane.
    pub plane: Arc<Plane>,
}

/// Values of a channel in row-major order, top row first.
#[derive(Clone, Debug)]
pub enum Plane {
    /// 8-bit integers; 255 is 1.
    Bytes(Vec<u8>),
    /// 16-bit integers; 65,535 is 1.
    Shorts(Vec<u16>),
    /// 32-bit integers, unscaled.
    Integers(Vec<u32>),
    /// Bits of half-precision floats.
    Halves(Vec<u16>),
    /// Single-precision floats.
    Floats(Vec<f32>),
    /// 1 for each pixel: alpha of an image without an alpha channel.
    One,
}

impl Plane {
    /// Copies the values of a range of pixels to `output`, which must have the same length.
    pub fn values(&self, pixels: Range<usize>, output: &mut [f64]) {
        match self {
            Plane::Bytes(values) => copy(&values[pixels], output, |value| f64::from(value) / 255.0),
            Plane::Shorts(values) => copy(&values[pixels], output, |value| f64::from(value) / 65_535.0),
            Plane::Integers(values) => copy(&values[pixels], output, f64::from),
            Plane::Halves(values) => copy(&values[pixels], output, |value| f64::from(half_to_f32(value))),
            Plane::Floats(values) => copy(&values[pixels], output, f64::from),
            Plane::One => output.fill(1.0),
        }
    }

    /// Returns the value of a pixel.
    pub fn value(&self, pixel: usize) -> f64 {
        let mut value = [0.0];
        self.values(pixel..pixel + 1, &mut value);
        value[0]
    }

    /// Returns true if both planes store equal integers in these pixels. Always returns false for floats and for planes
    /// of different types.
    pub fn stores_same_integers(&self, other: &Plane, pixels: Range<usize>) -> bool {
        match (self, other) {
            (Plane::Bytes(a), Plane::Bytes(b)) => a[pixels.clone()] == b[pixels],
            (Plane::Shorts(a), Plane::Shorts(b)) => a[pixels.clone()] == b[pixels],
            (Plane::One, Plane::One) => true,
            _ => false,
        }
    }
}

/// Converts the bits of a half-precision float (IEEE 754 binary16), exactly.
fn half_to_f32(bits: u16) -> f32 {
    /// 2 to the difference of the exponent biases.
    const SCALE: f32 = f32::from_bits((127 + 127 - 15) << 23);
    let is_finite = bits & 0x7c00 != 0x7c00;
    let magnitude = u32::from(bits & 0x7fff) << 13;
    let sign = u32::from(bits >> 15) << 31;
    match is_finite {
        true => f32::from_bits(sign | magnitude) * SCALE,
        false => f32::from_bits(sign | magnitude | 0x7f80_0000),
    }
}

fn copy<T: Copy>(from: &[T], to: &mut [f64], value: impl Fn(T) -> f64) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = value(*from);
    }
}

impl Picture {
    /// Returns the number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Returns the channel with this name.
    pub fn channel(&self, name: &str) -> Option<&Arc<Plane>> {
        let channel = self.channels.iter().find(|channel| channel.name == name)?;
        Some(&channel.plane)
    }

    /// Returns red, green and blue, which are the same plane in gray images. `None` if the image has no colors.
    pub fn colors(&self) -> Option<[&Arc<Plane>; 3]> {
        let [r, g, b] = ["R", "G", "B"].map(|name| self.channel(name));
        match (r, g, b, self.channel("Y")) {
            (Some(r), Some(g), Some(b), _) => Some([r, g, b]),
            (None, None, None, Some(y)) => Some([y; 3]),
            _ => None,
        }
    }

    /// Converts linear values to the PNG of 8 or 16 `bits` that `wgray render` writes; `None` if the image has no
    /// colors.
    pub fn displayed(&self, bits: u8) -> Option<Picture> {
        let colors = self.colors()?;
        let alpha = self.channel("A");
        let mut channels = Vec::new();
        for (name, plane) in ["R", "G", "B"].into_iter().zip(colors) {
            channels.push((name, displayed(plane, alpha, self.pixels(), bits, true)));
        }
        if let Some(alpha) = alpha {
            channels.push(("A", displayed(alpha, None, self.pixels(), bits, false)));
        }
        Some(Picture {
            kind: Kind::Display { bits },
            channels: channels
                .into_iter()
                .map(|(name, plane)| Channel {
                    name: name.to_owned(),
                    plane: Arc::new(plane),
                })
                .collect(),
            ..*self
        })
    }

    /// Adds an opaque alpha channel if the image has none.
    pub fn with_alpha(mut self) -> Picture {
        if self.channel("A").is_none() {
            self.channels.push(Channel {
                name: "A".to_owned(),
                plane: Arc::new(Plane::One),
            });
        }
        self
    }
}

/// Encodes a plane as `wgray render` does for a PNG: colors are divided by alpha and gamma-encoded (1/2.2).
fn displayed(plane: &Plane, alpha: Option<&Arc<Plane>>, pixels: usize, bits: u8, is_color: bool) -> Plane {
    const CHUNK: usize = 4096;
    let (mut values, mut alphas) = ([0.0; CHUNK], [1.0; CHUNK]);
    let (mut bytes, mut words) = (Vec::new(), Vec::new());
    for start in (0..pixels).step_by(CHUNK) {
        let count = CHUNK.min(pixels - start);
        plane.values(start..start + count, &mut values[..count]);
        if let Some(alpha) = alpha {
            alpha.values(start..start + count, &mut alphas[..count]);
        }
        for (value, alpha_value) in values[..count].iter().zip(&alphas) {
            // Uses `f32`, like the PNG encoder of a render, so that the bytes are equal.
            let (value, alpha_value) = (*value as f32, *alpha_value as f32);
            let value = match alpha {
                Some(_) if !(alpha_value > 0.0) => 0.0,
                Some(_) => value / alpha_value,
                None => value,
            };
            let exponent = if is_color { super::colors::DISPLAY } else { 1.0 };
            let shown = f64::from(value.clamp(0.0, 1.0)).powf(exponent);
            // The casts saturate and map NaN to 0.
            match bits {
                8 => bytes.push((shown * 255.0 + 0.5) as u8),
                _ => words.push((shown * 65_535.0 + 0.5) as u16),
            }
        }
    }
    if bits == 8 {
        Plane::Bytes(bytes)
    } else {
        Plane::Shorts(words)
    }
}

#[cfg(all(test, feature = "formats"))]
mod tests {
    use super::half_to_f32;

    #[test]
    fn half_precision_floats_are_converted_exactly() {
        for bits in 0..=u16::MAX {
            let expected = ::exr::prelude::f16::from_bits(bits).to_f32();
            let value = half_to_f32(bits);
            assert!(
                value.to_bits() == expected.to_bits() || value.is_nan() && expected.is_nan(),
                "{bits}"
            );
        }
        assert_eq!(half_to_f32(0xc000), -2.0);
    }
}
