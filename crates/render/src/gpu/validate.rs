//! Validation of a scene's kernels without a device; reports all errors at once.

use rayon::prelude::*;

use super::bake::bake_if_small;
use super::compile::{ValidKernel, check_with_offset};
use super::compose::{KERNELS, Kernel, Shaders, Source};
use super::float_controls::FloatControls;
use super::functions::functions;
use super::interface;
use super::rounding::Rounding;
use crate::error::{ShaderError, ShaderErrors};
use wgray_trace::records::Packed;

/// Maximum number of errors reported per kernel.
const MAX_ERRORS: usize = 16;

/// Representation of the scene in the checked kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forms {
    /// In buffers.
    Buffers,
    /// In buffers and, if small enough, as constants.
    All,
}

/// Compiles every kernel of a scene to SPIR-V, without a driver, and compares its interface with the program's
/// bindings.
///
/// # Errors
///
/// All errors; an error of several kernels is listed once. Only the first error of each function is found.
pub fn check_kernels(packed: &Packed, shaders: &Shaders, forms: Forms) -> Result<(), ShaderErrors> {
    let baked = (forms == Forms::All).then(|| bake_if_small(packed)).flatten();
    let mut scenes = vec![None];
    scenes.extend(baked.as_deref().map(Some));
    let all: Vec<(&Kernel, Option<&str>)> = scenes
        .into_iter()
        .flat_map(|scene| KERNELS.map(|kernel| (kernel, scene)))
        .collect();
    let found: Vec<Vec<ShaderError>> = all
        .into_par_iter()
        .map(|(kernel, scene)| errors_of_kernel(kernel, shaders.compose(kernel, packed.integrator, scene), packed))
        .collect();
    let mut errors: Vec<ShaderError> = Vec::new();
    for error in found.into_iter().flatten() {
        if !errors.contains(&error) {
            errors.push(error);
        }
    }
    // An error in a declaration also causes errors in code that is generated from the declaration. The errors in
    // generated code are omitted.
    if errors.iter().any(|error| is_in_file(error, shaders)) {
        errors.retain(|error| is_in_file(error, shaders));
    }
    if errors.is_empty() {
        Ok(())
    } else {
        Err(ShaderErrors(errors))
    }
}

fn is_in_file(error: &ShaderError, shaders: &Shaders) -> bool {
    let file = error.place.split(':').next();
    shaders.files().any(|(name, _)| Some(name) == file)
}

fn errors_of_kernel(kernel: &Kernel, source: Source, packed: &Packed) -> Vec<ShaderError> {
    let (mut errors, valid) = errors_of_functions(source);
    let Some((source, checked)) = valid else { return errors };
    match interface::errors(kernel, packed.integrator, &source, &checked, errors.is_empty()) {
        Ok(interface_errors) => errors.extend(interface_errors),
        Err(error) => errors.push(error),
    }
    if errors.is_empty() {
        let compiled = checked.exact_spirv(kernel, &packed.specialization, Rounding::Device, FloatControls::ALL);
        errors.extend(compiled.err());
    }
    errors
}

