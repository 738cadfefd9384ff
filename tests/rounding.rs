//! Software quotients and square roots are correctly rounded on any device. With imprecise operations, images stay
//! within the tolerances.

use std::sync::OnceLock;

use wgray_image::Region;
use wgray_render::gpu::compose::{ROUNDING, Shaders, Source};
use wgray_render::job::WorkSplit;

use crate::adapter::{self, bit_exact};
use crate::kernel::functions;
use crate::nearly::FilmDifference;
use crate::pictures::{RenderMode, backend_with, differing, film, reference, render_with};
use crate::random::Random;
use crate::render::small_scenes;
use crate::sources::{self, edited, parse, shaders, shaders_with};

/// Adds -3 to 3 ulp, depending on the bits: more than the error that WGSL allows for a quotient.
const NUDGED: &str = "
fn nudged(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    let e = (bits >> 23u) & 255u;
    let step = i32(((bits * 0x9e3779b9u) >> 16u) % 7u) - 3;
    return select(x, bitcast<f32>(bitcast<i32>(bits) + step), (e > 1u) & (e < 254u));
}
";

/// Returns the software-rounding functions, based on imprecise device operations.
fn software_rounding_of_imprecise_operations() -> String {
    let mut text = shaders().text(ROUNDING).to_string();
    for (from, to) in [
        (
            "f32(numerator) / f32(under.mantissa)",
            "nudged(f32(numerator) / f32(under.mantissa))",
        ),
        ("f32(rest) / f32(denominator)", "nudged(f32(rest) / f32(denominator))"),
        (
            "sqrt(f32(mantissa) * 33554432.0)",
            "nudged(sqrt(f32(mantissa) * 33554432.0))",
        ),
        ("f32(rest) / f32(2 * digits)", "nudged(f32(rest) / f32(2 * digits))"),
    ] {
        text = edited(&text, from, to);
    }
    text + NUDGED
}

/// Returns replacements of the functions with software rounding, with equal names, which use only imprecise device
/// operations.
fn imprecise_operations() -> String {
    "fn quotient(a: f32, b: f32) -> f32 { return nudged(a / b); }
    fn quotient2(a: vec2f, b: vec2f) -> vec2f { return vec2f(quotient(a.x, b.x), quotient(a.y, b.y)); }
    fn quotient3(a: vec3f, b: vec3f) -> vec3f { return vec3f(quotient2(a.xy, b.xy), quotient(a.z, b.z)); }
    fn quotient4(a: vec4f, b: vec4f) -> vec4f { return vec4f(quotient2(a.xy, b.xy), quotient2(a.zw, b.zw)); }
    fn square_root(x: f32) -> f32 { return nudged(sqrt(x)); }
    fn square_root4(x: vec4f) -> vec4f {
        return vec4f(square_root(x.x), square_root(x.y), square_root(x.z), square_root(x.w));
    }
    "
    .to_string()
        + NUDGED
}

/// Returns a number of any magnitude, or a number at the end of a range.
fn random_number(random: &Random) -> f32 {
    const EDGES: [u32; 12] = [
        0,
        1,
        2,
        0x7f_ffff,
        0x80_0000,
        0x80_0001,
        0x3f7f_ffff,
        0x3f80_0000,
        0x3f80_0001,
        0x7f7f_ffff,
        0x7f80_0000,
        0x7fc0_0000,
    ];
    let sign = random.pick(&[0, 0x8000_0000]);
    let few_digits = || (random.below(64) << random.below(25)) | 1 << random.below(31);
    let bits = match random.below(5) {
        0 => random.bits() as u32,
        1 => random.pick(&EDGES),
        2 => few_digits(),
        3 => 0x3f80_0000 | (random.bits() as u32 & 0x7f_ffff), // from 1 to 2
        _ => random.bits() as u32 & 0xff_ffff,                 // denormal and slightly above
    };
    f32::from_bits(bits ^ sign)
}

struct Case {
    name: &'static str,
    arguments: usize,
    exact: fn(&[f32]) -> f32,
    /// Replacements in the source text that introduce an error, which the test must detect.
    mistakes: [(&'static str, &'static str); 2],
}

const CASES: [Case; 2] = [
    Case {
        name: "quotient",
        arguments: 2,
        exact: |x| x[0] / x[1],
        mistakes: [
            ("rest > half", "rest >= half"),
            ("rest >= denominator", "rest > denominator"),
        ], // the first replacement changes the rounding of ties
    },
    Case {
        name: "square_root",
        arguments: 1,
        exact: |x| x[0].sqrt(),
        mistakes: [
            ("    rest = i32(mantissa", "    rest = 33554432 + i32(mantissa"),
            ("(more | (", "(!more | ("),
        ],
    },
];

/// Returns how many of a million results differ from IEEE 754, and the first of them.
fn count_wrong(case: &Case, text: &str) -> (usize, Option<String>) {
    let mut source = Source::default();
    source.append("rounding", text);
    let module = parse(&source);
    let functions = functions(&module, &source);
    let (_, function) = functions
        .iter()
        .find(|(_, f)| f.name() == case.name)
        .expect("the function");
    let random = Random::new(5);
    let arguments: Vec<f32> = (0..case.arguments << 20).map(|_| random_number(&random)).collect();
    let device = adapter::device().expect("a device");
    let results = function.run_in(device, &source, bytemuck::cast_slice(&arguments));
    let calls = arguments
        .chunks_exact(case.arguments)
        .zip(results.into_iter().map(f32::from_bits));
    let wrong = calls.filter(|(x, result)| {
        let exact = (case.exact)(x);
        exact.to_bits() != result.to_bits() && !(exact.is_nan() && result.is_nan())
    });
    let mut wrong = wrong.map(|(x, result)| format!("{}{x:?} is {result:?}, not {:?}", case.name, (case.exact)(x)));
    let first_wrong = wrong.next();
    (wrong.count() + usize::from(first_wrong.is_some()), first_wrong)
}

