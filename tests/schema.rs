//! The JSON Schema of scene files and the program accept the same files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::OnceLock;

use jsonschema::Validator;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use rayon::prelude::*;
use serde_json::Value as Json;
use toml::{Table, Value};
use wgray::scene::{Assets, Description};

use crate::random_scenes::any_scene;
use crate::sources::path as project;

const PAGE: &str = include_str!("../docs/scene-format.md");

fn schema() -> &'static Json {
    static SCHEMA: OnceLock<Json> = OnceLock::new();
    SCHEMA.get_or_init(|| serde_json::from_str(&wgray::scene::schema()).expect("JSON"))
}

fn validator() -> &'static Validator {
    static VALIDATOR: OnceLock<Validator> = OnceLock::new();
    VALIDATOR.get_or_init(|| jsonschema::draft202012::new(schema()).expect("a valid schema"))
}

fn matches_schema(scene: &Table) -> bool {
    validator().is_valid(&serde_json::to_value(scene).expect("JSON"))
}

fn load(scene: &Table, folder: &Path) -> Result<(), String> {
    let text = toml::to_string(scene).expect("TOML");
    let description = Description::parse(&text, "s.toml").map_err(|error| error.to_string())?;
    let checked = description.validate_with(&Assets::beside(folder));
    checked.map(|_| ()).map_err(|problem| problem.to_string())
}

