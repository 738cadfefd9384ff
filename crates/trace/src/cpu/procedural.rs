//! Twin of `shaders/procedural.wgsl`.

use std::f32::consts::PI;

use glam::Vec2;

use super::footprint::Footprint;
use super::math::{floor, max, min, sine};
use crate::records::CHECKER;

pub fn procedural_share(kind: u32, line_width: f32, f: Footprint) -> f32 {
    let checker = kind == CHECKER;
    let scale = if checker { 0.5 } else { 1.0 };
    let duty = if checker { 0.5 } else { line_width };
    let shift = if checker { 0.0 } else { 0.5 * line_width };
    let wide_x = !((f.dx.x.abs() + f.dy.x.abs()) * scale < MAX_EXTENT);
    let wide_y = !((f.dx.y.abs() + f.dy.y.abs()) * scale < MAX_EXTENT);
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
    let extent = Vec2::new(long.x.abs() + short.x.abs(), long.y.abs() + short.y.abs());
    let position = Vec2::new(phase(f.uv.x * scale + shift), phase(f.uv.y * scale + shift));

    let min_gap = min(duty, 1.0 - duty);
    let near_x = extent.x < min_gap;
    let near_y = extent.y < min_gap;
    let offset = Vec2::new(nearest_step(position.x, duty), nearest_step(position.y, duty));
    let rise = Vec2::new(
        if offset.x == position.x - duty { -0.5 } else { 0.5 },
        if offset.y == position.y - duty { -0.5 } else { 0.5 },
    );
    let center = Vec2::new(
        if near_x { offset.x } else { position.x },
        if near_y { offset.y } else { position.y },
    );
    let wave = Vec2::new(
        wave_mean(center.x, long.x, short.x, duty, near_x),
        wave_mean(center.y, long.y, short.y, duty, near_y),
    );
    let mean_x = if wide_x {
        duty
    } else if near_x {
        0.5 + rise.x * wave.x
    } else {
        duty + wave.x
    };
    let mean_y = if wide_y {
        duty
    } else if near_y {
        0.5 + rise.y * wave.y
    } else {
        duty + wave.y
    };

    let is_uncorrelated =
        wide_x | wide_y | (near_x & (offset.x.abs() >= 0.5 * extent.x)) | (near_y & (offset.y.abs() >= 0.5 * extent.y));
    let crossed_periods = max(min(long.x.abs(), long.y.abs()), min(short.x.abs(), short.y.abs()));
    let covariance = if crossed_periods > MAX_PERIODS {
        far_product(position, long, short, duty)
    } else {
        let near = near_x & near_y;
        let area = long.x * short.y - long.y * short.x;
        let product = product_integral(if near { offset } else { position }, long, short, duty, near) / area;
        if near {
            rise.x * rise.y * (product - wave.x * wave.y)
        } else {
            product - (mean_x - duty) * (mean_y - duty)
        }
    };
    let mean_product = mean_x * mean_y + if is_uncorrelated { 0.0 } else { covariance };
    let share = mean_x + mean_y - mean_product * if checker { 2.0 } else { 1.0 };
    min(max(share, 0.0), 1.0)
}

pub fn phase(x: f32) -> f32 {
    let small = if x.abs() < 8_388_608.0 { x } else { 0.0 };
    small - floor(small)
}

pub fn widened_edge(long: Vec2, short: Vec2) -> Vec2 {
    let length = (long.x * long.x + long.y * long.y).sqrt();
    let perpendicular = Vec2::new(-long.y, long.x) / max(length, 1e-30);
    let width = perpendicular.x * short.x + perpendicular.y * short.y;
    let min_width = MIN_WIDTH * min(length, 1.0);
    let shift = if width < 0.0 { -min_width } else { min_width } - width;
    short + perpendicular * if width.abs() < min_width { shift } else { 0.0 }
}

pub fn nearest_step(x: f32, duty: f32) -> f32 {
    let outer = if x < 0.5 { x } else { x - 1.0 };
    let inner = x - duty;
    if inner.abs() < outer.abs() { inner } else { outer }
}

pub fn wave_value(x: f32, duty: f32, near: bool) -> f32 {
    if near {
        return if x < 0.0 { -1.0 } else { 1.0 };
    }
    if x - floor(x) < duty { 1.0 - duty } else { -duty }
}

pub fn wave_integral(x: f32, duty: f32, near: bool) -> f32 {
    if near {
        return x.abs();
    }
    let r = x - floor(x);
    min(r * (1.0 - duty), (1.0 - r) * duty) - 0.5 * duty * (1.0 - duty)
}

