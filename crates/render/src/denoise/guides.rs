//! The guides of the denoiser: colors without albedo, features, and their variances, as padded planes.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::coverage::{Coverage, averaged_light, coverages, surface_variance};
use super::window::{box_means, window};
use wgray_trace::film::{Film, Half, Layer, mean};
use wgray_trace::records::{
    DENOISE_PATCH_RADIUS, DENOISE_RADIUS, GUIDE_ALBEDO, GUIDE_COLOR, GUIDE_COLOR_VARIANCE, GUIDE_DEPTH, GUIDE_NORMAL,
    GUIDE_PLANES, GUIDE_VARIANCE_LIMIT,
};

/// Pixels around the image that the window and its patches reach.
pub const MARGIN: usize = (DENOISE_RADIUS + DENOISE_PATCH_RADIUS) as usize;

/// Added to the albedo before colors are divided by it, so that light which the albedo does not describe, such as
/// reflections on dark surfaces, is not amplified.
const ALBEDO_OFFSET: f32 = 0.15;
/// Squared differences of features at which the weight falls to about 1/e: of normals, of albedos, and of depths
/// relative to the depth.
const NORMAL_TOLERANCE: f32 = 0.015;
const ALBEDO_TOLERANCE: f32 = 0.03;
const DEPTH_TOLERANCE: f32 = 0.003;
/// Variances of features are multiplied by this factor, because estimates from a few samples are too low as often as too
/// high.
const FEATURE_VARIANCE_SCALE: f32 = 2.0;
/// Minimum of a pixel's variance, relative to the mean variance of the 3 x 3 pixels around it.
const MIN_RELATIVE_VARIANCE: f32 = 0.1;
/// Maximum of a pixel's variance, relative to the mean squared difference of the two halves of the samples around it.
const MAX_RELATIVE_VARIANCE: f32 = 2.0;
/// Radius of the square of pixels over which these differences are averaged.
const HALF_VARIANCE_RADIUS: usize = 4;
/// Fewest samples whose halves show how fast the variance falls.
const MIN_STRATIFIED_SAMPLES: u32 = 16;
/// Largest variance that is attributed to other pixels, relative to that of a pixel with at least `RELIABLE_SAMPLES`.
const MAX_VARIANCE_RATIO: f32 = 12.0;
const RELIABLE_SAMPLES: u32 = 64;
const UNLIMITED_VARIANCE: f32 = 1e30;
/// Depth of pixels that are not averaged with any other pixel.
const EXCLUDED_DEPTH: f32 = 1e15;

const COLOR: usize = GUIDE_COLOR as usize;
const COLOR_VARIANCE: usize = GUIDE_COLOR_VARIANCE as usize;
const VARIANCE_LIMIT: usize = GUIDE_VARIANCE_LIMIT as usize;
const NORMAL: usize = GUIDE_NORMAL as usize;
const ALBEDO: usize = GUIDE_ALBEDO as usize;
const DEPTH: usize = GUIDE_DEPTH as usize;
const PLANES: usize = GUIDE_PLANES as usize;

/// Bytes per pixel of the guides, without their margins, while they are computed.
pub const GUIDE_BYTES: u64 = (2 * PLANES * size_of::<f32>() + size_of::<Coverage>()) as u64;

/// Planes of floats, each with a margin that mirrors the image.
pub struct Guides {
    /// Width of the image without margins.
    pub width: usize,
    /// Height of the image without margins.
    pub height: usize,
    /// Floats per row of a plane.
    pub stride: usize,
    coverages: Vec<Coverage>,
    planes: Vec<Vec<f32>>,
}

impl Guides {
    /// Number of planes.
    pub const PLANES: usize = PLANES;

    /// Returns the guides of a film with noise estimates.
    pub fn of(film: &Film) -> Guides {
        let (width, height) = (film.region.width() as usize, film.region.height() as usize);
        let coverages = coverages(film);
        let mut values: Vec<[f32; PLANES]> = coverages
            .par_iter()
            .enumerate()
            .map(|(i, coverage)| guides_of(film, i, *coverage))
            .collect();
        limit_variances(film, &coverages, &mut values);
        extend_surfaces(width, &coverages, &mut values);
        let stride = width + 2 * MARGIN;
        let plane = |k: usize| {
            let mut plane = Vec::with_capacity(stride * (height + 2 * MARGIN));
            for y in padded(height) {
                let row = &values[y * width..(y + 1) * width];
                plane.extend(padded(width).map(|x| row[x][k]));
            }
            plane
        };
        Guides {
            width,
            height,
            stride,
            coverages,
            planes: (0..PLANES).into_par_iter().map(plane).collect(),
        }
    }

    /// Returns a plane.
    pub fn plane(&self, k: usize) -> &[f32] {
        &self.planes[k]
    }