/// Scenes that together use every key.
const SCENES: [&str; 4] = [
    r#"
[image]
width = 8
height = 6
view_transform = "agx"
exposure = 0.5
[camera]
type = "perspective"
position = [0, -5, 1]
look_at = [0, 0, 1]
up = [0, 0, 1]
fov = 40
focal_length = 0.05
aperture = 0.1
focus_distance = 4
blades = 6
blade_rotation = 20
path = { interpolation = "smooth", keys = [
    { frame = 1, position = [0, -5, 1], look_at = [0, 0, 1], up = [0, 0, 1], fov = 40, aperture = 0.1, focus_distance = 4 },
    { frame = 9, fov = 30 },
] }
[render]
integrator = "path"
ambient = [0, 0, 0]
background = [0, 0, 0]
shadow_epsilon = 0.001
shadows = "opaque"
max_depth = 4
rr_depth = 2
clamp = 3
alpha = true
ray_differentials = true
denoise = true
seed = 7
pixel_samples = { pattern = "sobol", count = 4 }
light_samples = { pattern = "random", count = 4 }
filter = { type = "gaussian", radius = 1.5 }
adaptive = { error = 0.01, max_samples = 64 }
[environment]
color = [1, 1, 1]
scale = 2
rotate = { axis = [0, 0, 1], degrees = 30 }
visible = true
background = [0, 0, 1]
[textures.one]
type = "constant"
color = [1, 0, 0]
[textures.two]
type = "checker"
even = [1, 1, 1]
odd = [0, 0, 0]
scale = [4, -4]
rotate = 20
offset = [0.5, 0]
[textures.three]
type = "grid"
cell = [1, 1, 1]
line = [0, 0, 0]
line_width = 0.1
scale = [4, 4]
rotate = 20
offset = [0.5, 0]
[textures.four]
type = "image"
file = "odd.exr"
encoding = "linear"
wrap = ["repeat", "clamp"]
filter = "trilinear"
max_anisotropy = 4
scale = [4, 4]
rotate = 20
offset = [0.5, 0]
factor = [1, 1, 1, 1]
uv_set = 0
[textures.five]
type = "image"
file = "dot.exr"
wrap = "mirror"
[materials.phong]
type = "phong"
color = [0.5, 0.5, 0.5]
ambient = [0.5, 0.5, 0.5]
diffuse = { texture = "two" }
specular = [0.5, 0.5, 0.5]
shininess = 8
normal_map = { texture = "five", strength = 0.5 }
emission = [0, 0, 0]
visible = true
[materials.mirror]
type = "mirror"
tint = { texture = "one" }
normal_map = { texture = "five" }
emission = [0, 0, 0]
visible = true
[materials.glass]
type = "glass"
ior = 1.5
tint = [1, 1, 1]
normal_map = { texture = "five" }
emission = [0, 0, 0]
visible = true
[materials.diffuse]
type = "diffuse"
color = [0.5, 0.5, 0.5]
roughness = { texture = "two", channel = "g" }
normal_map = { texture = "five" }
emission = { texture = "one" }
visible = true
[materials.metal]
type = "conductor"
color = [0.5, 0.5, 0.5]
roughness = 0.2
anisotropy = 0.5
anisotropy_rotation = 20
energy_compensation = true
normal_map = { texture = "five" }
emission = [0, 0, 0]
visible = true
[materials.gold]
type = "conductor"
metal = "gold"
[materials.other]
type = "conductor"
eta = [1, 1, 1]
k = [2, 2, 2]
[materials.water]
type = "dielectric"
ior = 1.3
color = [1, 1, 1]
absorption = [0.1, 0.1, 0.1]
thin = false
roughness = 0.2
anisotropy = 0.5
anisotropy_rotation = 20
energy_compensation = true
normal_map = { texture = "five" }
emission = [0, 0, 0]
visible = true
[materials.all]
type = "principled"
base_color = [0.5, 0.5, 0.5]
metallic = 0.5
roughness = 0.5
anisotropy = 0.5
anisotropy_rotation = 20
anisotropy_direction = { texture = "five" }
ior = 1.5
specular = 0.5
specular_color = [1, 1, 1]
transmission = 0.5
thickness = 1
attenuation_color = [0.5, 0.5, 0.5]
attenuation_distance = 2
clearcoat = 0.5
clearcoat_roughness = 0.5
clearcoat_normal_map = { texture = "five" }
sheen_color = [0.5, 0.5, 0.5]
sheen_roughness = 0.5
alpha = 0.5
alpha_mode = "mask"
alpha_cutoff = 0.5
vertex_colors = "base_color"
double_sided = true
normal_map = { texture = "five" }
emission = [0, 0, 0]
visible = true
[[lights]]
type = "rectangle"
center = [0, 0, 4]
size = [1, 1]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [1, 1, 1]
visible = true
[[lights]]
type = "point"
position = [0, 0, 4]
color = [1, 1, 1]
[[lights]]
type = "directional"
direction = [0, 0, -1]
color = [1, 1, 1]
[[lights]]
type = "spot"
position = [0, 0, 4]
direction = [0, 0, -1]
color = [1, 1, 1]
cone_angle = 30
inner_angle = 10
[[shapes]]
type = "rectangle"
material = "phong"
center = [0, 0, 1]
size = [1, 1]
normal = [0, 0, 1]
tangent = [1, 0, 0]
[[shapes]]
type = "disk"
material = "mirror"
center = [0, 0, 1]
radius = 1
normal = [0, 0, 1]
tangent = [1, 0, 0]
[[shapes]]
type = "ellipsoid"
material = "glass"
center = [0, 0, 1]
a = [1, 0, 0]
b = [0, 1, 0]
c = [0, 0, 2]
[[shapes]]
type = "sphere"
material = "diffuse"
center = [0, 0, 1]
radius = 1
[[shapes]]
type = "cylinder"
material = "diffuse"
start = [0, 0, 0]
end = [0, 0, 1]
radius = 1
tangent = [1, 0, 0]
[[shapes]]
type = "triangle"
material = "gold"
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
[[shapes]]
type = "tetrahedron"
material = "other"
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
[[shapes]]
type = "plane"
material = "water"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
[[shapes]]
type = "mesh"
file = "ball.obj"
normals = "smooth"
up = "y"
material = "all"
materials = { first = "gold" }
translate = [0, 0, 1]
rotate = [0, 20, 0]
scale = 0.5
[meshes.cube]
file = "cube.obj"
normals = "flat"
up = "z"
[[instances]]
mesh = "cube"
material = "gold"
materials = { first = "gold" }
translate = [0, 0, 1]
rotate = { axis = [0, 0, 1], degrees = 20 }
scale = [1, -1, 2]
[[instances]]
mesh = "cube"
material = "gold"
matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2]]
"#,
    r#"
