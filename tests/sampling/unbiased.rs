//! Adaptive sampling against converged images and uniform sampling: thin objects keep their brightness, and
//! errors do not exceed the errors of uniform sampling.

use std::fmt::Write;

use wgray_trace::film::{Film, mean};
use wgray_trace::records::Packed;

use crate::pictures::reference;
use crate::scenes;

/// Number of Sobol' samples per round, and the target error of adaptive sampling.
#[derive(Clone, Copy, Debug)]
struct Sampling {
    samples_per_round: u32,
    error: Option<f64>,
}

fn scene(size: u32, height: f64, sampling: Sampling, content: &str) -> Packed {
    let Sampling {
        samples_per_round,
        error,
    } = sampling;
    let adaptive = error.map_or(String::new(), |error| {
        format!(", adaptive = {{ error = {error}, max_samples = 256 }}")
    });
    scenes::parse(&format!(
        "image = {{ width = {size}, height = {size} }}\n\
         camera = {{ type = 'orthographic', position = [0, 0, 5], look_at = [0, 0, 0], up = [0, 1, 0], height = {height} }}\n\
         render = {{ ambient = [1, 1, 1], pixel_samples = {{ pattern = 'sobol', count = {samples_per_round} }}{adaptive} }}\n\
         materials.white = {{ type = 'phong', color = [1, 1, 1], specular = [0, 0, 0] }}\n{content}"
    ))
}

/// Returns a scene of white dots 0.2 pixels wide, one in each square of `spacing` x `spacing` pixels.
fn dots(spacing: u32, sampling: Sampling) -> Packed {
    let size = 20;
    let mut content = String::new();
    for i in 0..size / spacing {
        for j in 0..size / spacing {
            // The positions are unrelated to the pixel grid.
            let [x, y] = [0.754877666, 0.569840291].map(|a: f64| (0.5 + a * f64::from(i * 31 + j * 17)).fract());
            let coordinate =
                |cell: u32, x: f64| f64::from(spacing) * f64::from(cell) + 0.1 + x * (f64::from(spacing) - 0.2);
            let [x, y] = [coordinate(i, x), coordinate(j, y)].map(|x| x - f64::from(size) / 2.0);
            let (material, sizes) = (
                "material = 'white'",
                "a = [0.1, 0, 0], b = [0, 0.1, 0], c = [0, 0, 0.1]",
            );
            writeln!(
                content,
                "[[shapes]]\ntype = 'ellipsoid'\n{material}\ncenter = [{x}, {y}, 0]"
            )
            .expect("text");
            writeln!(content, "{}", sizes.replace(", b", "\nb").replace(", c", "\nc")).expect("text");
        }
    }
    scene(size, f64::from(size), sampling, &content)
}

fn lines(sampling: Sampling) -> Packed {
    let mut content = String::new();
    let mut y = -11.0;
    for i in 0..14 {
        let (a, tilt) = (y, y + 1.7);
        let width = 0.16;
        for [p, q, r] in [
            [(-14.0, a), (14.0, tilt), (14.0, tilt + width)],
            [(-14.0, a), (14.0, tilt + width), (-14.0, a + width)],
        ] {
            let vertices = [p, q, r].map(|(x, y)| format!("[{x}, {y}, 0]")).join(", ");
            writeln!(
                content,
                "[[shapes]]\ntype = 'triangle'\nmaterial = 'white'\nvertices = [{vertices}]"
            )
            .expect("text");
        }
        y += 3.2 - 0.2 * f64::from(i);
    }
    scene(24, 24.0, sampling, &content)
}

fn star(sampling: Sampling) -> Packed {
    let mut content = String::new();
    for i in 0..10 {
        let corner = |x: f64| {
            let (sin, cos) = (std::f64::consts::TAU * (f64::from(i) + x) / 10.0 + 0.05).sin_cos();
            format!("[{}, {}, 0]", 30.0 * cos, 30.0 * sin)
        };
        let vertices = format!("[0.13, 0.07, 0], {}, {}", corner(0.0), corner(0.5));
        writeln!(
            content,
            "[[shapes]]\ntype = 'triangle'\nmaterial = 'white'\nvertices = [{vertices}]"
        )
        .expect("text");
    }
    scene(32, 32.0, sampling, &content)
}

/// Returns a soft shadow with one light sample per pixel sample.
fn shadow(sampling: Sampling) -> Packed {
    let content = "\
shapes = [
  { type = 'rectangle', material = 'white', center = [0, 0, -2], size = [40, 40], normal = [0, 0, 1], tangent = [1, 0, 0] },
  { type = 'sphere', material = 'white', center = [1, 1, 0], radius = 2 },
]
[[lights]]
type = 'rectangle'
center = [-4, 3, 9]
size = [3, 3]
normal = [0.3, -0.2, -1]
tangent = [1, 0, 0]
color = [0.9, 0.9, 0.9]
";
    let mut packed = scene(24, 16.0, sampling, content);
    packed.specialization.light_pattern = wgray_trace::records::SOBOL;
    (packed.specialization.light_side, packed.specialization.light_samples) = (1, 1);
    packed.environment.light_weight = 1.0;
    packed.environment.ambient = glam::Vec3::splat(0.1);
    packed
}

fn seeded(mut packed: Packed, seed: u32) -> Film {
    packed.camera.seed = seed;
    reference(&packed)
}

fn displayed(film: &Film) -> Vec<f64> {
    let channels = film.means().flatten();
    channels.map(|v| f64::from(v.clamp(0.0, 1.0)).powf(1.0 / 2.2)).collect()
}

fn mean_square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64
}

