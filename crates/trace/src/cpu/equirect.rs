//! Twin of `shaders/equirect.wgsl`.

use super::lanes::{Real, Vector2, Vector3, Word, constant, select};
use super::math::{atan2, floor, max, min, sine};
use crate::records::NORMAL_BINS;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentCell<F: Real = f32> {
    pub column: F::Word,
    pub row: F::Word,
    pub x: F,
    pub y: F,
}

#[inline(always)]
pub fn cell_towards<V: Vector3>(d: V, width: u32, height: u32) -> EnvironmentCell<V::Real> {
    let (x, y, z) = (d.x(), d.y(), d.z());
    let zero = x.splat(0.0);
    let u = (constant(0.5) - atan2(y, x) * 0.159_154_94) * width as f32 - 0.5;
    let v = atan2((x * x + y * y).sqrt(), z) * std::f32::consts::FRAC_1_PI * height as f32 + 0.5;
    let column = floor(u);
    let row = min(floor(v), x.splat(height as f32));
    let fraction = v - row;
    let is_first = row.eq(zero);
    let is_last = row.eq(x.splat(height as f32));
    let y = select(
        select(fraction, constant(2.0) * fraction, is_last),
        constant(2.0) * fraction - 1.0,
        is_first,
    );
    let clamped_y = min(max(y, zero), x.splat(1.0));
    EnvironmentCell {
        column: select(x.splat(width as f32 - 1.0), column, column.ge(zero)).to_word(),
        row: row.to_word(),
        x: u - column,
        y: clamped_y,
    }
}

pub fn column_after(column: u32, width: u32) -> u32 {
    if column + 1 == width { 0 } else { column + 1 }
}

#[inline(always)]
pub fn cap_above<W: Word>(row: W, height: u32) -> W::Real {
    let row = row.to_real();
    let from_pole = max(row - 0.5, row.splat(0.0)) / row.splat(height as f32);
    let s = sine(constant(0.5) * min(from_pole, row.splat(1.0)));
    constant(2.0) * s * s
}

#[inline(always)]
pub fn normal_bin<V: Vector3>(normal: V) -> <V::Real as Real>::Word {
    let sum = normal.x().abs() + normal.y().abs() + normal.z().abs();
    let zero = sum.splat(0.0);
    let x = normal.x() / sum;
    let y = normal.y() / sum;
    let folded_x = select(y.abs() - 1.0, constant(1.0) - y.abs(), x.ge(zero));
    let folded_y = select(x.abs() - 1.0, constant(1.0) - x.abs(), y.ge(zero));
    let last = sum.splat((NORMAL_BINS - 1) as f32);
    let is_upper = normal.z().ge(zero);
    let column = (select(folded_x, x, is_upper) * 0.5 + 0.5) * last + 0.5;
    let row = (select(folded_y, y, is_upper) * 0.5 + 0.5) * last + 0.5;
    let (row, column) = (
        min(max(row, zero), last).to_word(),
        min(max(column, zero), last).to_word(),
    );
    let bin = row.wrapping_mul(row.splat(NORMAL_BINS)).wrapping_add(column);
    Word::select(row.splat(NORMAL_BINS * NORMAL_BINS), bin, sum.gt(zero))
}

#[inline(always)]
pub fn direction_in_cell<W: Word>(
    column: W,
    row: W,
    u: <W::Real as Real>::Vec2,
    width: u32,
    height: u32,
) -> <W::Real as Real>::Vec3 {
    let zero = u.x().splat(0.0);
    let turn = constant(1.0) - constant(2.0) * ((column.to_real() + 0.5 + u.x()) / zero.splat(width as f32));
    let is_lower_half = row.to_real().gt(zero.splat((height / 2) as f32));
    let from_pole = W::select(row, row.splat(height).wrapping_sub(row), is_lower_half);
    let inner = cap_above(from_pole, height);
    let cap = inner + (cap_above(from_pole.wrapping_add(row.splat(1)), height) - inner) * u.y();
    let radius = max(cap * (constant(2.0) - cap), zero).sqrt();
    let z = constant(1.0) - cap;
    Vector3::new(
        radius * sine(turn + 0.5),
        radius * sine(turn),
        select(z, -z, is_lower_half),
    )
}