    /// Returns the planes of some rows of the image with their margins, one plane after the other.
    pub fn rows(&self, rows: Range<usize>) -> Vec<f32> {
        let range = rows.start * self.stride..(rows.end + 2 * MARGIN) * self.stride;
        self.planes
            .iter()
            .flat_map(|plane| &plane[range.clone()])
            .copied()
            .collect()
    }

    /// Multiplies filtered colors by the albedo, and adds the light that was not filtered.
    pub fn colors(&self, film: &Film, filtered: &[Vec3]) -> Vec<Vec3> {
        let color = |(i, filtered): (usize, &Vec3)| match self.coverages[i] {
            Coverage::Excluded | Coverage::Bright | Coverage::Background => Vec3::from(mean(film.sums[i])),
            Coverage::Blurred => *filtered * divisor(film, i, 1.0),
            Coverage::Sharp => Vec3::from(film.layer(Layer::Emission, i)) + *filtered * divisor(film, i, 1.0),
            Coverage::Partial(fraction) => {
                Vec3::from(film.layer(Layer::Emission, i)) + *filtered * (fraction * divisor(film, i, fraction))
            }
        };
        filtered.iter().enumerate().map(color).collect()
    }
}

/// Returns the coordinates of a row with margins, mirrored at the centers of the first and last pixel.
fn padded(size: usize) -> impl Iterator<Item = usize> {
    let (size, margin) = (size as isize, MARGIN as isize);
    let period = (2 * (size - 1)).max(1);
    (-margin..size + margin).map(move |x| {
        let x = x.rem_euclid(period);
        x.min(period - x).min(size - 1) as usize
    })
}

/// Continues the colors of surfaces into the background and into other pixels that are not averaged by the radius of a
/// patch, so that the patches of pixels at the edge of a surface are similar to those inside.
fn extend_surfaces(width: usize, coverages: &[Coverage], guides: &mut [[f32; PLANES]]) {
    const VALUES: usize = VARIANCE_LIMIT - COLOR + 1;
    let extended = |i: usize| {
        let around = window(i, width, coverages.len(), DENOISE_PATCH_RADIUS as usize);
        let surfaces = around.filter(|j| coverages[*j].fraction().is_some());
        let (sum, count) = surfaces.fold(([0.0; VALUES], 0.0), |(sum, count), j| {
            (std::array::from_fn(|k| sum[k] + guides[j][COLOR + k]), count + 1.0)
        });
        (count > 0.0).then(|| (i, sum.map(|value: f32| value / count)))
    };
    let others = (0..coverages.len()).into_par_iter();
    let others = others.filter(|i| coverages[*i].fraction().is_none());
    let extensions: Vec<(usize, [f32; VALUES])> = others.filter_map(extended).collect();
    for (i, values) in extensions {
        guides[i][COLOR..COLOR + VALUES].copy_from_slice(&values);
    }
}

/// Returns the albedo of the surfaces in a pixel, by which their color is divided. `fraction` is the covered part.
fn divisor(film: &Film, i: usize, fraction: f32) -> Vec3 {
    (Vec3::from(film.layer(Layer::Albedo, i)) / fraction).max(Vec3::ZERO) + ALBEDO_OFFSET
}

fn guides_of(film: &Film, i: usize, coverage: Coverage) -> [f32; PLANES] {
    let mut guides = [0.0; PLANES];
    let Some(fraction) = coverage.fraction() else {
        guides[DEPTH] = EXCLUDED_DEPTH;
        guides[DEPTH + 2] = 1.0 / EXCLUDED_DEPTH;
        return guides;
    };
    let samples = film.sample_count(i) as f32;
    let of_surfaces = |mean: Vec3, variance: Vec3| surface_variance(mean, variance, samples, fraction);
    let mut set = |first: usize, values: &[f32]| guides[first..first + values.len()].copy_from_slice(values);
    let divisor = divisor(film, i, fraction);
    let (color, behind) = averaged_light(film, i, coverage);
    let variance = of_surfaces(color - behind, Vec3::from(film.variance(i)));
    // The estimated variance of a mean of values of at least 0 is at most the square of the mean. The rest of an estimate
    // is due to emission. The variance of a single sample is unknown.
    let variance = Vec3::select(variance.cmplt(color * color), variance, color * color);
    set(COLOR, &(color / divisor).to_array());
    set(COLOR_VARIANCE, &[(variance / (divisor * divisor)).element_sum()]);
    if film.has_layers() {
        let normal = (NORMAL, Layer::Normal, film.normal_variance(i), NORMAL_TOLERANCE);
        let albedo = (ALBEDO, Layer::Albedo, film.albedo_variance(i), ALBEDO_TOLERANCE);
        for (first, layer, variance, tolerance) in [normal, albedo] {
            let value = Vec3::from(film.layer(layer, i)) / fraction;
            let variance = feature_variance(of_surfaces(value, Vec3::from(variance)).element_sum());
            set(first, &value.to_array());
            set(first + 3, &[variance, 1.0 / variance.max(tolerance)]);
        }
        let depth = film.depth(i) / fraction;
        let variance = of_surfaces(Vec3::splat(depth), Vec3::splat(film.depth_variance(i)));
        let variance = feature_variance(variance.x);
        let tolerance = variance.max(DEPTH_TOLERANCE * depth * depth);
        set(DEPTH, &[depth, variance, 1.0 / tolerance.max(f32::MIN_POSITIVE)]);
    } else {
        guides[DEPTH + 2] = 1.0; // all depths are 0 except those of excluded pixels
    }
    guides
}

