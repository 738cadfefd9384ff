//! Converts the colors of two images for the perceptual metrics.

use std::ops::Range;

use super::picture::{Kind, Picture, Plane};

/// Exponent of the curve that encodes linear values for display.
pub const DISPLAY: f64 = 1.0 / 2.2;

/// Red, green and blue of a range of pixels.
pub type Rgb = [Vec<f64>; 3];

/// The colors of two images of the same size and kind.
#[derive(Clone, Debug)]
pub struct Colors<'a> {
    pub width: usize,
    pub height: usize,
    pub kind: Kind,
    a: Planes<'a>,
    b: Planes<'a>,
}

#[derive(Clone, Debug)]
struct Planes<'a> {
    colors: [&'a Plane; 3],
    /// Straight alpha.
    alpha: Option<&'a Plane>,
}

impl<'a> Planes<'a> {
    fn of(picture: &'a Picture) -> Option<Planes<'a>> {
        let colors = picture.colors()?.map(|plane| &**plane);
        let alpha = match picture.kind {
            Kind::Display { .. } => picture.channel("A").map(|plane| &**plane),
            Kind::Linear => None,
        };
        Some(Planes { colors, alpha })
    }

    fn values(&self, pixels: Range<usize>) -> Rgb {
        let mut alphas = vec![1.0; pixels.len()];
        if let Some(alpha) = self.alpha {
            alpha.values(pixels.clone(), &mut alphas);
        }
        self.colors.map(|plane| {
            let mut values = vec![0.0; pixels.len()];
            plane.values(pixels.clone(), &mut values);
            for (value, alpha) in values.iter_mut().zip(&alphas) {
                *value *= alpha;
            }
            values
        })
    }
}

impl<'a> Colors<'a> {
    /// Returns the colors of two images; `None` if either image has no colors.
    pub fn of(a: &'a Picture, b: &'a Picture) -> Option<Colors<'a>> {
        Some(Colors {
            width: b.width as usize,
            height: b.height as usize,
            kind: b.kind,
            a: Planes::of(a)?,
            b: Planes::of(b)?,
        })
    }

    /// Returns part of a row of both images, composited over black. Linear values that are non-finite in either image
    /// are replaced by 0 in both images.
    pub fn values(&self, y: usize, x: Range<usize>) -> (Rgb, Rgb) {
        let pixels = y * self.width + x.start..y * self.width + x.end;
        let (mut a, mut b) = (self.a.values(pixels.clone()), self.b.values(pixels));
        if self.kind == Kind::Linear {
            for (a, b) in a.iter_mut().flatten().zip(b.iter_mut().flatten()) {
                if !(a.is_finite() && b.is_finite()) {
                    (*a, *b) = (0.0, 0.0);
                }
            }
        }
        (a, b)
    }

    /// Like [`Self::values`], but encoded for display, 0 to 1.
    pub fn display_values(&self, y: usize, x: Range<usize>) -> (Rgb, Rgb) {
        let (mut a, mut b) = self.values(y, x);
        if self.kind == Kind::Linear {
            for value in a.iter_mut().chain(&mut b).flatten() {
                *value = value.clamp(0.0, 1.0).powf(DISPLAY);
            }
        }
        (a, b)
    }

    /// Returns [`Plane::stores_same_integers`] for all channels.
    pub fn stores_same_integers(&self, y: usize, x: Range<usize>) -> bool {
        let pixels = y * self.width + x.start..y * self.width + x.end;
        let mut planes = self.a.colors.iter().zip(&self.b.colors);
        let same_alpha = match (self.a.alpha, self.b.alpha) {
            (None, None) => true,
            (Some(a), Some(b)) => a.stores_same_integers(b, pixels.clone()),
            _ => false,
        };
        same_alpha && planes.all(|(a, b)| a.stores_same_integers(b, pixels.clone()))
    }
}
