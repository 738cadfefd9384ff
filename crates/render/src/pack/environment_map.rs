//! Packs the environment map: texels, and the tables for sampling it.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{BACKGROUND, ENVIRONMENT_BLOCKS, ENVIRONMENT_INVISIBLE, ENVIRONMENT_MAP, Environment, NORMAL_BINS};
use wgray_scene::downsample::linear;
use wgray_scene::{self as scene, EnvironmentImage, Scene};

/// Minimum integral of a map over all directions. Darker maps count as black, because their PDFs would approach the
/// subnormal numbers.
const MIN_INTEGRAL: f64 = 1e-25;
/// Blocks with less than this fraction of the map's power get no light samples; only BSDF samples reach them.
const MIN_BLOCK_FRACTION: f64 = 1e-12;
/// Number of parts per side of a block; each part has its own mean direction.
const PARTS_PER_SIDE: usize = 4;
/// Approximate angular radius of a bin of normals.
const BIN_RADIUS: f64 = 0.06;

#[derive(Debug, Default)]
pub struct EnvironmentMap(Option<PackedMap>);

#[derive(Clone, Debug)]
struct PackedMap {
    rows: [Vec3; 3],
    width: u32,
    height: u32,
    texels: usize,
    cells: usize,
    blocks: usize,
    shifts: u32,
    /// Integral of the radiance (mean of red, green and blue) over all directions.
    sum: f64,
}

impl EnvironmentMap {
    /// Appends texels and sampling tables.
    pub fn of(scene: &Scene, texels: &mut Vec<u32>) -> EnvironmentMap {
        let image = scene
            .environment
            .as_ref()
            .and_then(|environment| environment.image.as_ref());
        EnvironmentMap(image.and_then(|image| pack_map(image, texels)))
    }

    /// Returns the map with texels and sampling tables that start at another offset.
    pub fn with_start(&self, start: usize) -> EnvironmentMap {
        EnvironmentMap(self.0.as_ref().map(|map| PackedMap {
            texels: start,
            cells: map.cells - map.texels + start,
            blocks: map.blocks - map.texels + start,
            ..map.clone()
        }))
    }

    pub fn sum(&self) -> Option<f64> {
        self.0.as_ref().map(|map| map.sum)
    }

    /// Returns the flags of [`Specialization::environment_flags`](wgray_trace::records::Specialization::environment_flags).
    pub fn bits(&self, scene: &Scene) -> u32 {
        let any = |test: fn(&scene::Environment) -> bool| scene.environment.as_ref().is_some_and(test);
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        bit(self.0.is_some(), ENVIRONMENT_MAP)
            | bit(any(|environment| !environment.visible), ENVIRONMENT_INVISIBLE)
            | bit(any(|environment| environment.background.is_some()), BACKGROUND)
    }

    /// Returns a record with the fields of the map. `probability` is the probability of sampling the map.
    pub fn record(&self, probability: f64) -> Environment {
        let Some(map) = &self.0 else {
            return bytemuck::Zeroable::zeroed();
        };
        let [x, y, z] = map.rows;
        Environment {
            x,
            texels: map.texels as u32,
            y,
            width: map.width,
            z,
            height: map.height,
            cells: map.cells as u32,
            // The kernels multiply by the sum of three components at four corners, not by the mean.
            density: (probability / 12.0) as f32,
            blocks: map.blocks as u32,
            shifts: map.shifts,
            ..bytemuck::Zeroable::zeroed()
        }
    }
}

