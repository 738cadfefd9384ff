//! Tests of scenes in the JSON format of the course: their conversion, and error messages.

use std::fs;

use tempfile::TempDir;

use super::*;
use crate::{
    Color, Facets, Geometry, Light, Material, Overrides, Parallelogram, Pattern, Projection, Reflection, Samples,
    Scene, Value,
};

/// A valid file, one key per line.
const VALID: &str = r#"{
  "spp": 256,
  "max_depth": 10,
  "image_resolution": [600, 600],
  "cam_config": {
    "position": [0, 1, 6.8],
    "look_at": [0, 1, 0],
    "ref_up": [0, 1, 0],
    "vertical_fov": 19.5,
    "focal_length": 1
  },
  "light_config": {
    "position": [0, 1.98, 0],
    "size": [0.5, 0.25],
    "radiance": [17, 12, 5]
  },
  "materials": [
    {"name": "grey", "type": "diffuse", "color": [0.725, 0.71, 0.68]},
    {"name": "red", "type": "diffuse", "color": [0.63, 0.065, 0.05]},
    {"name": "a mirror", "type": "specular", "color": [1, 0.9, 0.8]}
  ],
  "objects": [
    {"obj_file_path": "../assets/floor.obj", "material_name": "grey", "translate": [0, 0, 0], "scale": 1, "has_bvh": false},
    {"obj_file_path": "../assets/left.obj", "material_name": "red", "translate": [0, 0, 0], "scale": 1, "has_bvh": false},
    {
      "obj_file_path": "../assets/tall.obj",
      "material_name": "a mirror",
      "translate": [0.7, 0, -0.5],
      "scale": 0.5,
      "has_bvh": true
    }
  ]
}
"#;

const FLOOR: &str = "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";
const LEFT_WALL: &str = "v -1 0 -1\nv -1 2 -1\nv -1 2 1\nv -1 0 1\nf 1 2 3 4\n";

