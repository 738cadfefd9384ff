//! The distribution of brightness over the pixels of an image.

use rayon::prelude::*;
use serde::Serialize;

/// The bins cover values from 2^-12 to 2^8. Positive values outside this range are counted in the first or the last
/// bin.
const MIN_EXPONENT: i32 = -12;
const MAX_EXPONENT: i32 = 8;
const BINS_PER_STOP: i32 = 4;
/// Bounds between the bins of a stop: 2^(1/4), 2^(1/2) and 2^(3/4).
const BOUNDS: [f32; 3] = [1.189_207_1, std::f32::consts::SQRT_2, 1.681_792_9];
const BINS: usize = ((MAX_EXPONENT - MIN_EXPONENT) * BINS_PER_STOP) as usize;

/// Histograms of the red, green and blue values of all pixels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Histogram {
    /// The stop at which the first bin starts.
    pub first: i32,
    /// The number of bins per stop.
    pub of_a_stop: i32,
    /// Counts for red, green and blue. Only positive values are counted.
    pub counts: [Vec<u32>; 3],
    /// The number of values per channel that are brighter than white.
    pub above_white: [u32; 3],
}

type Counts = [(Vec<u32>, u32); 3];

impl Histogram {
    /// Counts linear colors. White is the value 1 after applying the exposure in stops.
    pub fn of(colors: &[[f32; 3]], exposure: f64) -> Histogram {
        let white = (-exposure).exp2() as f32;
        let zeros = || [(); 3].map(|()| (vec![0; BINS], 0));
        let count = |mut counts: Counts, color: &[f32; 3]| {
            for ((counts, above), value) in counts.iter_mut().zip(color) {
                if let Some(count) = bin(*value).and_then(|bin| counts.get_mut(bin)) {
                    *count += 1;
                }
                *above += u32::from(*value > white);
            }
            counts
        };
        let add = |mut a: Counts, b: Counts| {
            for ((counts, above), (other_counts, other_above)) in a.iter_mut().zip(b) {
                counts
                    .iter_mut()
                    .zip(other_counts)
                    .for_each(|(count, other)| *count += other);
                *above += other_above;
            }
            a
        };
        let chunks = colors
            .par_chunks(1 << 16)
            .map(|chunk| chunk.iter().fold(zeros(), count));
        let sums = chunks.reduce(zeros, add);
        Histogram {
            first: MIN_EXPONENT,
            of_a_stop: BINS_PER_STOP,
            above_white: sums.each_ref().map(|(_, above)| *above),
            counts: sums.map(|(counts, _)| counts),
        }
    }
}

/// Returns the bin of a value, from the exponent of the float and the comparison of the mantissa with [`BOUNDS`].
fn bin(value: f32) -> Option<usize> {
    if value.is_nan() || value <= 0.0 {
        return None;
    }
    let exponent = (value.to_bits() >> 23) as i32 - 127;
    let mantissa = f32::from_bits(value.to_bits() & 0x007f_ffff | 0x3f80_0000);
    let quarter = exponent * BINS_PER_STOP + BOUNDS.iter().filter(|bound| mantissa >= **bound).count() as i32;
    Some((quarter - MIN_EXPONENT * BINS_PER_STOP).clamp(0, BINS as i32 - 1) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_quarters_of_stops() {
        for (value, stop) in [(1.0, 0), (0.5, -1), (0.18, -3), (3.9, 1), (4.0, 2), (255.0, 7)] {
            let bin = bin(value).unwrap() as i32;
            assert_eq!(bin.div_euclid(BINS_PER_STOP) + MIN_EXPONENT, stop, "{value}");
        }
        for value in (1..2000).map(|i| i as f32 * 0.0123) {
            let expected =
                (f64::from(value).log2() * f64::from(BINS_PER_STOP)).floor() as i32 - MIN_EXPONENT * BINS_PER_STOP;
            assert_eq!(bin(value), Some(expected as usize), "{value}");
        }
        for value in [0.0, -0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(bin(value), None, "{value}");
        }
        assert_eq!((bin(1e-45), bin(1e-9)), (Some(0), Some(0)));
        assert_eq!((bin(f32::MAX), bin(f32::INFINITY)), (Some(BINS - 1), Some(BINS - 1)));
    }

    #[test]
    fn every_positive_value_is_counted_once() {
        let mut colors = vec![[1.0, 0.0, 0.25]; 200_000];
        colors.push([f32::NAN, 2.0, 0.25]);
        let histogram = Histogram::of(&colors, 0.5);
        let sums = histogram.counts.each_ref().map(|counts| counts.iter().sum::<u32>());
        assert_eq!(sums, [200_000, 1, 200_001]);
        assert_eq!(histogram.counts[0][bin(1.0).unwrap()], 200_000);
        assert_eq!(histogram.above_white, [200_000, 1, 0]);
        assert_eq!(Histogram::of(&colors, 0.0).above_white, [0, 1, 0]);
        assert_eq!(Histogram::of(&[], 0.0).counts[0], vec![0; BINS]);
    }
}
