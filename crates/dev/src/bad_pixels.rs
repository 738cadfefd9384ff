//! Invalid pixels (NaN, infinite or negative), which would be displayed as black or white: counts and marks.

use rayon::prelude::*;
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadPixel {
    Nan,
    Infinite,
    Negative,
}

impl BadPixel {
    /// Returns the worst kind of invalid value among `values`; `None` if all values are valid.
    pub fn of(values: &[f32]) -> Option<BadPixel> {
        let kinds = [
            (BadPixel::Nan, values.iter().any(|v| v.is_nan())),
            (BadPixel::Infinite, values.iter().any(|v| v.is_infinite())),
            (BadPixel::Negative, values.iter().any(|v| *v < 0.0)),
        ];
        kinds.into_iter().find(|(_, found)| *found).map(|(kind, _)| kind)
    }

    pub fn color(self) -> [u8; 3] {
        match self {
            BadPixel::Nan => [255, 0, 255],
            BadPixel::Infinite => [0, 255, 255],
            BadPixel::Negative => [0, 255, 0],
        }
    }
}

/// Tiles along each side of an image; one invalid pixel per tile is listed.
const TILES_PER_SIDE: usize = 8;

/// The numbers of invalid pixels of an image.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct BadPixels {
    /// Number of pixels with a NaN.
    pub nan: usize,
    /// Number of pixels with an infinite value but no NaN.
    pub infinite: usize,
    /// Number of pixels with a negative value but no NaN and no infinite value.
    pub negative: usize,
    /// The locations of invalid pixels, at most one per tile.
    pub places: Vec<[u32; 2]>,
}

impl BadPixels {
    /// Counts the invalid pixels of an image with this width. `faults` is in row-major order, top row first.
    pub fn count(faults: &[Option<BadPixel>], width: u32) -> BadPixels {
        let width = width as usize;
        let height = faults.len().div_ceil(width.max(1));
        let mut counts = BadPixels::default();
        let mut listed = [false; TILES_PER_SIDE * TILES_PER_SIDE];
        for (i, fault) in faults.iter().enumerate() {
            match fault {
                None => continue,
                Some(BadPixel::Nan) => counts.nan += 1,
                Some(BadPixel::Infinite) => counts.infinite += 1,
                Some(BadPixel::Negative) => counts.negative += 1,
            }
            let (x, y) = (i % width, i / width);
            let is_listed = &mut listed[y * TILES_PER_SIDE / height * TILES_PER_SIDE + x * TILES_PER_SIDE / width];
            if !std::mem::replace(is_listed, true) {
                counts.places.push([x as u32, y as u32]);
            }
        }
        counts
    }
}

/// Returns the kind of each invalid pixel. `allow_negative` accepts negative values, which pixel filters with negative
/// lobes produce.
pub fn faults<T: Sync, const N: usize>(
    pixels: &[T],
    allow_negative: bool,
    values: impl Fn(&T) -> [f32; N] + Sync,
) -> Vec<Option<BadPixel>> {
    let fault =
        |pixel: &T| BadPixel::of(&values(pixel)).filter(|fault| !(allow_negative && *fault == BadPixel::Negative));
    pixels.par_iter().with_min_len(1024).map(fault).collect()
}

/// Marks the invalid pixels in the RGB bytes of an image.
pub fn mark(rgb: &mut [u8], faults: &[Option<BadPixel>]) {
    for (pixel, fault) in rgb.chunks_exact_mut(3).zip(faults) {
        if let Some(fault) = fault {
            pixel.copy_from_slice(&fault.color());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_kind_of_value_in_a_pixel_is_reported() {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        for (values, fault) in [
            ([0.0, -0.0, f32::MAX], None),
            ([0.0, 1.0, -1e-45], Some(BadPixel::Negative)),
            ([-1.0, inf, 0.0], Some(BadPixel::Infinite)),
            ([-inf, 0.0, 0.0], Some(BadPixel::Infinite)),
            ([-inf, 0.0, nan], Some(BadPixel::Nan)),
        ] {
            assert_eq!(BadPixel::of(&values), fault, "{values:?}");
        }
    }

    #[test]
    fn faults_are_counted_and_marked() {
        let pixels = [[0.5; 3], [f32::NAN; 3], [f32::INFINITY; 3], [-1.0; 3]];
        let found = faults(&pixels, false, |color| *color);
        let counts = BadPixels::count(&found, 2);
        assert_eq!((counts.nan, counts.infinite, counts.negative), (1, 1, 1));
        assert_eq!(counts.places, [[1, 0], [0, 1], [1, 1]]);
        let mut rgb = [7; 12];
        mark(&mut rgb, &found);
        assert_eq!(rgb, [7, 7, 7, 255, 0, 255, 0, 255, 255, 0, 255, 0]);
        let without_negative = faults(&pixels, true, |color| *color);
        assert_eq!(BadPixels::count(&without_negative, 4).negative, 0);
        let mut many = [Some(BadPixel::Negative); 1000];
        let counts = BadPixels::count(&many, 10);
        assert_eq!(
            (counts.negative, counts.places.len()),
            (1000, TILES_PER_SIDE * TILES_PER_SIDE)
        );
        many[10..].fill(None);
        many[999] = Some(BadPixel::Nan);
        let counts = BadPixels::count(&many, 10);
        assert!(counts.places.contains(&[9, 99]), "an isolated invalid pixel is missing");
    }
}
