//! Structural similarity (SSIM): Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility
//! to structural similarity", IEEE Trans. Image Process. 13 (4), 2004, equation 13, with the window of section III.B.

use std::ops::Range;

use rayon::prelude::*;

use super::colors::Colors;
use super::picture::Picture;

/// Radius of a window in pixels.
const RADIUS: usize = 5;
/// Standard deviation of the Gaussian of a window, in pixels.
const SIGMA: f64 = 1.5;
/// (K1 L)² and (K2 L)² for L = 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;
const TILE: usize = 256;

/// Returns the mean SSIM over all windows and the channels red, green and blue, encoded for display; 1 for equal
/// images; `None` if either image has no colors. Windows lie inside the image. Along a side that is shorter than a
/// window, the windows are clipped.
pub fn ssim(a: &Picture, b: &Picture) -> Option<f64> {
    let colors = Colors::of(a, b)?;
    let (x_axis, y_axis) = (Axis::of(colors.width), Axis::of(colors.height));
    let mut tiles = Vec::new();
    for y in (0..y_axis.count).step_by(TILE) {
        tiles.extend((0..x_axis.count).step_by(TILE).map(|x| (x, y)));
    }
    let sums = tiles.par_iter().map(|(x, y)| {
        let x_axis = x_axis.tile_axis(*x);
        tile(&colors, &x_axis, &y_axis.tile_axis(*y))
    });
    let sum = sums.collect::<Vec<_>>().iter().sum::<f64>();
    Some(sum / (3 * x_axis.count * y_axis.count) as f64)
}

/// The windows along one axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Center of the first window.
    first: usize,
    /// Number of windows.
    count: usize,
    /// Length of the image along the axis in pixels.
    side: usize,
}

impl Axis {
    fn of(side: usize) -> Axis {
        let (first, count) = match side > 2 * RADIUS {
            true => (RADIUS, side - 2 * RADIUS),
            false => (0, side),
        };
        Axis { first, count, side }
    }

    fn tile_axis(self, start: usize) -> Axis {
        Axis {
            first: self.first + start,
            count: TILE.min(self.count - start),
            side: self.side,
        }
    }

    fn pixels(self) -> Range<usize> {
        self.first.saturating_sub(RADIUS)..self.side.min(self.first + self.count + RADIUS)
    }

    /// For each filter tap, calls `visit` with a range of windows (relative to this axis), the pixels under the tap
    /// (relative to `pixels`) and the weight. Clipped windows differ in weights, so each clipped window is visited
    /// separately.
    fn for_each_tap(self, mut visit: impl FnMut(Range<usize>, Range<usize>, f64)) {
        let kernel: [f64; 2 * RADIUS + 1] = std::array::from_fn(|i| {
            let x = i as f64 - RADIUS as f64;
            (-x * x / (2.0 * SIGMA * SIGMA)).exp()
        });
        let start = self.pixels().start;
        if self.side > 2 * RADIUS {
            let sum: f64 = kernel.iter().sum();
            for (tap, weight) in kernel.iter().enumerate() {
                visit(0..self.count, tap..tap + self.count, weight / sum);
            }
            return;
        }
        for window in 0..self.count {
            let center = self.first + window;
            let is_inside = |tap: &usize| (RADIUS..self.side + RADIUS).contains(&(center + tap));
            let taps = || (0..kernel.len()).filter(is_inside);
            let sum: f64 = taps().map(|tap| kernel[tap]).sum();
            for tap in taps() {
                let pixel = center + tap - RADIUS - start;
                visit(window..window + 1, pixel..pixel + 1, kernel[tap] / sum);
            }
        }
    }
}

fn tile(colors: &Colors, x_axis: &Axis, y_axis: &Axis) -> f64 {
    let (columns, rows) = (x_axis.pixels(), y_axis.pixels());
    if rows.clone().all(|y| colors.stores_same_integers(y, columns.clone())) {
        return (3 * x_axis.count * y_axis.count) as f64;
    }
    let mut taps = Vec::new();
    x_axis.for_each_tap(|windows, pixels, weight| taps.push((windows, pixels, weight)));
    let mut sums = vec![[const { Vec::new() }; 5]; 3];
    for sum in sums.iter_mut().flatten() {
        *sum = vec![0.0; x_axis.count * y_axis.count];
    }
    let mut windows_of_row = vec![Vec::new(); rows.len()];
    y_axis.for_each_tap(|windows, pixels, weight| {
        for (window, pixel) in windows.zip(pixels) {
            windows_of_row[pixel].push((window, weight));
        }
    });
    let mut line = vec![0.0; x_axis.count];
    for (y, windows) in rows.zip(windows_of_row) {
        let (a, b) = colors.display_values(y, columns.clone());
        for ((a, b), sums) in a.iter().zip(&b).zip(&mut sums) {
            let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f64>>();
            let products = [a.clone(), b.clone(), product(a, a), product(b, b), product(a, b)];
            for (sums, product) in sums.iter_mut().zip(&products) {
                line.fill(0.0);
                for (windows, pixels, weight) in &taps {
                    add(&mut line[windows.clone()], &product[pixels.clone()], *weight);
                }
                for (window, weight) in &windows {
                    add(&mut sums[window * x_axis.count..][..x_axis.count], &line, *weight);
                }
            }
        }
    }
    let mut sum = 0.0;
    for [a, b, aa, bb, ab] in &sums {
        for ((((a, b), aa), bb), ab) in a.iter().zip(b).zip(aa).zip(bb).zip(ab) {
            let (variance_a, variance_b, covariance) = (aa - a * a, bb - b * b, ab - a * b);
            let numerator = (2.0 * a * b + C1) * (2.0 * covariance + C2);
            sum += numerator / ((a * a + b * b + C1) * (variance_a + variance_b + C2));
        }
    }
    sum
}

fn add(to: &mut [f64], from: &[f64], weight: f64) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}
