//! Per-value comparison of two images.

use super::Pixels;

/// Differences between two images of the same size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Pixels that are not bit-identical; signed zeros and NaN payloads differ.
    pub unequal: usize,
    /// Largest difference between two values; NaN if any difference is NaN.
    pub largest: f32,
    /// Pixels with a difference that exceeds the tolerance or is NaN.
    pub beyond: usize,
}

/// Compares two images value by value; `None` if their sizes differ.
pub fn difference(a: &Pixels, b: &Pixels, tolerance: f32) -> Option<Difference> {
    if (a.width, a.height) != (b.width, b.height) {
        return None;
    }
    let mut result = Difference {
        unequal: 0,
        largest: 0.0,
        beyond: 0,
    };
    for (a, b) in a.colors.iter().zip(&b.colors) {
        result.unequal += usize::from(a.map(f32::to_bits) != b.map(f32::to_bits));
        let mut is_beyond = false;
        for (a, b) in a.iter().zip(b) {
            let difference = if a.to_bits() == b.to_bits() { 0.0 } else { (a - b).abs() };
            is_beyond |= !(difference <= tolerance);
            result.largest = if difference.is_nan() || result.largest.is_nan() {
                f32::NAN
            } else {
                result.largest.max(difference)
            };
        }
        result.beyond += usize::from(is_beyond);
    }
    Some(result)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(colors: &[[f32; 3]]) -> Pixels {
        Pixels {
            width: colors.len() as u32,
            height: 1,
            colors: colors.to_vec(),
        }
    }

    #[test]
    fn differences_are_counted_and_measured() {
        let a = pixels(&[[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [0.0; 3]]);
        let no_difference = Difference {
            unequal: 0,
            largest: 0.0,
            beyond: 0,
        };
        assert_eq!(difference(&a, &a, 0.0), Some(no_difference));
        let b = pixels(&[[0.0, 1.0, 2.5], [3.0, 4.0, 5.0], [-0.0, 0.0, 0.25]]);
        let expected = Difference {
            unequal: 2,
            largest: 0.5,
            beyond: 1,
        };
        assert_eq!(difference(&a, &b, 0.25), Some(expected));
    }

    #[test]
    fn nan_exceeds_every_tolerance_unless_the_bits_are_equal() {
        let (a, b) = (pixels(&[[0.0; 3]]), pixels(&[[f32::NAN, 0.0, 0.0]]));
        let result = difference(&a, &b, f32::MAX).unwrap();
        assert_eq!((result.unequal, result.beyond), (1, 1));
        assert!(result.largest.is_nan());
        assert_eq!(
            difference(&b, &b, 0.0).unwrap().beyond,
            0,
            "equal NaN bits count as different"
        );
    }

    #[test]
    fn images_of_different_sizes_have_no_difference() {
        assert_eq!(difference(&pixels(&[[0.0; 3]]), &pixels(&[]), 1.0), None);
    }
}
