//! Random patterns are uniform, jointly and in projections, and have the same image mean as grids. The tests are
//! deterministic, because the seeds are fixed.

use glam::Vec2;
use wgray::scene::Pattern;
use wgray_trace::records::Packed;

use crate::kernel::functions;
use crate::pictures::{means, reference};
use crate::probes::twin;
use crate::sources::{parse, shared_source};
use crate::{adapter, patterns, scenes};

/// Probability of rejecting a uniform pattern: low, because each test makes dozens of checks.
const SIGNIFICANCE: f64 = 1e-6;

/// Returns `count` positions for each of `sets` pixels. The GPU computes them if it is available: `tests/probes.rs`
/// shows that the twins agree.
fn positions(pattern: Pattern, count: u32, sets: u32) -> Vec<Vec<Vec2>> {
    let mut description = scenes::scene("cornell.toml");
    description.render.pixel_samples = patterns::samples(pattern, count);
    let packed: Packed = scenes::packed(&description);
    let specialization = &packed.specialization;
    let keys = evaluate("sample_key", (0..sets).flat_map(|i| [i % 97, i / 97, 5, 0]).collect());
    let arguments = keys.chunks_exact(2).flat_map(|key| {
        (0..packed.sampling.pixel_samples).flat_map(|index| {
            [
                specialization.pixel_pattern,
                specialization.pixel_side,
                index,
                0,
                key[0],
                key[1],
            ]
        })
    });
    let points = evaluate("sample_square", arguments.collect());
    let point = |words: &[u32]| Vec2::new(f32::from_bits(words[0]), f32::from_bits(words[1]));
    let points: Vec<Vec2> = points.chunks_exact(2).map(point).collect();
    points
        .chunks_exact(packed.sampling.pixel_samples as usize)
        .map(<[Vec2]>::to_vec)
        .collect()
}

fn evaluate(name: &str, words: Vec<u32>) -> Vec<u32> {
    let Some(device) = adapter::device() else {
        return twin(name).results(&words, 2);
    };
    let source = shared_source();
    let module = parse(&source);
    let functions = functions(&module, &source);
    let (_, function) = functions.iter().find(|(_, f)| f.name() == name).expect("the function");
    function.run(device, &words)
}

fn is_fixed(pattern: Pattern) -> bool {
    let sets = positions(pattern, 16, 2);
    sets[0] == sets[1]
}

/// Returns the p-value of a chi-square, by the cube-root approximation of Wilson and Hilferty, "The Distribution of
/// Chi-Square", 1931.
fn p_value(chi_square: f64, degrees_of_freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * degrees_of_freedom);
    let z = ((chi_square / degrees_of_freedom).cbrt() - (1.0 - spread)) / spread.sqrt();
    upper_tail(z)
}

/// Returns the one-sided p-value of a standard normal deviate: Abramowitz and Stegun, 26.2.17.
fn upper_tail(z: f64) -> f64 {
    if z < 0.0 {
        return 1.0 - upper_tail(-z);
    }
    let t = 1.0 / (1.0 + 0.231_641_9 * z);
    let series = [
        0.319_381_530,
        -0.356_563_782,
        1.781_477_937,
        -1.821_255_978,
        1.330_274_429,
    ];
    let sum: f64 = series.iter().rev().fold(0.0, |sum, c| (sum + c) * t);
    (-z * z / 2.0).exp() / std::f64::consts::TAU.sqrt() * sum
}

/// Returns Pearson's chi-square for equal expected counts.
fn chi_square(counts: &[u32]) -> f64 {
    let expected = f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
    counts
        .iter()
        .map(|count| (f64::from(*count) - expected).powi(2) / expected)
        .sum()
}

