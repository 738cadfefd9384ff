//! WGSL and Rust have the same shared functions, and the SPIR-V kernels contain no floating-point operation whose
//! result depends on the driver.

use std::collections::BTreeSet;

use wgray::scene::Integrator;
use wgray_render::gpu::compose::{KERNELS, Kernel, RENDER, SHARED, Source, built_in};
use wgray_render::gpu::spirv::instructions;
use wgray_render::gpu::{FloatControls, Rounding, bake, check};
use wgray_trace::records::Packed;

use crate::scenes;
use crate::sources::{self, Signature, differences, parse, rust_functions, rust_records, shared_source};

/// Shaders without a twin, with reasons.
const SHADERS_WITHOUT_TWIN: &[(&str, &str)] = &[
    ("bindings.wgsl", "only declares buffers"),
    ("completion.wgsl", "no loop is truncated on the CPU"),
    (
        "rounding.wgsl",
        "quotients and square roots are correctly rounded in Rust",
    ),
    ("texels.wgsl", "the CPU backend has all texels in one list"),
    ("film.wgsl", "the film of the CPU backend has a list for each layer"),
    (
        "integrators/whole.wgsl",
        "the CPU backend renders complete samples in pixel.rs, without lockstep",
    ),
    (
        "bvh.wgsl",
        "the CPU backend has a different traversal (bvh.rs, traversal) with the same hits, see tests/meshes",
    ),
    (
        "buffers.wgsl",
        "scene access of kernels; baked kernels have generated functions with the scene as constants instead",
    ),
    (
        "meshes.wgsl",
        "mesh access of kernels; in Rust, mesh access is in geometry.rs",
    ),
];

/// Files in crates/trace/src/cpu that are not twins of a shader.
const RUST_FILES_WITHOUT_SHADER: &[&str] = &[
    "accumulate.rs",
    "bits.rs",
    "decoded_bvhs.rs",
    "ewa.rs",
    "mod.rs",
    "prefetch.rs",
    "integrators",
    "lanes",
    "lanes.rs",
    "lobes.rs",
    "samples.rs",
    "shadow_ray.rs",
    "traversal",
    "wavefront",
];

/// Functions and records that exist in only one language, or differ between the languages: file, name, reason.
const ONE_SIDED: &[(&str, &str, &str)] = &[
    (
        "linear_primitives.wgsl",
        "closest_primitive",
        "reads the scene: in WGSL, it is in buffers.wgsl",
    ),
    (
        "linear_primitives.wgsl",
        "occluded_by_primitives",
        "reads the scene: in WGSL, it is in buffers.wgsl",
    ),
    (
        "linear_primitives.wgsl",
        "is_occluded_by_primitives",
        "reads the scene: in WGSL, it is in buffers.wgsl",
    ),
    (
        "integrators/path.wgsl",
        "shade",
        "only in Rust: the part of `advance` after the closest hit",
    ),
    (
        "integrators/path.wgsl",
        "is_shadow_ray_occluded",
        "only in Rust: traces the shadow ray of `shade`",
    ),
    (
        "integrators/path.wgsl",
        "leave_scene",
        "only in Rust: the part of `shade` for a ray that hits nothing, also called by the wavefront",
    ),
    (
        "integrators/path.wgsl",
        "add_direct_light",
        "in Rust, `sample_direct_light` returns the shadow ray, which is traced after `shade`",
    ),
    (
        "integrators/path.wgsl",
        "sample_direct_light",
        "in WGSL, `add_direct_light` also traces the shadow ray",
    ),
    (
        "integrators/phong.wgsl",
        "radiance_after",
        "only in Rust: the part of `radiance` after the closest hit of the camera ray",
    ),
    (
        "phong.wgsl",
        "add_visible",
        "only in Rust: `phong_block` for directions that are computed once for several functions",
    ),
    (
        "pixel.wgsl",
        "pixel_radiance",
        "only in Rust: WGSL kernels loop over the samples",
    ),
    (
        "linear_primitives.wgsl",
        "occluded_by",
        "in Rust, a range of indices replaces two arguments",
    ),
    (
        "geometry.wgsl",
        "instance_of",
        "only in Rust, where instances are records in a list",
    ),
    (
        "geometry.wgsl",
        "group_word",
        "reads buffers: in WGSL, it is in meshes.wgsl",
    ),
    (
        "geometry.wgsl",
        "triangle_casts",
        "reads buffers: in WGSL, it is in meshes.wgsl",
    ),
    (
        "geometry.wgsl",
        "face_of",
        "reads buffers: in WGSL, it is in meshes.wgsl",
    ),
];

