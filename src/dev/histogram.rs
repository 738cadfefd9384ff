//! How bright the pixels of a picture are.

use rayon::prelude::*;
use serde::Serialize;

/// The exponents that are counted: 2^-12 up to 2^8. What is darker or brighter is in the first or the last bin.
const FIRST: i32 = -12;
const LAST: i32 = 8;
/// Bins of a stop: from 2^e to 2^(e + 1), a fourth of that length each.
const OF_A_STOP: i32 = 4;
const BINS: usize = ((LAST - FIRST) * OF_A_STOP) as usize;

/// How many pixels have which value, for red, green and blue.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Histogram {
    /// The stop at which the first bin begins.
    pub first: i32,
    /// The bins of a stop.
    pub of_a_stop: i32,
    /// Red, green and blue. Values of zero or less, and what is no number, are in none.
    pub counts: [Vec<u32>; 3],
}

impl Histogram {
    /// Counts linear colours.
    pub fn of(colors: &[[f32; 3]]) -> Histogram {
        let none = || [(); 3].map(|()| vec![0; BINS]);
        let count = |mut counts: [Vec<u32>; 3], color: &[f32; 3]| {
            for (counts, value) in counts.iter_mut().zip(color) {
                if let Some(count) = bin(*value).and_then(|bin| counts.get_mut(bin)) {
                    *count += 1;
                }
            }
            counts
        };
        let both = |mut a: [Vec<u32>; 3], b: [Vec<u32>; 3]| {
            for (a, b) in a.iter_mut().flatten().zip(b.into_iter().flatten()) {
                *a += b;
            }
            a
        };
        let parts = colors.par_chunks(1 << 16).map(|part| part.iter().fold(none(), count));
        Histogram {
            first: FIRST,
            of_a_stop: OF_A_STOP,
            counts: parts.reduce(none, both),
        }
    }
}

/// The bin of a value, read from the bits of the float: the exponent and the first two digits after the point.
fn bin(value: f32) -> Option<usize> {
    if value.is_nan() || value <= 0.0 {
        return None;
    }
    let quarter = (value.to_bits() >> 21) as i32 - 127 * OF_A_STOP;
    Some((quarter - FIRST * OF_A_STOP).clamp(0, BINS as i32 - 1) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_in_the_bin_of_its_stop() {
        for (value, stop) in [(1.0, 0), (0.5, -1), (0.18, -3), (3.9, 1), (4.0, 2), (255.0, 7)] {
            let bin = bin(value).unwrap() as i32;
            assert_eq!(bin.div_euclid(OF_A_STOP) + FIRST, stop, "{value}");
        }
        assert_eq!(bin(1.49), bin(1.26));
        assert_ne!(bin(1.49), bin(1.51));
        for none in [0.0, -0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(bin(none), None, "{none}");
        }
        assert_eq!((bin(1e-45), bin(1e-9)), (Some(0), Some(0)));
        assert_eq!((bin(f32::MAX), bin(f32::INFINITY)), (Some(BINS - 1), Some(BINS - 1)));
    }

    #[test]
    fn every_pixel_is_counted_once() {
        let mut colors = vec![[1.0, 0.0, 0.25]; 200_000];
        colors.push([f32::NAN, 2.0, 0.25]);
        let counted = Histogram::of(&colors);
        let sums = counted.counts.each_ref().map(|counts| counts.iter().sum::<u32>());
        assert_eq!(sums, [200_000, 1, 200_001]);
        assert_eq!(counted.counts[0][bin(1.0).unwrap()], 200_000);
        assert_eq!(Histogram::of(&[]).counts[0], vec![0; BINS]);
    }
}
