//! ꟻLIP, a perceptual image difference for alternating images.
//!
//! Display images: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "ꟻLIP: a difference evaluator
//! for alternating images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3 (2), 2020. Linear
//! images (HDR-ꟻLIP): Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing errors in rendered high dynamic
//! range images", Eurographics 2021 Short Papers. Filters are separated as in the authors' note "Separated
//! convolutions", 2022.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::colors::Colors;
use super::picture::{Kind, Picture};
use crate::color::srgb_to_linear;

/// Default resolution in pixels per degree of visual angle: a monitor 0.7 m wide with 3840 columns, 0.7 m away.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

const TILE: usize = 256;
/// Maximum number of tiles whose errors are in memory at the same time.
const MAX_TILES_IN_MEMORY: usize = 64;

/// Result of a comparison.
#[derive(Clone, Debug)]
pub struct Flip {
    /// Mean error, 0 to 1.
    pub mean: f64,
    /// Error map, if requested.
    pub map: Option<Map>,
}

/// An error map with 8 bits per value: 255 represents an error of 1. Each value is the maximum over a square of pixels.
#[derive(Clone, Debug)]
pub struct Map {
    /// Side of a square in pixels.
    pub step: usize,
    /// Squares per row.
    pub width: usize,
    /// Values in row-major order, top row first.
    pub values: Vec<u8>,
}

impl Map {
    /// Returns a map of zeros for an image.
    pub fn new(picture: &Picture, step: usize) -> Map {
        let squares = |side: u32| (side as usize).div_ceil(step);
        let width = squares(picture.width);
        Map {
            step,
            width,
            values: vec![0; width * squares(picture.height)],
        }
    }

    /// Raises the value at a pixel. Positive values are stored as at least 1 of 255.
    pub fn raise(&mut self, x: usize, y: usize, value: f64) {
        let steps = (value * 255.0 + 0.5) as u8;
        let steps = if value > 0.0 { steps.max(1) } else { 0 };
        if let Some(stored) = self.values.get_mut(y / self.step * self.width + x / self.step) {
            *stored = steps.max(*stored);
        }
    }
}

/// Compares the colors of two images; `b` is the reference. With a `step`, also returns an error map. `None` if either
/// image has no colors.
pub fn flip(a: &Picture, b: &Picture, pixels_per_degree: f64, step: Option<usize>) -> Option<Flip> {
    let colors = Colors::of(a, b)?;
    let filters = Filters::new(pixels_per_degree);
    let exposures = match colors.kind {
        Kind::Display { .. } => None,
        Kind::Linear => Some(exposures(&colors)),
    };
    let mut map = step.map(|step| Map::new(b, step));
    let mut tiles = Vec::new();
    for y in (0..colors.height).step_by(TILE) {
        tiles.extend((0..colors.width).step_by(TILE).map(|x| (x, y)));
    }
    let mut sum = 0.0;
    for tiles in tiles.chunks(MAX_TILES_IN_MEMORY) {
        let errors = tiles.par_iter().map(|(x, y)| {
            let tile = Tile {
                x: *x,
                y: *y,
                width: TILE.min(colors.width - x),
                height: TILE.min(colors.height - y),
            };
            let errors = tile.errors(&colors, &filters, exposures.as_deref());
            let sum: f64 = errors.iter().map(|error| f64::from(*error)).sum();
            (tile, sum, if step.is_some() { errors } else { Vec::new() })
        });
        for (tile, tile_sum, errors) in errors.collect::<Vec<_>>() {
            sum += tile_sum;
            if let Some(map) = &mut map {
                for (i, error) in errors.iter().enumerate() {
                    map.raise(tile.x + i % tile.width, tile.y + i / tile.width, f64::from(*error));
                }
            }
        }
    }
    Some(Flip {
        mean: sum / (colors.width * colors.height) as f64,
        map,
    })
}

// Constants from sections 4.1.1, 4.1.2, 4.2 and 4.3 and table 1 of the paper.

