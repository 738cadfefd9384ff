//! The environment map in SIMD lanes: directions and cells of the map in lanes, and table lookups one by one.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};
use glam::Vec2;

use super::super::environment::{EnvironmentEval, environment_at, environment_mis, environment_point};
use super::super::equirect::{EnvironmentCell, cell_towards, direction_in_cell};
use super::super::integrators::path::{PathState, leave_scene};
use super::super::lanes::{Lanes2, Lanes3};
use super::super::math::{dot, normalize};
use super::rows::{F, LANES, Row, Rows3, V, get3, lane_mask, lanes_of, load3, set3, splat3};
use crate::records::Packed;

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
    lanes: u64,
) -> (V<S>, EnvironmentRows) {
    let environment = &scene.environment;
    let (u_x, u_y): (Row, Row) = (u.x.into(), u.y.into());
    let (mut columns, mut rows) = ([0; LANES], [0; LANES]);
    let (mut x, mut y) = (Row::default(), Row::default());
    for lane in lanes_of(lanes) {
        let point = environment_point(scene, get3(normals, lane), Vec2::new(u_x[lane], u_y[lane]));
        (columns[lane], rows[lane]) = (point.column, point.row);
        (x[lane], y[lane]) = (point.position.x, point.position.y);
    }
    let position = Lanes2 {
        x: f32x8::simd_from(simd, x),
        y: f32x8::simd_from(simd, y),
    };
    let (columns, rows) = (u32x8::simd_from(simd, columns), u32x8::simd_from(simd, rows));
    let d: V<S> = direction_in_cell(columns, rows, position, environment.width, environment.height);
    let vector = |v| splat3(simd, v);
    let directions = normalize(vector(environment.x) * d.x + vector(environment.y) * d.y + vector(environment.z) * d.z);
    let evals = environment_evals(simd, scene, directions, normals, lanes);
    (directions, evals)
}

/// Evaluates the map for the paths of the lanes of a mask, like `environment_eval`.
#[inline(always)]
fn environment_evals<S: Simd>(
    simd: S,
    scene: &Packed,
    directions: V<S>,
    normals: &Rows3,
    lanes: u64,
) -> EnvironmentRows {
    let environment = &scene.environment;
    let axis = |v| dot(splat3(simd, v), directions);
    let d = Lanes3 {
        x: axis(environment.x),
        y: axis(environment.y),
        z: axis(environment.z),
    };
    let cells = cell_towards(d, environment.width, environment.height);
    let (columns, rows): ([u32; LANES], [u32; LANES]) = (cells.column.into(), cells.row.into());
    let (x, y): (Row, Row) = (cells.x.into(), cells.y.into());
    let mut evals = EnvironmentRows::default();
    for lane in lanes_of(lanes) {
        let cell = EnvironmentCell {
            column: columns[lane],
            row: rows[lane],
            x: x[lane],
            y: y[lane],
        };
        let eval = environment_at(scene, cell, get3(normals, lane));
        set3(&mut evals.radiance, lane, eval.radiance);
        evals.pdf[lane] = eval.pdf;
    }
    evals
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
        let evals = environment_evals(simd, scene, load3(simd, &directions), &normals, lane_mask(missed.len()));
        for (lane, &path) in missed.iter().enumerate() {
            let state = &mut paths[path as usize];
            let light = environment_mis(evals.eval(lane), state.pdf);
            leave_scene(scene, state, light);
        }
    }
}
