//! The CPU version of `shaders/kernels/denoise.wgsl`: the same sums in the same order, eight pixels at a time.
//! Distances of pixels are computed once per tile and offset, and summed over patches row by row.

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x8};
use glam::Vec3;
use rayon::prelude::*;

use super::guides::{Guides, MARGIN};
use wgray_trace::cpu::denoise::{color_distance, denoise_weight, feature_distance};
use wgray_trace::cpu::lanes::Lanes3;
use wgray_trace::cpu::math::{dot, max};
use wgray_trace::cpu::samples::LEVEL;
use wgray_trace::records::{
    DENOISE_PATCH_RADIUS, DENOISE_RADIUS, GUIDE_ALBEDO, GUIDE_COLOR, GUIDE_COLOR_VARIANCE, GUIDE_DEPTH, GUIDE_NORMAL,
    GUIDE_VARIANCE_LIMIT,
};

const LANES: usize = 8;
const TILE_WIDTH: usize = 128;
const TILE_HEIGHT: usize = 32;
const RADIUS: usize = DENOISE_RADIUS as usize;
/// Side of a patch.
const PATCH: usize = 2 * DENOISE_PATCH_RADIUS as usize + 1;
/// Columns and rows of a tile with the margins of its patches, in whole lanes.
const PATCH_COLUMNS: usize = (TILE_WIDTH + PATCH - 1).next_multiple_of(LANES);
const PATCH_ROWS: usize = TILE_HEIGHT + PATCH - 1;
/// Columns and rows of a tile's planes, in whole lanes.
const COLUMNS: usize = (PATCH_COLUMNS + 2 * RADIUS).next_multiple_of(LANES);
const ROWS: usize = PATCH_ROWS + 2 * RADIUS;

/// Filters the colors of the guides.
pub fn filter(guides: &Guides) -> Vec<Vec3> {
    let rows: Vec<usize> = (0..guides.height).step_by(TILE_HEIGHT).collect();
    let bands: Vec<Vec<Vec3>> = rows.into_par_iter().map(|y| filter_rows(guides, y)).collect();
    bands.concat()
}

/// Filters rows from `y` on, as many as a tile has.
fn filter_rows(guides: &Guides, y: usize) -> Vec<Vec3> {
    let height = TILE_HEIGHT.min(guides.height - y);
    let mut filtered = vec![Vec3::ZERO; height * guides.width];
    let mut tile = Tile::new();
    for x in (0..guides.width).step_by(TILE_WIDTH) {
        let width = TILE_WIDTH.min(guides.width - x);
        tile.read(guides, [x, y], [width, height]);
        dispatch!(*LEVEL, simd => tile.filter(simd));
        for row in 0..height {
            let start = row * guides.width + x;
            for (column, color) in filtered[start..start + width].iter_mut().enumerate() {
                *color = tile.color(row * TILE_WIDTH + column);
            }
        }
    }
    filtered
}

/// A tile of the image: its guides with margins, and the sums of its pixels.
struct Tile {
    /// Columns, in whole lanes, and rows of the part of the tile that lies in the image.
    columns: usize,
    rows: usize,
    planes: Vec<Vec<f32>>,
    /// Distances of a row of pixels.
    distances: Vec<f32>,
    /// Sums of the distances in a row of each pixel's patch.
    row_sums: Vec<f32>,
    /// Sums of weighted colors, and of weights.
    sums: [Vec<f32>; 4],
}

impl Tile {
    fn new() -> Tile {
        Tile {
            columns: 0,
            rows: 0,
            planes: vec![vec![0.0; COLUMNS * ROWS]; Guides::PLANES],
            distances: vec![0.0; PATCH_COLUMNS],
            row_sums: vec![0.0; PATCH_ROWS * TILE_WIDTH],
            sums: std::array::from_fn(|_| vec![0.0; TILE_WIDTH * TILE_HEIGHT]),
        }
    }

    /// Copies the guides of the tile at a position, of which a part with this size lies in the image. Pixels outside of
    /// the guides keep any value.
    fn read(&mut self, guides: &Guides, [x, y]: [usize; 2], [width, height]: [usize; 2]) {
        (self.columns, self.rows) = (width.next_multiple_of(LANES), height);
        let columns = COLUMNS.min(guides.stride - x);
        let rows = ROWS.min(guides.height + 2 * MARGIN - y);
        for (k, plane) in self.planes.iter_mut().enumerate() {
            for row in 0..rows {
                let start = (y + row) * guides.stride + x;
                plane[row * COLUMNS..row * COLUMNS + columns].copy_from_slice(&guides.plane(k)[start..start + columns]);
            }
        }
    }

    fn color(&self, i: usize) -> Vec3 {
        let [x, y, z, weight] = self.sums.each_ref().map(|sums| sums[i]);
        Vec3::new(x, y, z) / weight
    }

