//! The errors of the functions in `shaders/math.wgsl`, compared with f64, are within the documented bounds on CPU and
//! GPU.

use crate::adapter;
use crate::kernel::functions;
use crate::probes::twin;
use crate::random::Random;
use crate::sources::{parse, shared_source};

struct Bound {
    function: &'static str,
    unit: &'static str,
    /// The bound documented at the WGSL function and in `docs/decisions/exact-arithmetic.md`.
    max_error: f64,
    arguments: fn(&Random) -> Vec<f32>,
    /// Returns the error of a result in `unit`.
    error: fn(&[f32], f64) -> f64,
}

const EPSILON: f64 = f32::EPSILON as f64;
const CALLS: usize = 1 << 20;

/// Returns the error in units in the last place (ulp) of the true value.
fn ulps(result: f64, exact: f64) -> f64 {
    let magnitude = (exact as f32).abs().max(f32::MIN_POSITIVE);
    (result - exact).abs() / f64::from(magnitude.next_up() - magnitude)
}

const BOUNDS: &[Bound] = &[
    Bound {
        function: "log2",
        unit: "units in the last place, for normal x",
        max_error: 4.5,
        arguments: |random| {
            let (any_magnitude, near_one) = (random.magnitude(-37.9, 38.5), random.between(0.9, 1.1));
            vec![random.pick(&[any_magnitude, near_one]) as f32]
        },
        error: |x, result| ulps(result, f64::from(x[0]).log2()),
    },
    Bound {
        function: "exp2",
        unit: "units in the last place, for x from -126 to 127.4",
        max_error: 1.5,
        arguments: |random| vec![random.between(-126.0, 127.4) as f32],
        error: |x, result| ulps(result, f64::from(x[0]).exp2()),
    },
    Bound {
        function: "power",
        unit: "2^-23 (1 + |y log2 x|), relative, for normal powers",
        max_error: 1.7,
        arguments: |random| loop {
            let x = if random.once_in(2) {
                random.unit()
            } else {
                1.0 - random.magnitude(-7.0, 0.0)
            } as f32;
            let y = random.magnitude(-6.0, 6.0) as f32;
            if x > 0.0 && (f64::from(x).log2() * f64::from(y)) > -125.0 {
                return vec![x, y];
            }
        },
        error: |x, result| {
            let (x, y) = (f64::from(x[0]), f64::from(x[1]));
            let exact = x.powf(y);
            (result / exact - 1.0).abs() / (EPSILON * (1.0 + (y * x.log2()).abs()))
        },
    },
    Bound {
        function: "power_whole",
        unit: "2^-24 n, relative, for n below 4096 and normal powers",
        max_error: 1.0,
        arguments: |random| loop {
            let n = random.magnitude(0.0, 3.6) as u32;
            let x = 1.0 - random.magnitude(-6.0, -0.01);
            if x.powi(n as i32) > 1.2e-38 {
                return vec![x as f32, f32::from_bits(n), f32::from_bits(12)];
            }
        },
        error: |x, result| {
            let (x, n) = (f64::from(x[0]), x[1].to_bits());
            (result / x.powi(n as i32) - 1.0).abs() / (EPSILON / 2.0 * f64::from(n))
        },
    },
    Bound {
        function: "atan2",
        unit: "units in the last place of pi",
        max_error: 1.25,
        arguments: |random| {
            let coordinate = || (random.pick(&[1.0, -1.0]) * random.magnitude(-3.0, 3.0)) as f32;
            vec![coordinate(), coordinate()]
        },
        error: |x, result| {
            let exact = f64::from(x[0]).atan2(f64::from(x[1]));
            (result - exact).abs() / (2.0 * EPSILON)
        },
    },
    Bound {
        function: "atan2",
        unit: "units in the last place",
        max_error: 3.5,
        arguments: |random| {
            let coordinate = || (random.pick(&[1.0, -1.0]) * random.magnitude(-3.0, 3.0)) as f32;
            vec![coordinate(), coordinate()]
        },
        error: |x, result| ulps(result, f64::from(x[0]).atan2(f64::from(x[1]))),
    },
    Bound {
        function: "sine",
        unit: "10^-7, for |x| below 1000",
        max_error: 3.0,
        arguments: |random| {
            let size = random.pick(&[0.6, 3.0, 1000.0]);
            vec![random.between(-size, size) as f32]
        },
        error: |x, result| {
            let turn = f64::from(x[0]).rem_euclid(2.0);
            (result - (turn * std::f64::consts::PI).sin()).abs() * 1e7
        },
    },
    Bound {
        function: "normalize",
        unit: "2^-24, for the first component",
        max_error: 3.0,
        arguments: |random| {
            let size = random.magnitude(-9.0, 9.0);
            (0..3).map(|_| (random.between(-1.0, 1.0) * size) as f32).collect()
        },
        error: |v, result| {
            let v = [v[0], v[1], v[2]].map(f64::from);
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            (result - v[0] / length).abs() / (EPSILON / 2.0)
        },
    },
];

