//! Adaptive sampling: the same on both paths and under every cut; where it stops, and what its estimate is worth.

use glam::{UVec2, Vec4};
use wgray::cpu::adaptive::{display_slope_squared, display_variance, moments_with, variance_of_mean};
use wgray::cpu::integrator::{pixel_corners, pixel_radiance};
use wgray::film::mean;
use wgray::job::Cut;
use wgray::pack::Packed;
use wgray::scene::{AdaptiveDescription, Overrides, Pattern, PixelFilterDescription, PixelFilterKind, Scene};

use super::cornell;
use crate::pictures::{backend, both, differing, exact_ways, film, reference, render, whole};
use crate::scenes;

const GOING_ON: [Pattern; 4] = [Pattern::Jittered, Pattern::Random, Pattern::Halton, Pattern::Sobol];

fn adaptive(pattern: Pattern, error: f64, max_samples: u32) -> Packed {
    cornell(pattern, 16, |description| {
        let max_samples = Some(max_samples);
        description.render.adaptive = Some(AdaptiveDescription { error, max_samples });
    })
}

#[test]
fn pictures_are_the_same_on_both_paths_and_under_every_cut() {
    for pattern in GOING_ON {
        for kind in [PixelFilterKind::Box, PixelFilterKind::Mitchell] {
            let packed = cornell(pattern, 16, |description| {
                let max_samples = Some(90);
                description.render.adaptive = Some(AdaptiveDescription {
                    error: 0.02,
                    max_samples,
                });
                description.render.filter = PixelFilterDescription { kind, radius: None };
            });
            let expected = reference(&packed);
            assert!(expected.sample_counts().any(|n| n > 16) && expected.sample_counts().any(|n| n == 16));
            for way in exact_ways() {
                for (band_pixels, samples_per_call, rows_per_call) in [
                    (1 << 20, None, None),
                    (41 * 7, Some(5), Some(3)),
                    (1, Some(17), None),
                    (500, Some(1), Some(2)),
                ] {
                    let cut = Cut {
                        band_pixels,
                        samples_per_call,
                        rows_per_call,
                    };
                    let found = film(&mut *backend(&packed, way), &packed, whole(&packed), &cut);
                    assert_eq!(
                        differing(&found, &expected),
                        0,
                        "{pattern:?}, {kind:?}, {way:?}, {cut:?}"
                    );
                }
            }
        }
    }
    // negative control: another error, another seed
    let [a, b] = [0.02, 0.021].map(|error| reference(&adaptive(Pattern::Sobol, error, 90)));
    assert!(differing(&a, &b) > 0);
    let mut packed = adaptive(Pattern::Sobol, 0.02, 90);
    packed.camera.seed += 1;
    assert!(differing(&a, &reference(&packed)) > 500);
}

#[test]
fn samples_come_in_rounds_between_the_least_and_the_most() {
    let packed = adaptive(Pattern::Sobol, 0.01, 100);
    let film = reference(&packed);
    let mut counts: Vec<u32> = film.sample_counts().collect();
    for (pixel, count) in counts.iter().enumerate() {
        assert!(count % 16 == 0 || *count == 100, "{count}");
        let (sum, moments) = (film.sums[pixel], film.moments[pixel]);
        assert!(*count == 100 || display_variance(sum, moments) <= 0.01 * 0.01);
    }
    counts.sort_unstable();
    counts.dedup();
    assert_eq!((counts[0], counts[counts.len() - 1]), (16, 100));
}

#[test]
fn extreme_errors_give_the_least_or_the_most_samples() {
    let uniform = |count| {
        cornell(Pattern::Sobol, count, |description| {
            // the light's samples go on from group to group, whatever the pixel's count is
            description.render.adaptive = None;
        })
    };
    for (error, count) in [(1.0, 16), (0.0, 64)] {
        let adaptive = reference(&adaptive(Pattern::Sobol, error, 64));
        let uniform = reference(&uniform(count));
        // Error 0 stops where a pixel's samples are all the same: its mean is the same with any number of them.
        for (pixel, (a, b)) in adaptive.sums.iter().zip(&uniform.sums).enumerate() {
            let stopped = adaptive.sample_count(pixel) < count;
            assert!(!stopped || adaptive.moments[pixel].truncate() == glam::Vec3::ZERO);
            if stopped {
                let apart = |a: f32, b: f32| (a - b).abs() > 1e-5;
                assert!(!mean(*a).into_iter().zip(mean(*b)).any(|(a, b)| apart(a, b)));
            } else {
                assert_eq!(a, b);
            }
        }
    }
}

