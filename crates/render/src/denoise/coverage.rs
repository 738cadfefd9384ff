//! Coverage of pixels at the edges of surfaces. A pixel at an edge mixes a surface with the background. If the background
//! has no noise, its light is separated, so that the surface's color and features equal those inside of the edge.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use crate::film::{Film, Layer, mean};

/// Larger components of colors are treated like infinity, because their squares would overflow.
const MAX_COLOR: f32 = 1e15;
/// Largest standard error of a background without noise, relative to its color.
const MAX_BACKGROUND_ERROR: f32 = 0.01;

/// The coverage of a pixel by surfaces. At a silhouette in front of a background without noise, only the light of the
/// surface is filtered, so that pixels at the silhouette are averaged with pixels inside of it.
#[derive(Clone, Copy, PartialEq)]
pub enum Coverage {
    /// The color cannot be averaged: it is not finite, or the pixel has no samples.
    Excluded,
    /// Only a background without noise, which is not averaged.
    Background,
    /// Surfaces in front of such a background; the fraction that they cover.
    Partial(f32),
    /// Anything else; all light is averaged.
    Full,
}

/// Returns the coverage of each pixel.
pub fn coverages(film: &Film) -> Vec<Coverage> {
    let alone = |i: usize| {
        let color = Vec3::from(mean(film.sums[i]));
        let variance = Vec3::from(film.variance(i)).element_sum();
        let is_known = film.sums[i].w != 0.0 && color.abs().cmple(Vec3::splat(MAX_COLOR)).all();
        match film.alpha(i) {
            _ if !is_known => Coverage::Excluded,
            0.0 if variance <= MAX_BACKGROUND_ERROR * MAX_BACKGROUND_ERROR * color.length_squared() => {
                Coverage::Background
            }
            _ => Coverage::Full,
        }
    };
    let alone: Vec<Coverage> = (0..film.sums.len()).into_par_iter().map(alone).collect();
    let width = film.region.width() as usize;
    let partial = |i: usize| match (alone[i], film.alpha(i)) {
        (Coverage::Full, alpha) if alpha > 0.0 && alpha < 1.0 => {
            let near_background = window(i, width, alone.len(), 1).any(|j| alone[j] == Coverage::Background);
            if near_background {
                Coverage::Partial(alpha)
            } else {
                Coverage::Full
            }
        }
        (coverage, _) => coverage,
    };
    (0..alone.len()).into_par_iter().map(partial).collect()
}

/// Returns the pixels of a square of 2 * `radius` + 1 pixels around pixel `i`, clipped to the image.
pub fn window(i: usize, width: usize, count: usize, radius: usize) -> impl Iterator<Item = usize> {
    let columns = around(i % width, width, radius);
    around(i / width, count / width, radius).flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// Returns the numbers from `i` - `radius` to `i` + `radius`, clipped to a size.
pub fn around(i: usize, size: usize, radius: usize) -> Range<usize> {
    i.saturating_sub(radius)..(i + radius + 1).min(size)
}

/// Returns the color of the surfaces in a pixel, and of the background behind them.
pub fn colors_of(film: &Film, i: usize, fraction: f32) -> (Vec3, Vec3) {
    let color = Vec3::from(mean(film.sums[i]));
    if fraction == 1.0 {
        return (color, Vec3::ZERO);
    }
    let emission = Vec3::from(film.layer(Layer::Emission, i));
    ((color - emission) / fraction, emission / (1.0 - fraction))
}

/// Returns the variance of the mean over the samples that hit a surface. `variance` is that of the mean over all samples
/// of the value, which is 0 for samples that hit nothing; `mean` is the mean over the hits.
///
/// With the fraction f of n samples that hit a surface, the sum of squared deviations from the mean over all samples is
/// n (n - 1) `variance`. The squared deviations between hits and misses add n f (1 - f) `mean`² to those within the
/// hits.
pub fn surface_variance(mean: Vec3, variance: Vec3, samples: f32, fraction: f32) -> Vec3 {
    if fraction == 1.0 {
        return variance;
    }
    let hits = fraction * samples;
    let deviations = samples * ((samples - 1.0) * variance - fraction * (1.0 - fraction) * mean * mean);
    deviations.max(Vec3::ZERO) / (hits * (hits - 1.0))
}
