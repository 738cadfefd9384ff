//! What a scene of the path tracer becomes, and what is told of keys that only one integrator has.

use glam::DVec3;

use super::super::super::{
    Channel, CheckerDescription, Color, ColorDescription, ConductorDescription, Description, DielectricDescription,
    DiffuseDescription, Environment, EnvironmentDescription, Facets, Integrator, Material, MetalIndex, Overrides,
    Pattern, PerspectiveDescription, Reflection, Samples, SamplesDescription, Scene, SceneError, Shadows, Value,
    ValueDescription,
};

/// One of everything that paths have; every line is there once, so that a test can put another in its place.
const GOOD: &str = r#"
image = { width = 4, height = 4 }
camera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }
[render]
integrator = "path"
max_depth = 3
rr_depth = 2
clamp = 10
alpha = true
pixel_samples = { count = 5 }
[environment]
color = [0.5, 0.25, 0]
[textures.spots]
type = "checker"
even = [0, 0, 0]
odd = [1, 2, 3]
[textures.dark]
type = "constant"
color = [0, 0, 0]
[materials.clay]
type = "diffuse"
color = [0.5, 0.4, 0.3]
roughness = 0.75
[materials.coal]
type = "diffuse"
color = { texture = "spots" }
roughness = { texture = "dark" }
emission = { texture = "spots" }
[materials.gold]
type = "conductor"
emission = [7, 0, 0]
[materials.silver]
type = "conductor"
color = [0.9, 0.9, 0.8]
[materials.water]
type = "dielectric"
ior = 1.33
[materials.wine]
type = "dielectric"
ior = 1.34
color = [1, 0.5, 0]
absorption = [0, 2, 3]
emission = [0, 0, 1]
[materials.red]
type = "phong"
diffuse = [0.5, 0, 0]
ambient = [9, 9, 9]
specular = [0.5, 0.5, 0.5]
emission = [0, 2, 0]
[materials.mirror]
type = "mirror"
emission = [0, 3, 0]
[materials.glass]
type = "glass"
ior = 1.5
emission = [0, 4, 0]
[[shapes]]
type = "plane"
material = "clay"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
"#;

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(text, "s.toml")
}

/// The good scene with a line changed.
fn with(line: &str, changed: &str) -> String {
    let line = format!("\n{line}\n");
    assert_eq!(GOOD.matches(&line).count(), 1, "{line}");
    GOOD.replace(&line, &format!("\n{changed}\n"))
}

fn plain(r: f64, g: f64, b: f64) -> Color {
    Color::Plain(DVec3::new(r, g, b))
}

#[test]
fn a_scene_of_paths_is_what_its_file_says() {
    let scene = parse(GOOD).unwrap();
    assert_eq!(scene.notes, Vec::<String>::new());
    let render = scene.render;
    assert_eq!(render.integrator, Integrator::Path);
    assert_eq!(
        (render.max_depth, render.rr_depth, render.clamp, render.alpha),
        (3, 2, Some(10.0), true)
    );
    let sobol = Samples {
        pattern: Pattern::Sobol,
        count: 5,
    };
    assert_eq!(render.pixel_samples, sobol);
    let color = DVec3::new(0.5, 0.25, 0.0);
    assert_eq!(
        scene.environment,
        Some(Environment {
            color,
            image: None,
            visible: true
        })
    );
    assert_eq!(render.background, color);
    let material = |name: &str| {
        let i = scene.material_names.iter().position(|known| known == name).unwrap();
        scene.materials[i].clone()
    };
    let told = |reflection, emission| Material {
        reflection,
        emission,
        visible: true,
        normal_map: None,
    };
    let white = plain(1.0, 1.0, 1.0);
    let (dark, spots) = (0, 1);
    for (name, reflection, emission) in [
        (
            "clay",
            Reflection::Diffuse {
                color: plain(0.5, 0.4, 0.3),
                roughness: Value::Plain(0.75),
            },
            Color::BLACK,
        ),
        (
            "coal",
            Reflection::Diffuse {
                color: Color::Texture(spots),
                roughness: Value::Texture(dark, Channel::R),
            },
            Color::Texture(spots),
        ),
        (
            "gold",
            Reflection::Conductor {
                color: white,
                index: None,
                facets: Facets::default(),
            },
            plain(7.0, 0.0, 0.0),
        ),
        (
            "silver",
            Reflection::Conductor {
                color: plain(0.9, 0.9, 0.8),
                index: None,
                facets: Facets::default(),
            },
            Color::BLACK,
        ),
        (
            "water",
            Reflection::Dielectric {
                ior: 1.33,
                color: white,
                absorption: DVec3::ZERO,
                thin: false,
                facets: Facets::default(),
            },
            Color::BLACK,
        ),
        (
            "wine",
            Reflection::Dielectric {
                ior: 1.34,
                color: plain(1.0, 0.5, 0.0),
                absorption: DVec3::new(0.0, 2.0, 3.0),
                thin: false,
                facets: Facets::default(),
            },
            plain(0.0, 0.0, 1.0),
        ),
        (
            "red",
            Reflection::Phong {
                ambient: plain(9.0, 9.0, 9.0),
                diffuse: plain(0.5, 0.0, 0.0),
                specular: plain(0.5, 0.5, 0.5),
                shininess: 16.0,
            },
            plain(0.0, 2.0, 0.0),
        ),
        ("mirror", Reflection::Mirror { tint: white }, plain(0.0, 3.0, 0.0)),
        (
            "glass",
            Reflection::Glass { ior: 1.5, tint: white },
            plain(0.0, 4.0, 0.0),
        ),
    ] {
        assert_eq!(material(name), told(reflection, emission), "{name}");
    }
}

