//! Procedural textures, compared with numerical and exact means.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DVec2, Vec2};
use wgray_trace::cpu::footprint::Footprint;
use wgray_trace::cpu::procedural::procedural_share;
use wgray_trace::cpu::texture::texture_color;
use wgray_trace::records::{CHECKER, LINES};

use super::filters::textured;
use crate::random::Random;

fn pattern_value(kind: u32, width: f64, u: f64, v: f64) -> f64 {
    let is_odd_or_line = if kind == CHECKER {
        (u.floor() + v.floor()).rem_euclid(2.0) == 1.0
    } else {
        [u, v].iter().any(|x| (x - x.round()).abs() < width / 2.0)
    };
    f64::from(u8::from(is_odd_or_line))
}

/// Returns the mean over the parallelogram, at n x n points.
fn numeric_mean(kind: u32, width: f64, f: Footprint, n: i32) -> f64 {
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let offset = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
            let p = f.uv.as_dvec2() + f.dx.as_dvec2() * offset(i) + f.dy.as_dvec2() * offset(j);
            sum += pattern_value(kind, width, p.x, p.y);
        }
    }
    sum / f64::from(n * n)
}

/// Clips a polygon to the half-plane `normal . p <= limit`.
fn clip(polygon: &[DVec2], normal: DVec2, limit: f64) -> Vec<DVec2> {
    let mut clipped_polygon = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (start, end) = (normal.dot(a) - limit, normal.dot(b) - limit);
        if start <= 0.0 {
            clipped_polygon.push(a);
        }
        if (start < 0.0 && end > 0.0) || (start > 0.0 && end < 0.0) {
            clipped_polygon.push(a + (b - a) * (start / (start - end)));
        }
    }
    clipped_polygon
}

fn area(polygon: &[DVec2]) -> f64 {
    let fan = (2..polygon.len()).map(|i| (polygon[i - 1] - polygon[0]).perp_dot(polygon[i] - polygon[0]));
    fan.sum::<f64>().abs() / 2.0
}

/// Clips a polygon to the strip between two positions along an axis.
fn clip_to_strip(polygon: &[DVec2], axis: DVec2, low: f64, high: f64) -> Vec<DVec2> {
    clip(&clip(polygon, axis, high), -axis, -low)
}

/// Returns the exact mean of the pattern over the parallelogram, summed cell by cell.
fn exact_mean(kind: u32, width: f64, f: Footprint) -> f64 {
    let (uv, a, b) = (f.uv.as_dvec2(), f.dx.as_dvec2() / 2.0, f.dy.as_dvec2() / 2.0);
    let parallelogram = [uv - a - b, uv + a - b, uv + a + b, uv - a + b];
    let range = |polygon: &[DVec2], axis: DVec2| {
        let projections = || polygon.iter().map(|p| axis.dot(*p));
        let (low, high) = (
            projections().fold(f64::MAX, f64::min),
            projections().fold(f64::MIN, f64::max),
        );
        low.floor() as i64..=high.floor() as i64
    };
    let mut sum = 0.0;
    for i in range(&parallelogram, DVec2::X) {
        let x = i as f64;
        let (start, end) = if kind == CHECKER {
            (x, x + 1.0)
        } else {
            (x + width / 2.0, x + 1.0 - width / 2.0)
        };
        let column = clip_to_strip(&parallelogram, DVec2::X, start, end);
        if column.is_empty() {
            continue;
        }
        for j in range(&column, DVec2::Y) {
            let y = j as f64;
            if kind == CHECKER {
                if (i + j).rem_euclid(2) == 1 {
                    sum += area(&clip_to_strip(&column, DVec2::Y, y, y + 1.0));
                }
            } else {
                sum -= area(&clip_to_strip(
                    &column,
                    DVec2::Y,
                    y + width / 2.0,
                    y + 1.0 - width / 2.0,
                ));
            }
        }
    }
    sum / area(&parallelogram) + if kind == CHECKER { 0.0 } else { 1.0 }
}

