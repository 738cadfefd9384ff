//! The environment map in SIMD lanes: directions and cells of the map in lanes, and table lookups one by one.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};

use super::super::environment::{
    BlockCell, CellCorners, EnvironmentEval, block_cell, block_distributions, block_terms, cell_eval,
    environment_float, environment_mis, environment_texel, interval_at, interval_position, selected_cell,
};
use super::super::equirect::{cell_towards, column_after, direction_in_cell, normal_bin};
use super::super::integrators::path::{PathState, leave_scene};
use super::super::lanes::{Lanes2, Lanes3};
use super::super::math::{dot, normalize};
use super::super::rng::{hash4, unit_float};
use super::rows::{F, LANES, Row, Rows3, V, get3, lane_mask, lanes_of, load3, set3, splat3, store3};
use crate::records::{ENVIRONMENT_BLOCKS, Packed};

/// Values of [`EnvironmentEval`] per path.
#[derive(Default)]
pub struct EnvironmentRows {
    pub radiance: Rows3,
    pub pdf: Row,
}

impl EnvironmentRows {
    #[inline(always)]
    pub fn eval(&self, lane: usize) -> EnvironmentEval {
        EnvironmentEval {
            radiance: get3(&self.radiance, lane),
            pdf: self.pdf[lane],
        }
    }
}

/// Samples directions to the map for the paths of the lanes of a mask, like `sample_environment`. `normals` select the
/// distribution of the samples (`block_distributions`).
#[inline(always)]
pub fn environment_samples<S: Simd>(
    simd: S,
    scene: &Packed,
    normals: &Rows3,
    u: Lanes2<F<S>>,
    mask: u64,
) -> (V<S>, EnvironmentRows) {
    let environment = &scene.environment;
    let bins = normal_bin(load3(simd, normals));
    let point = environment_points(simd, scene, bins, u, mask);
    let (columns, rows) = (point.cell & 65_535, point.cell >> 16);
    let d: V<S> = direction_in_cell(columns, rows, point.position, environment.width, environment.height);
    let vector = |v| splat3(simd, v);
    let directions = normalize(vector(environment.x) * d.x + vector(environment.y) * d.y + vector(environment.z) * d.z);
    let evals = environment_evals(simd, scene, directions, bins, mask);
    (directions, evals)
}

/// Samples points of the map, like `environment_point`. `entry` is that of the cell before the choice of its alias.
#[inline(always)]
fn environment_points<S: Simd>(simd: S, scene: &Packed, bins: u32x8<S>, u: Lanes2<F<S>>, mask: u64) -> BlockCell<F<S>> {
    let zero: u32x8<S> = SimdBase::splat(simd, 0);
    let bits = hash4([u.x.bitcast(), u.y.bitcast(), zero, zero]);
    let (u_x, u_y): (Row, Row) = (u.x.into(), u.y.into());
    let distributions: [u32; LANES] = block_distributions(scene, bins).into();
    let (mut rows, mut columns) = ([0; LANES], [0; LANES]);
    // Lower and upper bounds of the intervals.
    let (mut x_bounds, mut y_bounds) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
    for lane in lanes_of(mask) {
        let distribution = distributions[lane];
        let row = interval_at(scene, distribution, u_y[lane]);
        let row_distribution = distribution + (row + 1) * (ENVIRONMENT_BLOCKS + 1);
        let column = interval_at(scene, row_distribution, u_x[lane]);
        for side in 0..2 {
            x_bounds[side][lane] = environment_float(scene, row_distribution + column + side as u32);
            y_bounds[side][lane] = environment_float(scene, distribution + row + side as u32);
        }
        (rows[lane], columns[lane]) = (row, column);
    }
    let number = |row: Row| f32x8::simd_from(simd, row);
    let position = |bounds: [Row; 2], u, bits| {
        let [low, high] = bounds.map(number);
        interval_position(low, high, u, unit_float(bits))
    };
    let position = Lanes2 {
        x: position(x_bounds, u.x, bits[0]),
        y: position(y_bounds, u.y, bits[1]),
    };
    let (rows, columns) = (u32x8::simd_from(simd, rows), u32x8::simd_from(simd, columns));
    let own = block_cell(scene, rows, columns, position);
    let entries: [u32; LANES] = own.entry.into();
    let (mut cells, bits): ([u32; LANES], [u32; LANES]) = (own.cell.into(), bits[2].into());
    for lane in lanes_of(mask) {
        cells[lane] = selected_cell(scene, entries[lane], cells[lane], bits[lane]);
    }
    BlockCell {
        cell: u32x8::simd_from(simd, cells),
        ..own
    }
}

/// Evaluates the map for the paths of the lanes of a mask, like `environment_eval`. `bins` are those of the normals.
#[inline(always)]
fn environment_evals<S: Simd>(simd: S, scene: &Packed, directions: V<S>, bins: u32x8<S>, mask: u64) -> EnvironmentRows {
    let environment = &scene.environment;
    let axis = |v| dot(splat3(simd, v), directions);
    let d = Lanes3 {
        x: axis(environment.x),
        y: axis(environment.y),
        z: axis(environment.z),
    };
    let cell = cell_towards(d, environment.width, environment.height);
    let (columns, rows): ([u32; LANES], [u32; LANES]) = (cell.column.into(), cell.row.into());
    let distributions: [u32; LANES] = block_distributions(scene, bins).into();
    let mut corners = [Rows3::default(); 4];
    let (mut probability, mut inverse) = (Row::default(), Row::default());
    for lane in lanes_of(mask) {
        let (row, column) = (rows[lane], columns[lane]);
        let next_column = column_after(column, environment.width);
        set3(&mut corners[0], lane, environment_texel(scene, row, column));
        set3(&mut corners[1], lane, environment_texel(scene, row, next_column));
        set3(&mut corners[2], lane, environment_texel(scene, row + 1, column));
        set3(&mut corners[3], lane, environment_texel(scene, row + 1, next_column));
        let block = block_terms(scene, distributions[lane], row, column);
        (probability[lane], inverse[lane]) = (block.x, block.y);
    }
    let [a, b, c, e] = corners.each_ref().map(|corner| load3(simd, corner));
    let number = |row| f32x8::simd_from(simd, row);
    let corners = CellCorners { a, b, c, e };
    let eval = cell_eval(scene, corners, cell.x, cell.y, number(probability), number(inverse));
    EnvironmentRows {
        radiance: store3(eval.radiance),
        pdf: eval.pdf.into(),
    }
}

/// Ends paths whose rays hit nothing, like the scalar `shade`. The scene has an environment map.
#[inline(always)]
pub fn leave_to_environment<S: Simd>(simd: S, scene: &Packed, paths: &mut [PathState], missed: &[u32]) {
    for missed in missed.chunks(LANES) {
        let (mut directions, mut normals) = (Rows3::default(), Rows3::default());
        for (lane, &path) in missed.iter().enumerate() {
            let state = &paths[path as usize];
            set3(&mut directions, lane, state.path.ray.direction);
            set3(&mut normals, lane, state.prev_normal);
        }
        let bins = normal_bin(load3(simd, &normals));
        let evals = environment_evals(simd, scene, load3(simd, &directions), bins, lane_mask(missed.len()));
        for (lane, &path) in missed.iter().enumerate() {
            let state = &mut paths[path as usize];
            let light = environment_mis(evals.eval(lane), state.pdf);
            leave_scene(scene, state, light);
        }
    }
}
