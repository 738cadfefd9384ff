//! Computed textures against means of many points.

use std::path::Path;

use glam::Vec2;
use wgray::cpu::footprint::Footprint;
use wgray::cpu::pattern::pattern_share;
use wgray::cpu::texture::texture_color;
use wgray::pack::{CHECKER, LINES};

use super::filters::textured;
use crate::random::Random;

fn point(kind: u32, width: f64, u: f64, v: f64) -> f64 {
    let share = if kind == CHECKER {
        (u.floor() + v.floor()).rem_euclid(2.0) == 1.0
    } else {
        [u, v].iter().any(|x| (x - x.round()).abs() < width / 2.0)
    };
    f64::from(u8::from(share))
}

/// The mean over the parallelogram of the footprint, at n x n points.
fn mean(kind: u32, width: f64, f: Footprint, n: i32) -> f64 {
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let step = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
            let p = f.uv.as_dvec2() + f.dx.as_dvec2() * step(i) + f.dy.as_dvec2() * step(j);
            sum += point(kind, width, p.x, p.y);
        }
    }
    sum / f64::from(n * n)
}

#[test]
fn upright_footprints_have_the_exact_mean() {
    let numbers = Random::new(2);
    let mut unfiltered = 0.0f64;
    for i in 0..150 {
        let kind = [CHECKER, LINES][i % 2];
        let size = 4f64.powf(numbers.between(-3.0, 2.0)) as f32;
        let uv = Vec2::new(numbers.between(-20.0, 20.0) as f32, numbers.between(-20.0, 20.0) as f32);
        // Some are lines along one axis, where the other is not averaged.
        let (width, height) = match i % 10 {
            4 | 5 => (size, 0.0),
            6 | 7 => (0.0, size),
            _ => (size, numbers.between(0.1, 3.0) as f32),
        };
        let (dx, dy) = (Vec2::new(width, 0.0), Vec2::new(0.0, height));
        let f = Footprint { uv, dx, dy };
        let found = f64::from(pattern_share(kind, 0.2, f));
        let exact = mean(kind, f64::from(0.2f32), f, 1000);
        assert!((found - exact).abs() < 6e-3, "{kind} {f:?}: {found} {exact}");
        unfiltered = unfiltered.max((point(kind, 0.2, f64::from(uv.x), f64::from(uv.y)) - exact).abs());
    }
    assert!(unfiltered > 0.5);
}

#[test]
fn slanted_footprints_have_nearly_the_mean() {
    let numbers = Random::new(4);
    let (mut square, mut worst) = (0.0, 0.0f64);
    let count = 300;
    for i in 0..count {
        let kind = [CHECKER, LINES][i % 2];
        let angle = numbers.between(0.0, std::f64::consts::TAU) as f32;
        let long = Vec2::from_angle(angle) * numbers.between(0.2, 4.0) as f32;
        let short = long.perp() * numbers.between(0.05, 1.0) as f32;
        let uv = Vec2::new(numbers.between(-9.0, 9.0) as f32, numbers.between(-9.0, 9.0) as f32);
        let f = Footprint {
            uv,
            dx: short,
            dy: long,
        };
        let error = f64::from(pattern_share(kind, 0.2, f)) - mean(kind, f64::from(0.2f32), f, 150);
        square += error * error / count as f64;
        worst = worst.max(error.abs());
    }
    assert!(square.sqrt() < 0.03 && worst < 0.15, "{} {worst}", square.sqrt());
}

#[test]
fn without_a_footprint_the_pattern_is_its_points() {
    let numbers = Random::new(6);
    for i in 0..1000 {
        let kind = [CHECKER, LINES][i % 2];
        let uv = Vec2::new(numbers.between(-9.0, 9.0) as f32, numbers.between(-9.0, 9.0) as f32);
        let share = pattern_share(
            kind,
            0.25,
            Footprint {
                uv,
                dx: Vec2::ZERO,
                dy: Vec2::ZERO,
            },
        );
        assert_eq!(
            f64::from(share),
            point(kind, 0.25, f64::from(uv.x), f64::from(uv.y)),
            "{uv}"
        );
    }
}

#[test]
fn footprints_without_bound_see_the_whole_pattern() {
    for size in [1e4, 1e20, 1e38, f32::INFINITY, f32::NAN] {
        let (dx, dy) = (Vec2::new(size, size), Vec2::new(0.0, size));
        for uv in [Vec2::new(0.3, 0.4), Vec2::splat(1e30), Vec2::splat(f32::NAN)] {
            assert_eq!(pattern_share(CHECKER, 0.0, Footprint { uv, dx, dy }), 0.5);
            let lines = pattern_share(LINES, 0.25, Footprint { uv, dx, dy });
            assert!((lines - 0.4375).abs() < 1e-6, "{lines}");
        }
    }
}

#[test]
fn textures_are_scaled_then_turned_then_moved() {
    let keys = "type = 'checker'\neven = [1, 0, 0]\nodd = [0, 1, 0]\nscale = [2, 1]\nrotate = 90\noffset = [0.5, 3]";
    let scene = textured(Path::new("."), keys);
    let mut odd = 0;
    for i in 0..100 {
        let (u, v) = (f64::from(i) * 0.1 + 0.01, f64::from(i % 7) * 0.3 + 0.02);
        // (u, v) -> (2 u, v) -> (-v, 2 u) -> (0.5 - v, 3 + 2 u)
        let expected = point(CHECKER, 0.0, 0.5 - v, 3.0 + 2.0 * u);
        let uv = Vec2::new(u as f32, v as f32);
        let found = texture_color(
            &scene,
            &scene.textures[0],
            Footprint {
                uv,
                dx: Vec2::ZERO,
                dy: Vec2::ZERO,
            },
        );
        assert_eq!([found.x, found.y], [1.0 - expected as f32, expected as f32]);
        odd += expected as u32;
    }
    assert!(odd > 20 && odd < 80);
}
