//! Tests of invalid values, and of valid values at the limits.

use super::*;

/// Lines of [`VALID`], each with an invalid replacement and the expected error.
const INVALID: &[(&str, &str, &str)] = &[
    (
        "max_depth = 3",
        "max_depth = 1025",
        "render.max_depth: 1025 must be from 0 to 1024",
    ),
    (
        "rr_depth = 2",
        "rr_depth = 1025",
        "render.rr_depth: 1025 must be from 0 to 1024",
    ),
    ("clamp = 10", "clamp = 0", "render.clamp: 0 must be from 1e-6 to 1e6"),
    (
        "clamp = 10",
        "clamp = 9e-7",
        "render.clamp: 9e-7 must be from 1e-6 to 1e6",
    ),
    (
        "clamp = 10",
        "clamp = 1.1e6",
        "render.clamp: 1.1e6 must be from 1e-6 to 1e6",
    ),
    (
        "clamp = 10",
        "clamp = nan",
        "render.clamp: nan must be from 1e-6 to 1e6",
    ),
    (
        "pixel_samples = { count = 5 }",
        "pixel_samples = { pattern = 'grid', count = 5 }",
        "render.pixel_samples.count: 5 must be a square number, such as 4 or 9: the pattern \"grid\" is an n x n grid; other patterns take any number",
    ),
    (
        "pixel_samples = { count = 5 }",
        "pixel_samples = { count = 0 }",
        "render.pixel_samples.count: 0 must be from 1 to 65536",
    ),
    (
        "pixel_samples = { count = 5 }",
        "adaptive = { error = 0.1 }\npixel_samples = { pattern = 'grid', count = 4 }",
        "render.adaptive: the pattern of pixel_samples, \"grid\", cannot add samples; use one of \
         \"jittered\", \"random\", \"halton\", \"sobol\"",
    ),
    (
        "color = [0.5, 0.25, 0]",
        "color = [0.5, -0.25, 0]",
        "environment.color: -0.25 must be from 0 to 1e6",
    ),
    (
        "color = [0.5, 0.25, 0]",
        "color = [0.5, 1.1e6, 0]",
        "environment.color: 1.1e6 must be from 0 to 1e6",
    ),
    (
        "color = [0.5, 0.4, 0.3]",
        "color = [0.5, 1.1, 0.3]",
        "materials.clay.color: 1.1 must be from 0 to 1",
    ),
    (
        "color = [0.5, 0.4, 0.3]",
        "color = [0.5, 0.4, -0.1]",
        "materials.clay.color: -0.1 must be from 0 to 1",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "roughness = 1.1\ncolor = [0.9, 0.9, 0.8]",
        "materials.silver.roughness: 1.1 must be from 0 to 1",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "anisotropy = -0.1\ncolor = [0.9, 0.9, 0.8]",
        "materials.silver.anisotropy: -0.1 must be from 0 to 1",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "anisotropy_rotation = 361\ncolor = [0.9, 0.9, 0.8]",
        "materials.silver.anisotropy_rotation: 361 must be from -360 to 360",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "metal = 'gold'\ncolor = [0.9, 0.9, 0.8]",
        "materials.silver.metal: cannot be combined with color",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "metal = 'gold'\neta = [1, 1, 1]",
        "materials.silver.metal: cannot be combined with eta",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "eta = [1, 1, 1]\nk = [1, 1, 1]\ncolor = [0.9, 0.9, 0.8]",
        "materials.silver.eta: cannot be combined with color",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "eta = [1, 0, 1]\nk = [1, 1, 1]",
        "materials.silver.eta: 0 must be from 0.001 to 100",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "k = [1, 1, 101]\neta = [1, 1, 1]",
        "materials.silver.k: 101 must be from 0 to 100",
    ),
    (
        "ior = 1.33",
        "absorption = [0, 0, 1]\nior = 1.33\nthin = true",
        "materials.water.absorption: must be 0 if thin is true: a thin sheet has no interior",
    ),
    (
        "roughness = 0.75",
        "roughness = 1.5",
        "materials.clay.roughness: 1.5 must be from 0 to 1",
    ),
    (
        "roughness = 0.75",
        "roughness = -0.5",
        "materials.clay.roughness: -0.5 must be from 0 to 1",
    ),
    (
        "roughness = { texture = \"dark\" }",
        "roughness = { texture = 'darker' }",
        "materials.coal.roughness.texture: there is no texture \"darker\"; did you mean \"dark\"?",
    ),
    (
        "emission = { texture = \"spots\" }",
        "emission = { texture = 'spot' }",
        "materials.coal.emission.texture: there is no texture \"spot\"; did you mean \"spots\"?",
    ),
    (
        "emission = [7, 0, 0]",
        "emission = [7, 0, -1]",
        "materials.gold.emission: -1 must be from 0 to 1e6",
    ),
    (
        "emission = [7, 0, 0]",
        "emission = [1.1e6, 0, 0]",
        "materials.gold.emission: 1.1e6 must be from 0 to 1e6",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "color = [0.9, 0.9, 8]",
        "materials.silver.color: 8 must be from 0 to 1",
    ),
    (
        "ior = 1.33",
        "ior = 0",
        "materials.water.ior: 0 must be from 0.01 to 100",
    ),
    (
        "ior = 1.33",
        "ior = 101",
        "materials.water.ior: 101 must be from 0.01 to 100",
    ),
    (
        "color = [1, 0.5, 0]",
        "color = [2, 0.5, 0]",
        "materials.wine.color: 2 must be from 0 to 1",
    ),
    (
        "absorption = [0, 2, 3]",
        "absorption = [0, -2, 3]",
        "materials.wine.absorption: -2 must be from 0 to 1e6",
    ),
    (
        "absorption = [0, 2, 3]",
        "absorption = [0, 2, inf]",
        "materials.wine.absorption: inf must be from 0 to 1e6",
    ),
    (
        "material = \"clay\"",
        "material = \"gold\"",
        "shapes[0].material: \"gold\" must not emit light here, because this shape is infinite",
    ),
    (
        "material = \"clay\"",
        "material = \"coal\"",
        "shapes[0].material: \"coal\" must not emit light here, because this shape is infinite",
    ),
];