fn pack_map(environment: &EnvironmentImage, texels: &mut Vec<u32>) -> Option<PackedMap> {
    let image = &*environment.image;
    let (width, height) = (image.width as usize, image.height as usize);
    let start = texels.len();
    let cells = start + 3 * width * (height + 2);
    let blocks = cells + 2 * width * (height + 1);
    let grid = Grid::of(width, height);
    texels.reserve_exact(blocks + grid.words() - start);
    let texel = linear(image);
    let color = |i: usize| texel(i) * environment.scale;
    let pole = |row: usize| (0..width).map(|column| color(row * width + column)).sum::<DVec3>() / width as f64;
    let mut add = |color: DVec3| texels.extend(color.as_vec3().to_array().map(f32::to_bits));
    (0..width).for_each(|_| add(pole(0)));
    (0..width * height).for_each(|i| add(color(i)));
    (0..width).for_each(|_| add(pole(height - 1)));
    let weights = weights(&texels[start..], width, height);
    let sum: f64 = weights.iter().sum();
    if !(sum >= MIN_INTEGRAL) {
        texels.truncate(start);
        return None;
    }
    let axes = [
        environment.to_world.x_axis,
        environment.to_world.y_axis,
        environment.to_world.z_axis,
    ];
    grid.write_cells(&weights, texels);
    grid.write_distributions(&weights, axes, sum, texels);
    Some(PackedMap {
        rows: axes.map(|axis| axis.as_vec3()),
        width: image.width,
        height: image.height,
        texels: start,
        cells,
        blocks,
        shifts: (grid.column_shift | grid.row_shift << 8) as u32,
        sum,
    })
}

/// Partition of the cells into at most [`ENVIRONMENT_BLOCKS`] x [`ENVIRONMENT_BLOCKS`] blocks. The sides of blocks are
/// powers of two, except at the right and lower edges.
struct Grid {
    width: usize,
    height: usize,
    /// log2 of a block's width in cells.
    column_shift: usize,
    /// log2 of a block's height in cells.
    row_shift: usize,
}

/// Integrals over a part of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    /// Integral of direction times radiance.
    vector: DVec3,
    /// Integral of radiance.
    power: f64,
}

impl Grid {
    /// Returns the partition for an image size in texels.
    fn of(width: usize, height: usize) -> Grid {
        let max_blocks = ENVIRONMENT_BLOCKS as usize;
        let shift = |count: usize| (0..).find(|shift| (count - 1) >> shift < max_blocks).unwrap_or(0);
        Grid {
            width,
            height: height + 1,
            column_shift: shift(width),
            row_shift: shift(height + 1),
        }
    }

    fn columns(&self) -> usize {
        ((self.width - 1) >> self.column_shift) + 1
    }

    fn rows(&self) -> usize {
        ((self.height - 1) >> self.row_shift) + 1
    }

    fn words(&self) -> usize {
        let (side, bins) = (ENVIRONMENT_BLOCKS as usize, (NORMAL_BINS * NORMAL_BINS) as usize + 1);
        self.rows() * side + bins * (self.rows() + 1) * (side + 1)
    }

    /// Returns the column and row ranges of the blocks, row by row.
    fn blocks(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        let columns = move |i: usize| i << self.column_shift..((i + 1) << self.column_shift).min(self.width);
        let rows = move |i: usize| i << self.row_shift..((i + 1) << self.row_shift).min(self.height);
        (0..self.rows()).flat_map(move |row| (0..self.columns()).map(move |column| (columns(column), rows(row))))
    }

    fn write_cells(&self, weights: &[f64], words: &mut Vec<u32>) {
        let table = |(columns, rows): (Range<usize>, Range<usize>)| {
            let cells: Vec<(usize, usize)> = rows
                .flat_map(|row| columns.clone().map(move |column| (row, column)))
                .collect();
            let cell_weights: Vec<f64> = cells
                .iter()
                .map(|(row, column)| weights[row * self.width + column])
                .collect();
            let mean = cell_weights.iter().sum::<f64>() / cell_weights.len() as f64;
            let scale = if mean > 0.0 { 1.0 / mean } else { 0.0 };
            let mut words = Vec::with_capacity(2 * cell_weights.len());
            write_table(
                cell_weights.into_iter().map(|weight| weight * scale).collect(),
                &mut words,
            );
            for pair in words.chunks_mut(2) {
                let (row, column) = cells[pair[1] as usize];
                pair[1] = (row << 16 | column) as u32;
            }
            words
        };
        // One row of blocks at a time, to bound the memory.
        let blocks: Vec<_> = self.blocks().collect();
        for blocks in blocks.chunks(self.columns()) {
            let tables: Vec<Vec<u32>> = blocks.par_iter().cloned().map(table).collect();
            tables.iter().for_each(|table| words.extend_from_slice(table));
        }
    }