#[test]
fn quotients_and_square_roots_are_rounded_correctly_on_any_device() {
    if adapter::device().is_none() {
        return;
    }
    for case in &CASES {
        for (device, text) in [
            ("this device", shaders().text(ROUNDING)),
            ("an imprecise device", &software_rounding_of_imprecise_operations()),
        ] {
            let (count, first) = count_wrong(case, text);
            println!(
                "{} on {device}: {count} of {} are not rounded correctly",
                case.name,
                1 << 20
            );
            assert_eq!(count, 0, "on {device}: {first:?}");
        }
        // Negative controls.
        assert!(
            count_wrong(case, &imprecise_operations()).0 > 100_000,
            "{}: imprecise operations are not detected",
            case.name
        );
        for (from, to) in case.mistakes {
            let (count, _) = count_wrong(case, &edited(&software_rounding_of_imprecise_operations(), from, to));
            assert!(count > 0, "{}: '{to}'", case.name);
        }
    }
}

/// Returns shaders in which imprecise device operations replace the functions that round in software.
pub fn imprecise_shaders() -> &'static Shaders {
    static SHADERS: OnceLock<Shaders> = OnceLock::new();
    SHADERS.get_or_init(|| shaders_with(ROUNDING, &imprecise_operations()))
}

/// Seeds of the camera for [`selectable_shaders`].
const DEVICE: u32 = 0;
const CORRECTED: u32 = 1;
const IMPRECISE: u32 = 2;

/// Returns shaders in which the camera seed selects how quotients and roots are computed. `DEVICE`: software rounding
/// over the device's operations; `CORRECTED`: software rounding over deliberately imprecise operations; `IMPRECISE`:
/// only the imprecise operations. One kernel per scene covers all three.
fn selectable_shaders() -> Shaders {
    let mut text = software_rounding_of_imprecise_operations();
    for (from, to) in [
        (
            "i32(((bits * 0x9e3779b9u) >> 16u) % 7u) - 3;".to_owned(),
            format!("select(i32(((bits * 0x9e3779b9u) >> 16u) % 7u) - 3, 0, camera.seed == {DEVICE}u);"),
        ),
        (
            "return bitcast<f32>(sign | select(bits, 0x7fc00000u, is_nan));".to_owned(),
            format!(
                "return select(bitcast<f32>(sign | select(bits, 0x7fc00000u, is_nan)), nudged(a / b), camera.seed == {IMPRECISE}u);"
            ),
        ),
        (
            "let root = select(finite, bits, is_itself);".to_owned(),
            format!(
                "let root = select(select(finite, bits, is_itself), bitcast<u32>(nudged(sqrt(x))), camera.seed == {IMPRECISE}u);"
            ),
        ),
    ] {
        text = edited(&text, &from, &to);
    }
    shaders_with(ROUNDING, &text)
}

/// With imprecise operations, images are within the tolerances; with software rounding, they are bit-identical.
#[test]
fn images_keep_their_guarantees_on_an_imprecise_device() {
    if !adapter::device().is_some_and(bit_exact) {
        // The imprecise device is simulated on a bit-exact one. `tests/render.rs` also covers real devices that need
        // not match the CPU bit for bit.
        return;
    }
    let shaders = selectable_shaders();
    for (name, mut packed) in small_scenes() {
        // The center only, because software rounding takes long.
        let (width, height) = (packed.camera.width, packed.camera.height);
        let center = Region {
            x0: width / 4,
            y0: height / 4,
            x1: width - width / 4,
            y1: height - height / 4,
        };
        let mut rendered = |seed: u32| {
            packed.camera.seed = seed;
            let [cpu, found] = [RenderMode::Cpu, RenderMode::Rounded].map(|mode| {
                let mut backend = backend_with(&packed, mode, &shaders);
                film(&mut *backend, &packed, center, &WorkSplit::default())
            });
            (
                differing(&found, &cpu),
                FilmDifference::loose(&packed, &found, &cpu),
                cpu.sums.len(),
            )
        };
        let (differ, difference, pixels) = rendered(IMPRECISE);
        println!("{name} on an imprecise device: {differ} of {pixels} pixels are not bit-identical; {difference}");
        assert!(differ * 4 > pixels, "{name}: only {differ} pixels differ");
        let verdict = difference.judge();
        assert!(verdict.is_ok(), "{name}, imprecise device: {}", verdict.unwrap_err());
        for (device, seed) in [("a corrected imprecise device", CORRECTED), ("this device", DEVICE)] {
            assert_eq!(rendered(seed).0, 0, "{name} on {device}");
        }
    }
    // Images of the unmodified shaders are also bit-identical.
    let (name, packed) = small_scenes().swap_remove(0);
    let found = render_with(&packed, RenderMode::Rounded, sources::shaders());
    assert_eq!(differing(&found, &reference(&packed)), 0, "{name}");
}
