//! Twin of `shaders/procedural.wgsl`.

use std::f32::consts::PI;

use glam::Vec2;

use super::footprint::Footprint;
use super::math::{floor, max, min, sine};
use crate::records::CHECKER;

pub fn procedural_share(kind: u32, line_width: f32, f: Footprint) -> f32 {
    let checker = kind == CHECKER;
    let scale = if checker { 0.5 } else { 1.0 };
    let on = if checker { 0.5 } else { line_width };
    let shift = if checker { 0.0 } else { 0.5 * line_width };
    let wide_x = !((f.dx.x.abs() + f.dy.x.abs()) * scale < WIDEST);
    let wide_y = !((f.dx.y.abs() + f.dy.y.abs()) * scale < WIDEST);
    let dx = Vec2::new(
        if wide_x { 0.0 } else { f.dx.x * scale },
        if wide_y { 0.0 } else { f.dx.y * scale },
    );
    let dy = Vec2::new(
        if wide_x { 0.0 } else { f.dy.x * scale },
        if wide_y { 0.0 } else { f.dy.y * scale },
    );
    let swap = dx.x * dx.x + dx.y * dx.y < dy.x * dy.x + dy.y * dy.y;
    let long = if swap { dy } else { dx };
    let short = widened_edge(long, if swap { dx } else { dy });
    let t_max = Vec2::new(long.x.abs() + short.x.abs(), long.y.abs() + short.y.abs());
    let at = Vec2::new(phase(f.uv.x * scale + shift), phase(f.uv.y * scale + shift));

    let least = min(on, 1.0 - on);
    let near_x = t_max.x < least;
    let near_y = t_max.y < least;
    let offset = Vec2::new(nearest_step(at.x, on), nearest_step(at.y, on));
    let rise = Vec2::new(
        if offset.x == at.x - on { -0.5 } else { 0.5 },
        if offset.y == at.y - on { -0.5 } else { 0.5 },
    );
    let center = Vec2::new(
        if near_x { offset.x } else { at.x },
        if near_y { offset.y } else { at.y },
    );
    let wave = Vec2::new(
        wave_mean(center.x, long.x, short.x, on, near_x),
        wave_mean(center.y, long.y, short.y, on, near_y),
    );
    let mean_x = if wide_x {
        on
    } else if near_x {
        0.5 + rise.x * wave.x
    } else {
        on + wave.x
    };
    let mean_y = if wide_y {
        on
    } else if near_y {
        0.5 + rise.y * wave.y
    } else {
        on + wave.y
    };

    let apart =
        wide_x | wide_y | (near_x & (offset.x.abs() >= 0.5 * t_max.x)) | (near_y & (offset.y.abs() >= 0.5 * t_max.y));
    let crossed = max(min(long.x.abs(), long.y.abs()), min(short.x.abs(), short.y.abs()));
    let together = if crossed > MAX_PERIODS {
        far_product(at, long, short, on)
    } else {
        let near = near_x & near_y;
        let area = long.x * short.y - long.y * short.x;
        let product = around_footprint(if near { offset } else { at }, long, short, on, near) / area;
        if near {
            rise.x * rise.y * (product - wave.x * wave.y)
        } else {
            product - (mean_x - on) * (mean_y - on)
        }
    };
    let both = mean_x * mean_y + if apart { 0.0 } else { together };
    let share = mean_x + mean_y - both * if checker { 2.0 } else { 1.0 };
    min(max(share, 0.0), 1.0)
}

pub fn phase(x: f32) -> f32 {
    let small = if x.abs() < 8_388_608.0 { x } else { 0.0 };
    small - floor(small)
}

pub fn widened_edge(long: Vec2, short: Vec2) -> Vec2 {
    let length = (long.x * long.x + long.y * long.y).sqrt();
    let across = Vec2::new(-long.y, long.x) / max(length, 1e-30);
    let width = across.x * short.x + across.y * short.y;
    let least = THINNEST * min(length, 1.0);
    let more = if width < 0.0 { -least } else { least } - width;
    short + across * if width.abs() < least { more } else { 0.0 }
}

pub fn nearest_step(x: f32, on: f32) -> f32 {
    let outer = if x < 0.5 { x } else { x - 1.0 };
    let inner = x - on;
    if inner.abs() < outer.abs() { inner } else { outer }
}

pub fn wave_value(x: f32, on: f32, near: bool) -> f32 {
    if near {
        return if x < 0.0 { -1.0 } else { 1.0 };
    }
    if x - floor(x) < on { 1.0 - on } else { -on }
}

pub fn wave_integral(x: f32, on: f32, near: bool) -> f32 {
    if near {
        return x.abs();
    }
    let r = x - floor(x);
    min(r * (1.0 - on), (1.0 - r) * on) - 0.5 * on * (1.0 - on)
}

