//! Reconstruction filters: integrals and moments, sample positions and weights, images.

use glam::Vec4;
use wgray::scene::{Pattern, PixelFilterDescription, PixelFilterKind};
use wgray_render::pack::filter::{kernel_value, table};
use wgray_trace::cpu::pixel::filtered;
use wgray_trace::cpu::sequence::sobol_sample;
use wgray_trace::film::mean;
use wgray_trace::records::{FILTER_TABLE_SIZE, Packed};

use super::cornell;
use crate::pictures::{RenderMode, differing, exact_modes, render};
use crate::scenes;

const KINDS: [PixelFilterKind; 5] = [
    PixelFilterKind::Box,
    PixelFilterKind::Triangle,
    PixelFilterKind::Gaussian,
    PixelFilterKind::Mitchell,
    PixelFilterKind::BlackmanHarris,
];

fn filtered_scene(kind: PixelFilterKind, radius: f64) -> Packed {
    cornell(Pattern::Sobol, 16, |description| {
        let radius = Some(radius);
        description.render.filter = PixelFilterDescription { kind, radius };
    })
}

fn valid_filter(kind: PixelFilterKind, radius: f64) -> wgray::scene::PixelFilter {
    let mut description = scenes::scene("cornell.toml");
    let radius = Some(radius);
    description.render.filter = PixelFilterDescription { kind, radius };
    description.validate().expect("a valid scene").render.filter
}

/// Returns the integral of |x|^power times a filter of radius 1, computed with the midpoint rule.
fn moment(kind: PixelFilterKind, power: i32) -> f64 {
    let steps = 200_000;
    let filter = valid_filter(kind, 1.0);
    let position = |i: i32| (f64::from(i) + 0.5) / f64::from(steps);
    (0..steps)
        .map(|i| 2.0 * kernel_value(filter, position(i)) * position(i).powi(power))
        .sum::<f64>()
        / f64::from(steps)
}

#[test]
fn filters_have_the_expected_integrals() {
    // Mitchell's filter has unit integral at radius 2. The cosines of the Blackman-Harris window integrate to 0.
    let gaussian = 0.833_287 - 2.0 * (-4.5f64).exp(); // sqrt(2 pi) / 3 erf(3 / sqrt 2), minus the offset
    let expected = [2.0, 1.0, gaussian, 0.5, 2.0 * 0.35875];
    for (kind, expected) in KINDS.into_iter().zip(expected) {
        let found = moment(kind, 0);
        let error = (found - expected).abs();
        assert!(error < 1e-5, "{kind:?}: {found}, expected {expected}");
    }
    // Mitchell's filter with B = C = 1/3 sums to 1 over integer offsets.
    let mitchell = valid_filter(PixelFilterKind::Mitchell, 2.0);
    for i in 0..10 {
        let sum: f64 = (-3..=3)
            .map(|k| kernel_value(mitchell, f64::from(k) + f64::from(i) / 10.0))
            .sum();
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
    }
    assert!((kernel_value(mitchell, 0.0) - 8.0 / 9.0).abs() < 1e-12 && kernel_value(mitchell, 1.5) < 0.0);
}

/// Returns the weighted mean of |x|^power over equally probable, uniform bins.
fn table_moment(table: &[Vec4], power: i32) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for bin in table {
        let [a, b, weight] = [bin.x, bin.y, bin.z].map(f64::from);
        let n = power + 1;
        sum += weight * (b.powi(n) - a.powi(n)) / (f64::from(n) * (b - a));
        weights += weight;
    }
    sum / weights
}

