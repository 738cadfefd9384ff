//! A picture as its file has it: channels by name, each in the type of values that the file stores.

mod exr;
mod read;

use std::ops::Range;
use std::sync::Arc;

use ::exr::prelude::f16;

pub use read::Unreadable;

/// What the values of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// What a screen shows, from 0 to 1, in steps of so many bits: PNG, JPEG, WebP.
    Display {
        /// 8 or 16.
        bits: u8,
    },
    /// Numbers without bounds: OpenEXR, Radiance.
    Linear,
}

/// A picture in memory.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Columns, one at least.
    pub width: u32,
    /// Rows, one at least.
    pub height: u32,
    /// The place of the first pixel, where the file tells it.
    pub position: (i32, i32),
    /// What the values mean.
    pub kind: Kind,
    /// The channels in the order of the file. No two have one name, and each has a value for every pixel.
    pub channels: Vec<Channel>,
}

/// A channel of a picture.
#[derive(Clone, Debug)]
pub struct Channel {
    /// `R`, `A`, `normal.X`.
    pub name: String,
    /// The values, which channels of a gray picture share.
    pub plane: Arc<Plane>,
}

/// The values of a channel, row by row from the top.
#[derive(Clone, Debug)]
pub enum Plane {
    /// 255 is 1.
    Bytes(Vec<u8>),
    /// 65,535 is 1.
    Words(Vec<u16>),
    /// Whole numbers as they are.
    Whole(Vec<u32>),
    /// The bits of numbers of half precision.
    Halves(Vec<u16>),
    /// Numbers.
    Floats(Vec<f32>),
    /// 1 for every pixel: the alpha of a picture that has none.
    One,
}

impl Plane {
    /// Writes the values of some pixels, of which the plane has as many as there are places.
    pub fn values(&self, pixels: Range<usize>, to: &mut [f64]) {
        match self {
            Plane::Bytes(values) => copy(&values[pixels], to, |value| f64::from(value) / 255.0),
            Plane::Words(values) => copy(&values[pixels], to, |value| f64::from(value) / 65_535.0),
            Plane::Whole(values) => copy(&values[pixels], to, f64::from),
            Plane::Halves(values) => copy(&values[pixels], to, |value| f64::from(f16::from_bits(value).to_f32())),
            Plane::Floats(values) => copy(&values[pixels], to, f64::from),
            Plane::One => to.fill(1.0),
        }
    }

    /// The value of a pixel.
    pub fn value(&self, pixel: usize) -> f64 {
        let mut value = [0.0];
        self.values(pixel..pixel + 1, &mut value);
        value[0]
    }

    /// Whether two planes of a screen's values have the same ones; where that takes arithmetic it is not found out.
    pub fn is_plainly(&self, other: &Plane, pixels: Range<usize>) -> bool {
        match (self, other) {
            (Plane::Bytes(a), Plane::Bytes(b)) => a[pixels.clone()] == b[pixels],
            (Plane::Words(a), Plane::Words(b)) => a[pixels.clone()] == b[pixels],
            (Plane::One, Plane::One) => true,
            _ => false,
        }
    }
}

fn copy<T: Copy>(from: &[T], to: &mut [f64], value: impl Fn(T) -> f64) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = value(*from);
    }
}

impl Picture {
    /// Its pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The channel of a name.
    pub fn channel(&self, name: &str) -> Option<&Arc<Plane>> {
        let channel = self.channels.iter().find(|channel| channel.name == name)?;
        Some(&channel.plane)
    }

    /// Red, green and blue; those of gray are one plane. None if there are no colours.
    pub fn colors(&self) -> Option<[&Arc<Plane>; 3]> {
        let [r, g, b] = ["R", "G", "B"].map(|name| self.channel(name));
        match (r, g, b, self.channel("Y")) {
            (Some(r), Some(g), Some(b), _) => Some([r, g, b]),
            (None, None, None, Some(y)) => Some([y; 3]),
            _ => None,
        }
    }

    /// What `wgray render` shows of linear values as a PNG of 8 or 16 bits: red, green, blue, and alpha where there is any. None
    /// if there are no colours.
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

    /// The same with alpha: a screen's picture without it covers all.
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

/// A plane as a PNG has it: of colours those by themselves, to the power 1/2.2.
fn displayed(plane: &Plane, alpha: Option<&Arc<Plane>>, pixels: usize, bits: u8, is_color: bool) -> Plane {
    const CHUNK: usize = 4096;
    let (mut values, mut shares) = ([0.0; CHUNK], [1.0; CHUNK]);
    let (mut bytes, mut words) = (Vec::new(), Vec::new());
    for start in (0..pixels).step_by(CHUNK) {
        let count = CHUNK.min(pixels - start);
        plane.values(start..start + count, &mut values[..count]);
        if let Some(alpha) = alpha {
            alpha.values(start..start + count, &mut shares[..count]);
        }
        for (value, share) in values[..count].iter().zip(&shares) {
            // in the 32-bit floats of a render, so that the bytes are those of its PNG
            let (value, share) = (*value as f32, *share as f32);
            let value = match alpha {
                Some(_) if !(share > 0.0) => 0.0,
                Some(_) => value / share,
                None => value,
            };
            let exponent = if is_color { super::colors::DISPLAY } else { 1.0 };
            let shown = f64::from(value.clamp(0.0, 1.0)).powf(exponent);
            // the conversions saturate, and take NaN to 0
            match bits {
                8 => bytes.push((shown * 255.0 + 0.5) as u8),
                _ => words.push((shown * 65_535.0 + 0.5) as u16),
            }
        }
    }
    if bits == 8 {
        Plane::Bytes(bytes)
    } else {
        Plane::Words(words)
    }
}
