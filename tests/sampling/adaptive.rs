//! Adaptive sampling: equal bits on CPU and GPU for any work split, sample counts, variance estimates.

use glam::{DVec3, UVec2, Vec4};
use wgray::scene::{AdaptiveDescription, Overrides, Pattern, PixelFilterDescription, PixelFilterKind, Scene};
use wgray_image::Region;
use wgray_render::job::WorkSplit;
use wgray_trace::cpu::adaptive::{
    display_slope_squared, display_variance, moments_with, samples_wanted, variance_of_mean,
};
use wgray_trace::cpu::pixel::pixel_radiance;
use wgray_trace::records::Packed;

use super::cornell;
use crate::pictures::{backend, crop, differing, exact_modes, film, reference, render, whole};

pub const EXTENSIBLE: [Pattern; 4] = [Pattern::Jittered, Pattern::Random, Pattern::Halton, Pattern::Sobol];

fn adaptive(pattern: Pattern, error: f64, max_samples: u32) -> Packed {
    cornell(pattern, 16, |description| {
        let max_samples = Some(max_samples);
        description.render.adaptive = Some(AdaptiveDescription { error, max_samples });
    })
}

#[test]
fn adaptive_images_do_not_depend_on_backend_or_work_split() {
    for pattern in EXTENSIBLE {
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
            let variances = (0..expected.sums.len()).flat_map(|pixel| expected.variance(pixel));
            assert!(
                variances.into_iter().all(|variance| variance >= 0.0),
                "{pattern:?}, {kind:?}"
            );
            for mode in exact_modes() {
                for (band_pixels, samples_per_dispatch, rows_per_dispatch) in [
                    (1 << 20, None, None),
                    (41 * 7, Some(5), Some(3)),
                    (1, Some(17), None),
                    (1, None, None),
                    (500, Some(1), Some(2)),
                ] {
                    let split = WorkSplit {
                        band_pixels,
                        samples_per_dispatch,
                        rows_per_dispatch,
                    };
                    let found = film(&mut *backend(&packed, mode), &packed, whole(&packed), &split);
                    assert_eq!(
                        differing(&found, &expected),
                        0,
                        "{pattern:?}, {kind:?}, {mode:?}, {split:?}"
                    );
                }
            }
        }
    }
    // Negative controls: another error, and another seed.
    let [a, b] = [0.02, 0.021].map(|error| reference(&adaptive(Pattern::Sobol, error, 90)));
    assert!(differing(&a, &b) > 0);
    let mut packed = adaptive(Pattern::Sobol, 0.02, 90);
    packed.camera.seed += 1;
    assert!(differing(&a, &reference(&packed)) > 500);
}

#[test]
fn a_crop_equals_the_region_of_the_full_image() {
    let packed = adaptive(Pattern::Sobol, 0.01, 100);
    let expected = reference(&packed);
    for mode in exact_modes() {
        for (x0, y0, x1, y1) in [
            (0, 0, 1, 1),
            (20, 13, 21, 14),
            (3, 5, 37, 29),
            (40, 0, 41, 33),
            (0, 32, 41, 33),
        ] {
            let region = Region { x0, y0, x1, y1 };
            for band_pixels in [1 << 20, 50] {
                let split = WorkSplit {
                    band_pixels,
                    ..WorkSplit::default()
                };
                let found = film(&mut *backend(&packed, mode), &packed, region, &split);
                assert_eq!(differing(&found, &crop(&expected, region)), 0, "{mode:?}, {region:?}");
            }
        }
    }
}