fn twin_differences(source: &Source, file: &str, twin: &syn::File) -> Vec<String> {
    let module = parse(source);
    let has_twin = |s: &Signature| !ONE_SIDED.iter().any(|(f, name, _)| *f == file && *name == s.name);
    let functions: Vec<_> = sources::wgsl_functions(&module, source, file)
        .into_iter()
        .filter(has_twin)
        .collect();
    let mut twins: Vec<_> = rust_functions(twin).into_iter().filter(has_twin).collect();
    // If a WGSL function takes `before` and returns the new value, its Rust twin may take `state: &mut T` instead. The
    // argument is renamed for the comparison.
    let in_place = |wgsl: &Signature, twin: &Signature| {
        let has_result_type = |s: &Signature, name: &str| {
            s.members
                .iter()
                .any(|(n, ty)| n == name && Some(ty) == s.result.as_ref())
        };
        has_result_type(wgsl, "before") && has_result_type(twin, "state")
    };
    for twin in &mut twins {
        if functions.iter().any(|f| f.name == twin.name && in_place(f, twin)) {
            let state = twin.members.iter_mut().find(|(name, _)| name == "state");
            state.expect("the argument just found").0 = "before".to_string();
        }
    }
    if !is_shared(file) {
        for twin in &mut twins {
            if twin.members.first().is_some_and(|(_, ty)| ty == "Packed") {
                twin.members.remove(0);
            }
        }
    }
    let mut records = sources::wgsl_records(&module, source, file);
    records.retain(has_twin);
    let twin_records: Vec<_> = rust_records(twin).into_iter().filter(has_twin).collect();
    let mut problems = differences(file, &functions, &twins);
    problems.extend(differences(file, &records, &twin_records));
    problems
}

fn is_shared(file: &str) -> bool {
    SHARED.iter().any(|(name, _)| *name == file)
}

fn twin_of(file: &str) -> syn::File {
    sources::rust(&format!("crates/trace/src/cpu/{}", file.replace(".wgsl", ".rs")))
}

