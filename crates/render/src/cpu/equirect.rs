//! Twin of `shaders/equirect.wgsl`.

use glam::{Vec2, Vec3};

use super::math::{atan2, floor, max, min, sine};
use crate::records::NORMAL_BINS;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentCell {
    pub column: u32,
    pub row: u32,
    pub x: f32,
    pub y: f32,
}

pub fn cell_towards(d: Vec3, width: u32, height: u32) -> EnvironmentCell {
    let u = (0.5 - atan2(d.y, d.x) * 0.159_154_94) * width as f32 - 0.5;
    let v = atan2((d.x * d.x + d.y * d.y).sqrt(), d.z) * std::f32::consts::FRAC_1_PI * height as f32 + 0.5;
    let column = floor(u);
    let row = min(floor(v), height as f32);
    let fraction = v - row;
    let is_first = row == 0.0;
    let is_last = row == height as f32;
    let y = if is_first {
        2.0 * fraction - 1.0
    } else if is_last {
        2.0 * fraction
    } else {
        fraction
    };
    let clamped_y = min(max(y, 0.0), 1.0);
    EnvironmentCell {
        column: if column >= 0.0 { column } else { width as f32 - 1.0 } as u32,
        row: row as u32,
        x: u - column,
        y: clamped_y,
    }
}

pub fn column_after(column: u32, width: u32) -> u32 {
    if column + 1 == width { 0 } else { column + 1 }
}

pub fn cap_above(row: u32, height: u32) -> f32 {
    let from_pole = max(row as f32 - 0.5, 0.0) / height as f32;
    let s = sine(0.5 * min(from_pole, 1.0));
    2.0 * s * s
}

pub fn normal_bin(normal: Vec3) -> u32 {
    let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
    let x = normal.x / sum;
    let y = normal.y / sum;
    let folded_x = if x >= 0.0 { 1.0 - y.abs() } else { y.abs() - 1.0 };
    let folded_y = if y >= 0.0 { 1.0 - x.abs() } else { x.abs() - 1.0 };
    let last = (NORMAL_BINS - 1) as f32;
    let column = (if normal.z >= 0.0 { x } else { folded_x } * 0.5 + 0.5) * last + 0.5;
    let row = (if normal.z >= 0.0 { y } else { folded_y } * 0.5 + 0.5) * last + 0.5;
    let bin = min(max(row, 0.0), last) as u32 * NORMAL_BINS + min(max(column, 0.0), last) as u32;
    if sum > 0.0 { bin } else { NORMAL_BINS * NORMAL_BINS }
}

pub fn direction_in_cell(column: u32, row: u32, u: Vec2, width: u32, height: u32) -> Vec3 {
    let turn = 1.0 - 2.0 * ((column as f32 + 0.5 + u.x) / width as f32);
    let is_lower_half = row > height / 2;
    let from_pole = if is_lower_half { height - row } else { row };
    let inner = cap_above(from_pole, height);
    let cap = inner + (cap_above(from_pole + 1, height) - inner) * u.y;
    let radius = max(cap * (2.0 - cap), 0.0).sqrt();
    let z = 1.0 - cap;
    Vec3::new(
        radius * sine(turn + 0.5),
        radius * sine(turn),
        if is_lower_half { -z } else { z },
    )
}