    /// Writes the reciprocal of the power of each block, then the cumulative distributions over the blocks: one for
    /// each bin of normals, weighted by the clamped cosine, and one without the cosine.
    fn write_distributions(&self, weights: &[f64], axes: [DVec3; 3], sum: f64, words: &mut Vec<u32>) {
        let side = ENVIRONMENT_BLOCKS as usize;
        let mut powers = vec![0.0; self.rows() * side];
        let mut parts: Vec<(usize, Part)> = Vec::new();
        let sines_and_cosines = |count: usize, angle: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            (0..count).map(|i| angle(i).sin_cos()).collect()
        };
        let azimuths = sines_and_cosines(self.width, &|i| PI - TAU * (i + 1) as f64 / self.width as f64);
        let image_rows = (self.height - 1) as f64;
        let polar = sines_and_cosines(self.height, &|row| {
            let border = |row: f64| row.clamp(0.0, image_rows) / image_rows * PI;
            0.5 * (border(row as f64 - 0.5) + border(row as f64 + 0.5))
        });
        for (i, (columns, rows)) in self.blocks().enumerate() {
            let block = i / self.columns() * side + i % self.columns();
            let mut block_parts = [Part::default(); PARTS_PER_SIDE * PARTS_PER_SIDE];
            for row in rows.clone() {
                for column in columns.clone() {
                    let weight = weights[row * self.width + column];
                    let ((sine, cosine), (y, x)) = (polar[row], azimuths[column]);
                    let part_index = |i: usize, range: &Range<usize>| (i - range.start) * PARTS_PER_SIDE / range.len();
                    let part = &mut block_parts[part_index(row, &rows) * PARTS_PER_SIDE + part_index(column, &columns)];
                    part.power += weight;
                    part.vector += weight * DVec3::new(sine * x, sine * y, cosine);
                }
            }
            let power: f64 = block_parts.iter().map(|part| part.power).sum();
            if power > MIN_BLOCK_FRACTION * sum {
                powers[block] = power;
                parts.extend(
                    block_parts
                        .into_iter()
                        .filter(|part| part.power > 0.0)
                        .map(|part| (block, part)),
                );
            }
        }
        let inverse = |power: &f64| if *power > 0.0 { (1.0 / power) as f32 } else { 0.0 };
        words.extend(powers.iter().map(inverse).map(f32::to_bits));
        let cell_radius = ((PI / self.width as f64).powi(2) + (PI / 2.0 / image_rows).powi(2)).sqrt();
        let lobes: Vec<(usize, DVec3, f64, f64)> = (parts.iter())
            .map(|(block, Part { vector, power })| {
                let mean = *vector / *power;
                let spread = (1.0 - mean.length_squared()).max(0.0).sqrt() + cell_radius.min(1.0) + BIN_RADIUS;
                let [x, y, z] = axes;
                (*block, x * mean.x + y * mean.y + z * mean.z, *power, spread.min(1.0))
            })
            .collect();
        let bins = (0..NORMAL_BINS * NORMAL_BINS).into_par_iter().map(|bin| {
            let normal = bin_normal(bin);
            let mut cosines = vec![0.0; powers.len()];
            for (block, mean, power, spread) in &lobes {
                cosines[*block] += power * mean_cosine(normal.dot(*mean), *spread);
            }
            // If no light is in front of the surface, no sample contributes, so the distribution does not matter.
            let has_light = cosines.iter().any(|weight| *weight > 0.0);
            let mut words = Vec::new();
            write_bin(if has_light { &cosines } else { &powers }, &mut words);
            words
        });
        let bins: Vec<Vec<u32>> = bins.collect();
        bins.iter().for_each(|bin| words.extend_from_slice(bin));
        write_bin(&powers, words);
    }
}

/// Returns the normal at the center of a bin; inverse of `normal_bin`.
fn bin_normal(bin: u32) -> DVec3 {
    let coordinate = |i: u32| f64::from(i) / f64::from(NORMAL_BINS - 1) * 2.0 - 1.0;
    let (x, y) = (coordinate(bin % NORMAL_BINS), coordinate(bin / NORMAL_BINS));
    let z = 1.0 - x.abs() - y.abs();
    let folded = |a: f64, b: f64| if z < 0.0 { (1.0 - b.abs()).copysign(a) } else { a };
    DVec3::new(folded(x, y), folded(y, x), z).normalize()
}