/// Returns the sample count from the neighbors' pilot samples in double precision, or `None` if the count depends on
/// rounding.
fn expected_count(packed: &Packed, pixel: UVec2, pilot: u32, error: f64, max_count: u32) -> Option<u32> {
    let (mut squares, mut neighbors, mut deviations, mut fourth_moments) = (0.0, 0.0, 0.0, 0.0);
    for (dx, dy) in [(0, -1), (-1, 0), (1, 0), (0, 1)] {
        let (x, y) = (pixel.x.checked_add_signed(dx), pixel.y.checked_add_signed(dy));
        let Some((x, y)) = x
            .zip(y)
            .filter(|(x, y)| *x < packed.camera.width && *y < packed.camera.height)
        else {
            continue;
        };
        let values = (0..pilot).map(|i| pixel_radiance(packed, UVec2::new(x, y), i).0.truncate().as_dvec3());
        let (mut n, mut mean, mut sum) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for value in values {
            n += 1.0;
            let previous_mean = mean;
            mean += (value - mean) / n;
            let deviation = (value - previous_mean) * (value - mean);
            sum += deviation;
            deviations += deviation.element_sum();
            fourth_moments += deviation.element_sum().powi(2);
        }
        let slope = mean.to_array().map(|v| v.clamp(0.01, 1.0).powf(1.0 / 2.2 - 1.0) / 2.2);
        squares += (sum / (n - 1.0) * DVec3::from(slope).powf(2.0)).element_sum() / 3.0;
        neighbors += 1.0;
    }
    let variance_limit = squares / neighbors / (error * error);
    let effective_samples = if fourth_moments > 0.0 {
        deviations * deviations / fourth_moments
    } else {
        0.0
    };
    let effective_limit = f64::from(pilot) * (1.0 + effective_samples / 2.0);
    let mut count = pilot;
    while count < max_count && variance_limit > f64::from(count) && effective_limit >= f64::from(2 * count) {
        count *= 2;
    }
    let is_close = |limit: f64| (0..20).any(|k| (limit / f64::from(pilot << k) - 1.0).abs() < 1e-3);
    (!is_close(variance_limit) && !is_close(effective_limit)).then_some(count.min(max_count))
}

#[test]
fn sample_counts_follow_the_pilot_samples_of_neighbors() {
    for (samples_per_round, pilot, error, max_count) in [
        (16, 16, 0.01, 100),
        (4, 16, 0.02, 256),
        (3, 18, 0.005, 1000),
        (1, 16, 0.03, 40),
    ] {
        let packed = cornell(Pattern::Sobol, samples_per_round, |description| {
            let max_samples = Some(max_count);
            description.render.adaptive = Some(AdaptiveDescription { error, max_samples });
        });
        let film = reference(&packed);
        let (mut checked, mut counts) = (0, Vec::new());
        for (pixel, count) in film.sample_counts().enumerate() {
            let position = UVec2::new(pixel as u32 % 41, pixel as u32 / 41);
            if let Some(expected) = expected_count(&packed, position, pilot, error, max_count) {
                assert_eq!(count, expected, "{samples_per_round}, {position}");
                checked += 1;
            }
            counts.push(count);
        }
        counts.sort_unstable();
        counts.dedup();
        assert!(
            checked > 1300 && counts.len() > 2 && counts[0] == pilot,
            "{checked}, {counts:?}"
        );
    }
}

#[test]
fn extreme_errors_give_the_minimum_or_maximum_samples() {
    let uniform_scene = |count| {
        cornell(Pattern::Sobol, count, |description| {
            // Light samples continue the sequence of the previous pixel sample, whatever the number of pixel samples.
            description.render.adaptive = None;
        })
    };
    for (error, count) in [(1.0, 16), (0.0, 64)] {
        let adaptive = reference(&adaptive(Pattern::Sobol, error, 64));
        assert_eq!(adaptive.sums, reference(&uniform_scene(count)).sums);
        assert!(adaptive.sample_counts().all(|n| n == count));
    }
}

#[test]
fn tiny_images_and_few_pilot_samples_agree_in_all_modes() {
    let counts = |width, height, samples_per_round, max_count| {
        let packed = cornell(Pattern::Random, samples_per_round, |description| {
            (description.image.width, description.image.height) = (width, height);
            let max_samples = Some(max_count);
            description.render.adaptive = Some(AdaptiveDescription {
                error: 1e-4,
                max_samples,
            });
        });
        let expected = reference(&packed);
        for mode in exact_modes() {
            assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}");
        }
        expected.sample_counts().collect::<Vec<u32>>()
    };
    // Without neighbors, the variance is unknown.
    assert_eq!(counts(1, 1, 4, 50), [50]);
    assert!(counts(7, 1, 4, 50).iter().all(|n| [16, 32, 50].contains(n)));
    // The maximum also limits the number of pilot samples.
    assert_eq!(counts(3, 3, 1, 2), [2; 9]);
    assert!(counts(5, 5, 1, 17).iter().all(|n| [16, 17].contains(n)));
}