/// The mesh of a tall box, whose corners have the x and z coordinates of a box in the course's scene.
fn tall_box() -> String {
    let corners = [
        (-0.720444, 0.473882),
        (-0.146892, 0.673479),
        (0.0495656, 0.108948),
        (-0.523986, -0.0906493),
    ];
    let mut text = String::new();
    for y in [0.0, 1.2] {
        for (x, z) in corners {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text + "f 5 6 7 8\nf 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    fs::create_dir(folder.path().join("configs")).unwrap();
    fs::create_dir(folder.path().join("assets")).unwrap();
    write("assets/floor.obj", FLOOR);
    write("assets/left.obj", LEFT_WALL);
    write("assets/tall.obj", &tall_box());
    folder
}

/// Writes a text to a file in the folder `configs`, and loads the file.
fn load(name: &str, text: &str, overrides: &Overrides) -> Result<Scene, SceneError> {
    let folder = folder();
    let path = folder.path().join("configs").join(name);
    fs::write(&path, text).unwrap();
    Scene::load_with(&path, overrides)
}

fn near(a: DVec3, b: DVec3) -> bool {
    a.distance(b) < 1e-6
}

fn extent(scene: &Scene, shape: usize) -> (DVec3, DVec3) {
    let Geometry::Mesh { mesh, to_world, .. } = &scene.shapes[shape].geometry else {
        panic!("shape {shape} is not a mesh: {:?}", scene.shapes[shape]);
    };
    let world = |p: &glam::Vec3| to_world.transform_point3(mesh.center + p.as_dvec3());
    let low = mesh.positions.iter().map(world).reduce(DVec3::min).unwrap();
    let high = mesh.positions.iter().map(world).reduce(DVec3::max).unwrap();
    ((low + high) / 2.0, (high - low) / 2.0)
}

#[test]
fn a_course_file_is_loaded_as_a_scene_with_z_up() {
    let scene = load("cornell.json", VALID, &Overrides::default()).unwrap();
    assert_eq!((scene.width, scene.height), (600, 600));
    assert_eq!(scene.notes, Vec::<String>::new());
    let camera = scene.camera;
    assert_eq!(camera.position, DVec3::new(0.0, -6.8, 1.0));
    assert_eq!(camera.look_at, DVec3::new(0.0, 0.0, 1.0));
    assert_eq!((camera.right, camera.up), (DVec3::X, DVec3::Z));
    assert_eq!(
        camera.projection,
        Projection::Perspective {
            fov: 19.5_f64.to_radians()
        }
    );
    let samples = |pattern, count| Samples { pattern, count };
    assert_eq!(scene.render.integrator, Integrator::Path);
    assert_eq!(scene.render.pixel_samples, samples(Pattern::Sobol, 256));
    assert_eq!(scene.render.max_depth, 10);
    assert_eq!((scene.render.background, &scene.environment), (DVec3::ZERO, &None));

    let [Light::Rectangle { rectangle, color, .. }] = &scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    let Parallelogram { center, u, v } = rectangle;
    assert_eq!(*center, DVec3::new(0.0, 0.0, 1.98));
    assert_eq!((*u, v.abs()), (DVec3::X * 0.25, DVec3::Y * 0.125));
    assert!(near(u.cross(*v).normalize(), DVec3::NEG_Z));
    assert_eq!(*color, DVec3::new(17.0, 12.0, 5.0));

    // The materials are sorted by name: a mirror, grey, red.
    let plain = |r, g, b| Color::Plain(DVec3::new(r, g, b));
    let material = |reflection| Material {
        reflection,
        emission: Color::BLACK,
        visible: true,
        normal_map: None,
    };
    let mirror = Reflection::Conductor {
        color: plain(1.0, 0.9, 0.8),
        index: None,
        facets: Facets::default(),
    };
    let red = Reflection::Diffuse {
        color: plain(0.63, 0.065, 0.05),
        roughness: Value::Plain(0.0),
    };
    assert_eq!(scene.materials[0], material(mirror));
    assert_eq!(scene.materials[2], material(red));
    let materials: Vec<usize> = scene.shapes.iter().map(|shape| shape.material).collect();
    assert_eq!(materials, [1, 2, 0]);
    assert_eq!(extent(&scene, 0), (DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)));
    assert_eq!(
        extent(&scene, 1),
        (DVec3::new(-1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 1.0))
    );
    // Scaled by 0.5, then translated by (0.7, 0, -0.5): 0.5 farther from the camera.
    let (middle, half) = extent(&scene, 2);
    let (low, high) = ((-0.720444, -0.0906493), (0.0495656, 0.673479));
    let expected = DVec3::new((low.0 + high.0) / 4.0 + 0.7, -(low.1 + high.1) / 4.0 + 0.5, 0.3);
    assert!(near(middle, expected), "{middle} {expected}");
    assert!(
        near(half, DVec3::new((high.0 - low.0) / 4.0, (high.1 - low.1) / 4.0, 0.3)),
        "{half}"
    );
}

#[test]
fn spp_and_max_depth_may_have_any_value_in_range() {
    // The limits of both ranges, and a number of samples that is not a square number.
    for (spp, max_depth) in [(1, 0), (200, 12), (65_536, 1024)] {
        let text = VALID
            .replace("\"spp\": 256", &format!("\"spp\": {spp}"))
            .replace("\"max_depth\": 10", &format!("\"max_depth\": {max_depth}"));
        let render = load("a.json", &text, &Overrides::default()).unwrap().render;
        assert_eq!((render.pixel_samples.count, render.max_depth), (spp, max_depth));
    }
}

#[test]
fn a_camera_has_the_same_view_in_both_coordinate_systems() {
    // The axes of the loaded camera must equal the converted axes of the camera in the file.
    let in_file = camera(&Camera {
        position: DVec3::new(1.0, 2.0, 3.0),
        look_at: DVec3::new(-1.0, 0.5, 0.25),
        ref_up: DVec3::new(0.1, 1.0, 0.2),
        vertical_fov: 30.0,
        focal_length: 1.0,
    });
    let before = in_file.validate().unwrap();
    let text = VALID
        .replace("\"position\": [0, 1, 6.8]", "\"position\": [1, 2, 3]")
        .replace("\"look_at\": [0, 1, 0]", "\"look_at\": [-1, 0.5, 0.25]")
        .replace("\"ref_up\": [0, 1, 0]", "\"ref_up\": [0.1, 1, 0.2]");
    let after = load("a.json", &text, &Overrides::default()).unwrap().camera;
    assert!(near(to_z_up(before.right), after.right));
    assert!(near(to_z_up(before.up), after.up));
    assert!(near(to_z_up(before.forward), after.forward));
    assert!(near(to_z_up(DVec3::X).cross(to_z_up(DVec3::Y)), to_z_up(DVec3::Z)));
}

#[test]
fn the_extension_json_may_be_in_any_case() {
    for name in ["a.JSON", "b.Json", "c.toml.json"] {
        assert_eq!(load(name, VALID, &Overrides::default()).unwrap().shapes.len(), 3);
    }
    for name in ["a.toml", "json"] {
        let message = load(name, VALID, &Overrides::default()).unwrap_err().to_string();
        assert!(message.contains(&format!("{name}:1:1: ")), "{message}");
    }
}

#[test]
fn optional_keys_have_defaults() {
    let text = VALID
        .replace(",\n    \"focal_length\": 1", "")
        .replace(", \"translate\": [0, 0, 0], \"scale\": 1, \"has_bvh\": false", "");
    assert!(text.len() + 100 < VALID.len());
    let complete = load("a.json", VALID, &Overrides::default()).unwrap();
    let scene = load("a.json", &text, &Overrides::default()).unwrap();
    assert_eq!((scene.camera, &scene.shapes), (complete.camera, &complete.shapes));
}

#[test]
fn overrides_replace_values_of_the_file() {
    let overrides = Overrides {
        size: Some((30, 20)),
        pixel_samples: Some(5),
        pixel_pattern: Some(Pattern::Sobol),
        light_samples: Some(3),
        seed: Some(7),
        ..Overrides::default()
    };
    let scene = load("a.json", VALID, &overrides).unwrap();
    let render = scene.render;
    assert_eq!((scene.width, scene.height, render.seed), (30, 20, 7));
    assert_eq!((render.pixel_samples.count, render.light_samples.count), (5, 3));
    let refused = |overrides: &Overrides| load("a.json", VALID, overrides).unwrap_err().to_string();
    let overrides = Overrides {
        pixel_samples: Some(5),
        pixel_pattern: Some(Pattern::Grid),
        ..Overrides::default()
    };
    assert_eq!(
        refused(&overrides),
        "pixel_samples: 5 must be a square number, such as 4 or 9: the pattern \"grid\" is an n x n grid; other patterns take any number"
    );
    let overrides = |integrator, max_depth| Overrides {
        integrator,
        max_depth,
        ..Overrides::default()
    };
    let scene = load("a.json", VALID, &overrides(None, Some(0))).unwrap();
    assert_eq!(scene.render.max_depth, 0);
    assert_eq!(
        refused(&overrides(None, Some(1025))),
        "max_depth: 1025 must be from 0 to 1024"
    );
    // The materials need the path tracer.
    let message = refused(&overrides(Some(Integrator::Phong), None));
    let rule = "a.json:20: materials[2].type: \"specular\" needs integrator = \"path\"";
    assert!(message.ends_with(rule), "{message}");
    let diffuse = VALID.replace("specular", "diffuse");
    let message = load("a.json", &diffuse, &overrides(Some(Integrator::Phong), None)).unwrap_err();
    let rule = ":20: materials[2].type: \"diffuse\" needs integrator = \"path\"";
    assert!(message.to_string().ends_with(rule), "{message}");
}

#[test]
fn all_errors_are_reported() {
    let errors = |changes: &[(&str, &str)]| {
        let change = |text: String, (from, to): &(&str, &str)| text.replacen(from, to, 1);
        let text = changes.iter().fold(VALID.to_owned(), change);
        let error = load("a.json", &text, &Overrides::default()).unwrap_err();
        let lines = error
            .each()
            .0
            .iter()
            .map(|error| error.place().line.unwrap_or_default());
        lines.collect::<Vec<_>>()
    };
    // Invalid keys and types, including a key within an object.
    let types = [
        ("256", "\"many\""),
        ("[0, 1, 6.8]", "[0, 1]"),
        ("19.5", "\"wide\""),
        ("\"size\"", "\"sizes\""),
    ];
    assert_eq!(errors(&types), [2, 6, 9, 14]);
    let ranges = [("19.5", "200"), ("[0.5, 0.25]", "[0, -1]"), ("\"red\"", "\"grey\"")];
    assert_eq!(errors(&ranges), [9, 14, 19]);
}

#[test]
fn defines_use_the_keys_of_the_file() {
    let load = |define: &str| {
        let overrides = Overrides {
            define: vec![define.parse().unwrap()],
            ..Overrides::default()
        };
        load("a.json", VALID, &overrides)
    };
    let scene = load("spp=5").unwrap();
    assert_eq!(scene.render.pixel_samples.count, 5);
    let scene = load("cam_config.position[1]=-3.5").unwrap();
    assert_eq!(scene.camera.position.z, -3.5, "+Y is up in the file");
    for (define, expected) in [
        ("spp=0", "define.spp: 0 must be from 1 to 65536"),
        ("spp=many", "define.spp: \"many\" must be a whole number"),
        ("render.seed=3", "define.render: unknown key; expected one of \"spp\""),
        ("cam_config.fov=3", "define.cam_config.fov: unknown key"),
        (
            "cam_config.vertical_fov=180",
            "define.cam_config.vertical_fov: 180 must be from",
        ),
        ("materials[0].color=[2, 0, 0]", "define.materials[0].color: "),
        (
            "materials[9].color=[2, 0, 0]",
            "define.materials[9]: does not exist; the length of the list is 3, and indices start at 0",
        ),
        (
            "materials.first.color=[2, 0, 0]",
            "define.materials: is a list; add the index",
        ),
        ("objects[0].scale=0", "define.objects[0].scale: "),
    ] {
        let message = load(define).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{define}: {message}");
    }
}

#[test]
fn meshes_must_be_in_the_parent_folder_or_the_asset_root() {
    let folder = folder();
    let configs = folder.path().join("configs");
    let path = configs.join("a.json");
    fs::write(&path, VALID).unwrap();
    let load_within = |root: &Path| {
        let overrides = Overrides {
            asset_root: Some(root.to_owned()),
            ..Overrides::default()
        };
        Scene::load_with(&path, &overrides).map_err(|error| error.to_string())
    };
    Scene::load(&path).unwrap();
    load_within(&folder.path().join("assets")).unwrap();
    let message = load_within(&configs).unwrap_err();
    assert!(
        message.contains(":23: objects[0].obj_file_path: \"../assets/floor.obj\" lies outside of the scene's folder"),
        "{message}"
    );
    fs::write(&path, VALID.replace("../assets", "../../assets")).unwrap();
    let message = Scene::load(&path).unwrap_err().to_string();
    assert!(
        message.contains(":23: objects[0].obj_file_path: \"../../assets/floor.obj\" "),
        "{message}"
    );
}

/// Valid fragment, invalid replacement, and the message from the line number on.
const INVALID: &[(&str, &str, &str)] = &[
    // The replacement is not valid JSON.
    ("\"spp\": 256,", "\"spp\": 256", "3:3: expected \",\" or \"}\""),
    ("\"spp\": 256,", "\"spp\": NaN,", "2:10: spp: expected value"),
    (
        "[0.5, 0.25]",
        "[0.5, 0.25,]",
        "14:24: light_config.size: trailing comma",
    ),
    ("\"spp\": 256,", "\"spp\": null,", "2:13: spp: invalid type: null"),
    (
        "\"spp\": 256,",
        "\"spp\": 256, \"spp\": 16,",
        "2:19: duplicate key: \"spp\"",
    ),
    (
        "\"has_bvh\": true\n    }\n  ]\n}",
        "\"has_bvh\": true\n    }\n  ]\n} {",
        "33:3: trailing characters",
    ),
    // Unknown and missing keys, and values of the wrong type.
    (
        "\"spp\": 256,",
        "\"spp\": 256, \"SPP\": 16,",
        "2:22: SPP: unknown key; did you mean \"spp\"?",
    ),
    ("  \"spp\": 256,\n", "", "1:1: spp is missing"),
    (
        "\"vertical_fov\": 19.5,\n    ",
        "\"é\": 19.5,\n    ",
        "9:10: cam_config.\"é\": unknown key",
    ),
    (
        "\"vertical_fov\": 19.5,\n",
        "",
        "5:17: cam_config.vertical_fov is missing",
    ),
    (
        "\"spp\": 256",
        "\"spp\": 256.5",
        "2:10: spp: 256.5 must be a whole number from 1 to 65536",
    ),
    (
        "\"spp\": 256",
        "\"spp\": \"256\"",
        "2:10: spp: \"256\" must be a whole number from 1 to 65536",
    ),
    (
        "\"max_depth\": 10",
        "\"max_depth\": -1",
        "3:16: max_depth: -1 must be a whole number from 0 to 1024",
    ),
    (
        "[600, 600]",
        "[600]",
        "4:23: image_resolution: [600] must be a list of 2 numbers",
    ),
    (
        "[600, 600]",
        "{\"x\": 3}",
        "4:23: image_resolution: {\"x\": 3} must be a list of 2 numbers",
    ),
    (
        "[0, 1, 6.8]",
        "[0, \"1\", 6.8]",
        "6:21: cam_config.position[1]: \"1\" must be a number",
    ),
    (
        "[0, 1, 6.8]",
        "[0, 1]",
        "6:17: cam_config.position: [0, 1] must be a list of 3 numbers",
    ),
    (
        "\"specular\"",
        "\"glass\"",
        "20:34: materials[2].type: \"glass\" must be \"diffuse\" or \"specular\"",
    ),
    (
        "\"scale\": 0.5",
        "\"size\": 0.5",
        "29:15: objects[2].size: unknown key; expected one of \"obj_file_path\", \"material_name\", \"translate\", \
         \"scale\", \"has_bvh\"",
    ),
    ("\"has_bvh\": true", "\"has_bvh\": 1", "30:18: objects[2].has_bvh: "),
    // Values out of range, repeated names, and references to missing materials and files.
    ("\"spp\": 256", "\"spp\": 0", "2: spp: 0 must be from 1 to 65536"),
    (
        "\"max_depth\": 10",
        "\"max_depth\": 1025",
        "3: max_depth: 1025 must be from 0 to 1024",
    ),
    (
        "[600, 600]",
        "[600, 0]",
        "4: image_resolution[1]: 0 must be from 1 to 65536",
    ),
    (
        "19.5",
        "180",
        "9: cam_config.vertical_fov: 180 must be from 0.001 to 179.999",
    ),
    (
        "\"ref_up\": [0, 1, 0]",
        "\"ref_up\": [0, 0, 2]",
        "7: cam_config.look_at: [0, 1, 0] makes the view parallel to up, [0, 0, 1]",
    ),
    (
        "\"ref_up\": [0, 1, 0]",
        "\"ref_up\": [0, 0, 0]",
        "8: cam_config.ref_up: [0, 0, 0] must not be zero: its length must be at least 1e-9",
    ),
    (
        "[0, 1, 6.8]",
        "[0, 1, 2e9]",
        "6: cam_config.position: 2e9 must be from -1e9 to 1e9",
    ),
    (
        "[0, 1.98, 0]",
        "[0, 2e9, 0]",
        "13: light_config.position: 2e9 must be from -1e9 to 1e9",
    ),
    (
        "[0.5, 0.25]",
        "[0.5, -1]",
        "14: light_config.size: -1 must be from 1e-9 to 1e9",
    ),
    (
        "[17, 12, 5]",
        "[17, -12, 5]",
        "15: light_config.radiance: -12 must be from 0 to 1e6",
    ),
    (
        "[0.63, 0.065, 0.05]",
        "[0.63, 0.065, -1]",
        "19: materials[1].color: -1 must be from 0 to 1",
    ),
    (
        "[1, 0.9, 0.8]",
        "[1, 2, 0.8]",
        "20: materials[2].color: 2 must be from 0 to 1",
    ),
    (
        "\"name\": \"red\"",
        "\"name\": \"grey\"",
        "19: materials[1].name: \"grey\" is defined twice, first in materials[0]",
    ),
    (
        "\"material_name\": \"red\"",
        "\"material_name\": \"blue\"",
        "24: objects[1].material_name: there is no material \"blue\"; the scene has \"a mirror\", \"grey\", \"red\"",
    ),
    (
        "[0.7, 0, -0.5]",
        "[0.7, 0, -2e9]",
        "28: objects[2].translate: -2e9 must be from -1e9 to 1e9",
    ),
    (
        "\"scale\": 0.5",
        "\"scale\": 0",
        "29: objects[2].scale: 0 must be from 1e-6 to 1e6, or from -1e6 to -1e-6",
    ),
    (
        "../assets/tall.obj",
        "../assets/dragon.obj",
        "26: objects[2].obj_file_path: \"../assets/dragon.obj\" cannot be read: ",
    ),
];

#[test]
fn invalid_files_are_reported_with_location_key_value_and_rule() {
    for (fragment, invalid, expected) in INVALID {
        assert_eq!(VALID.matches(fragment).count(), 1, "{fragment}");
        let text = VALID.replace(fragment, invalid);
        let error = load("a.json", &text, &Overrides::default()).unwrap_err().to_string();
        let (_, rest) = error.split_once("a.json:").unwrap();
        assert!(rest.starts_with(expected), "{rest}\n{expected}");
        assert_eq!(rest.lines().count(), 1);
    }
}

const PAGE: &str = include_str!("../../../../docs/scene-format.md");

#[test]
fn the_documentation_has_every_key_and_a_valid_example() {
    let (_, section) = PAGE.split_once("\n## Scenes in JSON\n").unwrap();
    let example = section.split("```json\n").nth(1).unwrap().split("```").next().unwrap();
    Description::parse(example, "page.json").unwrap();
    let rows = section
        .lines()
        .filter_map(|line| Some(line.strip_prefix("| `")?.split_once('`')?.0));
    let mut rows: Vec<&str> = rows.collect();
    let mut keys = Vec::new();
    for (prefix, next_key) in [
        ("", "\"spp\""),
        ("cam_config.", "\"ref_up\""),
        ("light_config.", "\"radiance\""),
        ("materials[].", "\"name\": \"red\""),
        ("objects[].", "\"has_bvh\": true"),
    ] {
        let text = VALID.replace(next_key, &format!("\"?\": 1, {next_key}"));
        let message = Description::parse(&text, "a.json").unwrap_err().to_string();
        let (_, names) = message.split_once("expected one of ").unwrap();
        keys.extend(
            names
                .split(", ")
                .map(|name| format!("{prefix}{}", name.trim_matches('"'))),
        );
    }
    rows.sort_unstable();
    keys.sort_unstable();
    assert_eq!(rows, keys);
}

#[test]
fn any_prefix_of_a_file_is_refused_with_a_location() {
    for end in 0..VALID.trim_end().len() {
        let error = Scene::parse(&VALID[..end], "a.json").unwrap_err();
        assert!(matches!(error, SceneError::Syntax { .. }), "{end}: {error}");
    }
    for text in ["3", "[]", "null", "\"\"", "{}"] {
        let message = Scene::parse(text, "a.json").unwrap_err().to_string();
        assert!(message.starts_with("a.json:1:"), "{message}");
    }
    let deep = "[".repeat(100_000);
    let message = Scene::parse(&deep, "a.json").unwrap_err().to_string();
    assert!(message.contains("at most 127 levels deep"), "{message}");
    let large = " ".repeat(MAX_FILE_BYTES + 1);
    let message = Scene::parse(&large, "a.json").unwrap_err().to_string();
    assert_eq!(message, "a.json:1:1: a JSON scene must not be larger than 4 MiB");
}
