//! Coverage of pixels by surfaces, which determines the light that is averaged. Emitted light is excluded if it has only
//! the noise of antialiasing. A pixel at the edge of a surface mixes it with the background. If the background has no
//! noise, its light is separated, so that the surface's color and features equal those inside of the edge.

use glam::Vec3;
use rayon::prelude::*;

use super::bright::bright_pixels;
use super::window::{box_means, window};
use wgray_trace::film::{Film, Layer, mean};
use wgray_trace::records::DENOISE_PATCH_RADIUS;

/// Larger components of colors are treated like infinity, because their squares would overflow.
const MAX_COLOR: f32 = 1e15;
/// Largest standard error of a background without noise, relative to its color.
const MAX_BACKGROUND_ERROR: f32 = 0.01;
/// Variance of the distances of a pixel's samples, relative to the squared distance, above which they hit several surfaces.
const EDGE_VARIANCE: f32 = 1e-4;

/// The coverage of a pixel by surfaces, which determines the light that is averaged.
#[derive(Clone, Copy, PartialEq)]
pub enum Coverage {
    /// The color cannot be averaged: it is not finite, or the pixel has no samples.
    Excluded,
    /// Much brighter than the pixels around it: averaged with them, it would brighten all of them visibly.
    Bright,
    /// Only a background without noise, which is not averaged.
    Background,
    /// Surfaces in front of such a background; the fraction that they cover.
    Partial(f32),
    /// Surfaces, or a background with noise. The light that they emit is not averaged, because it has only the noise of
    /// antialiasing.
    Sharp,
    /// Surfaces that the lens blurs. All light is averaged: a blurred emitter has noise.
    Blurred,
}

impl Coverage {
    /// Returns the fraction of the pixel that surfaces cover; `None` if the pixel is not averaged.
    pub fn fraction(self) -> Option<f32> {
        match self {
            Coverage::Excluded | Coverage::Bright | Coverage::Background => None,
            Coverage::Partial(fraction) => Some(fraction),
            Coverage::Sharp | Coverage::Blurred => Some(1.0),
        }
    }
}

/// Returns the coverage of each pixel.
pub fn coverages(film: &Film) -> Vec<Coverage> {
    let width = film.region.width() as usize;
    let edges: Vec<f32> = (0..film.sums.len())
        .into_par_iter()
        .map(|i| f32::from(u8::from(has_edge(film, i))))
        .collect();
    let edges = box_means(&edges, width, DENOISE_PATCH_RADIUS as usize);
    let alone = |i: usize| {
        let color = Vec3::from(mean(film.sums[i]));
        let variance = Vec3::from(film.variance(i)).element_sum();
        let is_known = film.sums[i].w != 0.0 && color.abs().cmple(Vec3::splat(MAX_COLOR)).all();
        match film.alpha(i) {
            _ if !is_known => Coverage::Excluded,
            _ if edges[i] > 0.5 => Coverage::Blurred,
            0.0 if variance <= MAX_BACKGROUND_ERROR * MAX_BACKGROUND_ERROR * color.length_squared() => {
                Coverage::Background
            }
            _ => Coverage::Sharp,
        }
    };
    let alone: Vec<Coverage> = (0..film.sums.len()).into_par_iter().map(alone).collect();
    let partial = |i: usize| match (alone[i], film.alpha(i)) {
        (Coverage::Sharp, alpha)
            if is_divisible(alpha, film.sample_count(i))
                && window(i, width, alone.len(), 1).any(|j| alone[j] == Coverage::Background) =>
        {
            Coverage::Partial(alpha)
        }
        (coverage, _) => coverage,
    };
    let mut coverages: Vec<Coverage> = (0..alone.len()).into_par_iter().map(partial).collect();
    for (coverage, is_bright) in coverages
        .iter_mut()
        .zip(bright_pixels(film, |i| alone[i] != Coverage::Excluded))
    {
        if is_bright {
            *coverage = Coverage::Bright;
        }
    }
    coverages
}

/// Returns true if the fraction `alpha` of a pixel amounts to at least one sample, and the rest of the pixel, too. With a
/// filter that has negative weights, the fraction may be close to 0 or 1, or outside of this range.
fn is_divisible(alpha: f32, sample_count: u32) -> bool {
    const ONE: f32 = 0.999; // allows for rounding
    let samples = sample_count as f32;
    alpha * samples > ONE && (1.0 - alpha) * samples > ONE
}

/// Returns true if the samples of a pixel hit surfaces at different distances.
fn has_edge(film: &Film, i: usize) -> bool {
    if !film.has_layers() {
        return false;
    }
    let (distance, variance) = (film.depth(i), film.depth_variance(i) * film.sample_count(i) as f32);
    variance.is_finite() && variance > EDGE_VARIANCE * distance * distance
}

/// Returns the light of a pixel's surfaces that is averaged, and the light of the background behind them.
pub fn averaged_light(film: &Film, i: usize, coverage: Coverage) -> (Vec3, Vec3) {
    let color = Vec3::from(mean(film.sums[i]));
    let emission = Vec3::from(film.layer(Layer::Emission, i));
    match coverage {
        Coverage::Partial(fraction) => ((color - emission) / fraction, emission / (1.0 - fraction)),
        Coverage::Sharp => (color - emission, Vec3::ZERO),
        _ => (color, Vec3::ZERO),
    }
}

/// Returns the variance of the mean over the samples that hit a surface. `variance` is that of the mean over all samples
/// of the value, which is 0 for samples that hit nothing; `mean` is the mean over the hits.
///
/// With the fraction f of n samples that hit a surface, the sum of squared deviations from the mean over all samples is
/// n (n - 1) `variance`. The squared deviations between hits and misses add n f (1 - f) `mean`² to those within the
/// hits. The variance of a single hit is infinite.
pub fn surface_variance(mean: Vec3, variance: Vec3, samples: f32, fraction: f32) -> Vec3 {
    if fraction == 1.0 {
        return variance;
    }
    let hits = fraction * samples;
    if hits < 1.5 {
        return Vec3::INFINITY;
    }
    let deviations = samples * ((samples - 1.0) * variance - fraction * (1.0 - fraction) * mean * mean);
    deviations.max(Vec3::ZERO) / (hits * (hits - 1.0))
}