fn brightness(film: &Film) -> f64 {
    let values: Vec<f64> = film.means().flatten().map(f64::from).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn estimate(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Pairs of samples per round and target error. With the same target error, rounds of 4 and of 16 samples give the same
/// image, as the next test shows, so each error is tested with one of them.
const SETTINGS: [(u32, f64); 2] = [(16, 0.02), (4, 0.01)];

#[test]
fn small_rounds_have_the_same_pilot_pass() {
    for error in [0.02, 0.01] {
        let [a, b] = [4, 16].map(|samples_per_round| {
            let error = Some(error);
            seeded(
                lines(Sampling {
                    samples_per_round,
                    error,
                }),
                1,
            )
        });
        assert_eq!((a.sums, a.moments), (b.sums, b.moments));
    }
}

/// The tolerance includes three standard errors, which contain 99.7 % of means.
#[test]
fn dots_and_lines_keep_their_brightness() {
    // Disks of radius 0.1 inside the image.
    let brightness_of_dots = |spacing: u32| std::f64::consts::PI * 0.01 / f64::from(spacing * spacing);
    let brightness_of_lines = brightness(&seeded(lines(uniform(4096)), 99));
    type MakeScene = Box<dyn Fn(Sampling) -> Packed>;
    let cases: [(&str, f64, MakeScene); 3] = [
        ("dots", brightness_of_dots(4), Box::new(|sampling| dots(4, sampling))),
        (
            "dense dots",
            brightness_of_dots(2),
            Box::new(|sampling| dots(2, sampling)),
        ),
        ("lines", brightness_of_lines, Box::new(lines)),
    ];
    for (name, expected, make) in &cases {
        for (samples_per_round, error) in SETTINGS {
            let sampling = Sampling {
                samples_per_round,
                error: Some(error),
            };
            let films: Vec<Film> = (0..24).map(|seed| seeded(make(sampling), seed)).collect();
            let (found, standard_error) = estimate(&films.iter().map(brightness).collect::<Vec<_>>());
            assert!(
                (found - expected).abs() < 0.003 * expected + 3.0 * standard_error,
                "{name}, {sampling:?}: {found} +- {standard_error}, expected {expected}"
            );
        }
    }
    // Negative control: stopping at pixels whose first 16 samples are black darkens the image.
    let (few, many) = (dots(2, uniform(16)), dots(2, uniform(256)));
    let estimates = (0..24).map(|seed| {
        let (few, many) = (seeded(few.clone(), seed), seeded(many.clone(), seed));
        let kept_sums = few
            .sums
            .iter()
            .zip(&many.sums)
            .map(|(few, many)| if few.x == 0.0 { few } else { many });
        kept_sums.map(|sum| f64::from(mean(*sum)[0])).sum::<f64>() / few.sums.len() as f64
    });
    let (found, standard_error) = estimate(&estimates.collect::<Vec<_>>());
    let expected = brightness_of_dots(2);
    assert!(
        found + 3.0 * standard_error < 0.8 * expected,
        "{found} +- {standard_error}"
    );
}

fn uniform(samples_per_round: u32) -> Sampling {
    Sampling {
        samples_per_round,
        error: None,
    }
}

/// Returns the RMS error of uniform sampling with `samples` samples, interpolated between powers of two by a power law.
fn error_of_uniform(make: &dyn Fn(Sampling) -> Packed, converged: &[f64], seeds: u32, samples: f64) -> f64 {
    let lower = samples.log2().floor().min(8.0);
    let mean_square_error = |count: f64| {
        let packed = make(uniform(count.exp2() as u32));
        let error_of_seed = |seed| mean_square(&displayed(&seeded(packed.clone(), seed)), converged);
        (0..seeds).map(error_of_seed).sum::<f64>() / f64::from(seeds)
    };
    let (a, b) = (mean_square_error(lower), mean_square_error(lower + 1.0));
    (a.ln() + (b / a).ln() * (samples.log2() - lower)).exp().sqrt()
}

#[test]
fn adaptive_errors_do_not_exceed_errors_of_uniform_sampling() {
    let seeds = 4;
    type MakeScene = Box<dyn Fn(Sampling) -> Packed>;
    let cases: [(&str, MakeScene); 5] = [
        ("dots", Box::new(|sampling| dots(4, sampling))),
        ("dense dots", Box::new(|sampling| dots(2, sampling))),
        ("lines", Box::new(lines)),
        ("star", Box::new(star)),
        ("shadow", Box::new(shadow)),
    ];
    for (name, make) in &cases {
        let converged = displayed(&seeded(make(uniform(4096)), 99));
        for (samples_per_round, error) in SETTINGS {
            let sampling = Sampling {
                samples_per_round,
                error: Some(error),
            };
            let films: Vec<Film> = (0..seeds).map(|seed| seeded(make(sampling), seed)).collect();
            let square: f64 = films.iter().map(|film| mean_square(&displayed(film), &converged)).sum();
            let found = (square / f64::from(seeds)).sqrt();
            let counts: Vec<u32> = films.iter().flat_map(Film::sample_counts).collect();
            let samples = counts.iter().map(|n| f64::from(*n)).sum::<f64>() / counts.len() as f64;
            let expected = error_of_uniform(make, &converged, seeds, samples);
            println!(
                "{name}, {sampling:?}: {samples:.1} samples, RMS error {found:.4}, uniform sampling {expected:.4}, ratio {:.2}",
                found / expected
            );
            assert!(
                found < 1.1 * expected,
                "{name}, {sampling:?}: RMS error {found}, uniform sampling {expected}"
            );
        }
    }
}
