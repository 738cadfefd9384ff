//! Conversion of pixel values: films to images, and values to text and bytes.

use glam::Vec3;
use rayon::prelude::*;
use wgray_image::Pixels;
use wgray_trace::film::{Film, mean};

/// Returns the mean colors of a film. Rows without samples show `coarser`, a film of lower resolution.
pub fn means(film: &Film, coarser: Option<&Film>, has_samples: &(dyn Fn(u32) -> bool + Sync)) -> Pixels {
    Pixels {
        width: film.region.width(),
        height: film.region.height(),
        colors: film_values(film, coarser, has_samples, &|film, i| mean(film.sums[i])),
    }
}

/// Returns one value per pixel of a film. In rows without samples, the values come from a film of lower resolution.
pub(super) fn film_values<T: Default + Send>(
    film: &Film,
    coarser: Option<&Film>,
    has_samples: &(dyn Fn(u32) -> bool + Sync),
    value: &(dyn Fn(&Film, usize) -> T + Sync),
) -> Vec<T> {
    let size = |film: &Film| [film.region.width(), film.region.height()];
    let from = size(film);
    let pixels = (0..film.sums.len()).into_par_iter().with_min_len(1024);
    let pixel_value = |i: usize| match coarser {
        Some(coarser) if !has_samples(i as u32 / from[0]) => {
            let scaled = ScaledImage {
                from,
                to: size(coarser),
            };
            scaled
                .index(i as u32 % from[0], i as u32 / from[0])
                .map_or_else(T::default, |i| value(coarser, i))
        }
        _ => value(film, i),
    };
    pixels.map(pixel_value).collect()
}

/// Maps the pixels of an image to the pixels of a resized version.
pub(super) struct ScaledImage {
    pub from: [u32; 2],
    pub to: [u32; 2],
}

impl ScaledImage {
    /// Returns the index of the resized image's pixel for pixel (x, y); `None` outside the image.
    pub fn index(&self, x: u32, y: u32) -> Option<usize> {
        let scaled = |x: u32, i: usize| {
            (x < self.from[i]).then(|| u64::from(x) * u64::from(self.to[i]) / u64::from(self.from[i]))
        };
        Some((scaled(y, 1)? * u64::from(self.to[0]) + scaled(x, 0)?) as usize)
    }
}

pub(super) fn numbers<const N: usize>(values: [f32; N]) -> String {
    values.map(|v| format!("{v}")).join("  ")
}

/// Formats the bits of floats in hexadecimal.
pub(super) fn bits<const N: usize>(values: [f32; N]) -> String {
    values.map(|v| format!("{:08x}", v.to_bits())).join("  ")
}

/// Converts display colors, 0 to 1, to bytes.
pub(super) fn bytes<T: Sync>(pixels: &[T], color: impl Fn(&T) -> Vec3 + Sync) -> Vec<u8> {
    let byte = |v: f32| (v * 255.0 + 0.5) as u8; // saturates
    pixels
        .par_iter()
        .with_min_len(1024)
        .flat_map_iter(|pixel| color(pixel).to_array().map(byte))
        .collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec4;
    use wgray_image::Region;

    use super::*;

    #[test]
    fn rows_without_samples_show_the_coarser_film() {
        let mut coarser = Film::new(Region::whole(1, 1));
        coarser.sums[0] = Vec4::new(1.0, 0.0, 0.0, 1.0);
        let mut film = Film::new(Region::whole(1, 2));
        film.sums[0] = Vec4::new(0.0, 2.0, 4.0, 2.0);
        assert_eq!(
            means(&film, Some(&coarser), &|y| y < 1).colors,
            [[0.0, 1.0, 2.0], [1.0, 0.0, 0.0]]
        );
        assert_eq!(means(&film, None, &|y| y < 1).colors[1], [0.0; 3]);
    }
}