#[test]
fn metals_have_an_index_by_name_or_by_numbers() {
    let silver = "color = [0.9, 0.9, 0.8]";
    let index = |text: &str| {
        let scene = parse(&with(silver, text)).unwrap();
        let at = scene.material_names.iter().position(|name| name == "silver").unwrap();
        match &scene.materials[at].reflection {
            Reflection::Conductor { color, index, facets } => (*color, *index, *facets),
            other => panic!("{other:?}"),
        }
    };
    let (color, plain, facets) = index(silver);
    assert_eq!((plain, facets), (None, Facets::default()));
    assert_eq!(color, Color::Plain(DVec3::new(0.9, 0.9, 0.8)));
    let told = "eta = [1, 2, 3]\nk = [0, 5, 100]\nroughness = 0.5\nanisotropy = 1\nanisotropy_rotation = -90\n\
                energy_compensation = false";
    let (color, told, facets) = index(told);
    let told = told.unwrap();
    assert_eq!(
        (told.eta, told.k),
        (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 5.0, 100.0))
    );
    assert_eq!(color, Color::Plain(DVec3::ONE));
    let found = (facets.roughness, facets.anisotropy, facets.rotation, facets.compensated);
    assert_eq!(found, (Value::Plain(0.5), 1.0, -90.0, false));
    // Every name is on the page.
    let page = include_str!("../../../../docs/scene-format.md");
    for name in MetalIndex::names() {
        let (_, named, _) = index(&format!("metal = '{name}'"));
        assert_eq!(named, MetalIndex::named(name));
        assert!(page.contains(&format!("`\"{name}\"`")), "{name}");
    }
    for (own, other) in [("eta", "k"), ("k", "eta")] {
        let told = parse(&with(silver, &format!("{own} = [1, 1, 1]")))
            .unwrap_err()
            .to_string();
        assert!(
            told.ends_with(&format!("materials.silver.{other}: is missing beside {own}")),
            "{told}"
        );
    }
    let unknown = parse(&with(silver, "metal = 'bronze'")).unwrap_err().to_string();
    assert!(
        unknown.contains("materials.silver.metal: \"bronze\" must be one of \"aluminium\", "),
        "{unknown}"
    );
}

#[test]
fn what_is_absent_has_defaults() {
    let absent = [
        "max_depth = 3",
        "rr_depth = 2",
        "clamp = 10",
        "alpha = true",
        "pixel_samples = { count = 5 }",
    ];
    let text = absent.iter().fold(GOOD.to_owned(), |text, line| text.replace(line, ""));
    let render = parse(&text).unwrap().render;
    assert_eq!(
        (render.max_depth, render.rr_depth, render.clamp, render.alpha),
        (8, 5, None, false)
    );
    let samples = |pattern, count| Samples { pattern, count };
    assert_eq!(render.pixel_samples, samples(Pattern::Sobol, 16));
    // Each integrator has a usual pattern; what is said goes before it.
    for (integrator, said, pattern) in [
        ("path", "", Pattern::Sobol),
        ("phong", "", Pattern::Grid),
        ("path", "pattern = 'grid',", Pattern::Grid),
        ("phong", "pattern = 'sobol',", Pattern::Sobol),
    ] {
        let text = format!(
            "image = {{ width = 1, height = 1 }}\ncamera = {{ position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }}\n\
             [render]\nintegrator = '{integrator}'\npixel_samples = {{ {said} count = 9 }}\n"
        );
        let render = parse(&text).unwrap().render;
        assert_eq!(render.pixel_samples, samples(pattern, 9), "{integrator}");
    }
    // So paths may be adaptive without a word on it.
    parse(&with("clamp = 10", "adaptive = { error = 0.01 }")).unwrap();
}