image = { width = 8, height = 6 }
camera = { type = "orthographic", position = [0, -5, 1], look_at = [0, 0, 1], up = [0, 0, 1], height = 3, path = { keys = [
    { frame = 0, height = 2 },
] } }
[render]
integrator = "path"
[environment]
name = "sky"
rotate = 20
sun_elevation = 30
sun_azimuth = 20
turbidity = 3
[[lights]]
type = "spot"
position = [0, 0, 4]
look_at = [0, 0, 0]
color = [1, 1, 1]
cone_angle = 30
[materials.gray]
type = "diffuse"
color = [0.5, 0.5, 0.5]
[[shapes]]
type = "mesh"
file = "rock.obj"
material = "gray"
matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1]]
"#,
    // Only the schema accepts this scene, because the file does not exist.
    r#"
image = { width = 8, height = 6 }
camera = { position = [0, -5, 1], look_at = [0, 0, 1], fov = 40, f_number = 2 }
[[shapes]]
type = "gltf"
file = "cube.glb"
scene = 0
time = 2
animation = "walk"
variant = 1
lights = true
materials = { brick = "gray" }
translate = [0, 0, 1]
rotate = [0, 20, 0]
scale = 0.5
[[shapes]]
type = "gltf"
file = "cube.glb"
matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2]]
"#,
    r#"
image = { width = 8, height = 6 }
[camera]
type = "panorama"
position = [0, -5, 1]
look_at = [0, 0, 1]
up = [0, 0, 1]
path = { keys = [{ frame = 0, up = [0, 0, 1] }] }
[environment]
file = "wide.exr"
[render]
integrator = "path"
"#,
];

/// Parts of error messages for rules that the schema cannot express: relations between values, names, and file
/// contents.
const BEYOND_SCHEMA: &[&str] = &[
    // Names and files.
    "there is no texture",
    "there is no material",
    "there is no mesh",
    "has no such group",
    ".file: ",
    "is missing; ",
    "reaches to",
    "no texture here",
    "no normal map here",
    "must be a texture of type",
    "its encoding must be",
    "its factor must be",
    "texture's factor",
    "texture with uv_set",
    // Keys that exclude or require other keys.
    "integrator = \"path\"",
    "must be from 1 to 64",
    "must not be there",
    "does not apply to",
    "cannot be combined with",
    "needs a thickness",
    "needs name",
    "needs alpha_mode",
    "thin is true",
    "must have \"position\"",
    "square number",
    "cannot add samples",
    "the count of pixel_samples",
    "from the start",
    "to cone_angle",
    "must not emit light",
    "must be greater than the frame of the previous key",
    "camera.path: at frame",
    // Relations between numbers.
    "must not be parallel",
    "must not lie",
    "must differ from the camera's position",
    "makes the view parallel to up",
    "away from the light",
    "must not be zero: its length",
    "must have a length from",
    " apart",
    "must be [0, 0, 0, 1]",
];

fn value_paths(value: &Value, path: &mut Vec<Step>, all: &mut Vec<Vec<Step>>) {
    all.push(path.clone());
    match value {
        Value::Table(table) => {
            for (key, value) in table {
                path.push(Step::Key(key.clone()));
                value_paths(value, path, all);
                path.pop();
            }
        }
        // One component represents all components of a point or color.
        Value::Array(list) if list.first().is_some_and(|first| !first.is_table() && !first.is_array()) => {
            if let Some(value) = list.last() {
                path.push(Step::Index(list.len() - 1));
                value_paths(value, path, all);
                path.pop();
            }
        }
        Value::Array(list) => {
            for (i, value) in list.iter().enumerate() {
                path.push(Step::Index(i));
                value_paths(value, path, all);
                path.pop();
            }
        }
        _ => {}
    }
}

#[derive(Clone, Debug)]
enum Step {
    Key(String),
    Index(usize),
}

fn value_at<'a>(scene: &'a mut Value, path: &[Step]) -> &'a mut Value {
    path.iter().fold(scene, |value, step| match step {
        Step::Key(key) => &mut value[key.as_str()],
        Step::Index(i) => &mut value[*i],
    })
}