/// Exponent of the color difference.
const QC: f64 = 0.7;
/// Color difference at the knee of the error curve, as a fraction of the maximum color difference.
const PC: f64 = 0.4;
/// Error at the knee.
const PT: f64 = 0.95;
/// Width of the edge detection filter in degrees.
const W: f64 = 0.082;
/// Exponent of the feature difference.
const QF: f64 = 0.5;

/// Contrast sensitivity functions as sums of Gaussians (amplitude, width): achromatic, red-green, blue-yellow.
const ACHROMATIC: (f64, f64) = (1.0, 0.0047);
const RED_GREEN: (f64, f64) = (1.0, 0.0053);
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];

struct Filters {
    radius: usize,
    achromatic: Vec<f32>,
    red_green: Vec<f32>,
    /// Two separable filters; their results are added.
    blue_yellow: [Vec<f32>; 2],
    /// A Gaussian; `edge` and `point` are its first and second derivatives.
    gauss: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
    /// Linear values of the 256 steps of a display.
    curve: [f64; 256],
}

impl Filters {
    fn new(pixels_per_degree: f64) -> Filters {
        let spatial = (3.0 * (BLUE_YELLOW[0].1 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
        let deviation = 0.5 * W * pixels_per_degree;
        let feature = (3.0 * deviation).ceil() as usize;
        let radius = spatial.max(feature);
        let taps = |filter_radius: usize, weight: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let tap = |i: usize| i as f64 - radius as f64;
            let weight = |x: f64| {
                if x.abs() <= filter_radius as f64 {
                    weight(x)
                } else {
                    0.0
                }
            };
            (0..2 * radius + 1).map(|i| weight(tap(i))).collect()
        };
        let gaussian = |x: f64, (a, b): (f64, f64)| {
            let x = x / pixels_per_degree;
            a * (PI / b).sqrt() * (-PI * PI * x * x / b).exp()
        };
        // A 2D Gaussian is the product of two 1D Gaussians that have the square root of its amplitude.
        let root = |x: f64, (a, b): (f64, f64)| gaussian(x, ((a / (PI / b).sqrt()).sqrt(), b));
        let achromatic = taps(spatial, &|x| gaussian(x, ACHROMATIC));
        let red_green = taps(spatial, &|x| gaussian(x, RED_GREEN));
        let blue_yellow = BLUE_YELLOW.map(|gauss| taps(spatial, &|x| root(x, gauss)));
        let sum = |weights: &[f64]| weights.iter().sum::<f64>();
        let blue_yellow_sum = blue_yellow
            .iter()
            .map(|weights| sum(weights).powi(2))
            .sum::<f64>()
            .sqrt();
        let bell = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let gauss = taps(feature, &bell);
        let edge = taps(feature, &|x| -x * bell(x));
        let point = taps(feature, &|x| (x * x / (deviation * deviation) - 1.0) * bell(x));
        let divided = |weights: &[f64], sum: f64| {
            let weights = weights.iter().map(|weight| (weight / sum) as f32);
            weights.collect::<Vec<f32>>()
        };
        // Scales positive weights to a sum of 1, and negative weights to a sum of -1.
        let balanced = |weights: &[f64]| {
            let above: f64 = weights.iter().filter(|weight| **weight > 0.0).sum();
            let below: f64 = weights.iter().filter(|weight| **weight < 0.0).sum();
            let scaled = |weight: &f64| (if *weight > 0.0 { weight / above } else { -weight / below }) as f32;
            weights.iter().map(scaled).collect::<Vec<f32>>()
        };
        Filters {
            radius,
            achromatic: divided(&achromatic, sum(&achromatic)),
            red_green: divided(&red_green, sum(&red_green)),
            blue_yellow: blue_yellow.map(|weights| divided(&weights, blue_yellow_sum)),
            gauss: divided(&gauss, sum(&gauss)),
            edge: balanced(&edge),
            point: balanced(&point),
            curve: std::array::from_fn(|i| srgb_to_linear(i as f64 / 255.0)),
        }
    }
}

/// Tone curve (a x² + b x + c) / (d x² + e x + f) of HDR-ꟻLIP: Narkowicz, "ACES filmic tone mapping curve", 2015,
/// without its exposure of 0.6.
const ACES: [f64; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

fn tone(x: f64) -> f64 {
    let [a, b, c, d, e, f] = ACES;
    (a * x * x + b * x + c) / (d * x * x + e * x + f)
}

/// Returns the exposures in stops for linear images, about one stop apart. The first maps the brightest pixel of the
/// reference to 0.85, the last maps the median luminance to 0.85. If the median is 0, black pixels are ignored. For a
/// black reference, the only exposure is 0.
fn exposures(colors: &Colors) -> Vec<f64> {
    let rows = (0..colors.height).into_par_iter();
    let luminances = rows.flat_map_iter(|y| {
        let [r, g, b] = colors.values(y, 0..colors.width).1;
        let colors = r.into_iter().zip(g).zip(b);
        let luminance =
            |((r, g), b): ((f64, f64), f64)| (0.2126 * r.max(0.0) + 0.7152 * g.max(0.0) + 0.0722 * b.max(0.0)) as f32;
        colors.map(luminance).collect::<Vec<f32>>()
    });
    let mut luminances: Vec<f32> = luminances.collect();
    let brightest = luminances.iter().copied().fold(0.0, f32::max);
    if !(brightest > 0.0) {
        return vec![0.0];
    }
    let mut middle = median(&mut luminances);
    if !(middle > 0.0) {
        luminances.retain(|luminance| *luminance > 0.0);
        middle = median(&mut luminances);
    }
    let [a, b, c, d, e, f] = ACES;
    let (a, b, c) = (a - 0.85 * d, b - 0.85 * e, c - 0.85 * f);
    let half = -0.5 * b / a;
    let bright = half + (half * half - c / a).sqrt();
    let start = (bright / f64::from(brightest)).log2();
    let stop = (bright / f64::from(middle)).log2();
    let count = (stop - start).ceil().max(2.0);
    let step = (stop - start) / (count - 1.0);
    (0..count as usize).map(|i| start + i as f64 * step).collect()
}

fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    match values.is_empty() {
        true => 0.0,
        false => *values.select_nth_unstable_by(middle, f32::total_cmp).1,
    }
}

#[derive(Clone, Copy, Debug)]
struct Tile {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

/// Three planes of a tile with a margin for the filters. Pixels outside the image repeat the edge of the image.
struct PaddedTile {
    width: usize,
    values: [Vec<f32>; 3],
}

impl Tile {
    fn errors(&self, colors: &Colors, filters: &Filters, exposures: Option<&[f64]>) -> Vec<f32> {
        let radius = filters.radius;
        let columns = self.x.saturating_sub(radius)..colors.width.min(self.x + self.width + radius);
        let rows = self.y.saturating_sub(radius)..colors.height.min(self.y + self.height + radius);
        let mut errors = vec![0.0; self.width * self.height];
        if rows.clone().all(|y| colors.stores_same_integers(y, columns.clone())) {
            return errors;
        }
        let width = self.width + 2 * radius;
        let empty = || PaddedTile {
            width,
            values: [const { Vec::new() }; 3],
        };
        let (mut a, mut b) = (empty(), empty());
        for i in 0..self.height + 2 * radius {
            let y = (self.y + i).saturating_sub(radius).min(colors.height - 1);
            let (row_a, row_b) = colors.values(y, columns.clone());
            for (padded, row) in [(&mut a, row_a), (&mut b, row_b)] {
                for (to, from) in padded.values.iter_mut().zip(row) {
                    to.extend((0..width).map(|j| {
                        let x = (self.x + j).saturating_sub(radius).min(colors.width - 1);
                        from[x - columns.start].max(0.0) as f32
                    }));
                }
            }
        }
        if a.values == b.values {
            return errors;
        }
        match exposures {
            None => {
                let linear = |value: f64| screen_to_linear(&filters.curve, value);
                self.raise_errors(&opponents(&a, linear), &opponents(&b, linear), filters, &mut errors);
            }
            Some(exposures) => {
                for exposure in exposures {
                    let factor = exposure.exp2();
                    let linear = |value: f64| tone(value * factor).clamp(0.0, 1.0);
                    self.raise_errors(&opponents(&a, linear), &opponents(&b, linear), filters, &mut errors);
                }
            }
        }
        errors
    }