/// Finds the errors in all functions, although naga stops at the first error: a function with an error gets an empty
/// body, which callers of the function accept. Also returns the valid remainder, unless an error is outside all bodies.
fn errors_of_functions(mut source: Source) -> (Vec<ShaderError>, Option<(Source, ValidKernel)>) {
    let mut errors: Vec<ShaderError> = Vec::new();
    loop {
        let (mut error, offset) = match check_with_offset(&source) {
            Ok(checked) => return (errors, Some((source, checked))),
            Err(error) => error,
        };
        let texts = functions(&source.text);
        let with_empty_body = |i: usize| {
            let function = &texts[i];
            let body = match function.result {
                "" => "{}".to_string(),
                ty => format!("{{ var nothing: {ty}; return nothing; }}"),
            };
            source.replaced(function.body.clone(), &body)
        };
        let culprit = match offset {
            Some(offset) => texts
                .iter()
                .position(|text| (text.start..text.body.end).contains(&offset)),
            // naga reports no location: the error disappears with the body of its function.
            None => (0..texts.len()).find(|i| {
                check_with_offset(&with_empty_body(*i))
                    .err()
                    .map(|(error, _)| error)
                    .as_ref()
                    != Some(&error)
            }),
        };
        if let (None, Some(i)) = (offset, culprit) {
            let function = &texts[i];
            let message = format!("in `{}`: {}", function.name, error.message);
            let head = function.start..function.start + "fn ".len() + function.name.len();
            error = ShaderError::at(&source, Some(naga::Span::from(head)), message);
        }
        let is_repeated = errors.iter().any(|earlier| earlier.place == error.place);
        if !is_repeated {
            errors.push(error);
        }
        let Some(i) = culprit.filter(|_| !is_repeated && errors.len() < MAX_ERRORS) else {
            return (errors, None);
        };
        source = with_empty_body(i);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pack::pack;
    use wgray_scene::Scene;

    const SCENE: &str = "
        image = { width = 8, height = 8 }
        camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }
        materials.m = { type = 'phong', color = [0.5, 0.5, 0.5] }
        shapes = [{ type = 'sphere', material = 'm', center = [0, 0, 0], radius = 1 }]
    ";

    /// Returns the error messages for the built-in shaders after edits: file, old text, new text. With an empty old
    /// text, the new text is appended to the file.
    fn messages_of(edits: &[(&str, &str, &str)]) -> Vec<String> {
        let mut shaders = Shaders::built_in();
        for (name, old, new) in edits {
            let text = shaders.text(name);
            assert!(text.contains(old), "{name} has no '{old}'");
            let text = match *old {
                "" => format!("{text}{new}\n"),
                old => text.replacen(old, new, 1),
            };
            shaders = shaders.with(name, text);
        }
        let packed = pack(&Scene::parse(SCENE, "s.toml").unwrap());
        let errors = check_kernels(&packed, &shaders, Forms::Buffers).err();
        errors.map_or(Vec::new(), |errors| errors.0.iter().map(ToString::to_string).collect())
    }

    /// Asserts that the edits cause exactly the expected messages. An expected message is a location and, after a
    /// space, parts of the message separated by ` .. `.
    #[track_caller]
    fn reports(edits: &[(&str, &str, &str)], expected: &[&str]) {
        let messages = messages_of(edits);
        assert_eq!(messages.len(), expected.len(), "{messages:#?}");
        for expected in expected {
            let (location, parts) = expected.split_once(' ').unwrap();
            let matches =
                |line: &&String| line.starts_with(location) && parts.split(" .. ").all(|part| line.contains(part));
            assert!(messages.iter().any(|line| matches(&line)), "{expected}: {messages:#?}");
        }
    }

    const FILM: &str = "film.wgsl";
    const RENDER: &str = "kernels/render.wgsl";
    const FIRST_HITS: &str = "kernels/first_hits.wgsl";
    const ADAPTIVE: &str = "kernels/adaptive.wgsl";

    #[test]
    fn the_built_in_shaders_are_valid() {
        assert_eq!(messages_of(&[]), [""; 0]);
    }

    #[test]
    fn every_kernel_is_checked_and_each_error_is_reported_once() {
        reports(
            &[
                (RENDER, "sample++", "sample+"),
                (FIRST_HITS, "pixel_first_hit(pixel)", "pixel_first_hit(pixels)"),
                (ADAPTIVE, "= moments;", "= moments.xyz;"),
                ("phong.wgsl", "", "fn one() -> f32 { return missing; }"),
                ("phong.wgsl", "", "fn two() -> f32 { return vec2f(1.0); }"),
                (
                    "light.wgsl",
                    "",
                    "fn three(a: f32) -> bool { let b = a && true; return b; }",
                ),
            ],
            &[
                "kernels/render.wgsl: expected",
                "kernels/first_hits.wgsl:12: `pixels`",
                "kernels/adaptive.wgsl: in `adaptive`: .. `moments.xyz` (`vec3<f32>`) .. vec4<f32>",
                "phong.wgsl: `missing`",
                "phong.wgsl: in `two`: .. expression `vec2f(1.0)` (`vec2<f32>`) does not match the declared return type `f32`",
                "light.wgsl: in `three`: Incompatible operands",
            ],
        );
    }

    #[test]
    fn the_entry_point_must_match_the_program() {
        reports(
            &[(RENDER, "@workgroup_size(8, 8)", "@workgroup_size(4, 4)")],
            &["kernels/render.wgsl: workgroup size of `render` is (4, 4) .. (8, 8)"],
        );
        reports(
            &[(RENDER, "@workgroup_size(8, 8)", "@workgroup_size(BOUNCES, 8)")],
            &["kernels/render.wgsl: workgroup size of `render` is set by an override"],
        );
        reports(
            &[(FIRST_HITS, "fn first_hits", "fn hits_first")],
            &["kernels/first_hits.wgsl: must be called `first_hits`, not `hits_first`"],
        );
        let built_in = Shaders::built_in();
        let text = built_in.text(FIRST_HITS);
        let start = text.find("@compute").unwrap();
        reports(
            &[(FIRST_HITS, &text[start..], "")],
            &["kernels/first_hits.wgsl:1:1: there is no entry point: @compute @workgroup_size(8, 8) fn first_hits"],
        );
        reports(
            &[
                (FIRST_HITS, "@compute @workgroup_size(8, 8)", ""),
                (FIRST_HITS, "@builtin(global_invocation_id) ", ""),
                (FIRST_HITS, "@builtin(local_invocation_index) ", ""),
            ],
            &["kernels/first_hits.wgsl: `first_hits` must be the entry point: @compute"],
        );
    }

    #[test]
    fn bindings_must_match_the_program() {
        let film = "@group(0) @binding(1) var<storage, read_write> film: array<vec4f>;";
        reports(
            &[(FILM, "@binding(1)", "@binding(40)")],
            &["film.wgsl: `film` must be at @group(0) @binding(1)"],
        );
        reports(
            &[(FILM, film, "var<private> film: array<vec4f, 9>;")],
            &["film.wgsl:1:1: @group(0) @binding(1) .. `var<storage, read_write>` film: array<vec4<f32>> is missing"],
        );
        reports(
            &[
                (FIRST_HITS, "array<FirstHit>", "array<vec4f>"),
                (
                    FIRST_HITS,
                    "= pixel_first_hit(pixel);",
                    "= vec4f(pixel_first_hit(pixel).depth);",
                ),
            ],
            &["kernels/first_hits.wgsl: `hits[]` is `vec4<f32>` and must be `FirstHit`"],
        );
        reports(
            &[("bindings.wgsl", "", "@group(0) @binding(30) var<uniform> more: vec4f;")],
            &["bindings.wgsl: `more`: the program binds nothing at @group(0) @binding(30)"],
        );
        reports(
            &[("bindings.wgsl", "var<uniform> camera", "var<storage, read> camera")],
            &["bindings.wgsl: `camera` is `var<storage, read>`; @group(1) @binding(0) must be `var<uniform>`"],
        );
        reports(
            &[("bindings.wgsl", "texels: array<u32>", "texels: array<u32, 16>")],
            &["bindings.wgsl: `texels` is `array<u32, 16>` and must be `array<u32>`"],
        );
        // A comment changes no binding.
        reports(&[("bindings.wgsl", "", "// nothing")], &[]);
    }

    #[test]
    fn layouts_of_bindings_must_match_the_program() {
        let rows = "struct Rows { light_counts: vec4u, more: vec4u }\n";
        reports(
            &[
                ("bindings.wgsl", "completion: Completion", "completion: Receipts"),
                (
                    "completion.wgsl",
                    "",
                    "struct Receipts { groups_done: atomic<u32>, more: f32, truncated: atomic<u32> }",
                ),
            ],
            &["bindings.wgsl: `completion` does not have the layout .. `completion.more` is `f32`"],
        );
        reports(
            &[
                ("bindings.wgsl", "", rows),
                (
                    "bindings.wgsl",
                    "filter_table: array<vec4f, FILTER_TABLE_SIZE>",
                    "filter_table: array<vec4f, 64>",
                ),
            ],
            &["bindings.wgsl: `filter_table` is `array<vec4<f32>, 64>` and must be `array<vec4<f32>, 128>`"],
        );
    }

    #[test]
    fn errors_in_generated_code_are_omitted_if_a_file_has_the_cause() {
        let messages = messages_of(&[("bindings.wgsl", "records: array<vec4u>", "records: array<vec2u>")]);
        assert!(
            messages
                .iter()
                .any(|line| line.starts_with("bindings.wgsl:") && line.contains("does not have the layout")),
            "{messages:#?}"
        );
        assert!(messages.iter().all(|line| !line.starts_with('(')), "{messages:#?}");
    }

    #[test]
    fn redefinitions_are_reported_with_the_other_definition() {
        reports(
            &[("phong.wgsl", "", "const steps: i32 = 3;")],
            &["bvh_node.wgsl:5:4: redefinition of `steps`; the other definition is at phong.wgsl:"],
        );
    }

    #[test]
    fn overrides_must_have_values() {
        reports(
            &[("math.wgsl", "", "override MINE: f32;")],
            &["math.wgsl: `MINE` has no value"],
        );
        reports(&[("math.wgsl", "", "override MINE: f32 = 2.0;")], &[]);
    }

    #[test]
    fn buffers_that_are_read_back_must_be_written() {
        reports(
            &[(RENDER, "    report_completion(local);\n", "")],
            &[
                "kernels/render.wgsl: `render` never writes `completion`, which the program reads: every pixel must end with `report_completion(local)`",
            ],
        );
        reports(
            &[(
                FIRST_HITS,
                "hits[film_pixel.y * params.film_size.x + film_pixel.x] =",
                "let hit =",
            )],
            &["kernels/first_hits.wgsl: `first_hits` never writes `hits`"],
        );
    }

    #[test]
    fn messages_use_the_names_of_the_source() {
        let messages_with = |body: &str| {
            messages_of(&[(
                "phong.wgsl",
                "",
                &format!("fn wrong(a: f32, b: vec3f, n: u32) {{\n    {body}\n}}"),
            )])
        };
        for (body, expected) in [
            ("if n { }", "condition `n` (`u32`) is not a boolean"),
            (
                "let x = b + vec2f();",
                "Add can't work with `b` (`vec3<f32>`) and `vec2f()` (`vec2<f32>`)",
            ),
            ("let x = !a;", "LogicalNot can't work with `a` (`f32`)"),
            (
                "let x = wronged(a, a, n); }\nfn wronged(a: f32, b: vec3f, n: u32) -> f32 { return a;",
                "Call to `wronged` is invalid: Argument 1 value `a` (`f32`) doesn't match the type `vec3<f32>`",
            ),
            (
                "return a;",
                "expression `a` (`f32`) does not match the declared return type None",
            ),
            (
                "var x = film;",
                "variable 'x' is invalid: Local variable has a type `array<vec4<f32>>` that can't",
            ),
            (
                "let x = select(a, a, n);",
                "Expected selection condition to be a boolean value, got Scalar(u32)",
            ),
            (
                "let x = vec3f(1.0, 2u, 3.0);",
                "Composing 1's component type is not expected",
            ),
            ("let x = n << 40u;", "Shift amount exceeds the bit width of Scalar(u32)"),
            ("let x = records[a].x;", "Accessing with index `a` (`f32`)"),
            ("primitives[0].level = a;", "`primitives[0].level`"),
            ("break;", "outside of a `loop`"),
            ("let x = all(b);", "Relational argument `b` (`vec3<f32>`)"),
            ("let x = b == camera;", "`camera` (`Camera`)"),
            ("let x = camera == camera;", "Incompatible operands"),
        ] {
            let messages = messages_with(body);
            // Only two of the three kernels declare `film`; the third kernel reports another error.
            let line = messages
                .iter()
                .find(|line| line.contains(expected))
                .unwrap_or_else(|| panic!("{body}: {messages:?}"));
            let message = line.split_once(' ').unwrap().1;
            assert!(line.starts_with("phong.wgsl:"), "{line}");
            let contains_index = message
                .as_bytes()
                .windows(2)
                .any(|pair| pair[0] == b'[' && pair[1].is_ascii_digit());
            assert!(
                (!contains_index || message.contains("primitives[0]")) && !message.contains("Some("),
                "{line}"
            );
        }
    }
}