pub fn wave_integral_2(x: f32, on: f32, near: bool) -> f32 {
    if near {
        return 0.5 * x * x.abs();
    }
    let r = x - floor(x);
    let s = 1.0 - r;
    if r < on {
        0.5 * (1.0 - on) * r * (r - on)
    } else {
        0.5 * on * s * (1.0 - on - s)
    }
}

pub fn wave_mean(x: f32, a: f32, b: f32, on: f32, near: bool) -> f32 {
    let long = max(a.abs(), b.abs());
    let short = min(a.abs(), b.abs());
    let outer = 0.5 * (long + short);
    let inner = 0.5 * (long - short);
    if (long < 1e-6) | (near & (x.abs() >= outer)) {
        return wave_value(x, on, near);
    }
    if short < 0.001 * long {
        return (wave_integral(x + 0.5 * long, on, near) - wave_integral(x - 0.5 * long, on, near)) / long;
    }
    let after = wave_integral_2(x + outer, on, near) - wave_integral_2(x + inner, on, near);
    let before = wave_integral_2(x - inner, on, near) - wave_integral_2(x - outer, on, near);
    (after - before) / (long * short)
}

pub fn around_footprint(at: Vec2, a: Vec2, b: Vec2, on: f32, near: bool) -> f32 {
    let half = (a + b) * 0.5;
    let other = (a - b) * 0.5;
    let mut sum = 0.0;
    let mut tail = at - half;
    for i in 0..4 {
        let head = at + if i % 2 == 0 { other } else { half } * if i < 2 { 1.0 } else { -1.0 };
        sum += along_edge(tail, head, on, near);
        tail = head;
    }
    sum
}

pub fn along_edge(tail: Vec2, head: Vec2, on: f32, near: bool) -> f32 {
    let steep = (head.x - tail.x).abs() < (head.y - tail.y).abs();
    let start = if steep { Vec2::new(tail.y, tail.x) } else { tail };
    let end = if steep { Vec2::new(head.y, head.x) } else { head };
    let up = end.y >= start.y;
    let low = if up { start } else { end };
    let high = if up { end } else { start };
    let run = high.x - low.x;
    let rise = high.y - low.y;
    let inverse = run / rise;
    let first = if near { 0.0 } else { floor(low.y) };
    let most = min(floor(high.y) - first, MAX_PERIODS + 2.0);
    let last = if near { 0.0 } else { most };
    let value_low = wave_value(low.y, on, near);
    let value_high = wave_value(high.y, on, near);
    let mut steps = 0.0;
    let mut i = 0.0;
    while i <= last {
        let y = first + i - low.y;
        let rises = if near {
            (value_low < 0.0) & (value_high > 0.0)
        } else {
            i > 0.0
        };
        let falls = !near & ((i > 0.0) | (value_low > 0.0)) & ((i < last) | (value_high <= 0.0));
        let height = if near { 2.0 } else { 1.0 };
        steps += if rises {
            height * wave_integral_2(low.x + y * inverse, on, near)
        } else {
            0.0
        };
        steps -= if falls {
            wave_integral_2(low.x + (y + on) * inverse, on, near)
        } else {
            0.0
        };
        i += 1.0;
    }
    let ends = wave_integral_2(high.x, on, near) * value_high - wave_integral_2(low.x, on, near) * value_low;
    let slope = if rise > 0.0 { rise / run } else { 0.0 };
    let along = slope * (ends - steps) * if up { 1.0 } else { -1.0 };
    let corner = wave_integral(end.x, on, near) * wave_integral(end.y, on, near)
        - wave_integral(start.x, on, near) * wave_integral(start.y, on, near);
    if steep { corner - along } else { along }
}

pub fn far_product(at: Vec2, long: Vec2, short: Vec2, on: f32) -> f32 {
    let flat = long.x.abs() > long.y.abs();
    let a = if flat { Vec2::new(long.y, long.x) } else { long };
    let b = if flat { Vec2::new(short.y, short.x) } else { short };
    let x = if flat { at.y } else { at.x } - 0.5 * on;
    let y = if flat { at.x } else { at.y } - 0.5 * on;
    let ratio = min(a.y.abs() / a.x.abs(), 1000.0);
    let turn = if a.x * a.y > 0.0 { -1.0 } else { 1.0 };
    let mut sum = 0.0;
    let mut i = 1.0;
    while i <= MAX_HARMONICS {
        let n = turn * i;
        let m = floor(i * ratio + 0.5);
        let along = sine_ratio(m * a.x + n * a.y) * sine_ratio(m * b.x + n * b.y);
        let weight = on * on * (sine_ratio(m * on) * sine_ratio(n * on));
        sum += 2.0 * weight * (sine(2.0 * (m * x + n * y) + 0.5) * along);
        i += 1.0;
    }
    sum
}

pub fn sine_ratio(x: f32) -> f32 {
    if x.abs() < 0.001 { 1.0 } else { sine(x) / (PI * x) }
}

const MAX_HARMONICS: f32 = 8.0;
const MAX_PERIODS: f32 = 32.0;
const THINNEST: f32 = 0.001;
const WIDEST: f32 = 4096.0;