/// The first argument of `samples_wanted` contains sums over pixels: the variances, the squared deviations, the squares
/// of the squared deviations, and the number of pixels.
#[test]
fn effective_samples_limit_the_doublings() {
    let count_for = |pilot_sums: [f32; 4], error: f32, max_count| {
        samples_wanted(Vec4::from(pilot_sums), 16, error * error, max_count)
    };
    // 4 pixels with a standard error of 0.04: 4 times the samples halve the error.
    let no_limit = [4.0 * 0.04 * 0.04, 1000.0, 1.0, 4.0];
    for (error, count) in [
        (0.041, 16),
        (0.021, 64),
        (0.011, 256),
        (0.009, 512),
        (0.001, 1000),
        (0.0, 1000),
    ] {
        assert_eq!(count_for(no_limit, error, 1000), count, "{error}");
    }
    // Effective samples limit the doublings: 2 permit one doubling, 6 permit two.
    for (samples, count) in [(1.0, 16), (1.9, 16), (2.0, 32), (5.9, 32), (6.0, 64), (30.0, 256)] {
        assert_eq!(count_for([1.0, samples, samples, 4.0], 0.001, 1000), count, "{samples}");
    }
    assert_eq!(count_for([0.0, 0.0, 0.0, 4.0], 0.001, 1000), 16);
    assert_eq!(count_for([0.0, 0.0, 0.0, 0.0], 0.001, 1000), 1000);
}

#[test]
fn the_variance_of_the_mean_matches_the_samples() {
    let packed = adaptive(Pattern::Random, 0.01, 48);
    let film = reference(&packed);
    for (pixel, sum) in film.sums.iter().enumerate() {
        let position = UVec2::new(pixel as u32 % 41, pixel as u32 / 41);
        let n = film.sample_count(pixel);
        let values: Vec<_> = (0..n)
            .map(|i| pixel_radiance(&packed, position, i).0.as_dvec4())
            .collect();
        let mean = values.iter().map(|v| v.truncate()).sum::<glam::DVec3>() / f64::from(n);
        let deviations: glam::DVec3 = values
            .iter()
            .map(|v| (v.truncate() - mean) * (v.truncate() - mean))
            .sum();
        let expected = deviations / f64::from(n) / f64::from(n - 1);
        let found = variance_of_mean(*sum, film.moments[pixel]);
        let error = (found.as_dvec3() - expected).abs();
        assert!(
            (error.cmple(expected * 1e-3 + 1e-9)).all(),
            "{position}: {found}, expected {expected}"
        );
        assert_eq!(found.to_array(), film.variance(pixel));
    }
}

/// The target error applies to the displayed value v^(1 / 2.2).
#[test]
fn errors_are_scaled_by_the_slope_of_the_displayed_value() {
    let displayed = |v: f64| v.powf(1.0 / 2.2);
    for i in 1..=1000 {
        let v = f64::from(i) / 1000.0;
        let slope = |v: f64| (displayed(v * 1.0001) - displayed(v * 0.9999)) / (v * 2e-4);
        let expected = slope(v.max(0.01)).powi(2);
        let found = f64::from(display_slope_squared(v as f32));
        assert!(
            (found / expected - 1.0).abs() < 1e-5,
            "{v}: {found}, expected {expected}"
        );
    }
    // Below 0.01 and above 1, the slope is clamped.
    assert_eq!(display_slope_squared(-0.5), display_slope_squared(0.01));
    assert_eq!(display_slope_squared(7.0), display_slope_squared(1.0));
    // The mean over the channels, each scaled by the slope of the channel.
    let (sum, moments) = (Vec4::new(1.0, 2.0, 4.0, 8.0), Vec4::new(0.1, 0.4, 0.2, 8.0));
    let [x, y, z] = [(0.125, 0.1), (0.25, 0.4), (0.5, 0.2)].map(|(mean, moment): (f64, f64)| {
        let slope = displayed(mean) / (2.2 * mean);
        slope * slope * moment / 8.0 / 7.0
    });
    let (found, expected) = (f64::from(display_variance(sum, moments)), (x + y + z) / 3.0);
    assert!((found / expected - 1.0).abs() < 1e-5, "{found}, expected {expected}");
}