#[test]
fn moments_are_the_variance_of_the_samples() {
    let packed = adaptive(Pattern::Random, 0.0, 48);
    let film = reference(&packed);
    for (pixel, sum) in film.sums.iter().enumerate() {
        let at = UVec2::new(pixel as u32 % 41, pixel as u32 / 41);
        let n = film.sample_count(pixel);
        let values: Vec<_> = (0..n).map(|i| pixel_radiance(&packed, at, i).as_dvec4()).collect();
        let mean = values.iter().map(|v| v.truncate()).sum::<glam::DVec3>() / f64::from(n);
        let deviations: glam::DVec3 = values
            .iter()
            .map(|v| (v.truncate() - mean) * (v.truncate() - mean))
            .sum();
        let corners = pixel_corners(&packed, at).truncate().as_dvec3();
        let expected = (deviations + corners) / f64::from(n) / f64::from(n - 1);
        let found = variance_of_mean(*sum, film.moments[pixel]);
        let error = (found.as_dvec3() - expected).abs();
        assert!(
            (error.cmple(expected * 1e-3 + 1e-9)).all(),
            "{at}: {found}, not {expected}"
        );
        assert_eq!(found.to_array(), film.variance(pixel));
    }
}

/// The error that is aimed at is that of the displayed value, v^(1 / 2.2).
#[test]
fn errors_are_scaled_by_the_slope_of_the_displayed_value() {
    let displayed = |v: f64| v.powf(1.0 / 2.2);
    for i in 1..=1000 {
        let v = f64::from(i) / 1000.0;
        let slope = |v: f64| (displayed(v * 1.0001) - displayed(v * 0.9999)) / (v * 2e-4);
        let expected = slope(v.max(0.01)).powi(2);
        let found = f64::from(display_slope_squared(v as f32));
        assert!((found / expected - 1.0).abs() < 1e-5, "{v}: {found}, not {expected}");
    }
    // black and what is brighter than white: as at the nearest value that is told apart
    assert_eq!(display_slope_squared(-0.5), display_slope_squared(0.01));
    assert_eq!(display_slope_squared(7.0), display_slope_squared(1.0));
    // the mean over the channels, each with its own slope
    let (sum, moments) = (Vec4::new(1.0, 2.0, 4.0, 8.0), Vec4::new(0.1, 0.4, 0.2, 8.0));
    let [x, y, z] = [(0.125, 0.1), (0.25, 0.4), (0.5, 0.2)].map(|(mean, moment): (f64, f64)| {
        let slope = displayed(mean) / (2.2 * mean);
        slope * slope * moment / 8.0 / 7.0
    });
    let (found, expected) = (f64::from(display_variance(sum, moments)), (x + y + z) / 3.0);
    assert!((found / expected - 1.0).abs() < 1e-5, "{found}, not {expected}");
}

#[test]
fn weighted_moments_of_a_constant_are_nothing() {
    let (mut sum, mut moments) = (Vec4::ZERO, Vec4::ZERO);
    for weight in [1.0, 0.98, -1.02, 1.0, 1.0, -1.02, 1.0] {
        let sample = (glam::Vec3::new(0.3, 0.2, 0.7) * weight).extend(weight);
        moments = moments_with(moments, sum, sample);
        sum += sample;
    }
    assert!(
        moments.truncate().abs().max_element() < 1e-12 && moments.w == 7.0,
        "{moments}"
    );
    // negative control
    let other = moments_with(moments, sum, Vec4::new(0.3, 0.2, 0.6, 1.0));
    assert!(other.z > 1e-3);
}

#[test]
fn an_edge_that_no_sample_meets_is_found_by_the_corners() {
    // A white rectangle on black that reaches 1 % into the columns and rows of its edge.
    let scene = "\
image = { width = 20, height = 20 }
camera = { type = 'orthographic', position = [0, 0, 5], look_at = [0, 0, 0], up = [0, 1, 0], height = 20 }
render = { ambient = [1, 1, 1], pixel_samples = { pattern = 'sobol', count = 16 }, adaptive = { error = 0.001 } }
materials.white = { type = 'phong', color = [1, 1, 1] }
shapes = [{ type = 'rectangle', material = 'white', center = [0, 0, 0], size = [8.02, 8.02], normal = [0, 0, 1], tangent = [1, 0, 0] }]
";
    let packed = scenes::parse(scene);
    for way in both() {
        let film = render(&packed, way);
        let mut blind = 0;
        for (pixel, count) in film.sample_counts().enumerate() {
            let at = UVec2::new(pixel as u32 % 20, pixel as u32 / 20);
            let outside = |x: u32| x == 5 || x == 14;
            let inside = |x: u32| (5..=14).contains(&x);
            let edge = inside(at.x) && inside(at.y) && (outside(at.x) || outside(at.y));
            assert_eq!(count > 16, edge, "{at}: {count} samples");
            let first = pixel_radiance(&packed, at, 0);
            blind += u32::from(edge && (1..16).all(|i| pixel_radiance(&packed, at, i) == first));
        }
        assert!(blind > 10, "the first rounds alone would have found the edge");
    }
}

