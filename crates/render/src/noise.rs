//! The noise of an image: standard errors of its pixels, relative to their displayed values.

use wgray_trace::film::{Film, mean};

/// Weights of red, green and blue in the luminance: Rec. 709.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// Displayed value below which errors are no longer relative, because they are hard to see.
const MIN_VALUE: f64 = 0.01;
/// Samples per pixel before the first decision.
const MIN_SAMPLES: u32 = 16;

/// The noise of an image. The noise of a pixel is the standard error of its mean luminance, divided by the luminance,
/// but at least by 0.01. Both are multiplied by the exposure. Channels count as fully correlated, and samples as
/// independent, so that the noise is, on average, an upper bound for stratified patterns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Noise that 95 % of the pixels do not exceed. Infinite for a single sample per pixel.
    pub percentile_95: f64,
    /// Noise that half of the pixels do not exceed.
    pub median: f64,
}

/// Returns true if a render may end after this number of samples per pixel because its noise is low: after 16, 32, 64,
/// ... samples, at which the Sobol' points of a pixel are spread best, so that the decision does not depend on timing.
pub fn is_decision(samples: u32) -> bool {
    samples >= MIN_SAMPLES && samples.is_power_of_two()
}

/// Returns the next number of samples per pixel at which a render may end.
pub fn next_decision(samples: u32) -> u32 {
    (samples + 1).next_power_of_two().max(MIN_SAMPLES)
}

/// Returns the estimated number of samples per pixel at which the noise falls below a limit. The noise is inversely
/// proportional to the root of the number of samples.
pub fn estimated_samples(samples: u32, noise: f64, limit: f64) -> f64 {
    let count = f64::from(samples) * (noise / limit).powi(2);
    count.max(f64::from(samples)).log2().ceil().exp2()
}

/// Collects the noise of pixels.
#[derive(Clone, Debug, Default)]
pub struct NoiseMeter {
    /// Factor of the exposure.
    factor: f64,
    pixels: Vec<f64>,
}

impl NoiseMeter {
    /// Returns a meter without pixels. `exposure` is in stops.
    pub fn new(exposure: f64) -> NoiseMeter {
        NoiseMeter {
            factor: exposure.exp2(),
            pixels: Vec::new(),
        }
    }

    /// Adds the pixels of a film with noise estimates.
    pub fn add(&mut self, film: &Film) {
        let pixels = 0..film.moments.len();
        self.pixels
            .extend(pixels.map(|pixel| self::pixel(film, pixel, self.factor)));
    }

    /// Adds the pixels that are missing to `pixels` pixels, which have no samples: their noise is infinite.
    pub fn complete(&mut self, pixels: u64) {
        let pixels = usize::try_from(pixels).unwrap_or(usize::MAX).max(self.pixels.len());
        self.pixels.resize(pixels, f64::INFINITY);
    }

    /// Returns the noise of all pixels, which does not depend on their order; 0 without pixels.
    pub fn noise(&mut self) -> Noise {
        Noise {
            percentile_95: self.quantile(95),
            median: self.quantile(50),
        }
    }

    /// Returns the smallest value that at least `percent` of the pixels do not exceed.
    fn quantile(&mut self, percent: usize) -> f64 {
        let Some(last) = self.pixels.len().checked_sub(1) else {
            return 0.0;
        };
        let rank = (self.pixels.len() * percent).div_ceil(100).saturating_sub(1).min(last);
        *self.pixels.select_nth_unstable_by(rank, f64::total_cmp).1
    }
}

fn pixel(film: &Film, pixel: usize, factor: f64) -> f64 {
    let luminance = |color: [f64; 3]| {
        color
            .iter()
            .zip(LUMINANCE)
            .map(|(value, weight)| value * weight)
            .sum::<f64>()
    };
    let value = luminance(mean(film.sums[pixel]).map(f64::from)) * factor;
    let error = luminance(film.variance(pixel).map(|variance| f64::from(variance).sqrt())) * factor;
    error / value.max(MIN_VALUE) // the maximum is not NaN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decisions_follow_each_other() {
        let decisions: Vec<u32> = (0..=65_536).filter(|&samples| is_decision(samples)).collect();
        assert_eq!(decisions[..3], [16, 32, 64]);
        for samples in 0..65_536 {
            let next = decisions.iter().find(|&&decision| decision > samples);
            assert_eq!(Some(&next_decision(samples)), next, "{samples}");
        }
    }

    #[test]
    fn quantiles_are_ranks() {
        let quantiles = |count: u32| {
            let pixels = (1..=count).rev().map(f64::from).collect();
            let mut meter = NoiseMeter { factor: 1.0, pixels };
            let noise = meter.noise();
            [noise.percentile_95, noise.median]
        };
        assert_eq!(quantiles(0), [0.0, 0.0]);
        assert_eq!(quantiles(1), [1.0, 1.0]);
        assert_eq!(quantiles(2), [2.0, 1.0]);
        assert_eq!(quantiles(19), [19.0, 10.0]);
        assert_eq!(quantiles(20), [19.0, 10.0]);
        assert_eq!(quantiles(21), [20.0, 11.0]);
        assert_eq!(quantiles(100), [95.0, 50.0]);
        assert_eq!(quantiles(101), [96.0, 51.0]);
        let mut meter = NoiseMeter {
            factor: 1.0,
            pixels: vec![1.0, 2.0],
        };
        meter.complete(3);
        let noise = meter.noise();
        assert_eq!([noise.percentile_95, noise.median], [f64::INFINITY, 2.0]);
    }

    #[test]
    fn decisions_are_powers_of_two_from_16() {
        let found: Vec<u32> = (0..=300).filter(|samples| is_decision(*samples)).collect();
        assert_eq!(found, [16, 32, 64, 128, 256]);
        assert_eq!(estimated_samples(16, 0.08, 0.02), 256.0);
        assert_eq!(estimated_samples(16, 0.081, 0.02), 512.0);
        assert_eq!(estimated_samples(16, 0.01, 0.02), 16.0);
        assert_eq!(estimated_samples(16, f64::INFINITY, 0.02), f64::INFINITY);
    }
}