/// Returns the mean clamped cosine for cosines uniform in m - r to m + r. If few cosines are positive, the result
/// exceeds the mean, so that light just above the horizon is sampled often enough.
fn mean_cosine(m: f64, r: f64) -> f64 {
    if m >= r {
        m
    } else if m <= -r {
        0.0
    } else {
        (m + r) * 0.25 * ((m + r) / r).max(1.0)
    }
}

/// Writes the cumulative distribution of the rows of blocks, then the cumulative distributions of the blocks in each
/// row.
fn write_bin(weights: &[f64], words: &mut Vec<u32>) {
    let rows: Vec<&[f64]> = weights.chunks(ENVIRONMENT_BLOCKS as usize).collect();
    let sums: Vec<f64> = rows.iter().map(|row| row.iter().sum()).collect();
    write_distribution(&sums, words);
    rows.iter().for_each(|row| write_distribution(row, words));
}

/// Writes the cumulative distribution of up to [`ENVIRONMENT_BLOCKS`] weights in multiples of 2^-24, so that
/// differences are exact. A weight of 0 gives an empty interval.
fn write_distribution(weights: &[f64], words: &mut Vec<u32>) {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    let last = weights.iter().rposition(|weight| *weight > 0.0);
    for i in 0..=ENVIRONMENT_BLOCKS as usize {
        let bound = match last {
            Some(last) if i > last => 1.0,
            None => 1.0_f64.min(i as f64),
            _ => (sum / total * 16_777_216.0).round() / 16_777_216.0,
        };
        words.push((bound as f32).to_bits());
        sum += weights.get(i).copied().unwrap_or(0.0);
    }
}

/// Returns the weights of cells: the mean of the values at the corners times the solid angle.
fn weights(texels: &[u32], width: usize, height: usize) -> Vec<f64> {
    let value = |i: usize| {
        let rgb = &texels[3 * i..3 * i + 3];
        rgb.iter().map(|bits| f64::from(f32::from_bits(*bits))).sum::<f64>() / 3.0
    };
    let mut weights = Vec::with_capacity(width * (height + 1));
    let mut upper: Vec<f64> = (0..width).map(value).collect();
    for row in 0..=height {
        let lower: Vec<f64> = (0..width).map(|column| value((row + 1) * width + column)).collect();
        let angle = solid_angle(row, width, height) / 4.0;
        for column in 0..width {
            let next = (column + 1) % width;
            weights.push((upper[column] + upper[next] + lower[column] + lower[next]) * angle);
        }
        upper = lower;
    }
    weights
}

fn solid_angle(row: usize, width: usize, height: usize) -> f64 {
    let border = |row: f64| (row - 0.5).clamp(0.0, height as f64) / height as f64 * std::f64::consts::PI;
    let (above, below) = (border(row as f64), border(row as f64 + 1.0));
    // cos a - cos b without cancellation.
    let zone = 2.0 * ((above + below) / 2.0).sin() * ((below - above) / 2.0).sin();
    std::f64::consts::TAU / width as f64 * zone
}