#[test]
fn weighted_moments_of_a_constant_are_zero() {
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
    let with_deviation = moments_with(moments, sum, Vec4::new(0.3, 0.2, 0.6, 1.0));
    assert!(with_deviation.z > 1e-3);
}

#[test]
fn the_target_error_is_an_upper_bound_on_average() {
    let packed = adaptive(Pattern::Sobol, 0.02, 1024);
    let film = reference(&packed);
    let converged = reference(&cornell(Pattern::Sobol, 2048, |description| {
        description.render.seed = 9
    }));
    let displayed = |v: f32| f64::from(v.clamp(0.0, 1.0)).powf(1.0 / 2.2);
    let mut squares = 0.0;
    for (a, b) in film.means().zip(converged.means()) {
        squares += (0..3).map(|c| (displayed(a[c]) - displayed(b[c])).powi(2)).sum::<f64>();
    }
    let error = (squares / 3.0 / film.sums.len() as f64).sqrt();
    assert!((0.0005..0.02).contains(&error), "{error}");
}

#[test]
fn invalid_adaptive_settings_are_rejected() {
    let text = |render: &str| {
        format!(
            "image = {{ width = 4, height = 3 }}\ncamera = {{ position = [0, 1, 0], look_at = [1, 0, 0], fov = 40 }}\n\
             [render]\n{render}\n"
        )
    };
    let message = |render: &str, overrides: &Overrides| match Scene::parse_with(&text(render), "s.toml", overrides) {
        Ok(_) => "valid".to_string(),
        Err(error) => error.to_string(),
    };
    let no_overrides = Overrides::default();
    let sobol = "pixel_samples = { pattern = 'sobol', count = 8 }\n";
    for (render, expected) in [
        (
            "adaptive = { error = 0.1 }",
            "s.toml:4: render.adaptive: the pattern of pixel_samples, \"grid\", cannot add samples",
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
            "valid",
        ),
        (&format!("{sobol}adaptive = {{ error = 0 }}"), "valid"),
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
        ("filter = { type = 'blackman_harris' }", "valid"),
        (
            "pixel_samples = { pattern = 'jittered', count = 8 }",
            "s.toml:4: render.pixel_samples.count: 8 must be a square",
        ),
        (
            "pixel_samples = { pattern = 'rotated_grid', count = 8 }",
            "s.toml:4: render.pixel_samples.count: 8 must be a",
        ),
        ("pixel_samples = { pattern = 'halton', count = 8 }", "valid"),
    ] {
        assert!(
            message(render, &no_overrides).starts_with(expected),
            "{render}: {}",
            message(render, &no_overrides)
        );
    }
    let overrides = |error, pattern| Overrides {
        adaptive: Some(error),
        pixel_pattern: pattern,
        ..Overrides::default()
    };
    let grid_message = "adaptive: the pattern of pixel_samples, \"grid\", cannot add samples";
    assert!(message("", &overrides(0.1, None)).starts_with(grid_message));
    assert!(message("", &overrides(-0.1, Some(Pattern::Sobol))).starts_with("adaptive: -0.1 must be from 0 to 1"));
    let scene = Scene::parse_with(&text(""), "s.toml", &overrides(0.1, Some(Pattern::Sobol))).expect("a valid scene");
    let adaptive = scene.render.adaptive.expect("adaptive sampling");
    assert_eq!((adaptive.error, adaptive.max_samples), (0.1, 256));
}
