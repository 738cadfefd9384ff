//! Per-value metrics: how many pixels differ, by how much, and where.

use rayon::prelude::*;

use super::flip::Map;
use super::picture::{Kind, Picture, Plane};

/// Added to the squared reference in the denominator of the relative error: Rousselle, Knaus and Zwicker, "Adaptive
/// sampling and reconstruction using greedy error minimization", ACM Trans. Graph. 30 (6), 2011, section 5.
const EPSILON: f64 = 0.01;
/// Pixels per work unit. Partial sums are added in order, independent of the number of threads.
const CHUNK: usize = 1 << 16;

/// A group of channels that both images have.
#[derive(Clone, Debug)]
pub struct Layer<'a> {
    /// `color` for `R`, `G`, `B`, `A` and `Y`; `normal` for `normal.X`; otherwise the name of the channel.
    pub name: String,
    /// For each channel: the name, and the values in both images.
    pub channels: Vec<(&'a str, &'a Plane, &'a Plane)>,
    kind: Kind,
}

/// Coordinates of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelCoord {
    /// Column, counted from 0 at the left.
    pub x: u32,
    /// Row, counted from 0 at the top.
    pub y: u32,
}

/// Counts of non-finite values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NonFiniteCounts {
    /// Number of NaNs.
    pub nan: u64,
    /// Number of infinities of either sign.
    pub infinite: u64,
}

impl NonFiniteCounts {
    fn count(&mut self, value: f64) {
        self.nan += u64::from(value.is_nan());
        self.infinite += u64::from(value.is_infinite());
    }

    /// Returns the number of non-finite values.
    pub fn total(self) -> u64 {
        self.nan + self.infinite
    }
}

/// The largest difference between two values.
#[derive(Clone, Debug, PartialEq)]
pub struct LargestDifference {
    /// Absolute difference.
    pub difference: f64,
    /// The first pixel with this difference in row-major order.
    pub pixel: PixelCoord,
    /// Name of the channel.
    pub channel: String,
    /// Value in the first image.
    pub a: f64,
    /// Value in the second image.
    pub b: f64,
}

/// Differences between two images in one layer. For `largest`, `rmse`, `rel_mse` and `psnr`, values that are non-finite
/// in either image count as 0 in both images.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Pixels with a value that is not bit-identical; signed zeros differ.
    pub different: u64,
    /// The first pixel counted in `different`, in row-major order.
    pub first: Option<PixelCoord>,
    /// Pixels with a value that differs by more than the threshold, or with a value that is not finite and not
    /// bit-identical.
    pub beyond: u64,
    /// The largest difference; `None` if all differences are 0.
    pub largest: Option<LargestDifference>,
    /// Root mean square of all differences.
    pub rmse: f64,
    /// Mean of d² / (b² + 0.01), where b is the value in the second image.
    pub rel_mse: f64,
    /// 20 log10(peak / rmse) in decibels; infinite for equal images. The peak is 1 for display values; otherwise the
    /// maximum magnitude in the second image, or 1 if the maximum is 0.
    pub psnr: f64,
    /// Non-finite values of the first image.
    pub a: NonFiniteCounts,
    /// Non-finite values of the second image.
    pub b: NonFiniteCounts,
    /// The first pixel, in row-major order, with a non-finite value in either image.
    pub first_non_finite: Option<PixelCoord>,
}