#[test]
fn functions_and_records_match() {
    let shared = shared_source();
    let kernels = Integrator::ALL.map(|integrator| sources::shaders().compose(&RENDER, integrator, None));
    let mut problems = Vec::new();
    for (file, _) in built_in() {
        if file.starts_with("kernels/") || SHADERS_WITHOUT_TWIN.iter().any(|(f, _)| *f == file) {
            continue;
        }
        // Files with overrides or bindings are parsed as parts of a kernel. The twins of these files take the scene as
        // the first argument.
        let kernel = kernels.iter().find(|kernel| kernel.start_of(file).is_some());
        let source = if is_shared(file) {
            &shared
        } else {
            kernel.expect("a kernel with the file")
        };
        let count = sources::wgsl_functions(&parse(source), source, file).len();
        assert!(count > 0, "{file}: no function was found");
        problems.extend(twin_differences(source, file, &twin_of(file)));
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn a_changed_twin_is_detected() {
    let shared = shared_source();
    let edited_twin = |file: &str, from: &str, to: &str| {
        let text = std::fs::read_to_string(sources::path(&format!("crates/trace/src/cpu/{file}"))).expect("a twin");
        assert!(text.contains(from), "{file}: '{from}' not found");
        syn::parse_file(&text.replacen(from, to, 1)).expect("still Rust")
    };
    for (change, file, from, to) in [
        (
            "swapped arguments",
            "math.rs",
            "cross<V: Vector3>(a: V, b: V)",
            "cross<V: Vector3>(b: V, a: V)",
        ),
        ("another type", "ray.rs", "t: f32, i: u32", "t: f32, i: i32"),
        (
            "another result",
            "math.rs",
            "log2(x: f32) -> f32",
            "log2(x: f32) -> f64",
        ),
        ("another generic result", "rng.rs", "-> W::Real", "-> W"),
        ("another bound", "math.rs", "max<F: Real>", "max<F: Word>"),
        ("a function that is not generic", "math.rs", "min<F: Real>", "min"),
        ("a renamed function", "plane.rs", "fn plane_occludes", "fn plane_block"),
        (
            "one more function",
            "plane.rs",
            "pub fn plane_occludes",
            "fn more() {}\npub fn plane_occludes",
        ),
        ("a renamed field", "light.rs", "pub towards: Vec3", "pub toward: Vec3"),
        (
            "moved fields",
            "phong.rs",
            "pub diffuse: F,\n    pub specular: F",
            "pub specular: F,\n    pub diffuse: F",
        ),
    ] {
        let twin = edited_twin(file, from, to);
        assert!(
            !twin_differences(&shared, &file.replace(".rs", ".wgsl"), &twin).is_empty(),
            "{change}"
        );
    }
}

#[test]
fn an_argument_updated_in_place_is_a_result() {
    let functions = |text: &str| rust_functions(&syn::parse_file(text).expect("Rust"));
    let by_value = functions("fn advance(state: PathState, pixel: UVec2) -> PathState { state }");
    assert_eq!(
        functions("fn advance(state: &mut PathState, pixel: UVec2) {}"),
        by_value
    );
    assert_ne!(functions("fn advance(state: &PathState, pixel: UVec2) {}"), by_value);
    assert_ne!(functions("fn advance(state: &mut Path, pixel: UVec2) {}"), by_value);
}

#[test]
fn generic_signatures_have_wgsl_types() {
    let functions = |text: &str| rust_functions(&syn::parse_file(text).expect("Rust"));
    let records = |text: &str| rust_records(&syn::parse_file(text).expect("Rust"));
    let scalar = functions("fn f(x: f32, i: u32, u: Vec2, n: Vec3, key: UVec2, words: UVec4) -> Vec3 { n }");
    for generic in [
        "fn f<F: Real>(x: F, i: F::Word, u: F::Vec2, n: F::Vec3, key: UVec2, words: UVec4) -> F::Vec3 { n }",
        "fn f<V: Vector3>(x: V::Real, i: u32, u: <V::Real as Real>::Vec2, n: V, key: UVec2, words: UVec4) -> V { n }",
        "fn f<W: Word, K: WordVector4>(x: W::Real, i: W, u: Vec2, n: Vec3, key: W::UVec2, words: K) -> Vec3 { n }",
        "fn f<U: Vector2, K: WordVector2>(x: U::Real, i: u32, u: U, n: Vec3, key: K, words: UVec4) -> Vec3 { n }",
    ] {
        assert_eq!(functions(generic), scalar, "{generic}");
    }
    let masks = functions("fn f<V: Vector2>(x: V::Real) -> <V::Real as Real>::Mask {}");
    assert_eq!(masks, functions("fn f(x: f32) -> bool {}"));
    // A type parameter hides the type of the same name, and a bound other than numbers matches no WGSL type.
    assert_ne!(functions("fn f<Vec3: Real>(n: Vec3) {}"), functions("fn f(n: Vec3) {}"));
    assert_ne!(functions("fn f<F: Copy>(x: F) {}"), functions("fn f(x: f32) {}"));
    assert_eq!(records("struct R<V = Vec3> { u: V }"), records("struct R { u: Vec3 }"));
    assert_ne!(records("struct R<F = f32> { u: F }"), records("struct R { u: Vec3 }"));
}

#[test]
fn every_rust_file_has_a_shader() {
    for entry in std::fs::read_dir(sources::path("crates/trace/src/cpu")).expect("the twins") {
        let name = entry
            .expect("an entry")
            .file_name()
            .into_string()
            .expect("a plain name");
        let wgsl = name.replace(".rs", ".wgsl");
        let twin = built_in().any(|(file, _)| file == wgsl);
        assert!(
            twin || RUST_FILES_WITHOUT_SHADER.contains(&name.as_str()),
            "crates/trace/src/cpu/{name} is not the twin of a shader"
        );
    }
}

/// Allowed SPIR-V instructions. For floats, only arithmetic protected by `NoContraction`, comparisons, conversions and
/// moves are allowed.
mod opcode {
    use std::ops::RangeInclusive;

    /// Names, modes, decorations, types, constants, variables.
    pub const DECLARATIONS: &[RangeInclusive<u16>] =
        &[3..=8, 10..=11, 14..=17, 19..=24, 28..=30, 32..=33, 41..=46, 71..=72];
    /// Functions, memory and control flow.
    pub const STRUCTURE: &[RangeInclusive<u16>] = &[1..=1, 54..=57, 59..=59, 61..=62, 65..=65, 68..=68, 245..=255];
    /// Composites, copies, selections, bit casts.
    pub const MOVES: &[RangeInclusive<u16>] = &[77..=83, 124..=124, 169..=169];
    /// Integers, logic and comparisons.
    pub const INTEGERS: &[RangeInclusive<u16>] = &[
        126..=126,
        128..=128,
        130..=130,
        132..=132,
        134..=135,
        137..=139,
        149..=152,
        154..=155,
        164..=168,
        170..=179,
        194..=205,
        228..=228, // atomic store and addition, for the completion of a dispatch
        234..=234,
    ];
    /// Floating-point comparisons except `!=`, which naga translates to an ordered comparison (false for NaN).
    pub const COMPARISONS: &[RangeInclusive<u16>] = &[156..=157, 180..=181, 184..=191];
    /// Instructions that must be decorated: negate, add, subtract, multiply, divide, vector times scalar; conversions
    /// between floats and integers.
    pub const PROTECTED: &[u16] = &[127, 129, 131, 133, 136, 142, 109, 110, 111, 112];

    pub const FUNCTION: u16 = 54;
    pub const EXTENDED: u16 = 12;
    pub const DECORATE: u16 = 71;
    pub const NO_CONTRACTION: u32 = 42;
    /// GLSL.std.450: absolute values, square root, integer minimum, maximum and clamp, first bit.
    pub const EXTENDED_ALLOWED: &[u32] = &[4, 5, 31, 38, 39, 41, 42, 44, 45, 73, 74, 75];
    /// GLSL.std.450 `FClamp`, which naga writes before conversions to integers; exact except for NaN.
    pub const FLOAT_CLAMP: u32 = 43;
    pub const FLOAT_TO_INTEGER: &[u16] = &[109, 110];
}

/// Returns the operations whose result may depend on the device.
fn violations(module: &[u32]) -> Vec<String> {
    let decorated: BTreeSet<u32> = instructions(module)
        .filter(|(op, words)| *op == opcode::DECORATE && words[2] == opcode::NO_CONTRACTION)
        .map(|(_, words)| words[1])
        .collect();
    let groups = [
        opcode::DECLARATIONS,
        opcode::STRUCTURE,
        opcode::MOVES,
        opcode::INTEGERS,
        opcode::COMPARISONS,
    ];
    let mut problems = Vec::new();
    for (op, words) in instructions(module) {
        if opcode::PROTECTED.contains(&op) {
            if !decorated.contains(&words[2]) {
                problems.push(format!("%{} (opcode {op}) may be contracted", words[2]));
            }
        } else if op == opcode::EXTENDED {
            let is_integer_clamp = words[4] == opcode::FLOAT_CLAMP && is_only_converted_to_integer(module, words[2]);
            if !opcode::EXTENDED_ALLOWED.contains(&words[4]) && !is_integer_clamp {
                problems.push(format!("extended instruction {}", words[4]));
            }
        } else if !groups.iter().any(|group| group.iter().any(|range| range.contains(&op))) {
            problems.push(format!("opcode {op}"));
        }
    }
    problems
}

/// Returns true if only conversions to integers use `result`.
fn is_only_converted_to_integer(module: &[u32], result: u32) -> bool {
    let defines = |op: u16, words: &[u32]| op == opcode::EXTENDED && words[2] == result;
    let functions = instructions(module).skip_while(|(op, _)| *op != opcode::FUNCTION);
    let mut users = functions.filter(|(op, words)| words[1..].contains(&result) && !defines(*op, words));
    users.all(|(op, _)| opcode::FLOAT_TO_INTEGER.contains(&op))
}

fn spirv(source: &Source, kernel: &Kernel, packed: &Packed, rounding: Rounding) -> Vec<u32> {
    let checked =
        check(source).unwrap_or_else(|error| panic!("{error}\n{}", error.excerpt.clone().unwrap_or_default()));
    checked
        .exact_spirv(kernel, &packed.specialization, rounding, FloatControls::ALL)
        .expect("a kernel")
}

#[test]
fn kernels_have_only_exact_operations() {
    let mut operations = 0;
    for (name, packed) in scenes::all() {
        for kernel in KERNELS {
            for (baked, rounding) in [
                (None, Rounding::Device),
                (Some(bake(&packed)), Rounding::Device),
                (None, Rounding::Software),
            ] {
                let source = sources::shaders().compose(kernel, packed.integrator, baked.as_deref());
                let module = spirv(&source, kernel, &packed, rounding);
                operations += instructions(&module)
                    .filter(|(op, _)| opcode::PROTECTED.contains(op))
                    .count();
                let problems = violations(&module);
                assert!(
                    problems.is_empty(),
                    "{name}, {}, baked {}, {rounding:?}: {problems:?}",
                    kernel.entry_point,
                    baked.is_some()
                );
            }
        }
    }
    assert!(operations > 1000, "the scan found too few instructions");
}

#[test]
fn an_inexact_operation_is_detected() {
    let (_, packed) = scenes::all().remove(0);
    let source = sources::shaders().compose(&RENDER, Integrator::Phong, None);
    let from = "    var sum = environment.ambient * material.ambient;\n";
    assert!(source.text.contains(from));
    for to in [
        "    var sum = mix(environment.ambient, material.ambient, 0.5);\n",
        "    var sum = fma(environment.ambient, material.ambient, surface.normal);\n",
        "    var sum = mat3x3f(surface.normal, surface.wo, surface.ray_origin) * material.ambient;\n",
        "    var sum = environment.ambient % material.ambient;\n",
        "    var sum = ceil(material.ambient);\n",
        "    var sum = clamp(material.ambient, vec3f(0.0), vec3f(1.0));\n",
        "    var sum = vec3f(pow(material.shininess, 2.0));\n",
        "    var sum = vec3f(inverseSqrt(material.shininess));\n",
        "    var sum = vec3f(length(material.ambient));\n",
        "    var sum = vec3f(sin(material.shininess));\n",
        "    var sum = select(material.ambient, vec3f(1.0), material.shininess != 1.0);\n",
    ] {
        let mut changed = Source::default();
        changed.append("changed", &source.text.replacen(from, to, 1));
        assert!(
            !violations(&spirv(&changed, &RENDER, &packed, Rounding::Device)).is_empty(),
            "{to}"
        );
    }
    let module = spirv(&source, &RENDER, &packed, Rounding::Device);
    assert_eq!(violations(&module), Vec::<String>::new());
    let decorations: Vec<usize> = instruction_starts(&module)
        .filter(|start| module[*start] as u16 == opcode::DECORATE && module[start + 2] == opcode::NO_CONTRACTION)
        .collect();
    assert!(decorations.len() > 100);
    let mut without = module.clone();
    without.drain(decorations[17]..decorations[17] + 3);
    assert_eq!(violations(&without).len(), 1, "an undecorated operation was not found");
}

fn instruction_starts(module: &[u32]) -> impl Iterator<Item = usize> {
    let mut position = 5; // after the header
    instructions(module).map(move |(_, words)| {
        let start = position;
        position += words.len();
        start
    })
}