#[test]
fn the_estimate_is_an_upper_bound_on_average() {
    let packed = adaptive(Pattern::Sobol, 0.02, 1024);
    let film = reference(&packed);
    let truth = reference(&cornell(Pattern::Sobol, 2048, |description| {
        description.render.seed = 9
    }));
    let display = |v: f32| f64::from(v.clamp(0.0, 1.0)).powf(1.0 / 2.2);
    let mut squares = 0.0;
    for (a, b) in film.means().zip(truth.means()) {
        squares += (0..3).map(|c| (display(a[c]) - display(b[c])).powi(2)).sum::<f64>();
    }
    let error = (squares / 3.0 / film.sums.len() as f64).sqrt();
    assert!((0.0005..0.02).contains(&error), "{error}");
}

#[test]
fn what_cannot_be_is_told() {
    let text = |render: &str| {
        format!(
            "image = {{ width = 4, height = 3 }}\ncamera = {{ position = [0, 1, 0], look_at = [1, 0, 0], fov = 40 }}\n\
             [render]\n{render}\n"
        )
    };
    let told = |render: &str, overrides: &Overrides| match Scene::parse(&text(render), "s.toml", overrides) {
        Ok(_) => "sound".to_string(),
        Err(error) => error.to_string(),
    };
    let none = Overrides::default();
    let sobol = "pixel_samples = { pattern = 'sobol', count = 8 }\n";
    for (render, expected) in [
        (
            "adaptive = { error = 0.1 }",
            "s.toml:4: render.adaptive: the pattern of pixel_samples must not be a grid",
        ),
        (
            &format!("{sobol}adaptive = {{ error = 2 }}"),
            "s.toml:5: render.adaptive.error: 2 must be from 0 to 1",
        ),
        (
            &format!("{sobol}adaptive = {{ error = nan }}"),
            "s.toml:5: render.adaptive.error: ",
        ),
        (&format!("{sobol}adaptive = {{ }}"), "s.toml:5: render.adaptive"),
        (
            &format!("{sobol}adaptive = {{ error = 0.1, max_samples = 7 }}"),
            "s.toml:5: render.adaptive.max_samples: 7 must be from 8 to 65536",
        ),
        (
            &format!("{sobol}adaptive = {{ error = 0.1, max_samples = 8 }}"),
            "sound",
        ),
        (&format!("{sobol}adaptive = {{ error = 0 }}"), "sound"),
        ("filter = { type = 'lanczos' }", "s.toml:4: render.filter.type: "),
        ("filter = { radius = 1 }", "s.toml:4: render.filter"),
        (
            "filter = { type = 'box', radius = 0 }",
            "s.toml:4: render.filter.radius: 0 must be from 0.01 to 16",
        ),
        (
            "filter = { type = 'box', radius = 17 }",
            "s.toml:4: render.filter.radius: 17 must be from 0.01 to 16",
        ),
        ("filter = { type = 'blackman_harris' }", "sound"),
        (
            "pixel_samples = { pattern = 'jittered', count = 8 }",
            "s.toml:4: render.pixel_samples.count: 8 must be a square",
        ),
        (
            "pixel_samples = { pattern = 'rotated_grid', count = 8 }",
            "s.toml:4: render.pixel_samples.count: 8 must be a",
        ),
        ("pixel_samples = { pattern = 'halton', count = 8 }", "sound"),
    ] {
        assert!(
            told(render, &none).starts_with(expected),
            "{render}: {}",
            told(render, &none)
        );
    }
    let option = |error, pattern| Overrides {
        adaptive: Some(error),
        pixel_pattern: pattern,
        ..Overrides::default()
    };
    assert!(told("", &option(0.1, None)).starts_with("--adaptive: the pattern of pixel_samples must not be a grid"));
    assert!(told("", &option(-0.1, Some(Pattern::Sobol))).starts_with("--adaptive: -0.1 must be from 0 to 1"));
    let scene = Scene::parse(&text(""), "s.toml", &option(0.1, Some(Pattern::Sobol))).expect("a sound scene");
    let adaptive = scene.render.adaptive.expect("adaptive sampling");
    assert_eq!((adaptive.error, adaptive.max_samples), (0.1, 256));
}