fn mutated(scene: &Table, path: &[Step]) -> Vec<Table> {
    let floats = [-1e10, -400.0, -0.5, -1e-12, 0.0, 1e-12, 0.5, 1.5, 1e7, 1e10];
    let integers = [-1, 0, 2, 17, 101, 1025, 65_537, 5_000_000_000_i64];
    let mut values: Vec<Value> = floats.map(Value::from).into();
    values.extend(integers.map(Value::from));
    values.extend([Value::from("?"), Value::from(true), Value::Table(Table::new())]);
    values.extend([Value::Array(Vec::new()), Value::from(vec![1]), Value::from(vec![1, 2])]);
    values.extend([
        Value::from(vec![0, 0, 0]),
        Value::from(vec![1, 2, 3, 4]),
        Value::from(vec!["a", "b"]),
    ]);
    let mut scenes = Vec::new();
    let mut push_changed = |change: &dyn Fn(&mut Value)| {
        let mut scene = Value::Table(scene.clone());
        change(value_at(&mut scene, path));
        if let Value::Table(scene) = scene {
            scenes.push(scene);
        }
    };
    if !path.is_empty() {
        for value in values {
            push_changed(&|old| *old = value.clone());
        }
    }
    push_changed(&|old| match old {
        Value::Table(table) => drop(table.insert("unknown".to_owned(), Value::from(1))),
        Value::Array(list) => list.extend(list.last().cloned()),
        Value::String(text) => text.push('x'),
        Value::Integer(number) => *old = Value::from(*number as f64 + 0.5),
        _ => {}
    });
    if let Value::Table(table) = value_at(&mut Value::Table(scene.clone()), path) {
        for key in table.keys().cloned().collect::<Vec<_>>() {
            push_changed(&|old| {
                if let Value::Table(table) = old {
                    table.remove(&key);
                }
            });
        }
    }
    scenes
}

fn disagreement(scene: &Table, folder: &Path) -> Option<String> {
    match (matches_schema(scene), load(scene, folder)) {
        (false, Ok(())) => Some(format!("only the schema rejects {scene}")),
        // JSON Schema treats 1.0 as an integer.
        (true, Err(message))
            if message.contains(".0 must be ")
                && ["whole number", "a name or an index"]
                    .iter()
                    .any(|rule| message.contains(rule)) =>
        {
            None
        }
        // The schema lets a camera with a path omit static keys.
        (true, Err(message)) if message.contains(": camera.") && message.ends_with(" is missing") => {
            let has_path = scene["camera"].get("path").is_some();
            (!has_path).then(|| format!("only the program rejects a camera without a path: {message}"))
        }
        (true, Err(message)) if !BEYOND_SCHEMA.iter().any(|phrase| message.contains(phrase)) => {
            Some(format!("only the program rejects: {message}"))
        }
        _ => None,
    }
}

/// Checks every `step`-th change of a value; returns the number of checked changes.
fn compare(scene: &Table, folder: &Path, step: usize) -> usize {
    let mut paths = Vec::new();
    value_paths(&Value::Table(scene.clone()), &mut Vec::new(), &mut paths);
    let scenes: Vec<Table> = paths
        .iter()
        .flat_map(|path| mutated(scene, path))
        .step_by(step)
        .collect();
    let disagreements: BTreeSet<String> = scenes
        .par_iter()
        .filter_map(|scene| disagreement(scene, folder))
        .collect();
    assert!(
        disagreements.is_empty(),
        "{} of {} changed scenes: {disagreements:#?}",
        disagreements.len(),
        scenes.len()
    );
    scenes.len()
}

#[test]
fn schema_and_parser_reject_the_same_changed_values() {
    let folder = any_scene::folder();
    let scenes = SCENES.map(|text| text.parse::<Table>().unwrap());
    // Every third change still leaves several changes for each value.
    let count: usize = scenes.iter().map(|scene| compare(scene, folder, 3)).sum();
    assert!(count > 3000, "{count}");
    let valid = scenes
        .iter()
        .filter(|scene| load(scene, folder).is_ok() && matches_schema(scene));
    assert_eq!(valid.count(), 3, "some unchanged scenes are invalid");
}