#[test]
fn the_background_is_the_surroundings() {
    let environment = "[environment]\ncolor = [0.5, 0.25, 0]";
    let dark = parse(&with(environment, "")).unwrap();
    assert_eq!((dark.render.background, dark.environment), (DVec3::ZERO, None));
    let text = with(environment, "").replace("[render]", "[render]\nbackground = [0.1, 0.2, 0.3]");
    let scene = parse(&text).unwrap();
    let color = DVec3::new(0.1, 0.2, 0.3);
    assert_eq!(scene.render.background, color);
    assert_eq!(
        scene.environment,
        Some(Environment {
            color,
            image: None,
            visible: true
        })
    );
    // A black one is none, and stands beside the section.
    let text = GOOD.replace("[render]", "[render]\nbackground = [0, 0, 0]");
    assert_eq!(parse(&text).unwrap(), parse(GOOD).unwrap());
    let black = parse(&with("color = [0.5, 0.25, 0]", "color = [0, 0, 0]")).unwrap();
    assert_eq!(black.environment, None);
    // Direct light has a background alone.
    let text = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n\
                render = { background = [1, 1, 1] }\n";
    let scene = parse(text).unwrap();
    assert_eq!((scene.render.background, scene.environment), (DVec3::ONE, None));
}

/// A line of the good scene, a bad one in its place, and what is told of it.
const BAD: &[(&str, &str, &str)] = &[
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
    (
        "clamp = 10",
        "clamp = 0",
        "render.clamp: 0 must be greater than 0, from 1e-6 to 1e6",
    ),
    (
        "clamp = 10",
        "clamp = 9e-7",
        "render.clamp: 9e-7 must be greater than 0, from 1e-6 to 1e6",
    ),
    (
        "clamp = 10",
        "clamp = 1.1e6",
        "render.clamp: 1.1e6 must be greater than 0, from 1e-6 to 1e6",
    ),
    (
        "clamp = 10",
        "clamp = nan",
        "render.clamp: nan must be greater than 0, from 1e-6 to 1e6",
    ),
    (
        "pixel_samples = { count = 5 }",
        "pixel_samples = { pattern = 'grid', count = 5 }",
        "render.pixel_samples.count: 5 must be a square number, as its pattern is n x n cells",
    ),
    (
        "pixel_samples = { count = 5 }",
        "pixel_samples = { count = 0 }",
        "render.pixel_samples.count: 0 must be from 1 to 65536",
    ),
    (
        "pixel_samples = { count = 5 }",
        "adaptive = { error = 0.1 }\npixel_samples = { pattern = 'grid', count = 4 }",
        "render.adaptive: the pattern of pixel_samples is \"grid\", which has no further samples; it must be one of \
         \"jittered\", \"random\", \"halton\", \"sobol\"",
    ),
    (
        "color = [0.5, 0.25, 0]",
        "color = [0.5, -0.25, 0]",
        "environment.color: -0.25 must be finite, from 0 to 1e6",
    ),
    (
        "color = [0.5, 0.25, 0]",
        "color = [0.5, 1.1e6, 0]",
        "environment.color: 1.1e6 must be finite, from 0 to 1e6",
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
        "materials.silver.metal: cannot stand beside color",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "metal = 'gold'\neta = [1, 1, 1]",
        "materials.silver.metal: cannot stand beside eta",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "eta = [1, 1, 1]\nk = [1, 1, 1]\ncolor = [0.9, 0.9, 0.8]",
        "materials.silver.eta: cannot stand beside color",
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
        "materials.water.absorption: must be 0 where thin is true: a sheet has no inside",
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
        "materials.coal.roughness.texture: \"darker\" is no texture; there are \"dark\", \"spots\"",
    ),
    (
        "emission = { texture = \"spots\" }",
        "emission = { texture = 'spot' }",
        "materials.coal.emission.texture: \"spot\" is no texture; there are \"dark\", \"spots\"",
    ),
    (
        "emission = [7, 0, 0]",
        "emission = [7, 0, -1]",
        "materials.gold.emission: -1 must be finite, from 0 to 1e6",
    ),
    (
        "emission = [7, 0, 0]",
        "emission = [1.1e6, 0, 0]",
        "materials.gold.emission: 1.1e6 must be finite, from 0 to 1e6",
    ),
    (
        "color = [0.9, 0.9, 0.8]",
        "color = [0.9, 0.9, 8]",
        "materials.silver.color: 8 must be from 0 to 1",
    ),
    (
        "ior = 1.33",
        "ior = 0",
        "materials.water.ior: 0 must be greater than 0, from 0.01 to 100",
    ),
    (
        "ior = 1.33",
        "ior = 101",
        "materials.water.ior: 101 must be greater than 0, from 0.01 to 100",
    ),
    (
        "color = [1, 0.5, 0]",
        "color = [2, 0.5, 0]",
        "materials.wine.color: 2 must be from 0 to 1",
    ),
    (
        "absorption = [0, 2, 3]",
        "absorption = [0, -2, 3]",
        "materials.wine.absorption: -2 must be finite, from 0 to 1e6",
    ),
    (
        "absorption = [0, 2, 3]",
        "absorption = [0, 2, inf]",
        "materials.wine.absorption: inf must be finite, from 0 to 1e6",
    ),
    (
        "material = \"clay\"",
        "material = \"gold\"",
        "shapes[0].material: \"gold\" must not emit light here, as this shape is infinite",
    ),
    (
        "material = \"clay\"",
        "material = \"coal\"",
        "shapes[0].material: \"coal\" must not emit light here, as this shape is infinite",
    ),
];