#[test]
fn invalid_values_are_reported_with_line_key_value_and_rule() {
    for &(line, invalid, expected) in INVALID {
        let text = with_line(line, invalid);
        let line_number = text[..text.find(invalid).unwrap()].lines().count() + 1;
        let message = parse(&text).unwrap_err().to_string();
        assert_eq!(message, format!("s.toml:{line_number}: {expected}"));
    }
    let text = VALID.replace("[render]", "[render]\nbackground = [0, 0.5, 0]");
    let line_number = text[..text.find("[environment]").unwrap()].lines().count() + 1;
    let rule = "cannot be combined with render.background, [0, 0.5, 0]; remove one";
    assert_eq!(
        parse(&text).unwrap_err().to_string(),
        format!("s.toml:{line_number}: environment: {rule}")
    );
}

#[test]
fn values_at_the_limits_are_valid() {
    for (line, valid) in [
        ("max_depth = 3", "max_depth = 0"),
        ("max_depth = 3", "max_depth = 1024"),
        ("rr_depth = 2", "rr_depth = 0"),
        ("rr_depth = 2", "rr_depth = 1024"),
        ("clamp = 10", "clamp = 1e-6"),
        ("clamp = 10", "clamp = 1e6"),
        ("pixel_samples = { count = 5 }", "pixel_samples = { count = 65536 }"),
        ("pixel_samples = { count = 5 }", "pixel_samples = { count = 1 }"),
        ("color = [0.5, 0.25, 0]", "color = [0, 1e6, -0.0]"),
        ("color = [0.5, 0.4, 0.3]", "color = [0, 1, 0.3]"),
        ("roughness = 0.75", "roughness = 0"),
        ("roughness = 0.75", "roughness = 1"),
        ("emission = [7, 0, 0]", "emission = [0, 1e6, 0]"),
        ("ior = 1.33", "ior = 0.01"),
        ("ior = 1.33", "ior = 100"),
        ("absorption = [0, 2, 3]", "absorption = [0, 1e6, 0]"),
    ] {
        parse(&with_line(line, valid)).unwrap_or_else(|error| panic!("{valid}: {error}"));
    }
    // A plane may have a black texture as emission.
    let dark = with_line(
        "emission = { texture = \"spots\" }",
        "emission = { texture = \"dark\" }",
    );
    parse(&dark.replace("material = \"clay\"", "material = \"coal\"")).unwrap();
}