    /// Raises each of `errors` to at least the error between two tiles in opponent colors.
    fn raise_errors(&self, a: &PaddedTile, b: &PaddedTile, filters: &Filters, errors: &mut [f32]) {
        let (lines_a, lines_b) = (
            Lines::filter_horizontally(a, self.width, filters),
            Lines::filter_horizontally(b, self.width, filters),
        );
        let max_distance = max_distance();
        let (mut row_a, mut row_b) = (FilteredRow::new(self.width), FilteredRow::new(self.width));
        for (y, errors) in errors.chunks_mut(self.width).enumerate() {
            row_a.filter_vertically(&lines_a, y, filters);
            row_b.filter_vertically(&lines_b, y, filters);
            for (x, error) in errors.iter_mut().enumerate() {
                let color = color_difference(row_a.color(x), row_b.color(x), max_distance);
                let ((edge_a, point_a), (edge_b, point_b)) = (row_a.features(x), row_b.features(x));
                let feature = (edge_a - edge_b).abs().max((point_a - point_b).abs());
                let feature = (f64::from(feature) * std::f64::consts::FRAC_1_SQRT_2).powf(QF);
                let pixel_error = if color > 0.0 { color.powf(1.0 - feature) } else { 0.0 };
                *error = error.max(pixel_error as f32);
            }
        }
    }
}

/// Converts to the opponent space Y Cx Cz. `linear` converts a value to linear display light.
fn opponents(padded: &PaddedTile, linear: impl Fn(f64) -> f64) -> PaddedTile {
    let count = padded.values[0].len();
    let mut values = [const { Vec::new() }; 3].map(|mut list: Vec<f32>| {
        list.reserve_exact(count);
        list
    });
    let [r, g, b] = &padded.values;
    for ((r, g), b) in r.iter().zip(g).zip(b) {
        let [x, y, z] = xyz_relative_to_white([*r, *g, *b].map(|value| linear(f64::from(value))));
        let opponent = [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)];
        for (to, value) in values.iter_mut().zip(opponent) {
            to.push(value as f32);
        }
    }
    PaddedTile {
        width: padded.width,
        values,
    }
}

/// Returns X, Y and Z of a linear color relative to white: IEC 61966-2-1, with the matrix of ꟻLIP.
fn xyz_relative_to_white([r, g, b]: [f64; 3]) -> [f64; 3] {
    let x = (10_135_552.0 * r + 8_788_810.0 * g + 4_435_075.0 * b) / 24_577_794.0;
    let y = (2_613_072.0 * r + 8_788_810.0 * g + 887_015.0 * b) / 12_288_897.0;
    let z = (1_425_312.0 * r + 8_788_810.0 * g + 70_074_185.0 * b) / 73_733_382.0;
    [x * INVERSE_WHITE[0], y, z * INVERSE_WHITE[1]]
}

/// 1 / X and 1 / Z of white, whose Y is 1.
const INVERSE_WHITE: [f64; 2] = [1.052_156_925, 0.918_357_670];

/// Converts an opponent color to linear RGB, clamped to 0 ... 1.
fn linear([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let (x, z) = ((y + cx / 500.0) / INVERSE_WHITE[0], (y - cz / 200.0) / INVERSE_WHITE[1]);
    let rows = [
        [3.241_003_275, -1.537_398_934, -0.498_615_861],
        [-0.969_224_334, 1.875_930_071, 0.041_554_224],
        [0.055_639_423, -0.204_011_202, 1.057_148_933],
    ];
    rows.map(|[a, b, c]: [f64; 3]| (a * x + b * y + c * z).clamp(0.0, 1.0))
}

/// Returns L*, a* and b* of a linear color; a* and b* are scaled by L* (Hunt effect).
fn hunt_lab(color: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = xyz_relative_to_white(color).map(|value| {
        if value > DELTA * DELTA * DELTA {
            value.cbrt()
        } else {
            value / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * y - 16.0;
    [
        lightness,
        0.01 * lightness * 500.0 * (x - y),
        0.01 * lightness * 200.0 * (y - z),
    ]
}

/// Returns the HyAB distance of two colors, raised to the power `QC`.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(QC)
}

/// Returns the maximum distance, which is the distance between green and blue.
fn max_distance() -> f64 {
    distance(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]))
}

/// Returns the error, 0 to 1, between two filtered opponent colors.
fn color_difference(a: [f32; 3], b: [f32; 3], max_distance: f64) -> f64 {
    if a == b {
        return 0.0;
    }
    let lab = |color: [f32; 3]| hunt_lab(linear(color.map(f64::from)));
    let (distance, knee) = (distance(lab(a), lab(b)), PC * max_distance);
    if distance < knee {
        distance * PT / knee
    } else {
        PT + (distance - knee) / (max_distance - knee) * (1.0 - PT)
    }
}

/// A horizontally filtered tile. The channels are achromatic, red-green and two of blue-yellow; then the achromatic
/// channel, filtered by a Gaussian and by the two derivatives of the Gaussian.
struct Lines {
    width: usize,
    values: [Vec<f32>; 7],
}

impl Lines {
    fn filter_horizontally(padded: &PaddedTile, width: usize, filters: &Filters) -> Lines {
        let [achromatic, red_green, blue_yellow] = &padded.values;
        let filter = |from: &[f32], weights: &[f32]| {
            let mut lines = vec![0.0; from.len() / padded.width * width];
            for (to, from) in lines.chunks_mut(width).zip(from.chunks(padded.width)) {
                for (i, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
                    add(to, &from[i..i + width], *weight);
                }
            }
            lines
        };
        Lines {
            width,
            values: [
                filter(achromatic, &filters.achromatic),
                filter(red_green, &filters.red_green),
                filter(blue_yellow, &filters.blue_yellow[0]),
                filter(blue_yellow, &filters.blue_yellow[1]),
                filter(achromatic, &filters.gauss),
                filter(achromatic, &filters.edge),
                filter(achromatic, &filters.point),
            ],
        }
    }
}

/// A row that is filtered in both directions: the four color channels, the first and second derivatives in x, and the
/// first and second derivatives in y.
struct FilteredRow {
    values: [Vec<f32>; 8],
}

impl FilteredRow {
    fn new(width: usize) -> FilteredRow {
        FilteredRow {
            values: std::array::from_fn(|_| vec![0.0; width]),
        }
    }

    fn filter_vertically(&mut self, lines: &Lines, y: usize, filters: &Filters) {
        let channels = [0, 1, 2, 3, 5, 6, 4, 4];
        let weights = [
            &filters.achromatic,
            &filters.red_green,
            &filters.blue_yellow[0],
            &filters.blue_yellow[1],
            &filters.gauss,
            &filters.gauss,
            &filters.edge,
            &filters.point,
        ];
        for ((to, channel), weights) in self.values.iter_mut().zip(channels).zip(weights) {
            to.fill(0.0);
            let rows = lines.values[channel].chunks(lines.width).skip(y);
            for (row, weight) in rows.zip(weights).filter(|(_, weight)| **weight != 0.0) {
                add(to, row, *weight);
            }
        }
    }

    fn color(&self, x: usize) -> [f32; 3] {
        let [achromatic, red_green, first, second, ..] = &self.values;
        [achromatic[x], red_green[x], first[x] + second[x]]
    }

    /// Returns the edge and point features. The achromatic channel is scaled to 0 ... 1; derivatives ignore its offset.
    fn features(&self, x: usize) -> (f32, f32) {
        let [.., edge_x, point_x, edge_y, point_y] = &self.values;
        (edge_x[x].hypot(edge_y[x]) / 116.0, point_x[x].hypot(point_y[x]) / 116.0)
    }
}

fn add(to: &mut [f32], from: &[f32], weight: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

/// Converts a display value to a linear value. The 256 values of an 8-bit image, even if rounded to `f32`, are looked
/// up in the table.
fn screen_to_linear(curve: &[f64; 256], value: f64) -> f64 {
    let step = (value * 255.0 + 0.5) as u8;
    if value as f32 == (f64::from(step) / 255.0) as f32 {
        curve[usize::from(step)]
    } else {
        srgb_to_linear(value)
    }
}
