//! Tests of scenes for the path tracer, and of keys that only one integrator supports.

mod messages;
mod notes;

use glam::DVec3;

use super::super::super::{
    Channel, CheckerDescription, Color, ColorDescription, ConductorDescription, Description, DielectricDescription,
    DiffuseDescription, Environment, EnvironmentDescription, Facets, Integrator, Material, MetalIndex, Overrides,
    Pattern, PerspectiveDescription, Reflection, Samples, SamplesDescription, Scene, SceneError, Shadows, Value,
    ValueDescription,
};

/// A scene with all features. Each line is unique, so that tests can replace it.
const VALID: &str = r#"
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

fn with_line(line: &str, changed: &str) -> String {
    let line = format!("\n{line}\n");
    assert_eq!(VALID.matches(&line).count(), 1, "{line}");
    VALID.replace(&line, &format!("\n{changed}\n"))
}

fn plain(r: f64, g: f64, b: f64) -> Color {
    Color::Plain(DVec3::new(r, g, b))
}

#[test]
fn a_path_tracer_scene_has_the_values_of_its_file() {
    let scene = parse(VALID).unwrap();
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
            visible: true,
            background: None,
        })
    );
    assert_eq!(render.background, color);
    let material = |name: &str| {
        let i = scene
            .material_names
            .iter()
            .position(|material_name| material_name == name)
            .unwrap();
        scene.materials[i].clone()
    };
    let expected = |reflection, emission| Material {
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
        assert_eq!(material(name), expected(reflection, emission), "{name}");
    }
}

#[test]
fn metals_have_an_index_of_refraction_by_name_or_by_numbers() {
    let silver = "color = [0.9, 0.9, 0.8]";
    let conductor = |text: &str| {
        let scene = parse(&with_line(silver, text)).unwrap();
        let silver_index = scene.material_names.iter().position(|name| name == "silver").unwrap();
        match &scene.materials[silver_index].reflection {
            Reflection::Conductor { color, index, facets } => (*color, *index, *facets),
            other => panic!("{other:?}"),
        }
    };
    let (color, no_index, facets) = conductor(silver);
    assert_eq!((no_index, facets), (None, Facets::default()));
    assert_eq!(color, Color::Plain(DVec3::new(0.9, 0.9, 0.8)));
    let keys = "eta = [1, 2, 3]\nk = [0, 5, 100]\nroughness = 0.5\nanisotropy = 1\nanisotropy_rotation = -90\n\
                energy_compensation = false";
    let (color, metal, facets) = conductor(keys);
    let metal = metal.unwrap();
    assert_eq!(
        (metal.eta, metal.k),
        (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 5.0, 100.0))
    );
    assert_eq!(color, Color::Plain(DVec3::ONE));
    let found = (facets.roughness, facets.anisotropy, facets.rotation, facets.compensated);
    assert_eq!(found, (Value::Plain(0.5), 1.0, -90.0, false));
    // The page lists all metals.
    let page = include_str!("../../../../../docs/scene-format.md");
    for name in MetalIndex::names() {
        let (_, found, _) = conductor(&format!("metal = '{name}'"));
        assert_eq!(found, MetalIndex::named(name));
        assert!(page.contains(&format!("`\"{name}\"`")), "{name}");
    }
    for (key, missing_key) in [("eta", "k"), ("k", "eta")] {
        let message = parse(&with_line(silver, &format!("{key} = [1, 1, 1]")))
            .unwrap_err()
            .to_string();
        assert!(
            message.ends_with(&format!("materials.silver.{missing_key} is missing; {key} needs it")),
            "{message}"
        );
    }
    let unknown = parse(&with_line(silver, "metal = 'bronze'")).unwrap_err().to_string();
    assert!(
        unknown.contains("materials.silver.metal: \"bronze\" must be one of \"aluminium\", "),
        "{unknown}"
    );
}

#[test]
fn absent_keys_have_defaults() {
    let absent = [
        "max_depth = 3",
        "rr_depth = 2",
        "clamp = 10",
        "alpha = true",
        "pixel_samples = { count = 5 }",
    ];
    let text = absent
        .iter()
        .fold(VALID.to_owned(), |text, line| text.replace(line, ""));
    let render = parse(&text).unwrap().render;
    assert_eq!(
        (render.max_depth, render.rr_depth, render.clamp, render.alpha),
        (8, 5, None, false)
    );
    let samples = |pattern, count| Samples { pattern, count };
    assert_eq!(render.pixel_samples, samples(Pattern::Sobol, 16));
    // The default pattern depends on the integrator.
    for (integrator, key, pattern) in [
        ("path", "", Pattern::Sobol),
        ("phong", "", Pattern::Grid),
        ("path", "pattern = 'grid',", Pattern::Grid),
        ("phong", "pattern = 'sobol',", Pattern::Sobol),
    ] {
        let text = format!(
            "image = {{ width = 1, height = 1 }}\ncamera = {{ position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }}\n\
             [render]\nintegrator = '{integrator}'\npixel_samples = {{ {key} count = 9 }}\n"
        );
        let render = parse(&text).unwrap().render;
        assert_eq!(render.pixel_samples, samples(pattern, 9), "{integrator}");
    }
    // The default pattern of the path tracer supports adaptive sampling.
    parse(&with_line("clamp = 10", "adaptive = { error = 0.01 }")).unwrap();
}

#[test]
fn the_background_becomes_the_environment() {
    let environment = "[environment]\ncolor = [0.5, 0.25, 0]";
    let dark = parse(&with_line(environment, "")).unwrap();
    assert_eq!((dark.render.background, dark.environment), (DVec3::ZERO, None));
    let text = with_line(environment, "").replace("[render]", "[render]\nbackground = [0.1, 0.2, 0.3]");
    let scene = parse(&text).unwrap();
    let color = DVec3::new(0.1, 0.2, 0.3);
    assert_eq!(scene.render.background, color);
    assert_eq!(
        scene.environment,
        Some(Environment {
            color,
            image: None,
            visible: true,
            background: None,
        })
    );
    // A black background has no effect.
    let text = VALID.replace("[render]", "[render]\nbackground = [0, 0, 0]");
    assert_eq!(parse(&text).unwrap(), parse(VALID).unwrap());
    let black = parse(&with_line("color = [0.5, 0.25, 0]", "color = [0, 0, 0]")).unwrap();
    assert_eq!(black.environment, None);
    // The Phong integrator only has a background.
    let text = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n\
                render = { background = [1, 1, 1] }\n";
    let scene = parse(text).unwrap();
    assert_eq!((scene.render.background, scene.environment), (DVec3::ONE, None));
}

#[test]
fn serialized_descriptions_parse_to_the_same_scene() {
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
    description.render.integrator = Some(Integrator::Path);
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
    description.render.integrator = Some(Integrator::Phong);
    let message = description.validate().unwrap_err().to_string();
    assert_eq!(message, "render.rr_depth: needs integrator = \"path\"");
}