#[test]
fn schema_and_parser_reject_missing_and_unknown_keys() {
    let folder = any_scene::folder();
    let key = |name: &str| Step::Key(name.to_owned());
    let camera_path = [key("camera"), key("path")];
    let shape = |index| [key("shapes"), Step::Index(index)];
    let phong = [key("materials"), key("phong")];
    let instance = [key("instances"), Step::Index(0)];
    let key_frame = Table::from_iter([("frame".to_owned(), Value::from(3))]);
    for (scene_index, table, name, value) in [
        (0, &camera_path[..], "keys", Value::Array(Vec::new())),
        (3, &camera_path, "keys", Value::from(vec![key_frame])),
        (0, &[key("textures"), key("four")], "file", "".into()),
        (0, &[key("meshes"), key("cube")], "file", "".into()),
        (0, &shape(7), "file", "".into()),
        (2, &shape(0), "file", "".into()),
        (3, &[key("environment")], "file", "".into()),
        (3, &[], "environment", Table::new().into()),
        (3, &[key("environment")], "name", "sky".into()),
        (0, &[key("instances"), Step::Index(1)], "scale", 1.into()),
        (1, &shape(0), "translate", vec![0, 0, 0].into()),
        (2, &shape(1), "scale", 1.into()),
        // A list does not replace a table.
        (0, &[key("render")], "adaptive", vec![0.01].into()),
        (
            0,
            &[key("render")],
            "light_samples",
            Value::Array(vec!["random".into(), 4.into()]),
        ),
        (
            0,
            &camera_path,
            "keys",
            Value::Array(vec![Value::from(vec![1]), Value::from(vec![2])]),
        ),
        (0, &phong, "color", vec!["two"].into()),
        (0, &phong, "normal_map", vec!["five"].into()),
        (
            0,
            &instance,
            "rotate",
            Value::Array(vec![vec![0, 0, 1].into(), 20.into()]),
        ),
    ] {
        let mut scene = Value::Table(SCENES[scene_index].parse().unwrap());
        assert!(
            matches_schema(scene.as_table().unwrap()),
            "the unchanged scene is rejected"
        );
        let parent = value_at(&mut scene, table).as_table_mut().unwrap();
        parent.insert(name.to_owned(), value);
        let scene = scene.as_table().unwrap();
        assert!(
            !matches_schema(scene) && load(scene, folder).is_err(),
            "{table:?}.{name}"
        );
    }
}

#[test]
fn schema_and_parser_agree_on_random_scenes_and_mutations() {
    let (folder, strategy) = (any_scene::folder(), any_scene::description());
    let mut runner = TestRunner::deterministic();
    for i in 0..60 {
        let scene = strategy.new_tree(&mut runner).expect("a scene").current();
        let scene = Table::try_from(&scene).unwrap();
        assert!(matches_schema(&scene), "{scene}");
        if i < 12 {
            assert!(compare(&scene, folder, 37) > 10);
        }
    }
}

#[test]
fn scenes_of_the_project_match_the_schema() {
    let mut count = 0;
    for entry in std::fs::read_dir(project("scenes")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|end| end == "toml") {
            let scene: Table = std::fs::read_to_string(&path).unwrap().parse().unwrap();
            assert!(matches_schema(&scene), "{}", path.display());
            count += 1;
        }
    }
    assert!(count > 10);
    for page in [include_str!("../README.md"), PAGE] {
        let scenes = page
            .split("```toml\n")
            .skip(1)
            .filter_map(|rest| rest.split("```").next());
        let scenes: Vec<&str> = scenes.filter(|scene| scene.contains("[camera]")).collect();
        assert!(!scenes.is_empty());
        for scene in scenes {
            assert!(matches_schema(&scene.parse().unwrap()), "{scene}");
        }
    }
}

