//! Adds samples to a film: row segments of a tile are rendered in parallel.

use std::ops::Range;

use glam::{UVec2, Vec4};
use rayon::prelude::*;
use wgray_image::Region;
use wgray_scene::Integrator;

use super::adaptive::{layer_mean, pilot_add, pilot_finish, proportional_samples, samples_wanted};
use super::integrators::path::{path_layers, path_value};
use super::integrators::phong;
use super::pixel::Layers;
use super::wavefront::{MAX_PATHS, Wavefront};
use crate::film::{Film, Layer};
use crate::records::{EDGE_NEIGHBOR_RADIUS, JITTERED, Packed, SMOOTH_NEIGHBOR_RADIUS};

/// Minimum number of pixels in the row segment of a task; more if their samples do not fill a batch.
const MIN_RUN: usize = 32;

/// Adds samples to a tile. With adaptive sampling, the samples are either pilot samples or further samples.
pub fn add_samples(scene: &Packed, film: &mut Film, tile: Region, samples: Range<u32>) {
    let Film {
        region,
        sums,
        moments,
        pilot_sums,
        layers,
        half_sums,
        albedo_moments,
        normal_moments,
        denoised: _,
    } = film;
    let region = *region;
    let is_pilot = scene.sampling.adaptive && samples.start < scene.specialization.pilot_samples;
    let (pilot_to_read, pilot_to_write) = match is_pilot {
        true => (&[][..], &mut pilot_sums[..]),
        false => (&pilot_sums[..], &mut [][..]),
    };
    let run_length = MIN_RUN.max(MAX_PATHS / samples.len());
    let runs = |records| runs(region, records, tile, run_length).into_iter();
    let sums = runs(sums);
    let mut segments: Vec<Run> = sums
        .map(|(first, sums)| Run {
            first,
            sums,
            ..Run::default()
        })
        .collect();
    for (run, (_, moments)) in segments.iter_mut().zip(runs(moments)) {
        run.moments = moments;
    }
    for (run, (_, pilot_sums)) in segments.iter_mut().zip(runs(pilot_to_write)) {
        run.pilot_sums = pilot_sums;
    }
    for (i, layer) in layers.iter_mut().enumerate() {
        for (run, (_, layer)) in segments.iter_mut().zip(runs(layer)) {
            run.layers[i] = layer;
        }
    }
    for (run, (_, half_sums)) in segments.iter_mut().zip(runs(half_sums)) {
        run.half_sums = half_sums;
    }
    for (i, moments) in [albedo_moments, normal_moments].into_iter().enumerate() {
        for (run, (_, moments)) in segments.iter_mut().zip(runs(moments)) {
            run.layer_moments[i] = moments;
        }
    }
    let has_further_samples = scene.sampling.adaptive && !is_pilot;
    segments.into_par_iter().for_each_init(
        || Wavefront::new(scene),
        |wavefront, mut run| {
            let (first, width) = (run.first, run.sums.len());
            let pixel = |x: usize| UVec2::new(first.x + x as u32, first.y);
            let samples_of = |x: usize| {
                let end = match has_further_samples {
                    true => further_samples_end(scene, pilot_to_read, region, pixel(x), samples.end),
                    false => samples.end,
                };
                (samples.start..end).map(move |sample| (x, sample))
            };
            let camera_samples: Vec<(usize, u32)> = (0..width).flat_map(samples_of).collect();
            for batch in camera_samples.chunks(MAX_PATHS) {
                let samples = batch.iter().map(|&(x, sample)| (pixel(x), sample));
                match scene.integrator {
                    Integrator::Phong => {
                        let first_hits = wavefront.first_hits(scene, samples);
                        for (&(x, sample), (state, hit)) in batch.iter().zip(first_hits) {
                            let radiance = phong::radiance_after(scene, state.path, hit, pixel(x), sample);
                            let value = (radiance * state.weight).extend(state.weight);
                            run.add(x, sample, value, Layers::default());
                        }
                    }
                    Integrator::Path => {
                        let paths = wavefront.trace(scene, samples);
                        for (&(x, sample), path) in batch.iter().zip(paths) {
                            run.add(x, sample, path_value(path), path_layers(path));
                        }
                    }
                }
            }
            if is_pilot {
                run.finish_pilot();
            }
        },
    );
}