/// Returns the maximum error over [`CALLS`] random arguments. Only the first word of each result is compared.
fn largest_error(bound: &Bound, evaluate: &dyn Fn(&[u32]) -> Vec<u32>) -> f64 {
    let random = Random::new(bound.max_error.to_bits());
    let arguments: Vec<Vec<f32>> = (0..CALLS).map(|_| (bound.arguments)(&random)).collect();
    let words: Vec<u32> = arguments.iter().flatten().map(|x| x.to_bits()).collect();
    let results = evaluate(&words);
    let words_per_result = results.len() / CALLS;
    let errors = arguments.iter().zip(results.chunks_exact(words_per_result));
    // A NaN error must propagate, but `f64::max` would drop it.
    errors
        .map(|(x, r)| (bound.error)(x, f64::from(f32::from_bits(r[0]))))
        .fold(0.0, |a, b| if b <= a { a } else { b })
}

#[test]
fn function_errors_are_within_the_documented_bounds() {
    let source = shared_source();
    let module = parse(&source);
    let functions = functions(&module, &source);
    let mut problems = Vec::new();
    for bound in BOUNDS {
        let (_, function) = functions
            .iter()
            .find(|(_, f)| f.name() == bound.function)
            .expect("the function");
        let words_out = function.words_out().len();
        let mut errors = vec![(
            "CPU",
            largest_error(bound, &|words| twin(bound.function).results(words, words_out)),
        )];
        if let Some(device) = adapter::device() {
            errors.push(("GPU", largest_error(bound, &|words| function.run(device, words))));
        }
        for (processor, error) in errors {
            let line = format!(
                "{processor} {}: {error:.3} {}; documented bound {}",
                bound.function, bound.unit, bound.max_error
            );
            println!("{line}");
            if !(error <= bound.max_error) {
                problems.push(line);
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn functions_are_exact_at_special_values() {
    let source = shared_source();
    let module = parse(&source);
    let functions = functions(&module, &source);
    let infinity = f32::INFINITY;
    let cases: &[(&str, &[f32], f32)] = &[
        ("log2", &[1.0], 0.0),
        ("log2", &[8.0], 3.0),
        ("log2", &[f32::MIN_POSITIVE], -126.0),
        ("exp2", &[0.0], 1.0),
        ("exp2", &[-126.0], f32::MIN_POSITIVE),
        ("exp2", &[-126.5], 0.0),
        ("exp2", &[-126.6], 0.0),
        ("exp2", &[f32::NEG_INFINITY], 0.0),
        ("exp2", &[127.0], 1.701_411_8e38),
        ("exp2", &[128.0], infinity),
        ("exp2", &[infinity], infinity),
        ("power", &[1.0, 1e6], 1.0),
        ("power", &[0.0, 0.5], 0.0),
        ("power", &[1e-40, 0.5], 0.0), // denormal numbers count as 0
        ("power", &[0.25, 0.5], 0.5),
        ("power", &[f32::NAN, 2.0], 0.0),
        ("atan2", &[0.0, 1.0], 0.0),
        ("atan2", &[0.0, 0.0], 0.0),
        ("atan2", &[0.0, -1.0], std::f32::consts::PI),
        ("sine", &[0.0], 0.0),
        ("sine", &[-7.0], -0.0),
        ("sine", &[1e30], 0.0),
        ("atan2", &[1.0, 0.0], std::f32::consts::FRAC_PI_2),
        ("atan2", &[-1.0, 0.0], -std::f32::consts::FRAC_PI_2),
        ("atan2", &[2.0, 2.0], std::f32::consts::FRAC_PI_4),
        ("atan2", &[-2.0, -2.0], -3.0 * std::f32::consts::FRAC_PI_4),
        ("min", &[1.0, 2.0], 1.0),
        ("max", &[1.0, 2.0], 2.0),
        ("min", &[0.0, -0.0], -0.0), // the second of two equal arguments
        ("max", &[f32::NAN, 0.0], 0.0),
        ("positive_zero", &[-0.0], 0.0),
        ("positive_zero", &[-1.5], -1.5),
        ("floor", &[-1.5], -2.0),
        ("floor", &[1.5], 1.0),
        ("floor", &[-3.0], -3.0),
        ("floor", &[1e30], 1e30),
        ("unit_float", &[f32::from_bits(u32::MAX)], 1.0 - f32::EPSILON / 2.0),
        ("dot", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 32.0),
        ("cross", &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0], -2.0),
    ];
    for (name, arguments, expected) in cases {
        let (_, function) = functions.iter().find(|(_, f)| f.name() == *name).expect("the function");
        let words: Vec<u32> = arguments.iter().map(|x| x.to_bits()).collect();
        let mut results = vec![twin(name).results(&words, function.words_out().len())];
        results.extend(adapter::device().map(|device| function.run(device, &words)));
        for result in results {
            assert_eq!(
                f32::from_bits(result[0]).to_bits(),
                expected.to_bits(),
                "{name}{arguments:?}"
            );
        }
    }
}

/// Values of pcg4d, computed in Python from the listing in Jarzynski and Olano, "Hash Functions for GPU Rendering",
/// JCGT 9(3), 2020.
#[test]
fn the_hash_is_pcg4d() {
    for (key, expected) in [
        ([0, 0, 0, 0], [251_852_841, 760_645_481, 850_445_371, 3_542_436_074]),
        ([1, 2, 3, 4], [908_250_390, 4_044_648_920, 3_775_961_919, 45_698_095]),
    ] {
        assert_eq!(twin("hash4").results(&key, 4), expected);
    }
}

#[test]
fn a_function_that_exceeds_its_error_bound_is_detected() {
    let Some(device) = adapter::device() else { return };
    for (index, from, to) in [
        (0, "s2 * (0.2 +", "s2 * (0.201 +"),
        (1, "f * 0.0001984127", "f * 0.00001984127"),
        (2, "2.8853900817779268", "2.8854"),
        (4, "0.05882353", "0.5882353"),
        (6, "0.007370431", "0.07370431"),
    ] {
        let bound = &BOUNDS[index];
        let text = shared_source().text;
        assert!(text.contains(from), "the source does not contain '{from}'");
        let mut source = wgray_render::gpu::compose::Source::default();
        source.append("changed", &text.replacen(from, to, 1));
        let module = parse(&source);
        let functions = functions(&module, &source);
        let (_, function) = functions
            .iter()
            .find(|(_, f)| f.name() == bound.function)
            .expect("the function");
        let error = largest_error(bound, &|words| function.run_in(device, &source, words));
        assert!(!(error <= bound.max_error), "{}: {error} with '{to}'", bound.function);
    }
}