/// Returns the first projection in which the positions are not uniform. The test assumes that the positions are
/// independent.
fn nonuniform_projection(positions: &[Vec2]) -> Option<String> {
    const CELLS: usize = 16;
    let cell = |x: f32| ((x * CELLS as f32) as usize).min(CELLS - 1);
    type Projection = fn(Vec2) -> f32;
    let projections: [(&str, Projection); 4] = [
        ("x", |p| p.x),
        ("y", |p| p.y),
        ("x + y modulo 1", |p| (p.x + p.y).fract()),
        ("fine digits of x + 3 y", |p| ((p.x + 3.0 * p.y) * 1024.0).fract()),
    ];
    let mut square = vec![0; CELLS * CELLS];
    positions
        .iter()
        .for_each(|p| square[cell(p.y) * CELLS + cell(p.x)] += 1);
    let mut tests = vec![("the square", square)];
    for (name, projection) in projections {
        let mut line = vec![0; CELLS];
        positions.iter().for_each(|p| line[cell(projection(*p))] += 1);
        tests.push((name, line));
    }
    tests.iter().find_map(|(name, counts)| {
        let p_value = p_value(chi_square(counts), counts.len() as f64 - 1.0);
        (p_value < SIGNIFICANCE).then(|| format!("{name} is not uniform: the p-value is {p_value:.1e}"))
    })
}

#[test]
fn p_values_match_published_tables() {
    for (z, expected) in [(0.0, 0.5), (1.0, 0.158_655), (3.0, 0.001_349_9), (-1.0, 0.841_345)] {
        assert!((upper_tail(z) - expected).abs() < 1e-6, "{z}");
    }
    // Abramowitz and Stegun, table 26.8.
    for (chi_square, degrees_of_freedom, expected) in
        [(24.996, 15.0, 0.05), (37.697, 15.0, 0.001), (124.342, 100.0, 0.05)]
    {
        assert!(
            (p_value(chi_square, degrees_of_freedom) / expected - 1.0).abs() < 0.05,
            "{chi_square} {degrees_of_freedom}"
        );
    }
}

#[test]
fn positions_are_on_the_unit_square() {
    for (name, pattern) in patterns::all() {
        for count in [1, 4, 16, 100, 1024] {
            for p in positions(pattern, count, 20).into_iter().flatten() {
                let is_inside = (0.0..1.0).contains(&p.x) & (0.0..1.0).contains(&p.y);
                assert!(is_inside, "{name}, {count} samples: {p}");
            }
        }
    }
}

/// Tests some positions individually, and all positions of a pixel together.
#[test]
fn random_patterns_are_uniform_over_pixels() {
    let mut pattern_count = 0;
    for (name, pattern) in patterns::all().into_iter().filter(|(_, pattern)| !is_fixed(*pattern)) {
        let pixel_positions = positions(pattern, 16, 40_000);
        // Some patterns confine a position to a grid cell.
        for (first, last) in [(0, 0), (7, 7), (15, 15), (0, 15)] {
            let confined = first == last
                && pixel_positions
                    .iter()
                    .take(100)
                    .all(|set| set[first].distance(pixel_positions[0][first]) < 0.36);
            let list: Vec<Vec2> = pixel_positions
                .iter()
                .flat_map(|set| set[first..=last].iter().copied())
                .collect();
            let problem = if confined { None } else { nonuniform_projection(&list) };
            assert!(problem.is_none(), "{name}, positions {first} to {last}: {problem:?}");
        }
        pattern_count += 1;
    }
    assert!(pattern_count >= 1, "no pattern is random");
}

/// The mean position is the center of the square.
#[test]
fn all_patterns_are_centered() {
    for (name, pattern) in patterns::all() {
        let pixel_positions = positions(pattern, 16, 10_000);
        let n = (pixel_positions.len() * pixel_positions[0].len()) as f64;
        let mean = pixel_positions
            .iter()
            .flatten()
            .map(|p| p.as_dvec2())
            .sum::<glam::DVec2>()
            / n;
        // The standard error of independent positions; no pattern has a larger error.
        let standard_error = (1.0 / 12.0 / n).sqrt();
        assert!(
            ((mean - 0.5) / standard_error).abs().max_element() < 5.0,
            "{name}: {mean}"
        );
    }
}

