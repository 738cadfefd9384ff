//! Reconstruction filters as tables of bins, for filter importance sampling.

use std::f64::consts::PI;

use glam::{DVec4, Vec4};

use super::FILTER_TABLE_SIZE;
use wgray_scene::{PixelFilter, PixelFilterKind};

/// Quadrature steps per lobe.
const STEPS: usize = 1 << 14;

/// Returns a filter's unnormalized value at a distance from the pixel center in pixels; 0 beyond the radius.
///
/// Mitchell: B = C = 1/3, scaled to the radius ("Reconstruction Filters in Computer Graphics", SIGGRAPH 1988, eq. 8).
/// Gaussian: standard deviation of radius / 3, shifted to 0 at the radius. Blackman-Harris: four-term window with side
/// lobes at -92 dB (Harris, "On the Use of Windows for Harmonic Analysis", Proc. IEEE 66(1), 1978).
pub fn kernel_value(filter: PixelFilter, distance: f64) -> f64 {
    let x = distance.abs() / filter.radius;
    if x > 1.0 {
        return 0.0;
    }
    match filter.kind {
        PixelFilterKind::Box => 1.0,
        PixelFilterKind::Triangle => 1.0 - x,
        PixelFilterKind::Gaussian => (-4.5 * x * x).exp() - f64::exp(-4.5),
        PixelFilterKind::Mitchell => mitchell(2.0 * x),
        PixelFilterKind::BlackmanHarris => {
            let cosine = |k: f64| (k * PI * x).cos();
            0.35875 + 0.48829 * cosine(1.0) + 0.14128 * cosine(2.0) + 0.01168 * cosine(3.0)
        }
    }
}

fn mitchell(x: f64) -> f64 {
    let value_times_6 = if x < 1.0 {
        7.0 * x.powi(3) - 12.0 * x.powi(2) + 16.0 / 3.0
    } else {
        -7.0 / 3.0 * x.powi(3) + 12.0 * x.powi(2) - 20.0 * x + 32.0 / 3.0
    };
    value_times_6 / 6.0
}

/// Returns the [`FILTER_TABLE_SIZE`] equally likely bins of a filter: inner edge, outer edge, weight, 0. The bins of a
/// lobe have equal integrals. The weight of the bins corrects for rounding to whole bins, and is close to 1, or to -1
/// in a negative lobe.
pub fn table(filter: PixelFilter) -> Vec<Vec4> {
    let lobes = lobes(filter);
    let total: f64 = lobes.iter().map(|lobe| lobe.integral().abs()).sum();
    let mut table = Vec::new();
    let mut remaining = FILTER_TABLE_SIZE;
    for (i, lobe) in lobes.iter().enumerate() {
        let exact_count = f64::from(FILTER_TABLE_SIZE) * lobe.integral().abs() / total;
        let bins = match i + 1 == lobes.len() {
            true => remaining,
            false => exact_count.round() as u32,
        };
        remaining -= bins;
        let weight = lobe.integral().signum() * exact_count / f64::from(bins);
        let edge = |bin: u32| lobe.quantile(f64::from(bin) / f64::from(bins));
        for bin in 0..bins {
            table.push(DVec4::new(edge(bin), 0.0, weight, 0.0).as_vec4());
        }
    }
    for bin in 0..table.len() {
        let outermost = filter.radius as f32;
        table[bin].y = table.get(bin + 1).map_or(outermost, |next| next.x);
    }
    table
}

/// An interval in which the filter has constant sign.
struct Lobe {
    start: f64,
    step: f64,
    /// Integrals up to each step.
    sums: Vec<f64>,
}

impl Lobe {
    fn new(filter: PixelFilter, start: f64, end: f64) -> Lobe {
        let step = (end - start) / STEPS as f64;
        let value_at = |i: f64| kernel_value(filter, start + step * i);
        let mut sum = 0.0;
        let mut sums = vec![sum];
        for i in 0..STEPS {
            let i = i as f64;
            sum += step / 6.0 * (value_at(i) + 4.0 * value_at(i + 0.5) + value_at(i + 1.0)); // Simpson's rule
            sums.push(sum);
        }
        Lobe { start, step, sums }
    }

    fn integral(&self) -> f64 {
        self.sums[STEPS]
    }

    /// Inverts the cumulative distribution.
    fn quantile(&self, fraction: f64) -> f64 {
        let target = fraction * self.integral().abs();
        let upper = self.sums.partition_point(|sum| sum.abs() <= target);
        let upper = upper.clamp(1, STEPS);
        let (low, high) = (self.sums[upper - 1].abs(), self.sums[upper].abs());
        self.start + self.step * ((upper - 1) as f64 + (target - low) / (high - low))
    }
}

/// Returns the lobes: a positive lobe, and for Mitchell also a negative lobe.
fn lobes(filter: PixelFilter) -> Vec<Lobe> {
    if filter.kind != PixelFilterKind::Mitchell {
        return vec![Lobe::new(filter, 0.0, filter.radius)];
    }
    let (mut positive, mut negative) = (0.5 * filter.radius, 0.75 * filter.radius);
    for _ in 0..64 {
        let middle = 0.5 * (positive + negative);
        match kernel_value(filter, middle) > 0.0 {
            true => positive = middle,
            false => negative = middle,
        }
    }
    let zero = 0.5 * (positive + negative);
    vec![Lobe::new(filter, 0.0, zero), Lobe::new(filter, zero, filter.radius)]
}