/// Returns a sheared footprint: at any angle or at almost 45 degrees, square to very thin, and sometimes near a corner
/// of the pattern.
fn random_footprint(size: f64, aspects: &[f64], numbers: &Random) -> Footprint {
    let angle = if numbers.once_in(2) {
        numbers.between(0.0, TAU)
    } else {
        TAU / 8.0 + numbers.between(-0.02, 0.02)
    };
    let long_edge = DVec2::from_angle(angle) * size;
    let short_edge = (long_edge.perp() + long_edge * numbers.between(-0.5, 0.5)) / numbers.pick(aspects);
    let is_near_corner = numbers.once_in(3);
    let coordinate = || {
        let x = numbers.between(-9.0, 9.0);
        (if is_near_corner {
            x.round() + numbers.between(-size, size)
        } else {
            x
        }) as f32
    };
    Footprint {
        uv: Vec2::new(coordinate(), coordinate()),
        dx: short_edge.as_vec2(),
        dy: long_edge.as_vec2(),
    }
}

/// The documented error is 0.001 if the long edge is below 64 squares or 32 cells, otherwise 0.01.
#[test]
fn footprints_of_any_size_and_angle_have_the_exact_mean() {
    let numbers = Random::new(11);
    let aspects = [1.0, 1.7, 8.0, 64.0, 900.0];
    for (kind, width) in [(CHECKER, 0.0), (LINES, 0.2), (LINES, 0.02f32), (LINES, 0.7)] {
        let mut max_control_error = 0.0f64;
        for size in [
            3e-4, 1e-3, 0.016, 0.0625, 0.25, 0.5, 1.0, 1.5, 2.0, 4.0, 16.0, 31.0, 63.0, 100.0, 300.0, 2000.0,
        ] {
            let is_small = size < if kind == CHECKER { 64.0 } else { 32.0 };
            let (count, tolerance) = if is_small { (300, 0.001) } else { (30, 0.01) };
            for _ in 0..count {
                let aspects = if size < 300.0 { &aspects } else { &aspects[3..] };
                let f = random_footprint(size, aspects, &numbers);
                let expected = exact_mean(kind, f64::from(width), f);
                let error = f64::from(procedural_share(kind, width, f)) - expected;
                assert!(error.abs() < tolerance, "{kind} {width} {size} {f:?}: {error}");
                let longer = Footprint { dx: f.dx * 1.2, ..f };
                max_control_error =
                    max_control_error.max((f64::from(procedural_share(kind, width, longer)) - expected).abs());
            }
        }
        assert!(max_control_error > 0.02, "{kind} {width}: {max_control_error}");
    }
}

/// At 45 degrees and with one to two squares per pixel, there is no moiré.
#[test]
fn slanted_checkers_keep_their_contrast() {
    for size in [1.0, 1.5, 2.0] {
        let edge = |eighths: f32| Vec2::from_angle(eighths * std::f32::consts::FRAC_PI_4) * size;
        let (mut low, mut high) = (1.0, 0.0);
        for i in 0..400 {
            let f = Footprint {
                uv: Vec2::new((i % 20) as f32, (i / 20) as f32) / 10.0,
                dx: edge(1.0),
                dy: edge(3.0),
            };
            let (mean, expected) = (
                f64::from(procedural_share(CHECKER, 0.0, f)),
                exact_mean(CHECKER, 0.0, f),
            );
            (low, high) = (expected.min(low), expected.max(high));
            assert!((mean - expected).abs() < 1e-5, "{size} {}: {mean} {expected}", f.uv);
        }
        assert!(high - low > 0.1, "{size}: {low} to {high}");
    }
}

/// Covers degenerate, infinite and NaN footprints.
#[test]
fn footprints_without_an_area_give_values_from_0_to_1() {
    let numbers = Random::new(12);
    let lengths = [
        0.0,
        1e-38,
        1e-20,
        1e-7,
        1e-4,
        0.3,
        3.0,
        1e3,
        1e7,
        1e30,
        f32::INFINITY,
        f32::NAN,
    ];
    for kind in [CHECKER, LINES] {
        for (a, b) in lengths.iter().flat_map(|a| lengths.map(|b| (*a, b))) {
            for _ in 0..20 {
                let uv = Vec2::new(
                    numbers.between(-3.0, 3.0) as f32,
                    numbers.between(-3.0, 3.0).round() as f32,
                );
                let edge = Vec2::from_angle(numbers.between(0.0, TAU) as f32);
                let edge = numbers.pick(&[edge, Vec2::X, Vec2::Y, Vec2::ONE]);
                for (dx, dy) in [
                    (edge * a, edge * b),
                    (edge * a, edge.perp() * b),
                    (edge * a, Vec2::new(b, a)),
                ] {
                    let mean = procedural_share(kind, 0.2, Footprint { uv, dx, dy });
                    assert!((0.0..=1.0).contains(&mean), "{kind} {uv} {dx} {dy}: {mean}");
                }
            }
        }
    }
    // Segments from 0.7 to 1.6, along an axis and the diagonal.
    let segment_mean =
        |uv: Vec2, dx: Vec2| f64::from(procedural_share(CHECKER, 0.0, Footprint { uv, dx, dy: Vec2::ZERO }));
    assert!((segment_mean(Vec2::new(1.15, 0.55), Vec2::new(0.9, 0.0)) - 0.6 / 0.9).abs() < 2e-3);
    assert!((segment_mean(Vec2::new(1.15, 0.65), Vec2::splat(0.9)) - 0.5 / 0.9).abs() < 5e-3);
}