#[test]
fn a_biased_pattern_is_detected() {
    let pixel_positions = positions(Pattern::Random, 16, 10_000);
    let unbiased: Vec<Vec2> = pixel_positions.into_iter().flatten().collect();
    assert_eq!(nonuniform_projection(&unbiased), None);
    type Change = fn(usize, Vec2) -> Vec2;
    let changes: [(&str, Change); 6] = [
        ("slightly to the left", |_, p| Vec2::new(p.x.powf(1.03), p.y)),
        ("slightly to the top", |_, p| Vec2::new(p.x, p.y * 0.99)),
        ("y equals x", |_, p| Vec2::splat(p.x)),
        ("y equals x for one position in eight", |i, p| {
            if i % 8 == 0 { Vec2::splat(p.x) } else { p }
        }),
        ("distance from the center", |_, p| (p - 0.5).abs()),
        ("only seven bits", |_, p| (p * 128.0).floor() / 128.0),
    ];
    for (name, change) in changes {
        let biased: Vec<Vec2> = unbiased.iter().enumerate().map(|(i, p)| change(i, *p)).collect();
        assert!(nonuniform_projection(&biased).is_some(), "{name}");
    }
}

/// Returns a scene with so few pixels that most of them contain edges.
fn noisy(pattern: Pattern, seed: u32, counts: (u32, u32)) -> Packed {
    let mut description = scenes::scene("cornell.toml");
    (description.image.width, description.image.height) = (20, 20);
    description.render.seed = seed;
    description.render.pixel_samples = patterns::samples(pattern, counts.0);
    description.render.light_samples = patterns::samples(pattern, counts.1);
    scenes::packed(&description)
}

/// Returns the deviation of each pixel from the reference, in standard errors over the seeds.
fn deviations(pictures: &[Vec<[f64; 3]>], expected_pixels: &[[f64; 3]]) -> Vec<f64> {
    let n = pictures.len() as f64;
    let pixel = |i: usize| {
        let values: Vec<f64> = pictures.iter().map(|p| p[i].iter().sum()).collect();
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let expected: f64 = expected_pixels[i].iter().sum();
        // The relative error of the reference, a fine grid, is assumed to be 1e-3.
        (mean - expected) / ((variance / n).sqrt() + 1e-3 * expected)
    };
    (0..expected_pixels.len()).map(pixel).collect()
}

/// Checks that the mean and mean square of the deviations are within the limits for a standard normal distribution.
fn check_unbiased(deviations: &[f64]) -> Result<(), String> {
    let n = deviations.len() as f64;
    let mean = deviations.iter().sum::<f64>() / n;
    let square = deviations.iter().map(|z| z * z).sum::<f64>() / n;
    if mean.abs() * n.sqrt() < 4.0 && square < 1.3 {
        Ok(())
    } else {
        Err(format!(
            "mean deviation {mean:.3}, mean square {square:.3}, for {n} pixels"
        ))
    }
}

#[test]
fn images_of_random_patterns_have_the_mean_of_grids() {
    let expected_pixels = means(&reference(&noisy(Pattern::Grid, 0, (256, 256))));
    for (name, pattern) in patterns::all().into_iter().filter(|(_, pattern)| !is_fixed(*pattern)) {
        let picture = |seed| means(&reference(&noisy(pattern, seed, (4, 4))));
        let pictures: Vec<_> = (0..48).map(picture).collect();
        let result = check_unbiased(&deviations(&pictures, &expected_pixels));
        assert!(result.is_ok(), "{name}: {}", result.unwrap_err());
        // Negative controls: a reference that is 2% too bright, and a shifted reference.
        let brighter: Vec<[f64; 3]> = expected_pixels.iter().map(|pixel| pixel.map(|v| v * 1.02)).collect();
        assert!(
            check_unbiased(&deviations(&pictures, &brighter)).is_err(),
            "{name}: a bias is not detected"
        );
        let mut shifted = expected_pixels.clone();
        shifted.rotate_right(1);
        assert!(
            check_unbiased(&deviations(&pictures, &shifted)).is_err(),
            "{name}: a shift is not detected"
        );
    }
}