/// Returns the layers that both images have, colors first; the channels that only the first image has; and the channels
/// that only the second image has.
pub fn layers<'a>(a: &'a Picture, b: &'a Picture) -> (Vec<Layer<'a>>, Vec<&'a str>, Vec<&'a str>) {
    let mut layers: Vec<Layer> = Vec::new();
    let mut only_a = Vec::new();
    for channel in &a.channels {
        let Some(plane_b) = b.channel(&channel.name) else {
            only_a.push(channel.name.as_str());
            continue;
        };
        let name = layer_of(&channel.name);
        let entry = (channel.name.as_str(), &*channel.plane, &**plane_b);
        match layers.iter_mut().find(|layer| layer.name == name) {
            Some(layer) => layer.channels.push(entry),
            None => layers.push(Layer {
                name: name.to_owned(),
                channels: vec![entry],
                kind: b.kind,
            }),
        }
    }
    for layer in &mut layers {
        // EXR files store channels alphabetically: A, B, G, R.
        layer
            .channels
            .sort_by_key(|(name, ..)| ["R", "G", "B", "A"].iter().position(|color| color == name));
    }
    layers.sort_by_key(|layer| layer.name != COLOR);
    let only_b = b.channels.iter().map(|channel| channel.name.as_str());
    let only_b = only_b.filter(|name| a.channel(name).is_none()).collect();
    (layers, only_a, only_b)
}

/// Name of the color layer.
pub const COLOR: &str = "color";

/// Returns the name of the layer of a channel.
pub fn layer_of(channel: &str) -> &str {
    match channel.rsplit_once('.') {
        Some((layer, _)) => layer,
        None if ["R", "G", "B", "A", "Y"].contains(&channel) => COLOR,
        None => channel,
    }
}

#[derive(Clone, Debug, Default)]
struct DifferenceSums {
    different: u64,
    first: Option<usize>,
    beyond: u64,
    largest: Option<(f64, usize, usize)>,
    squares: f64,
    relative: f64,
    peak: f64,
    a: NonFiniteCounts,
    b: NonFiniteCounts,
    first_non_finite: Option<usize>,
}

impl DifferenceSums {
    fn join(&mut self, next: &DifferenceSums) {
        self.different += next.different;
        self.first = self.first.or(next.first);
        self.beyond += next.beyond;
        if next.largest.map(|largest| largest.0) > self.largest.map(|largest| largest.0) {
            self.largest = next.largest;
        }
        self.squares += next.squares;
        self.relative += next.relative;
        self.peak = self.peak.max(next.peak);
        for (sum, next) in [(&mut self.a, next.a), (&mut self.b, next.b)] {
            sum.nan += next.nan;
            sum.infinite += next.infinite;
        }
        self.first_non_finite = self.first_non_finite.or(next.first_non_finite);
    }
}

impl<'a> Layer<'a> {
    /// Compares the layer in both images; `threshold` only affects [`Difference::beyond`].
    pub fn difference(&self, width: u32, height: u32, threshold: f64) -> Difference {
        let pixels = width as usize * height as usize;
        let chunks = (0..pixels.div_ceil(CHUNK)).into_par_iter();
        let chunk_sums = chunks.map(|i| self.chunk(i * CHUNK, pixels.min((i + 1) * CHUNK), threshold));
        let mut sums = DifferenceSums::default();
        for chunk in chunk_sums.collect::<Vec<_>>() {
            sums.join(&chunk);
        }
        let coord = |pixel: usize| PixelCoord {
            x: (pixel % width as usize) as u32,
            y: (pixel / width as usize) as u32,
        };
        let values = pixels as f64 * self.channels.len() as f64;
        let rmse = (sums.squares / values).sqrt();
        let peak = match self.kind {
            Kind::Linear if sums.peak > 0.0 => sums.peak,
            _ => 1.0,
        };
        Difference {
            different: sums.different,
            first: sums.first.map(coord),
            beyond: sums.beyond,
            largest: sums.largest.and_then(|(difference, pixel, channel)| {
                let (name, a, b) = self.channels.get(channel)?;
                Some(LargestDifference {
                    difference,
                    pixel: coord(pixel),
                    channel: (*name).to_owned(),
                    a: a.value(pixel),
                    b: b.value(pixel),
                })
            }),
            rmse,
            rel_mse: sums.relative / values,
            psnr: 20.0 * (peak / rmse).log10(),
            a: sums.a,
            b: sums.b,
            first_non_finite: sums.first_non_finite.map(coord),
        }
    }

