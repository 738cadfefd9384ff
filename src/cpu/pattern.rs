//! Twin of `shaders/pattern.wgsl`: a checker and a grid of lines, averaged over the footprint.

use glam::Vec2;

use super::footprint::Footprint;
use super::math::{floor, min};
use crate::pack::CHECKER;

const MOST_PIECES: f32 = 16.0;

pub fn pattern_share(kind: u32, line_width: f32, f: Footprint) -> f32 {
    let swap = f.dx.x * f.dx.x + f.dx.y * f.dx.y < f.dy.x * f.dy.x + f.dy.y * f.dy.y;
    let long = if swap { f.dy } else { f.dx };
    let short = if swap { f.dx } else { f.dy };
    let long_length = (long.x * long.x + long.y * long.y).sqrt();
    let short_length = (short.x * short.x + short.y * short.y).sqrt();
    let skewed = (long.x.abs() > 0.0) & (long.y.abs() > 0.0);
    let pieces = if skewed {
        floor(min(long_length / short_length, MOST_PIECES - 1.0)) + 1.0
    } else {
        1.0
    };
    let piece = long / pieces;
    let width = Vec2::new(
        (piece.x * piece.x + short.x * short.x).sqrt(),
        (piece.y * piece.y + short.y * short.y).sqrt(),
    );
    let mut sum = 0.0;
    let mut i = 0.0;
    while i < pieces {
        let at = f.uv + long * ((i + 0.5) / pieces - 0.5);
        sum += if kind == CHECKER {
            checker_in_box(at, width)
        } else {
            lines_in_box(at, width, line_width)
        };
        i += 1.0;
    }
    sum / pieces
}

pub fn checker_in_box(at: Vec2, width: Vec2) -> f32 {
    0.5 - 0.5 * (square_wave(at.x, width.x) * square_wave(at.y, width.y))
}

pub fn square_wave(x: f32, width: f32) -> f32 {
    let reduced = x - 2.0 * floor(0.5 * x);
    let point = if reduced < 1.0 { 1.0 } else { -1.0 };
    let mean = (square_wave_integral(reduced + 0.5 * width) - square_wave_integral(reduced - 0.5 * width)) / width;
    if width < WIDEST {
        if width > NARROWEST { mean } else { point }
    } else {
        0.0
    }
}

pub fn square_wave_integral(x: f32) -> f32 {
    let reduced = x - 2.0 * floor(0.5 * x);
    1.0 - (reduced - 1.0).abs()
}

pub fn lines_in_box(at: Vec2, width: Vec2, line_width: f32) -> f32 {
    1.0 - (1.0 - pulse(at.x, width.x, line_width)) * (1.0 - pulse(at.y, width.y, line_width))
}

pub fn pulse(x: f32, width: f32, line_width: f32) -> f32 {
    let reduced = x - floor(x) + 0.5 * line_width;
    let point = if reduced - floor(reduced) < line_width {
        1.0
    } else {
        0.0
    };
    let below = pulse_integral(reduced - 0.5 * width, line_width);
    let mean = (pulse_integral(reduced + 0.5 * width, line_width) - below) / width;
    if width < WIDEST {
        if width > NARROWEST { mean } else { point }
    } else {
        line_width
    }
}

pub fn pulse_integral(x: f32, line_width: f32) -> f32 {
    let whole = floor(x);
    whole * line_width + min(x - whole, line_width)
}

const NARROWEST: f32 = 0.0001;
const WIDEST: f32 = 4096.0;