#[test]
fn path_tracer_features_are_rejected_under_phong() {
    const START: &str = "image = { width = 1, height = 1 }\n\
                         camera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n";
    for (added, line, key) in [
        ("[render]\nrr_depth = 5", 2, "render.rr_depth:"),
        ("[render]\nclamp = 1", 2, "render.clamp:"),
        ("[render]\nalpha = false", 2, "render.alpha:"),
        ("[render]\nmax_depth = 3\nalpha = true", 3, "render.alpha:"),
        ("[environment]\ncolor = [0, 0, 0]", 1, "environment:"),
        (
            "[materials.a]\ntype = 'phong'\ncolor = [1, 1, 1]\nemission = [0, 0, 0]",
            4,
            "materials.a.emission:",
        ),
        (
            "[materials.a]\ntype = 'mirror'\nemission = [1, 1, 1]",
            3,
            "materials.a.emission:",
        ),
        (
            "[materials.a]\ntype = 'glass'\nior = 1\nemission = [1, 1, 1]",
            4,
            "materials.a.emission:",
        ),
        (
            "[materials.a]\ntype = 'diffuse'\ncolor = [1, 1, 1]",
            2,
            "materials.a.type: \"diffuse\"",
        ),
        (
            "[materials.a]\ntype = 'conductor'",
            2,
            "materials.a.type: \"conductor\"",
        ),
        (
            "[materials.a]\nior = 1\ntype = 'dielectric'",
            3,
            "materials.a.type: \"dielectric\"",
        ),
    ] {
        let text = format!("{START}{added}\n");
        let render = "[render]\nintegrator = 'phong'";
        let under_phong = match text.contains("[render]") {
            true => text.replace("[render]", render),
            false => text.replace("[materials.a]", &format!("{render}\n[materials.a]")),
        };
        let under_phong = under_phong.replace("[environment]", &format!("{render}\n[environment]"));
        let expected = format!(
            "s.toml:{}: {key} needs integrator = \"path\"",
            line + 3 + usize::from(!text.contains("[render]"))
        );
        assert_eq!(parse(&under_phong).unwrap_err().to_string(), expected);
        // If no integrator is specified, the path tracer is used.
        let scene = parse(&text).unwrap();
        assert_eq!(scene.render.integrator, Integrator::Path);
        let key = key.split(':').next().unwrap_or_default();
        let note = format!(
            "render.integrator is not set; using \"path\", which {key} requires. Set it in the scene to silence this warning"
        );
        assert_eq!(scene.notes[0], note);
        // An override determines the integrator.
        let overrides = |integrator| Overrides {
            integrator: Some(integrator),
            ..Overrides::default()
        };
        Scene::parse_with(&text, "s.toml", &overrides(Integrator::Path)).unwrap();
        let render = "[render]\nintegrator = 'path'";
        let under_path = match text.contains("[render]") {
            true => text.replace("[render]", render),
            false => format!("{text}{render}\n"),
        };
        parse(&under_path).unwrap();
        let expected = expected.replace("s.toml:", "").split_once(": ").unwrap().1.to_owned();
        let error = Scene::parse_with(&under_path, "s.toml", &overrides(Integrator::Phong)).unwrap_err();
        assert!(error.to_string().ends_with(&expected), "{error}");
    }
}