    #[inline(always)]
    fn filter<S: Simd>(&mut self, simd: S) {
        for sums in &mut self.sums {
            sums.fill(0.0);
        }
        for dy in 0..=2 * RADIUS {
            for dx in 0..=2 * RADIUS {
                self.sum_rows(simd, dx, dy);
                self.add_offset(simd, dx, dy);
            }
        }
    }

    /// Sums the distances of the pixels at an offset over the rows of all patches.
    #[inline(always)]
    fn sum_rows<S: Simd>(&mut self, simd: S, dx: usize, dy: usize) {
        for row in 0..self.rows + PATCH - 1 {
            let p = (row + RADIUS) * COLUMNS + RADIUS;
            let q = (row + dy) * COLUMNS + dx;
            for x in (0..self.columns + PATCH - 1).step_by(LANES) {
                let planes = Loader {
                    simd,
                    planes: &self.planes,
                    p: p + x,
                    q: q + x,
                };
                let distance = color_distance(
                    planes.squared(GUIDE_COLOR),
                    planes.p(GUIDE_COLOR_VARIANCE),
                    planes.q(GUIDE_COLOR_VARIANCE),
                    planes.p(GUIDE_VARIANCE_LIMIT),
                );
                distance.store_slice(&mut self.distances[x..x + LANES]);
            }
            for x in (0..self.columns).step_by(LANES) {
                let mut sum = load(simd, &self.distances, x);
                for i in 1..PATCH {
                    sum += load(simd, &self.distances, x + i);
                }
                let start = row * TILE_WIDTH + x;
                sum.store_slice(&mut self.row_sums[start..start + LANES]);
            }
        }
    }

    /// Adds the pixels at an offset to the sums.
    #[inline(always)]
    fn add_offset<S: Simd>(&mut self, simd: S, dx: usize, dy: usize) {
        for row in 0..self.rows {
            let p = (row + MARGIN) * COLUMNS + MARGIN;
            let q = (row + dy + MARGIN - RADIUS) * COLUMNS + dx + MARGIN - RADIUS;
            for x in (0..self.columns).step_by(LANES) {
                let i = row * TILE_WIDTH + x;
                let mut patch = load(simd, &self.row_sums, i);
                for j in 1..PATCH {
                    patch += load(simd, &self.row_sums, i + j * TILE_WIDTH);
                }
                let planes = Loader {
                    simd,
                    planes: &self.planes,
                    p: p + x,
                    q: q + x,
                };
                let color = patch * (1.0 / (PATCH * PATCH) as f32);
                let vectors = max(
                    planes.vector_distance(GUIDE_NORMAL),
                    planes.vector_distance(GUIDE_ALBEDO),
                );
                let distance = max(
                    max(color, vectors),
                    max(planes.depth_distance(), f32x8::splat(simd, 0.0)),
                );
                let weight = denoise_weight(distance);
                let values = [
                    planes.q(GUIDE_COLOR) * weight,
                    planes.q(GUIDE_COLOR + 1) * weight,
                    planes.q(GUIDE_COLOR + 2) * weight,
                    weight,
                ];
                for (sums, value) in self.sums.iter_mut().zip(values) {
                    (load(simd, sums, i) + value).store_slice(&mut sums[i..i + LANES]);
                }
            }
        }
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, values: &[f32], i: usize) -> f32x8<S> {
    f32x8::from_slice(simd, &values[i..i + LANES])
}

/// Loads the guides of eight pixels p and eight pixels q.
struct Loader<'a, S: Simd> {
    simd: S,
    planes: &'a [Vec<f32>],
    p: usize,
    q: usize,
}

impl<S: Simd> Loader<'_, S> {
    #[inline(always)]
    fn p(&self, plane: u32) -> f32x8<S> {
        load(self.simd, &self.planes[plane as usize], self.p)
    }

    #[inline(always)]
    fn q(&self, plane: u32) -> f32x8<S> {
        load(self.simd, &self.planes[plane as usize], self.q)
    }

    /// Returns the squared distance of vectors.
    #[inline(always)]
    fn squared(&self, plane: u32) -> f32x8<S> {
        let difference = |i| self.p(plane + i) - self.q(plane + i);
        let difference = Lanes3 {
            x: difference(0),
            y: difference(1),
            z: difference(2),
        };
        dot(difference, difference)
    }

    #[inline(always)]
    fn vector_distance(&self, plane: u32) -> f32x8<S> {
        let (p, q) = (self.p(plane + 3), self.q(plane + 3));
        feature_distance(self.squared(plane), p, q, self.p(plane + 4))
    }

    #[inline(always)]
    fn depth_distance(&self) -> f32x8<S> {
        let difference = self.p(GUIDE_DEPTH) - self.q(GUIDE_DEPTH);
        let (p, q) = (self.p(GUIDE_DEPTH + 1), self.q(GUIDE_DEPTH + 1));
        feature_distance(difference * difference, p, q, self.p(GUIDE_DEPTH + 2))
    }
}