/// A segment of a film row. Slices that the film lacks or that are not written are empty.
#[derive(Default)]
struct Run<'a> {
    first: UVec2,
    sums: &'a mut [Vec4],
    moments: &'a mut [Vec4],
    pilot_sums: &'a mut [Vec4],
    layers: [&'a mut [Vec4]; Layer::ALL.len()],
    half_sums: &'a mut [Vec4],
    /// Moments of albedo and normal.
    layer_moments: [&'a mut [Vec4]; 2],
    /// The pixel of the last sample, and its means so far: of radiance, and of albedo and normal.
    measured_pixel: Option<usize>,
    color_mean: Vec4,
    layer_means: [Vec4; 2],
}

/// Layers with moments.
const MEASURED: [Layer; 2] = [Layer::Albedo, Layer::Normal];

impl Run<'_> {
    /// Adds a sample to pixel `x`. Samples of a pixel are added in order.
    fn add(&mut self, x: usize, sample: u32, value: Vec4, layers: Layers) {
        let sum = self.sums[x];
        if let Some(pilot_sum) = self.pilot_sums.get_mut(x) {
            *pilot_sum = pilot_add(*pilot_sum, sum, value);
        }
        if !self.moments.is_empty() {
            self.add_to_moments(x, value, &layers);
        }
        if sample.is_power_of_two()
            && let Some(half_sum) = self.half_sums.get_mut(x)
        {
            *half_sum = sum;
        }
        self.sums[x] = sum + value;
        self.add_layers(x, layers);
    }

    /// Adds a sample to the moments, before it is added to the sums. Gives the bits of `moments_with` and
    /// `layer_moments_with`, but computes each mean once: the mean after a sample is the mean before the next one.
    #[inline(always)]
    fn add_to_moments(&mut self, x: usize, value: Vec4, layers: &Layers) {
        let is_first = self.measured_pixel != Some(x);
        self.measured_pixel = Some(x);
        let (sum, weight) = (self.sums[x], value.w);
        let weight_after = sum.w + weight;
        let before = if is_first {
            layer_mean(sum, sum.w)
        } else {
            self.color_mean
        };
        self.color_mean = layer_mean(sum + value, weight_after);
        self.moments[x] += deviation(before, self.color_mean, value, weight).with_w(1.0);
        for (i, moments) in self.layer_moments.iter_mut().enumerate() {
            let Some(moments) = moments.get_mut(x) else { return };
            let layer_sum = self.layers[MEASURED[i] as usize][x];
            let value = [layers.albedo, layers.normal][i];
            let before = if is_first {
                layer_mean(layer_sum, sum.w)
            } else {
                self.layer_means[i]
            };
            self.layer_means[i] = layer_mean(layer_sum + value, weight_after);
            *moments += deviation(before, self.layer_means[i], value, weight);
        }
    }

    fn finish_pilot(&mut self) {
        for ((pilot_sum, sum), moments) in self.pilot_sums.iter_mut().zip(&*self.sums).zip(&*self.moments) {
            *pilot_sum = pilot_finish(*pilot_sum, *sum, *moments);
        }
    }

    fn add_layers(&mut self, x: usize, sample: Layers) {
        let Layers {
            emission,
            direct,
            indirect,
            albedo,
            normal,
        } = sample;
        let values = [emission, direct, indirect, albedo, normal];
        for (layer, value) in self.layers.iter_mut().zip(values) {
            if let Some(sum) = layer.get_mut(x) {
                *sum += value;
            }
        }
    }
}

/// Returns the increment of the squared deviations by a sample, from the means before and after it.
#[inline(always)]
fn deviation(mean_before: Vec4, mean_after: Vec4, value: Vec4, weight: f32) -> Vec4 {
    let product = (value - mean_before * weight) * (value - mean_after * weight);
    Vec4::select(product.cmplt(Vec4::ZERO), Vec4::ZERO, product)
}

/// Splits the records of a tile into row segments, each paired with the position of its first pixel. `region` is the
/// region of the film, `length` the number of pixels of a segment.
fn runs(region: Region, records: &mut [Vec4], tile: Region, length: usize) -> Vec<(UVec2, &mut [Vec4])> {
    let rows = records.chunks_mut(region.width() as usize).enumerate();
    let rows = rows.skip((tile.y0 - region.y0) as usize).take(tile.height() as usize);
    let columns = (tile.x0 - region.x0) as usize..(tile.x1 - region.x0) as usize;
    rows.flat_map(|(y, row)| {
        let runs = row[columns.clone()].chunks_mut(length).enumerate();
        runs.map(move |(i, run)| (UVec2::new(tile.x0 + (i * length) as u32, region.y0 + y as u32), run))
    })
    .collect()
}

/// Returns the end of the range of a pixel's samples, from the pilot statistics of its neighbors.
fn further_samples_end(scene: &Packed, pilot_sums: &[Vec4], region: Region, pixel: UVec2, end: u32) -> u32 {
    let s = &scene.specialization;
    let squared_error = f32::from_bits(s.squared_error);
    let radius = neighbor_radius(s.smooth_noise != 0);
    let pilot_sum = neighbor_pilot_sum(pilot_sums, region, pixel, radius);
    if s.smooth_noise == 0 {
        return samples_wanted(pilot_sum, s.pilot_samples, squared_error, end);
    }
    // Whole rounds of patterns with cells, because the first cells of a round are not representative.
    let step = match s.pixel_pattern == JITTERED {
        true => s.pilot_samples,
        false => s.pilot_samples.div_ceil(2),
    };
    proportional_samples(pilot_sum, s.pilot_samples, step, squared_error, end)
}

/// Returns the sum of the pilot statistics of the pixels at a distance of at most `radius`, without the pixel itself.
fn neighbor_pilot_sum(pilot_sums: &[Vec4], region: Region, pixel: UVec2, radius: u32) -> Vec4 {
    let (x, y) = (pixel.x, pixel.y);
    let around = Region {
        x0: x,
        y0: y,
        x1: x + 1,
        y1: y + 1,
    };
    let neighbors = around.with_border(radius).within(region);
    let mut sum = Vec4::ZERO;
    for row in neighbors.y0..neighbors.y1 {
        for column in neighbors.x0..neighbors.x1 {
            let squared_distance = column.abs_diff(x).pow(2) + row.abs_diff(y).pow(2);
            if (1..=radius * radius).contains(&squared_distance) {
                let index = (row - region.y0) as usize * region.width() as usize + (column - region.x0) as usize;
                sum += pilot_sums[index];
            }
        }
    }
    sum
}

/// Returns the maximum distance of the neighbors whose pilot samples determine a pixel's sample count under adaptive
/// sampling.
pub fn neighbor_radius(has_smooth_noise: bool) -> u32 {
    match has_smooth_noise {
        true => SMOOTH_NEIGHBOR_RADIUS,
        false => EDGE_NEIGHBOR_RADIUS,
    }
}
