//! Adaptive sampling under `path`: counts in proportion to the noise, equal bits for any work split, unbiased images, smaller
//! errors.

use glam::{DVec3, UVec2, Vec4};
use wgray::scene::{AdaptiveDescription, Description, Pattern};
use wgray_image::Region;
use wgray_render::job::WorkSplit;
use wgray_trace::cpu::adaptive::proportional_samples;
use wgray_trace::cpu::pixel::pixel_radiance;
use wgray_trace::film::Film;
use wgray_trace::records::Packed;

use super::adaptive::EXTENSIBLE;
use crate::patterns;
use crate::pictures::{backend, crop, differing, exact_modes, film, reference};
use crate::scenes;

#[test]
fn paths_get_counts_in_proportion_to_the_error() {
    let count_for = |pilot_sums: [f32; 4], error: f32, max_count| {
        proportional_samples(Vec4::from(pilot_sums), 16, 8, error * error, max_count)
    };
    // 4 pixels with a standard error of 0.04: four times the target gives four times the samples.
    let no_limit = [4.0 * 0.04 * 0.04, 1000.0, 1.0, 4.0];
    for (error, count) in [
        (0.041, 16),
        (0.039, 24),
        (0.0201, 32),
        (0.0199, 40),
        (0.0101, 64),
        (0.0010001, 640),
        (0.0001, 1000),
        (1e-18, 1000),
        (0.0, 1000),
    ] {
        assert_eq!(count_for(no_limit, error, 1000), count, "{error}");
    }
    // Each effective sample permits the pilot samples twice more.
    for (samples, count) in [(0.25, 24), (0.5, 32), (1.0, 48), (3.0, 112), (30.0, 976)] {
        assert_eq!(
            count_for([1.0, samples, samples, 4.0], 0.0001, 1000),
            count,
            "{samples}"
        );
    }
    // No deviations, no pixels, values that are not finite, and a maximum below the pilot samples.
    let (nan, infinity) = (f32::NAN, f32::INFINITY);
    assert_eq!(count_for([0.0, 0.0, 0.0, 4.0], 0.001, 1000), 16);
    assert_eq!(count_for([0.0, 0.0, 0.0, 0.0], 0.001, 1000), 1000);
    assert_eq!(count_for([nan, nan, nan, 4.0], 0.001, 1000), 16);
    assert_eq!(count_for([infinity, infinity, infinity, 4.0], 0.001, 1000), 16);
    assert_eq!(count_for([infinity, 9.0, 1.0, 4.0], 0.001, 65_536), 16 + 162 * 16);
    assert_eq!(count_for(no_limit, 0.041, 7), 7);
    assert_eq!(count_for(no_limit, 0.0101, 50), 50);
}

/// Returns a scene under `path`, in which most noise is on a glass sphere and in its shadow.
fn paths(pattern: Pattern, count: u32, seed: u32, error: Option<f64>) -> Packed {
    let text = "image = { width = 32, height = 24 }
        camera = { position = [0, -6, 2], look_at = [0, 0, 0.8], fov = 34 }
        environment = { color = [0.2, 0.3, 0.4] }
        render = { integrator = 'path', max_depth = 6 }
        materials.floor = { type = 'diffuse', color = [0.6, 0.6, 0.6] }
        materials.glass = { type = 'dielectric', ior = 1.5 }
        materials.emitter = { type = 'diffuse', color = [0, 0, 0], emission = [40, 36, 30] }
        [[shapes]]
        type = 'plane'
        material = 'floor'
        point = [0, 0, 0]
        normal = [0, 0, 1]
        tangent = [1, 0, 0]
        [[shapes]]
        type = 'sphere'
        material = 'glass'
        center = [-0.5, 0, 0.8]
        radius = 0.8
        [[shapes]]
        type = 'sphere'
        material = 'emitter'
        center = [2, 1, 4]
        radius = 0.3
        ";
    let mut description: Description = Description::parse(text, "paths").expect("a scene");
    description.render.pixel_samples = patterns::samples(pattern, count);
    description.render.seed = seed;
    description.render.adaptive = error.map(|error| AdaptiveDescription {
        error,
        max_samples: Some(256),
    });
    scenes::packed(&description)
}

