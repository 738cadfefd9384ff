//! Structural similarity (SSIM): Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility
//! to structural similarity", IEEE Trans. Image Process. 13 (4), 2004, equation 13, with the window of section III.B.

use std::ops::Range;

use rayon::prelude::*;

use super::colors::Colors;
use super::picture::Picture;

/// Radius of a window in pixels, and standard deviation of its Gaussian.
const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
/// (K1 L)² and (K2 L)² for L = 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;
const TILE: usize = 256;

/// Returns the mean SSIM over all windows and the channels red, green and blue, encoded for display; 1 for equal
/// images. Windows lie inside the image, clipped along shorter sides. `None` if either image has no colors.
pub fn ssim(a: &Picture, b: &Picture) -> Option<f64> {
    let colors = Colors::of(a, b)?;
    let (across, down) = (Axis::of(colors.width), Axis::of(colors.height));
    let mut tiles = Vec::new();
    for y in (0..down.count).step_by(TILE) {
        tiles.extend((0..across.count).step_by(TILE).map(|x| (x, y)));
    }
    let sums = tiles.par_iter().map(|(x, y)| {
        let across = across.part(*x);
        tile(&colors, &across, &down.part(*y))
    });
    let sum = sums.collect::<Vec<_>>().iter().sum::<f64>();
    Some(sum / (3 * across.count * down.count) as f64)
}

/// The windows along one axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    first: usize,
    count: usize,
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

    fn part(self, start: usize) -> Axis {
        Axis {
            first: self.first + start,
            count: TILE.min(self.count - start),
            side: self.side,
        }
    }

    fn pixels(self) -> Range<usize> {
        self.first.saturating_sub(RADIUS)..self.side.min(self.first + self.count + RADIUS)
    }

    /// For each filter tap, calls `call` with a range of windows (relative to this axis), the pixels under the tap
    /// (relative to `pixels`) and the weight. Clipped windows differ in weights, so each of them has its own calls.
    fn each(self, mut call: impl FnMut(Range<usize>, Range<usize>, f64)) {
        let kernel: [f64; 2 * RADIUS + 1] = std::array::from_fn(|i| {
            let x = i as f64 - RADIUS as f64;
            (-x * x / (2.0 * SIGMA * SIGMA)).exp()
        });
        let start = self.pixels().start;
        if self.side > 2 * RADIUS {
            let whole: f64 = kernel.iter().sum();
            for (tap, weight) in kernel.iter().enumerate() {
                call(0..self.count, tap..tap + self.count, weight / whole);
            }
            return;
        }
        for window in 0..self.count {
            let middle = self.first + window;
            let inside = |tap: &usize| (RADIUS..self.side + RADIUS).contains(&(middle + tap));
            let taps = || (0..kernel.len()).filter(inside);
            let whole: f64 = taps().map(|tap| kernel[tap]).sum();
            for tap in taps() {
                let pixel = middle + tap - RADIUS - start;
                call(window..window + 1, pixel..pixel + 1, kernel[tap] / whole);
            }
        }
    }
}

fn tile(colors: &Colors, across: &Axis, down: &Axis) -> f64 {
    let (columns, rows) = (across.pixels(), down.pixels());
    if rows.clone().all(|y| colors.is_plainly_same(y, columns.clone())) {
        return (3 * across.count * down.count) as f64;
    }
    let mut taps = Vec::new();
    across.each(|windows, pixels, weight| taps.push((windows, pixels, weight)));
    let mut sums = vec![[const { Vec::new() }; 5]; 3];
    for sum in sums.iter_mut().flatten() {
        *sum = vec![0.0; across.count * down.count];
    }
    let mut rows_of = vec![Vec::new(); rows.len()];
    down.each(|windows, pixels, weight| {
        for (window, pixel) in windows.zip(pixels) {
            rows_of[pixel].push((window, weight));
        }
    });
    let mut line = vec![0.0; across.count];
    for (y, windows) in rows.zip(rows_of) {
        let (a, b) = colors.shown(y, columns.clone());
        for ((a, b), sums) in a.iter().zip(&b).zip(&mut sums) {
            let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f64>>();
            let products = [a.clone(), b.clone(), product(a, a), product(b, b), product(a, b)];
            for (sums, product) in sums.iter_mut().zip(&products) {
                line.fill(0.0);
                for (windows, pixels, weight) in &taps {
                    add(&mut line[windows.clone()], &product[pixels.clone()], *weight);
                }
                for (window, weight) in &windows {
                    add(&mut sums[window * across.count..][..across.count], &line, *weight);
                }
            }
        }
    }
    let mut sum = 0.0;
    for [a, b, aa, bb, ab] in &sums {
        for ((((a, b), aa), bb), ab) in a.iter().zip(b).zip(aa).zip(bb).zip(ab) {
            let (of_a, of_b, of_both) = (aa - a * a, bb - b * b, ab - a * b);
            let alike = (2.0 * a * b + C1) * (2.0 * of_both + C2);
            sum += alike / ((a * a + b * b + C1) * (of_a + of_b + C2));
        }
    }
    sum
}

fn add(to: &mut [f64], from: &[f64], weight: f64) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}
