//! Reference images, kept or uploaded by viewers, and error measures of two images.

use std::sync::Arc;

use serde::Serialize;

use super::pixel_values::ScaledImage;
use wgray_image::Pixels;
use wgray_image::color::srgb_to_linear;
use wgray_image::compare::{self, Channel, Kind, PIXELS_PER_DEGREE, Picture, Plane};
use wgray_scene::{ViewSettings, ViewTransform};

/// Maximum number of pixels of an uploaded image, a little more than 7680 x 4320.
const MAX_PIXELS: u64 = 1 << 25;

/// A reference image.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The name of the file, or a description.
    pub name: String,
    /// Linear colors.
    pub pixels: Arc<Pixels>,
}

impl Reference {
    /// Decodes an image file: the values of OpenEXR and Radiance files are linear; for PNG, JPEG and WebP, the curve of
    /// the view transform is inverted.
    ///
    /// # Errors
    ///
    /// A message for the viewer who uploaded the file.
    pub fn decode(name: String, bytes: Vec<u8>, view: ViewSettings) -> Result<Reference, String> {
        let picture = Picture::decode(bytes, MAX_PIXELS).map_err(|error| format!("{name}: {error}"))?;
        let colors = picture
            .colors()
            .ok_or_else(|| format!("{name}: has no color: channels R, G and B, or Y, are required"))?;
        let count = picture.pixels();
        let mut pixels = vec![[0.0; 3]; count];
        let mut values = vec![0.0; count];
        for (i, plane) in colors.into_iter().enumerate() {
            plane.values(0..count, &mut values);
            for (pixel, value) in pixels.iter_mut().zip(&values) {
                pixel[i] = match picture.kind {
                    Kind::Linear => *value,
                    Kind::Display { .. } => to_linear(*value, view.transform),
                } as f32;
            }
        }
        Ok(Reference {
            name,
            pixels: Arc::new(Pixels {
                width: picture.width,
                height: picture.height,
                colors: pixels,
            }),
        })
    }

    /// Returns the width and height.
    pub fn size(&self) -> [u32; 2] {
        [self.pixels.width, self.pixels.height]
    }

    /// Returns the pixels scaled to the displayed `size`; `None` if the size of the reference is not `full_size`.
    pub fn scaled(&self, full_size: [u32; 2], size: [u32; 2]) -> Option<Pixels> {
        if self.size() != full_size {
            return None;
        }
        if size == full_size {
            return Some((*self.pixels).clone());
        }
        let scaled = ScaledImage {
            from: size,
            to: full_size,
        };
        let color = |i: u32| {
            let index = scaled.index(i % size[0], i / size[0])?;
            self.pixels.colors.get(index).copied()
        };
        Some(Pixels {
            width: size[0],
            height: size[1],
            colors: (0..size[0] * size[1]).map(|i| color(i).unwrap_or_default()).collect(),
        })
    }
}

/// Converts a display value to a linear value. For AgX and PBR Neutral, only the sRGB curve can be inverted.
fn to_linear(value: f64, transform: ViewTransform) -> f64 {
    match transform {
        ViewTransform::Gamma22 => value.powf(2.2),
        _ => srgb_to_linear(value),
    }
}

/// Error measures of two images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorMeasures {
    /// The frame that was measured.
    pub frame: u64,
    /// The root mean square error of the linear values; `None` if the error is not finite.
    pub rmse: Option<f64>,
    /// The mean HDR-FLIP error, as in `wgray diff`; `None` if the error is not finite.
    pub flip: Option<f64>,
}

impl ErrorMeasures {
    /// Measures the difference between two images of equal size.
    pub fn of(frame: u64, first: &Pixels, second: &Pixels) -> ErrorMeasures {
        let squares = first.colors.iter().flatten().zip(second.colors.iter().flatten());
        let sum: f64 = squares.map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
        let rmse = (sum / (3.0 * first.colors.len().max(1) as f64)).sqrt();
        let flip = match first == second {
            true => Some(0.0),
            false => compare::flip(&picture(first), &picture(second), PIXELS_PER_DEGREE, None).map(|flip| flip.mean),
        };
        ErrorMeasures {
            frame,
            rmse: Some(rmse).filter(|rmse| rmse.is_finite()),
            flip: flip.filter(|flip| flip.is_finite()),
        }
    }
}