pub fn wave_integral_2(x: f32, duty: f32, near: bool) -> f32 {
    if near {
        return 0.5 * x * x.abs();
    }
    let r = x - floor(x);
    let s = 1.0 - r;
    if r < duty {
        0.5 * (1.0 - duty) * r * (r - duty)
    } else {
        0.5 * duty * s * (1.0 - duty - s)
    }
}

pub fn wave_mean(x: f32, a: f32, b: f32, duty: f32, near: bool) -> f32 {
    let long = max(a.abs(), b.abs());
    let short = min(a.abs(), b.abs());
    let outer = 0.5 * (long + short);
    let inner = 0.5 * (long - short);
    if (long < 1e-6) | (near & (x.abs() >= outer)) {
        return wave_value(x, duty, near);
    }
    if short < 0.001 * long {
        return (wave_integral(x + 0.5 * long, duty, near) - wave_integral(x - 0.5 * long, duty, near)) / long;
    }
    let after = wave_integral_2(x + outer, duty, near) - wave_integral_2(x + inner, duty, near);
    let before = wave_integral_2(x - inner, duty, near) - wave_integral_2(x - outer, duty, near);
    (after - before) / (long * short)
}

pub fn product_integral(center: Vec2, a: Vec2, b: Vec2, duty: f32, near: bool) -> f32 {
    let half_sum = (a + b) * 0.5;
    let half_difference = (a - b) * 0.5;
    let mut sum = 0.0;
    let mut tail = center - half_sum;
    for i in 0..4 {
        let head = center + if i % 2 == 0 { half_difference } else { half_sum } * if i < 2 { 1.0 } else { -1.0 };
        sum += edge_integral(tail, head, duty, near);
        tail = head;
    }
    sum
}

pub fn edge_integral(tail: Vec2, head: Vec2, duty: f32, near: bool) -> f32 {
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
    let periods = min(floor(high.y) - first, MAX_PERIODS + 2.0);
    let last = if near { 0.0 } else { periods };
    let value_low = wave_value(low.y, duty, near);
    let value_high = wave_value(high.y, duty, near);
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
            height * wave_integral_2(low.x + y * inverse, duty, near)
        } else {
            0.0
        };
        steps -= if falls {
            wave_integral_2(low.x + (y + duty) * inverse, duty, near)
        } else {
            0.0
        };
        i += 1.0;
    }
    let ends = wave_integral_2(high.x, duty, near) * value_high - wave_integral_2(low.x, duty, near) * value_low;
    let slope = if rise > 0.0 { rise / run } else { 0.0 };
    let integral = slope * (ends - steps) * if up { 1.0 } else { -1.0 };
    let corners = wave_integral(end.x, duty, near) * wave_integral(end.y, duty, near)
        - wave_integral(start.x, duty, near) * wave_integral(start.y, duty, near);
    if steep { corners - integral } else { integral }
}

pub fn far_product(center: Vec2, long: Vec2, short: Vec2, duty: f32) -> f32 {
    let flat = long.x.abs() > long.y.abs();
    let a = if flat { Vec2::new(long.y, long.x) } else { long };
    let b = if flat { Vec2::new(short.y, short.x) } else { short };
    let x = if flat { center.y } else { center.x } - 0.5 * duty;
    let y = if flat { center.x } else { center.y } - 0.5 * duty;
    let ratio = min(a.y.abs() / a.x.abs(), 1000.0);
    let sign = if a.x * a.y > 0.0 { -1.0 } else { 1.0 };
    let mut sum = 0.0;
    let mut i = 1.0;
    while i <= MAX_HARMONICS {
        let n = sign * i;
        let m = floor(i * ratio + 0.5);
        let footprint_factor = sine_ratio(m * a.x + n * a.y) * sine_ratio(m * b.x + n * b.y);
        let weight = duty * duty * (sine_ratio(m * duty) * sine_ratio(n * duty));
        sum += 2.0 * weight * (sine(2.0 * (m * x + n * y) + 0.5) * footprint_factor);
        i += 1.0;
    }
    sum
}

pub fn sine_ratio(x: f32) -> f32 {
    if x.abs() < 0.001 { 1.0 } else { sine(x) / (PI * x) }
}

const MAX_HARMONICS: f32 = 8.0;
const MAX_PERIODS: f32 = 32.0;
const MIN_WIDTH: f32 = 0.001;
const MAX_EXTENT: f32 = 4096.0;