#[test]
fn tables_have_the_moments_of_their_filters() {
    for kind in KINDS {
        for radius in [0.3, 1.0, 2.5] {
            let table = table(valid_filter(kind, radius));
            assert_eq!(table.len(), FILTER_TABLE_SIZE as usize);
            assert_eq!(
                (table[0].x, table[FILTER_TABLE_SIZE as usize - 1].y),
                (0.0, radius as f32)
            );
            assert!(table.iter().all(|bin| bin.x < bin.y), "{kind:?}");
            assert!(table.windows(2).all(|bin| bin[0].y == bin[1].x), "{kind:?}");
            assert!(table.iter().all(|bin| (0.9..1.1).contains(&bin.z.abs())), "{kind:?}");
            let negative = table.iter().filter(|bin| bin.z < 0.0).count();
            assert_eq!(negative > 0, kind == PixelFilterKind::Mitchell);
            for power in [1, 2, 4] {
                let expected = moment(kind, power) / moment(kind, 0) * radius.powi(power);
                let found = table_moment(&table, power);
                assert!(
                    (found - expected).abs() < 3e-3 * radius.powi(power),
                    "{kind:?} of radius {radius}, moment {power}: {found}, expected {expected}"
                );
                // Negative control: another filter has other moments.
                for other in KINDS.into_iter().filter(|other| *other != kind) {
                    let expected = moment(other, power) / moment(other, 0) * radius.powi(power);
                    assert!(
                        (found - expected).abs() > 3e-3 * radius.powi(power),
                        "{kind:?} and {other:?} have the same moment"
                    );
                }
            }
        }
    }
}

#[test]
fn positions_and_weights_have_the_moments_of_their_filters() {
    for kind in KINDS {
        let packed = filtered_scene(kind, 1.25);
        let (mut weights, mut x2, mut y4) = (0.0, 0.0, 0.0);
        for i in 0..1 << 14 {
            let sample = filtered(&packed, sobol_sample(i, [1, 2].into())).as_dvec3();
            let (x, y) = (sample.x - 0.5, sample.y - 0.5);
            assert!(x.abs() <= 1.25001 && y.abs() <= 1.25001);
            weights += sample.z;
            x2 += sample.z * x.powi(2);
            y4 += sample.z * y.powi(4);
        }
        for (found, power) in [(x2 / weights, 2), (y4 / weights, 4)] {
            let expected = moment(kind, power) / moment(kind, 0) * 1.25f64.powi(power);
            assert!(
                (found - expected).abs() < 6e-3,
                "{kind:?}, {power}: {found}, expected {expected}"
            );
        }
    }
}

#[test]
fn the_box_filter_needs_no_table_and_a_table_gives_equal_samples() {
    let box_scene = filtered_scene(PixelFilterKind::Box, 0.5);
    assert_eq!(
        (
            box_scene.specialization.filter_bins,
            box_scene.sampling.filter_table.len()
        ),
        (0, 0)
    );
    let mut with_table = filtered_scene(PixelFilterKind::Box, 0.51);
    with_table.sampling.filter_table = table(valid_filter(PixelFilterKind::Box, 0.5));
    assert_eq!(with_table.specialization.filter_bins, FILTER_TABLE_SIZE);
    for i in 0..1000 {
        let u = sobol_sample(i, [5, 6].into());
        let (without_table, with_table) = (filtered(&box_scene, u), filtered(&with_table, u));
        assert!(
            (without_table - with_table).length() < 2e-6,
            "{without_table} {with_table}"
        );
    }
}

#[test]
fn a_constant_image_is_constant_under_every_filter() {
    for kind in KINDS {
        let mut packed = filtered_scene(kind, 1.5);
        packed.primitives.clear();
        packed.bounds.clear();
        packed.counts.primitives = Default::default();
        packed.environment.background = glam::Vec3::new(0.25, 0.5, 0.75);
        for sum in render(&packed, RenderMode::Cpu).sums {
            let [r, g, b] = mean(sum);
            assert!(
                (r - 0.25).abs() < 1e-5 && (g - 0.5).abs() < 1e-5 && (b - 0.75).abs() < 1e-5,
                "{kind:?} {sum}"
            );
        }
    }
}

#[test]
fn images_of_every_filter_are_the_same_on_cpu_and_gpu() {
    let mut films = Vec::new();
    for kind in KINDS {
        let packed = filtered_scene(kind, 1.25);
        let expected = render(&packed, RenderMode::Cpu);
        for mode in exact_modes() {
            assert_eq!(differing(&render(&packed, mode), &expected), 0, "{kind:?}, {mode:?}");
        }
        films.push(expected);
    }
    // Negative control: the filters give different images.
    for (i, film) in films.iter().enumerate() {
        assert!(films[..i].iter().all(|other| differing(film, other) > 100));
    }
}