fn picture(pixels: &Pixels) -> Picture {
    let channel = |(name, i): (&str, usize)| Channel {
        name: name.to_owned(),
        plane: Arc::new(Plane::Floats(pixels.colors.iter().map(|color| color[i]).collect())),
    };
    Picture {
        width: pixels.width,
        height: pixels.height,
        position: (0, 0),
        kind: Kind::Linear,
        channels: [("R", 0), ("G", 1), ("B", 2)].map(channel).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgray_render::output as image;

    fn pixels(colors: Vec<[f32; 3]>, width: u32) -> Pixels {
        Pixels {
            width,
            height: colors.len() as u32 / width,
            colors,
        }
    }

    #[test]
    fn a_decoded_png_keeps_its_bytes_and_invalid_files_are_rejected() {
        for transform in [ViewTransform::Gamma22, ViewTransform::Srgb] {
            let view = ViewSettings {
                transform,
                ..ViewSettings::default()
            };
            let colors = [[0.0, 0.001, 0.18], [0.5, 0.75, 1.0]];
            let bytes: Vec<u8> = colors.iter().flat_map(|color| view.rgb8(*color)).collect();
            let file = image::in_memory(2, 1, &bytes).unwrap();
            let reference = Reference::decode("a.png".to_owned(), file, view).unwrap();
            let decoded = reference.pixels.colors.iter();
            let displayed: Vec<u8> = decoded.flat_map(|color| view.rgb8(*color)).collect();
            assert_eq!(displayed, bytes, "{transform:?}");
        }
        let error = Reference::decode("a.png".to_owned(), b"not an image".to_vec(), ViewSettings::default());
        assert!(error.unwrap_err().starts_with("a.png: "));
        let blank = image::in_memory(8193, 4096, &vec![0; 3 * 8193 * 4096]).unwrap();
        let error = Reference::decode("b.png".to_owned(), blank, ViewSettings::default());
        assert_eq!(
            error.unwrap_err(),
            "b.png: has 8193 x 4096 pixels; the limit is 33554432 pixels"
        );
    }

    #[test]
    fn a_reference_only_fits_images_of_its_size() {
        let colors = (0..16).map(|i| [i as f32; 3]).collect();
        let reference = Reference {
            name: "r".to_owned(),
            pixels: Arc::new(pixels(colors, 4)),
        };
        assert_eq!(reference.scaled([4, 4], [4, 4]).unwrap(), *reference.pixels);
        let half = reference.scaled([4, 4], [2, 2]).unwrap();
        assert_eq!(
            half.colors.iter().map(|color| color[0]).collect::<Vec<_>>(),
            [0.0, 2.0, 8.0, 10.0]
        );
        assert!(reference.scaled([4, 5], [4, 5]).is_none());
    }

    #[test]
    fn differences_between_images_are_measured() {
        let a = pixels(vec![[0.5; 3]; 64 * 64], 64);
        let b = pixels(vec![[0.75; 3]; 64 * 64], 64);
        let zero = ErrorMeasures::of(3, &a, &a);
        assert_eq!((zero.frame, zero.rmse, zero.flip), (3, Some(0.0), Some(0.0)));
        let nonzero = ErrorMeasures::of(4, &a, &b);
        assert_eq!(nonzero.rmse, Some(0.25));
        assert!(nonzero.flip.is_some_and(|flip| flip > 0.05), "{nonzero:?}");
        let invalid = pixels(vec![[f32::NAN; 3]; 64 * 64], 64);
        assert_eq!(ErrorMeasures::of(5, &a, &invalid).rmse, None);
    }
}
