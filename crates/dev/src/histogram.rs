//! The distribution of brightness over the pixels of an image.

use rayon::prelude::*;
use serde::Serialize;

/// The lowest exponent: bins cover 2^-12 to 2^8. Positive values outside this range are counted in the first or the
/// last bin.
const FIRST: i32 = -12;
const LAST: i32 = 8;
/// Bins per stop.
const OF_A_STOP: i32 = 4;
/// 2^(1/4), 2^(1/2) and 2^(3/4).
const BOUNDS: [f32; 3] = [1.189_207_1, std::f32::consts::SQRT_2, 1.681_792_9];
const BINS: usize = ((LAST - FIRST) * OF_A_STOP) as usize;

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
        let none = || [(); 3].map(|()| (vec![0; BINS], 0));
        let count = |mut counts: Counts, color: &[f32; 3]| {
            for ((counts, above), value) in counts.iter_mut().zip(color) {
                if let Some(count) = bin(*value).and_then(|bin| counts.get_mut(bin)) {
                    *count += 1;
                }
                *above += u32::from(*value > white);
            }
            counts
        };
        let both = |mut a: Counts, b: Counts| {
            for ((counts, above), (more, more_above)) in a.iter_mut().zip(b) {
                counts.iter_mut().zip(more).for_each(|(count, more)| *count += more);
                *above += more_above;
            }
            a
        };
        let parts = colors.par_chunks(1 << 16).map(|part| part.iter().fold(none(), count));
        let all = parts.reduce(none, both);
        Histogram {
            first: FIRST,
            of_a_stop: OF_A_STOP,
            above_white: all.each_ref().map(|(_, above)| *above),
            counts: all.map(|(counts, _)| counts),
        }
    }
}

/// Returns the bin of a value, derived from the exponent of the float and a comparison of the mantissa with the bounds.
fn bin(value: f32) -> Option<usize> {
    if value.is_nan() || value <= 0.0 {
        return None;
    }
    let exponent = (value.to_bits() >> 23) as i32 - 127;
    let rest = f32::from_bits(value.to_bits() & 0x007f_ffff | 0x3f80_0000);
    let quarter = exponent * OF_A_STOP + BOUNDS.iter().filter(|bound| rest >= **bound).count() as i32;
    Some((quarter - FIRST * OF_A_STOP).clamp(0, BINS as i32 - 1) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_quarters_of_stops() {
        for (value, stop) in [(1.0, 0), (0.5, -1), (0.18, -3), (3.9, 1), (4.0, 2), (255.0, 7)] {
            let bin = bin(value).unwrap() as i32;
            assert_eq!(bin.div_euclid(OF_A_STOP) + FIRST, stop, "{value}");
        }
        for value in (1..2000).map(|i| i as f32 * 0.0123) {
            let wanted = (f64::from(value).log2() * f64::from(OF_A_STOP)).floor() as i32 - FIRST * OF_A_STOP;
            assert_eq!(bin(value), Some(wanted as usize), "{value}");
        }
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
        let counted = Histogram::of(&colors, 0.5);
        let sums = counted.counts.each_ref().map(|counts| counts.iter().sum::<u32>());
        assert_eq!(sums, [200_000, 1, 200_001]);
        assert_eq!(counted.counts[0][bin(1.0).unwrap()], 200_000);
        assert_eq!(counted.above_white, [200_000, 1, 0]);
        assert_eq!(Histogram::of(&colors, 0.0).above_white, [0, 1, 0]);
        assert_eq!(Histogram::of(&[], 0.0).counts[0], vec![0; BINS]);
    }
}