/// Writes the alias table of weights with mean 1: Vose, "A Linear Algorithm for Generating Random Numbers with a Given
/// Distribution", IEEE TSE 17(9), 1991. Scans replace the lists of small and large weights, which would use as much
/// memory as the table. The first large weight fills each small weight.
fn write_table(mut weights: Vec<f64>, words: &mut Vec<u32>) {
    let start = words.len();
    words.extend((0..weights.len() as u32).flat_map(|i| [u32::MAX, i]));
    let next_large = |weights: &[f64], start: usize| (start..weights.len()).find(|i| weights[*i] >= 1.0);
    let mut large = next_large(&weights, 0);
    for i in 0..weights.len() {
        let mut small = i;
        // A large weight before `i` that becomes small is filled at once. Later weights are filled when the loop
        // reaches their indices.
        while let Some(donor) = large
            && weights[small] < 1.0
        {
            // Rounded up, so that every positive weight can be selected.
            words[start + 2 * small] = (weights[small] * 4_294_967_296.0).ceil() as u32;
            words[start + 2 * small + 1] = donor as u32;
            weights[donor] -= 1.0 - weights[small];
            if weights[donor] >= 1.0 {
                break;
            }
            large = next_large(&weights, donor + 1);
            if donor > i {
                break;
            }
            small = donor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgray_trace::cpu::equirect::normal_bin;

    /// Returns the probabilities that an alias table encodes.
    fn probabilities(words: &[u32]) -> Vec<f64> {
        let count = words.len() / 2;
        let mut out = vec![0.0; count];
        for (i, pair) in words.chunks(2).enumerate() {
            let probability = if pair[1] as usize == i {
                1.0
            } else {
                f64::from(pair[0]) / 4_294_967_296.0
            };
            out[i] += probability / count as f64;
            out[pair[1] as usize] += (1.0 - probability) / count as f64;
        }
        out
    }

    #[test]
    fn alias_tables_reproduce_their_weights() {
        let random = |i: usize| ((i as f64 * 0.618_033_988_749) % 1.0).powi(9);
        for weights in [
            vec![1.0],
            vec![2.0, 0.0],
            vec![0.0, 2.0],
            vec![0.0, 0.0, 3.0, 1.0],
            vec![3.0, 0.5, 0.5, 0.0],
            vec![1.5, 0.4, 1.6, 0.5],
            vec![1e-12, 1.0, 1e6],
            (0..1000).map(random).collect(),
            (0..1000).rev().map(random).collect(),
        ] {
            let sum: f64 = weights.iter().sum();
            let mean = sum / weights.len() as f64;
            let mut words = vec![7, 7];
            write_table(weights.iter().map(|weight| weight / mean).collect(), &mut words);
            for (found, weight) in probabilities(&words[2..]).into_iter().zip(&weights) {
                assert!((found - weight / sum).abs() < 1e-9, "{found} for {weight} of {sum}");
                assert!((found > 0.0) == (*weight > 0.0), "{found} for {weight} of {sum}");
            }
        }
    }

    fn widths(words: &[u32]) -> Vec<f64> {
        let bounds: Vec<f64> = words.iter().map(|bits| f64::from(f32::from_bits(*bits))).collect();
        assert_eq!((bounds[0], bounds[bounds.len() - 1]), (0.0, 1.0));
        bounds.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    #[test]
    fn cumulative_distributions_match_their_weights() {
        for weights in [
            vec![1.0],
            vec![0.0, 3.0, 0.0],
            vec![1e-30, 1.0, 1e6, 0.0],
            vec![0.0],
            (0..32).map(|i| f64::from(i % 5)).collect(),
        ] {
            let mut words = Vec::new();
            write_distribution(&weights, &mut words);
            assert_eq!(words.len(), 33);
            let sum: f64 = weights.iter().sum();
            let widths = widths(&words);
            for (i, width) in widths.iter().enumerate() {
                let weight = weights.get(i).copied().unwrap_or(0.0);
                if sum > 0.0 {
                    assert!((width - weight / sum).abs() < 1.3e-7, "{weights:?}: {width} at {i}");
                    assert!(weight > 0.0 || *width == 0.0, "{weights:?}: {width} at {i}");
                }
            }
        }
    }

    #[test]
    fn bins_contain_their_center_normal() {
        for bin in 0..NORMAL_BINS * NORMAL_BINS {
            // Two points on the edge of the octahedral map represent the same normal.
            let normal = bin_normal(bin);
            let center = bin_normal(normal_bin(normal.as_vec3()));
            assert!((normal - center).length() < 1e-6, "{bin}: {normal}, {center}");
        }
        assert_eq!(normal_bin(Vec3::ZERO), NORMAL_BINS * NORMAL_BINS);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z]
            .into_iter()
            .flat_map(|axis| [axis, -axis])
        {
            let middle = bin_normal(normal_bin(axis.as_vec3()));
            assert!((middle - axis).length() < 1e-6, "{axis}: {middle}");
        }
    }

    #[test]
    fn the_mean_cosine_matches_quadrature() {
        for r in [0.05, 0.2, 1.0] {
            for m in [0.0, 0.3 * r, r, 1.7 * r] {
                let count = 10_000;
                let cosine = |i: i32| m - r + 2.0 * r * (f64::from(i) + 0.5) / f64::from(count);
                let mean = (0..count).map(|i| cosine(i).max(0.0)).sum::<f64>() / f64::from(count);
                assert!((mean_cosine(m, r) - mean).abs() < 1e-6 * r, "{m}, {r}: {mean}");
            }
            assert_eq!(mean_cosine(-r, r), 0.0);
            assert!(mean_cosine(-0.99 * r, r) > 0.0);
        }
    }

    /// Block probabilities approximate the irradiance for a normal; cell probabilities match the power.
    #[test]
    fn block_probabilities_approximate_irradiance() {
        for (width, height) in [(1, 1), (2, 1), (5, 3), (64, 32), (100, 77), (1024, 512)] {
            let grid = Grid::of(width, height);
            assert!(grid.columns() <= 32 && grid.rows() <= 32, "{width} x {height}");
            let weights: Vec<f64> = (0..width * (height + 1))
                .map(|i| (1.0 + (i * i % 7) as f64) * solid_angle(i / width, width, height))
                .collect();
            let sum: f64 = weights.iter().sum();
            let mut words = Vec::new();
            grid.write_cells(&weights, &mut words);
            assert_eq!(words.len(), 2 * weights.len());
            let cells = std::mem::take(&mut words);
            grid.write_distributions(&weights, [DVec3::X, DVec3::Y, DVec3::Z], sum, &mut words);
            assert_eq!(words.len(), grid.words(), "{width} x {height}");
            let mut first_cell = 0;
            for (i, (columns, rows)) in grid.blocks().enumerate() {
                let block_cells: Vec<usize> = rows
                    .flat_map(|row| columns.clone().map(move |column| row * width + column))
                    .collect();
                let power: f64 = block_cells.iter().map(|cell| weights[*cell]).sum();
                let block = i / grid.columns() * 32 + i % grid.columns();
                let inverse = f64::from(f32::from_bits(words[block]));
                assert!((inverse * power - 1.0).abs() < 1e-6, "{width} x {height}, block {i}");
                // Aliases are stored as row and column.
                let table: Vec<u32> = cells[2 * first_cell..2 * (first_cell + block_cells.len())]
                    .chunks(2)
                    .flat_map(|pair| {
                        let alias = (pair[1] >> 16) as usize * width + (pair[1] & 0xffff) as usize;
                        let position = block_cells.iter().position(|cell| *cell == alias);
                        [pair[0], position.expect("a cell of the block") as u32]
                    })
                    .collect();
                for (found, cell) in probabilities(&table).into_iter().zip(&block_cells) {
                    assert!(
                        (found - weights[*cell] / power).abs() < 1e-6,
                        "{width} x {height}, block {i}"
                    );
                }
                first_cell += block_cells.len();
            }
            // For the upward normal, light comes only from the upper hemisphere, so lower rows have probability 0.
            let stride = (grid.rows() + 1) * 33;
            let up_bin = normal_bin(Vec3::new(0.01, 0.01, 1.0)) as usize;
            let distribution = |bin: usize| widths(&words[grid.rows() * 32 + bin * stride..][..33]);
            let lower_probability: f64 = distribution(up_bin)[grid.rows().div_ceil(2) + 2..].iter().sum();
            let lower_probability_without_cosine: f64 = distribution((NORMAL_BINS * NORMAL_BINS) as usize)
                [grid.rows().div_ceil(2) + 2..]
                .iter()
                .sum();
            if height >= 32 {
                assert_eq!(lower_probability, 0.0, "{width} x {height}: light from behind");
                assert!(
                    lower_probability_without_cosine > 0.2,
                    "without the cosine: {lower_probability_without_cosine}"
                );
            }
        }
    }

    #[test]
    fn cells_cover_all_directions() {
        for (width, height) in [(1, 1), (2, 1), (3, 2), (64, 32), (5, 101)] {
            let sum: f64 = (0..=height)
                .map(|row| width as f64 * solid_angle(row, width, height))
                .sum();
            assert!(
                (sum - 4.0 * std::f64::consts::PI).abs() < 1e-12,
                "{width} x {height}: {sum}"
            );
        }
    }
}