#[test]
fn bad_values_are_told_with_line_key_value_and_rule() {
    for &(line, bad, told) in BAD {
        let text = with(line, bad);
        let place = text[..text.find(bad).unwrap()].lines().count() + 1;
        let message = parse(&text).unwrap_err().to_string();
        assert_eq!(message, format!("s.toml:{place}: {told}"));
    }
    let text = GOOD.replace("[render]", "[render]\nbackground = [0, 0.5, 0]");
    let place = text[..text.find("[environment]").unwrap()].lines().count() + 1;
    let rule = "must not be there beside render.background, [0, 0.5, 0], which stands for it";
    assert_eq!(
        parse(&text).unwrap_err().to_string(),
        format!("s.toml:{place}: environment: {rule}")
    );
}

#[test]
fn values_at_the_limits_are_good() {
    for (line, good) in [
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
        parse(&with(line, good)).unwrap_or_else(|error| panic!("{good}: {error}"));
    }
    // A plane may have a material that could shine, and does not.
    let dark = with(
        "emission = { texture = \"spots\" }",
        "emission = { texture = \"dark\" }",
    );
    parse(&dark.replace("material = \"clay\"", "material = \"coal\"")).unwrap();
}

/// A scene of direct light, and what it may not have.
#[test]
fn what_only_paths_have_is_refused_under_phong() {
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
        let told = format!("s.toml:{}: {key} needs integrator = \"path\"", line + 2);
        assert_eq!(parse(&text).unwrap_err().to_string(), told);
        // It is the integrator that counts, wherever it is from.
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
        let told = told.replace("s.toml:", "").split_once(": ").unwrap().1.to_owned();
        let refused = Scene::parse_with(&under_path, "s.toml", &overrides(Integrator::Phong)).unwrap_err();
        assert!(refused.to_string().ends_with(&told), "{refused}");
    }
}

fn notes(text: &str) -> Vec<String> {
    parse(text).unwrap().notes
}