    /// Returns a mask of differing or non-finite pixels, and the differences divided by the largest difference.
    pub(super) fn maps(&self, picture: &Picture, step: usize) -> (Map, Map) {
        let (mut differing, mut differences) = (Map::new(picture, step), Map::new(picture, step));
        let largest = self.difference(picture.width, picture.height, 0.0).largest;
        let scale = largest.map_or(1.0, |largest| largest.difference);
        let width = picture.width as usize;
        let (mut a, mut b) = (vec![0.0; width], vec![0.0; width]);
        for (_, plane_a, plane_b) in &self.channels {
            for y in 0..picture.height as usize {
                let pixels = y * width..(y + 1) * width;
                if plane_a.stores_same_integers(plane_b, pixels.clone()) {
                    continue;
                }
                plane_a.values(pixels.clone(), &mut a);
                plane_b.values(pixels, &mut b);
                for (x, (a, b)) in a.iter().zip(&b).enumerate() {
                    if a.to_bits() != b.to_bits() || !a.is_finite() {
                        let relative = (a - b).abs() / scale;
                        differing.raise(x, y, 1.0);
                        differences.raise(x, y, if relative.is_finite() { relative } else { 1.0 });
                    }
                }
            }
        }
        (differing, differences)
    }

    /// Returns the first three channels except alpha, with the value range of the second image.
    pub(super) fn ranges(&self, picture: &Picture) -> Vec<([&'a Plane; 2], f64, f64)> {
        let channels = self.channels.iter().filter(|(name, ..)| *name != "A").take(3);
        let range = |(_, a, b): &(&str, &'a Plane, &'a Plane)| {
            let width = picture.width as usize;
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut values = vec![0.0; width];
            for y in 0..picture.height as usize {
                b.values(y * width..(y + 1) * width, &mut values);
                for value in values.iter().filter(|value| value.is_finite()) {
                    (low, high) = (low.min(*value), high.max(*value));
                }
            }
            ([*a, *b], low, high)
        };
        channels.map(range).collect()
    }

    fn chunk(&self, start: usize, end: usize, threshold: f64) -> DifferenceSums {
        let count = end - start;
        let (mut a, mut b) = (vec![0.0; count], vec![0.0; count]);
        let (mut different, mut beyond) = (vec![false; count], vec![false; count]);
        let mut sums = DifferenceSums::default();
        for (channel, (_, plane_a, plane_b)) in self.channels.iter().enumerate() {
            if plane_a.stores_same_integers(plane_b, start..end) {
                continue;
            }
            plane_a.values(start..end, &mut a);
            plane_b.values(start..end, &mut b);
            for (i, (a, b)) in a.iter().zip(&b).enumerate() {
                let (mut difference, mut reference) = ((a - b).abs(), *b);
                if !(a.is_finite() && b.is_finite()) {
                    sums.a.count(*a);
                    sums.b.count(*b);
                    sums.first_non_finite = Some(
                        sums.first_non_finite
                            .map_or(start + i, |first_non_finite| first_non_finite.min(start + i)),
                    );
                    beyond[i] |= a.to_bits() != b.to_bits();
                    (difference, reference) = (0.0, 0.0);
                }
                different[i] |= a.to_bits() != b.to_bits();
                beyond[i] |= difference > threshold;
                sums.squares += difference * difference;
                sums.relative += difference * difference / (reference * reference + EPSILON);
                sums.peak = sums.peak.max(reference.abs());
                let is_larger = match sums.largest {
                    None => difference > 0.0,
                    Some((largest, pixel, _)) => difference > largest || (difference == largest && start + i < pixel),
                };
                if is_larger {
                    sums.largest = Some((difference, start + i, channel));
                }
            }
        }
        let count = |flags: &[bool]| flags.iter().filter(|flag| **flag).count() as u64;
        sums.different = count(&different);
        sums.first = different.iter().position(|flag| *flag).map(|i| start + i);
        sums.beyond = count(&beyond);
        sums
    }
}