fn visit_keys(schema: &Json, path: &str, check: &mut impl FnMut(&str, &Json)) {
    match schema {
        Json::Object(all) => {
            for (key, property) in all.get("properties").and_then(Json::as_object).into_iter().flatten() {
                // The `then` branch of the condition describes these keys.
                if !path.ends_with("/if") {
                    check(&format!("{path}.{key}"), property);
                }
            }
            for (key, inner) in all {
                visit_keys(inner, &format!("{path}/{key}"), check);
            }
        }
        Json::Array(all) => {
            for (i, inner) in all.iter().enumerate() {
                visit_keys(inner, &format!("{path}/{i}"), check);
            }
        }
        _ => {}
    }
}

#[test]
fn every_key_has_a_description_and_every_number_a_range() {
    let mut count = 0;
    visit_keys(schema(), "", &mut |path, property| {
        let description = property["description"].as_str().unwrap_or_default();
        assert!(
            description.len() > 5 && description.ends_with('.'),
            "{path}: {description:?}"
        );
        for forbidden in ["[`", "Description", "  ", "..", "\n"] {
            assert!(!description.contains(forbidden), "{path}: {description:?}");
        }
        let is_number = ["number", "integer"].iter().any(|name| property["type"] == **name);
        let limits = ["minimum", "exclusiveMinimum", "anyOf"];
        assert!(
            !is_number || limits.iter().any(|limit| property.get(limit).is_some()),
            "{path}: {property}"
        );
        // If a texture may replace the number, the description of the key states the range.
        let is_texture = |either: &Json| either["properties"].get("texture").is_some();
        let either = property.get("anyOf").filter(|either| is_texture(&either[1]));
        let mut number_schema = either.map_or(&Json::Null, |either| &either[0]);
        while let Some(items) = number_schema.get("items") {
            number_schema = items;
        }
        assert!(
            number_schema.get("minimum").is_none() || description.contains(" to "),
            "{path}: {description:?}"
        );
        assert!(
            property.get("title").is_none() && property.get("format").is_none(),
            "{path}"
        );
        count += 1;
    });
    assert!(count > 250, "{count}");
}

#[test]
fn the_scenes_cover_every_key() {
    let mut covered: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut record_keys = |name: String, table: &Value| {
        covered
            .entry(name)
            .or_default()
            .extend(table.as_table().unwrap().keys().cloned());
    };
    let tag = |table: &Value| {
        table
            .get("type")
            .and_then(Value::as_str)
            .unwrap_or("perspective")
            .to_owned()
    };
    for scene in SCENES {
        let scene: Table = scene.parse().unwrap();
        for (key, value) in &scene {
            let kind = key.trim_end_matches('s');
            match (key.as_str(), value) {
                ("camera", camera) => record_keys(format!("camera-{}", tag(camera)), camera),
                ("textures" | "materials", Value::Table(tables)) => {
                    tables
                        .values()
                        .for_each(|entry| record_keys(format!("{kind}-{}", tag(entry)), entry));
                }
                ("lights" | "shapes", Value::Array(tables)) => {
                    tables
                        .iter()
                        .for_each(|entry| record_keys(format!("{kind}-{}", tag(entry)), entry));
                }
                ("meshes", Value::Table(tables)) => tables.values().for_each(|entry| record_keys(key.clone(), entry)),
                ("instances", Value::Array(tables)) => tables.iter().for_each(|entry| record_keys(key.clone(), entry)),
                (_, section) => record_keys(key.clone(), section),
            }
        }
    }
    let top = &schema()["properties"];
    let plain = ["image", "render", "environment"].map(|name| (name.to_owned(), &top[name]));
    let list_items = [
        ("meshes".to_owned(), &top["meshes"]["additionalProperties"]),
        ("instances".to_owned(), &top["instances"]["items"]),
    ];
    let defs = schema()["$defs"]
        .as_object()
        .unwrap()
        .iter()
        .map(|(name, table_schema)| (name.clone(), table_schema));
    for (name, table_schema) in defs.chain(plain).chain(list_items) {
        let expected: BTreeSet<String> = table_schema["properties"]
            .as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect();
        assert_eq!(covered.get(&name), Some(&expected), "{name}");
    }
}