#[test]
fn what_paths_ignore_is_told() {
    for (added, told) in [
        (
            "ambient = [0, 0.1, 0]",
            "render.ambient: without effect under integrator = \"path\"; surfaces light each other",
        ),
        (
            "shadows = 'transparent'",
            "render.shadows: without effect under integrator = \"path\"; light goes through glass as it does",
        ),
        ("light_samples = { count = 4 }", super::LIGHT_SAMPLES),
        (
            "light_samples = { pattern = 'sobol', count = 16 }",
            super::LIGHT_SAMPLES,
        ),
    ] {
        let text = GOOD.replace("[render]", &format!("[render]\n{added}"));
        assert_eq!(notes(&text), [told]);
        let render = parse(&text).unwrap().render;
        assert_eq!((render.ambient, render.shadows), (DVec3::ZERO, Shadows::Opaque));
    }
    for same in [
        "ambient = [0, 0, 0]",
        "shadows = 'opaque'",
        "light_samples = { count = 16 }",
    ] {
        let text = GOOD.replace("[render]", &format!("[render]\n{same}"));
        assert_eq!(notes(&text), Vec::<String>::new());
    }
    // An option is told whatever its value, and once.
    for count in [16, 9] {
        let overrides = Overrides {
            light_samples: Some(count),
            ..Overrides::default()
        };
        let scene = Scene::parse_with(GOOD, "s.toml", &overrides).unwrap();
        assert_eq!(scene.notes, [super::LIGHT_SAMPLES]);
    }
    // Direct light does all of it.
    let text = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n\
                materials.a = { type = 'phong', color = [1, 1, 1] }\n\
                render = { ambient = [1, 1, 1], shadows = 'transparent', light_samples = { count = 4 } }\n";
    assert_eq!(notes(text), Vec::<String>::new());
}

#[test]
fn phong_materials_that_are_too_bright_are_told() {
    const RULE: &str = "materials: diffuse + specular must be at most 1 under integrator = \"path\", and both are scaled down to that: ";
    let (diffuse, specular) = ("diffuse = [0.5, 0, 0]", "specular = [0.5, 0.5, 0.5]");
    for (line, changed, told) in [
        (diffuse, "diffuse = [0.7, 0.1, 0]", Some("1.2 of \"red\"")),
        (specular, "specular = [0.501, 0, 0]", Some("1.01 of \"red\"")),
        (specular, "specular = [0.5, 1, 1]", None),
        (specular, "specular = [0, 1.5, 1]", Some("1.5 of \"red\"")),
        // The largest of a texture's colours is 1, 2, 3.
        (diffuse, "diffuse = { texture = 'spots' }", Some("3.5 of \"red\"")),
        (diffuse, "diffuse = { texture = 'dark' }", None),
        (specular, "specular = { texture = 'spots' }", Some("3 of \"red\"")),
    ] {
        let text = with(line, changed);
        let told: Vec<String> = told.map(|told| format!("{RULE}{told}")).into_iter().collect();
        assert_eq!(notes(&text), told, "{changed}");
    }
    // Many are one note.
    let materials: String = (0..10)
        .map(|i| format!("[materials.m{i}]\ntype = 'phong'\ncolor = [0.{i}, 0.8, 0]\n"))
        .collect();
    let told = notes(&GOOD.replace("[materials.clay]", &format!("{materials}[materials.clay]")));
    let names: Vec<String> = (0..8).map(|i| format!("1.6 of \"m{i}\"")).collect();
    assert_eq!(told, [format!("{RULE}{} and 2 more", names.join(", "))]);
}

/// What code says is what a file says.
#[test]
fn descriptions_made_in_code_are_read_back() {
    let mut clay = DiffuseDescription::new([0.5, 0.4, 0.3]);
    clay.roughness = ValueDescription::texture("spots");
    clay.emission = Some(ColorDescription::texture("spots"));
    let mut wine = DielectricDescription::new(1.34);
    wine.absorption = DVec3::new(0.0, 2.0, 3.0);
    let texture = CheckerDescription::new([0.0; 3], [1.0; 3]);
    let mut description = Description::new(4, 3, PerspectiveDescription::new([0.0, -3.0, 1.0], [0.0; 3], 40.0))
        .with_environment(EnvironmentDescription::new([0.1, 0.2, 0.3]))
        .with_texture("spots", texture)
        .with_material("clay", clay)
        .with_material("gold", ConductorDescription::new([1.0, 0.8, 0.3]))
        .with_material("wine", wine);
    description.render.integrator = Integrator::Path;
    description.render.rr_depth = Some(3);
    description.render.clamp = Some(2.5);
    description.render.alpha = Some(true);
    description.render.pixel_samples = SamplesDescription::new(7);
    let text = toml::to_string(&description).unwrap();
    assert_eq!(Description::parse(&text, "s.toml").unwrap(), description, "{text}");
    let scene = description.validate().unwrap();
    assert_eq!(scene, Scene::parse(&text, "s.toml").unwrap());
    assert_eq!(
        scene.render.pixel_samples,
        Samples {
            pattern: Pattern::Sobol,
            count: 7
        }
    );
    description.render.integrator = Integrator::Phong;
    let told = description.validate().unwrap_err().to_string();
    assert_eq!(told, "materials.clay.type: \"diffuse\" needs integrator = \"path\"");
}