/// The sample counts of paths, from the formula in double precision.
#[test]
fn neighbors_up_to_two_pixels_away_determine_the_counts_of_paths() {
    let (pilot, error) = (16, 0.004);
    let packed = paths(Pattern::Sobol, pilot, 1, Some(error));
    let film = reference(&packed);
    let (width, height) = (packed.camera.width as i32, packed.camera.height as i32);
    let statistics: Vec<[f64; 3]> = (0..width * height)
        .map(|i| {
            let position = UVec2::new((i % width) as u32, (i / width) as u32);
            let values = (0..pilot).map(|i| pixel_radiance(&packed, position, i).0.truncate().as_dvec3());
            let (mut mean, mut sum, mut fourth_moments) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for (n, value) in values.enumerate() {
                let previous_mean = mean;
                mean += (value - mean) / (n + 1) as f64;
                let deviation = (value - previous_mean) * (value - mean);
                sum += deviation;
                fourth_moments += deviation.element_sum().powi(2);
            }
            let slope = mean.to_array().map(|v| v.clamp(0.01, 1.0).powf(1.0 / 2.2 - 1.0) / 2.2);
            let variance = sum / f64::from(pilot * (pilot - 1)) * DVec3::from(slope).powf(2.0);
            [variance.element_sum() / 3.0, sum.element_sum(), fourth_moments]
        })
        .collect();
    let (mut checked, mut counts) = (0, Vec::new());
    for y in 0..height {
        for x in 0..width {
            let offsets = (-2..=2).flat_map(|dy: i32| (-2..=2).map(move |dx: i32| (dx, dy)));
            let near = offsets.filter(|(dx, dy)| (1..=4).contains(&(dx * dx + dy * dy)));
            let inside = near
                .map(|(dx, dy)| (x + dx, y + dy))
                .filter(|&(x, y)| (0..width).contains(&x) && (0..height).contains(&y));
            let neighbors: Vec<[f64; 3]> = inside.map(|(x, y)| statistics[(y * width + x) as usize]).collect();
            let [variance, deviations, fourth_moments] =
                [0, 1, 2].map(|k| neighbors.iter().map(|values| values[k]).sum::<f64>());
            let wanted = (variance / neighbors.len() as f64).sqrt() / error - 1.0;
            let limit = match fourth_moments > 0.0 {
                true => 2.0 * deviations * deviations / fourth_moments,
                false => 0.0,
            };
            let steps = 2.0 * wanted.min(limit).max(0.0);
            let count = film.sample_count((y * width + x) as usize);
            counts.push(count);
            if steps == 0.0 || (steps - steps.round()).abs() > 1e-3 {
                let expected = (pilot + steps.ceil() as u32 * pilot / 2).min(256);
                assert_eq!(count, expected, "{x}, {y}: {steps}");
                checked += 1;
            }
        }
    }
    counts.sort_unstable();
    counts.dedup();
    assert!(
        checked > 700 && counts.len() > 5 && counts[0] == pilot,
        "{checked}, {counts:?}"
    );
}

#[test]
fn adaptive_paths_do_not_depend_on_backend_crop_or_work_split() {
    for pattern in EXTENSIBLE {
        let packed = paths(pattern, 16, 1, Some(0.01));
        let expected = reference(&packed);
        assert!(expected.sample_counts().any(|n| n > 64) && expected.sample_counts().any(|n| n == 16));
        if pattern == Pattern::Jittered {
            assert!(expected.sample_counts().all(|n| n % 16 == 0), "incomplete rounds");
        }
        for mode in exact_modes() {
            for (x0, y0, x1, y1) in [(0, 0, 32, 24), (9, 11, 10, 12), (1, 2, 31, 22), (31, 0, 32, 24)] {
                let region = Region { x0, y0, x1, y1 };
                for (band_pixels, samples_per_dispatch) in [(1 << 20, None), (32 * 3, Some(7))] {
                    let split = WorkSplit {
                        band_pixels,
                        samples_per_dispatch,
                        ..WorkSplit::default()
                    };
                    let found = film(&mut *backend(&packed, mode), &packed, region, &split);
                    let expected = crop(&expected, region);
                    assert_eq!(
                        differing(&found, &expected),
                        0,
                        "{pattern:?}, {mode:?}, {region:?}, {split:?}"
                    );
                }
            }
        }
    }
    // Negative control: another error.
    let [a, b] = [0.01, 0.0101].map(|error| reference(&paths(Pattern::Sobol, 16, 1, Some(error))));
    assert!(differing(&a, &b) > 0);
}

/// The tolerance includes three standard errors of the difference, which contain 99.7 % of differences.
#[test]
fn adaptive_paths_keep_the_brightness() {
    let brightness = |packed: &Packed| {
        let film = reference(packed);
        film.means().flatten().map(f64::from).sum::<f64>() / (3 * film.sums.len()) as f64
    };
    for pattern in [Pattern::Sobol, Pattern::Jittered] {
        let differences: Vec<f64> = (0..24)
            .map(|seed| {
                let adaptive = brightness(&paths(pattern, 16, seed, Some(0.01)));
                adaptive / brightness(&paths(pattern, 64, seed + 100, None)) - 1.0
            })
            .collect();
        let mean = differences.iter().sum::<f64>() / 24.0;
        let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / 23.0;
        let standard_error = (variance / 24.0).sqrt();
        assert!(standard_error < 0.005, "{pattern:?}: {standard_error}");
        assert!(
            mean.abs() < 3.0 * standard_error,
            "{pattern:?}: {mean} +- {standard_error}"
        );
    }
}

#[test]
fn errors_of_paths_are_smaller_than_with_as_many_uniform_samples() {
    let displayed = |v: f32| f64::from(v.clamp(0.0, 1.0)).powf(1.0 / 2.2);
    let converged = reference(&paths(Pattern::Sobol, 4096, 99, None));
    let squared_error = |film: &Film| {
        let pairs = film.means().zip(converged.means());
        let squares = pairs.map(|(a, b)| (0..3).map(|c| (displayed(a[c]) - displayed(b[c])).powi(2)).sum::<f64>());
        squares.sum::<f64>()
    };
    let (mut adaptive_total, mut uniform_total) = (0.0, 0.0);
    for seed in 0..8 {
        let film = reference(&paths(Pattern::Sobol, 16, seed, Some(0.01)));
        let mean_count = film.sample_counts().map(f64::from).sum::<f64>() / film.sums.len() as f64;
        adaptive_total += squared_error(&film);
        uniform_total += squared_error(&reference(&paths(Pattern::Sobol, mean_count.ceil() as u32, seed, None)));
    }
    let ratio = adaptive_total / uniform_total;
    assert!(ratio < 0.8, "{ratio}");
}