#[test]
fn axis_aligned_footprints_have_the_exact_mean() {
    let numbers = Random::new(2);
    let mut unfiltered = 0.0f64;
    for i in 0..150 {
        let kind = [CHECKER, LINES][i % 2];
        let size = 4f64.powf(numbers.between(-3.0, 2.0)) as f32;
        let uv = Vec2::new(numbers.between(-20.0, 20.0) as f32, numbers.between(-20.0, 20.0) as f32);
        // Some footprints are segments, which are averaged along one axis only.
        let (width, height) = match i % 10 {
            4 | 5 => (size, 0.0),
            6 | 7 => (0.0, size),
            _ => (size, numbers.between(0.1, 3.0) as f32),
        };
        let (dx, dy) = (Vec2::new(width, 0.0), Vec2::new(0.0, height));
        let f = Footprint { uv, dx, dy };
        let found = f64::from(procedural_share(kind, 0.2, f));
        let expected = numeric_mean(kind, f64::from(0.2f32), f, 1000);
        assert!((found - expected).abs() < 6e-3, "{kind} {f:?}: {found} {expected}");
        unfiltered = unfiltered.max((pattern_value(kind, 0.2, f64::from(uv.x), f64::from(uv.y)) - expected).abs());
    }
    assert!(unfiltered > 0.5);
}

#[test]
fn without_a_footprint_the_pattern_is_point_sampled() {
    let numbers = Random::new(6);
    for i in 0..1000 {
        let kind = [CHECKER, LINES][i % 2];
        let uv = Vec2::new(numbers.between(-9.0, 9.0) as f32, numbers.between(-9.0, 9.0) as f32);
        let mean = procedural_share(
            kind,
            0.25,
            Footprint {
                uv,
                dx: Vec2::ZERO,
                dy: Vec2::ZERO,
            },
        );
        assert_eq!(
            f64::from(mean),
            pattern_value(kind, 0.25, f64::from(uv.x), f64::from(uv.y)),
            "{uv}"
        );
    }
}

#[test]
fn unbounded_footprints_average_the_full_pattern() {
    for size in [1e4, 1e20, 1e38, f32::INFINITY, f32::NAN] {
        let (dx, dy) = (Vec2::new(size, size), Vec2::new(0.0, size));
        for uv in [Vec2::new(0.3, 0.4), Vec2::splat(1e30), Vec2::splat(f32::NAN)] {
            assert_eq!(procedural_share(CHECKER, 0.0, Footprint { uv, dx, dy }), 0.5);
            let lines = procedural_share(LINES, 0.25, Footprint { uv, dx, dy });
            assert!((lines - 0.4375).abs() < 1e-6, "{lines}");
        }
    }
}

#[test]
fn textures_are_scaled_then_rotated_then_translated() {
    let keys = "type = 'checker'\neven = [1, 0, 0]\nodd = [0, 1, 0]\nscale = [2, 1]\nrotate = 90\noffset = [0.5, 3]";
    let scene = textured(Path::new("."), keys);
    let mut odd_count = 0;
    for i in 0..100 {
        let (u, v) = (f64::from(i) * 0.1 + 0.01, f64::from(i % 7) * 0.3 + 0.02);
        // (u, v) -> (2 u, v) -> (-v, 2 u) -> (0.5 - v, 3 + 2 u)
        let expected = pattern_value(CHECKER, 0.0, 0.5 - v, 3.0 + 2.0 * u);
        let uv = Vec2::new(u as f32, v as f32);
        let found = texture_color(
            &scene,
            &scene.textures.records[0],
            Footprint {
                uv,
                dx: Vec2::ZERO,
                dy: Vec2::ZERO,
            },
        );
        assert_eq!([found.x, found.y], [1.0 - expected as f32, expected as f32]);
        odd_count += expected as u32;
    }
    assert!(odd_count > 20 && odd_count < 80);
}