/// Returns the variance of a feature for the denoiser; 0 if it is unknown.
fn feature_variance(variance: f32) -> f32 {
    if variance.is_finite() {
        FEATURE_VARIANCE_SCALE * variance
    } else {
        0.0
    }
}

/// Corrects the estimated variances of colors. The estimate assumes independent samples; the difference of the halves shows
/// how much less noise the samples have because they are stratified.
fn limit_variances(film: &Film, coverages: &[Coverage], guides: &mut [[f32; PLANES]]) {
    let width = film.region.width() as usize;
    let variances: Vec<f32> = guides.iter().map(|guides| guides[COLOR_VARIANCE]).collect();
    let half_variances: Vec<f32> = (0..guides.len())
        .into_par_iter()
        .map(|i| match coverages[i].fraction() {
            Some(fraction) => half_variance(film, i, fraction).min(squared_color(&guides[i])),
            None => 0.0,
        })
        .collect();
    let local = box_means(&variances, width, 1);
    let [wide, halves] = [&variances, &half_variances].map(|values| box_means(values, width, HALF_VARIANCE_RADIUS));
    for (i, guides) in guides.iter_mut().enumerate() {
        let samples = film.sample_count(i);
        let variance = variances[i].max(MIN_RELATIVE_VARIANCE * local[i]) * stratification(halves[i], wide[i], samples);
        guides[COLOR_VARIANCE] = variance.min(MAX_RELATIVE_VARIANCE * halves[i]);
        guides[VARIANCE_LIMIT] = variance_limit(guides[COLOR_VARIANCE], samples);
    }
}

/// Returns the largest variance that is attributed to other pixels than one with this variance. Few samples may have
/// missed a light: then the pixel is black, and its variance is 0.
fn variance_limit(variance: f32, samples: u32) -> f32 {
    if samples < RELIABLE_SAMPLES {
        UNLIMITED_VARIANCE
    } else {
        MAX_VARIANCE_RATIO * variance
    }
}

fn squared_color(guides: &[f32; PLANES]) -> f32 {
    Vec3::from_slice(&guides[COLOR..]).length_squared()
}

/// Returns the variance of the mean of stratified samples divided by that of independent samples, or a larger number, at
/// most 1. `halves` is the mean of the variances that the halves suggest; `independent` is that of the estimates.
///
/// If the variance of n samples is proportional to n^-b, then `halves` is that of n / 2 samples less that of n samples,
/// 2^b - 1 times the latter, and `halves / independent` is (2^b - 1) n^(1-b). The result is exact for b = 1 (independent
/// samples), and for b = 1.5 and 64 samples. It is 1.2 times too large for b = 1.5 and 16 samples. With few samples the
/// ratio hardly depends on b, so that a correction beyond it would only follow the noise of the ratio.
pub fn stratification(halves: f32, independent: f32, samples: u32) -> f32 {
    if independent > 0.0 {
        let ratio = (halves / independent).min(1.0);
        match samples < MIN_STRATIFIED_SAMPLES {
            true => ratio,
            false => ratio * (0.4 + 0.6 * ratio),
        }
    } else {
        1.0
    }
}

/// Returns the variance of the color of a pixel's surfaces, divided by their albedo, that the difference of the halves
/// suggests. `fraction` is the part of the pixel that they cover.
fn half_variance(film: &Film, i: usize, fraction: f32) -> f32 {
    let [first, second] = [Half::First, Half::Second].map(|half| Vec3::from(film.half_mean(half, i)));
    let (all, first_weight) = (film.sums[i].w, film.half_sums[i].w);
    // 1/4 for halves of equal weights
    let scale = first_weight * (all - first_weight) / (all * all);
    let variance = ((first - second) / (fraction * divisor(film, i, fraction))).length_squared() * scale;
    // Without a second sample, or with negative weights, the halves do not reveal the variance.
    let is_known = scale > 0.0 && variance >= 0.0;
    if is_known { variance } else { f32::INFINITY }
}
