use std::path::Path;

use serde_json::{Value as Json, json};

use super::*;
use crate::edit::edited;
use wgray_render::pack::pack;
use wgray_scene::{Overrides, PendingScene, Scene};

fn scene_view(text: &str, name: &Path, overrides: Overrides) -> SceneView {
    let origin = name.display().to_string();
    let pending = PendingScene::read(text, &origin, wgray_scene::folder_of(name), &overrides).unwrap();
    let (scene, description) = pending.check(&mut Default::default()).unwrap();
    let loaded = Loaded::new(text.to_owned(), scene, description, None);
    SceneView {
        camera: loaded.packed.camera,
        loaded: Arc::new(loaded),
        sources: Sources {
            scene: name.to_owned(),
            overrides,
            shaders: None,
        },
    }
}

fn table(text: &str) -> Value {
    Value::Table(toml::from_str(text.trim_start_matches('\u{feff}')).unwrap())
}

/// Returns a copy with all integers as floats, so that only the values are compared.
fn with_floats(value: &Value) -> Value {
    match value {
        Value::Integer(x) => Value::Float(*x as f64),
        Value::Array(list) => list.iter().map(with_floats).collect::<Vec<_>>().into(),
        Value::Table(table) => Value::Table(
            table
                .iter()
                .map(|(key, value)| (key.clone(), with_floats(value)))
                .collect(),
        ),
        value => value.clone(),
    }
}

/// Returns a copy with `new` at a path; missing tables are added.
fn with_value(document: &Value, path: &KeyPath, new: &Value) -> Value {
    let mut document = document.clone();
    let mut value = &mut document;
    for segment in &path.0 {
        value = match segment {
            Segment::Index(i) => value.get_mut(*i).unwrap(),
            Segment::Key(key) => {
                let table = value.as_table_mut().unwrap();
                table.entry(key.clone()).or_insert(Value::Table(Table::new()))
            }
        };
    }
    *value = new.clone();
    document
}

/// Returns a valid value that differs from the current value.
fn different_value(field: &Field) -> Json {
    let current = field.value.as_ref().or(field.default.as_ref());
    let different_number = |current: Option<f64>| {
        let (low, high) = field.range.unwrap();
        let slider = field.slider;
        let middle = slider.map_or((low + high) / 2.0, |slider| (slider.from + slider.to) / 2.0);
        let candidates = [current.unwrap_or(0.0) * 0.75 + 0.01, middle, low, high];
        let is_usable = |x: &f64| *x >= low && *x <= high && Some(*x) != current && *x != 0.0;
        candidates.into_iter().find(is_usable).unwrap()
    };
    match field.kind {
        wgray_scene::FieldKind::Number => json!(different_number(current.and_then(Json::as_f64))),
        wgray_scene::FieldKind::Whole => {
            let current = current.and_then(Json::as_f64);
            let x = different_number(current).round();
            json!(if Some(x) == current { x as i64 + 1 } else { x as i64 })
        }
        wgray_scene::FieldKind::Color | wgray_scene::FieldKind::Vector => {
            let list: Vec<Option<f64>> = match current.and_then(Json::as_array) {
                Some(list) => list.iter().map(Json::as_f64).collect(),
                None => vec![None; field.length],
            };
            json!(list.into_iter().map(different_number).collect::<Vec<_>>())
        }
        wgray_scene::FieldKind::Choice => {
            let different = field
                .choices
                .iter()
                .find(|choice| current.and_then(Json::as_str) != Some(choice.as_str()));
            json!(different.or(field.choices.first()))
        }
        wgray_scene::FieldKind::Switch => json!(current != Some(&json!(true))),
        wgray_scene::FieldKind::Text => panic!("{field:?}"),
    }
}

/// Sets every field to its current value and to a different value. Returns the number of fields.
fn set_all(view: &SceneView) -> usize {
    let text = view.loaded.text.clone();
    let document = table(&text);
    let names = view.names();
    let mut count = 0;
    for (name, _) in view.objects("").objects {
        let object = view.object(&name, None);
        assert_eq!(object.gone, None);
        let group = &object.groups[0];
        assert_eq!(group.name, name);
        assert!(
            group.line == 0
                || text.contains(
                    &group
                        .text
                        .replace('\n', if text.contains('\r') { "\r\n" } else { "\n" })
                )
        );
        for field in &group.fields {
            let case = format!("{}: {}", view.sources.scene.display(), field.path);
            let path: KeyPath = field.path.parse().unwrap();
            assert_eq!(view.field(&path).as_ref(), Some(field), "{case}");
            if let Some(current) = field.value.as_ref().filter(|_| field.fixed.is_none()) {
                let value = field.value_of(current, &names).unwrap();
                assert_eq!(edited(&text, &path, Some(&value)).unwrap(), text, "{case}");
            }
            if field.fixed.is_some() {
                continue;
            }
            let value = field.value_of(&different_value(field), &names).unwrap();
            let after = edited(&text, &path, Some(&value)).unwrap_or_else(|error| panic!("{case}: {error}"));
            let expected = with_value(&with_floats(&document), &path, &with_floats(&value));
            assert_eq!(with_floats(&table(&after)), expected, "{case}");
            Description::parse(&after, "s.toml").unwrap_or_else(|error| panic!("{error}"));
            // Removing an added key restores every byte.
            if field.value.is_none()
                && !after.contains(&format!(
                    "[{}]\n",
                    path.0[0..1].iter().map(|_| "render").collect::<String>()
                ))
            {
                assert_eq!(edited(&after, &path, None).as_deref(), Ok(text.as_str()), "{case}");
            }
            count += 1;
        }
    }
    count
}

#[test]
fn every_field_of_every_scene_can_be_set() {
    let mut count = 0;
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes"));
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        count += set_all(&scene_view(&text, &path, Overrides::default()));
        let dos = format!("\u{feff}{}", text.replace('\n', "\r\n"));
        set_all(&scene_view(&dos, &path, Overrides::default()));
    }
    assert!(count > 1000, "{count}");
}

const SCENE: &str = "\
image = { width = 40, height = 30 }
camera = { position = [0, -4, 0.5], look_at = [0, 0, 0.5], fov = 40 }
render.pixel_samples = { count = 4 }

[materials]
red = { type = 'phong', color = [0.8, 0.1, 0.1] }
\"dark red\" = { type = 'phong', color = { texture = 'squares' } }
[textures.squares]
type = 'checker'
even = [1, 1, 1]
odd = [0, 0, 0]

# the ball
[[shapes]]
type = 'sphere'
material = 'dark red'
center = [0, 0, 0.5]
radius = 0.5 # wide

[[shapes]]
type = 'plane'
material = 'red'
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]

[[lights]]
type = 'rectangle'
center = [0.9, 0, 1]
size = [0.2, 0.2]
normal = [0, -1, 0]
tangent = [1, 0, 0]
color = [4, 4, 4]
";

fn small_view() -> SceneView {
    scene_view(SCENE, Path::new("s.toml"), Overrides::default())
}

#[test]
fn sample_counts_of_grid_patterns_are_squares() {
    let square_fields = |render: &str| {
        let text = format!(
            "image = {{ width = 4, height = 4 }}\n[camera]\nposition = [0, 1, 0]\nlook_at = [0, 0, 0]\nfov = 40\n{render}"
        );
        let object = scene_view(&text, Path::new("s.toml"), Overrides::default()).object("render", None);
        let fields = object.groups[0].fields.iter();
        fields
            .filter(|field| field.squares)
            .map(|field| field.name.clone())
            .collect::<Vec<_>>()
    };
    let (pixel, light) = ("pixel_samples.count", "light_samples.count");
    assert_eq!(
        square_fields("[render]\npixel_samples = { count = 4 }\nlight_samples = { count = 4 }"),
        [pixel, light]
    );
    assert_eq!(
        square_fields(
            "[render]\npixel_samples = { pattern = 'halton', count = 5 }\nlight_samples = { pattern = 'jittered', count = 4 }"
        ),
        [light]
    );
    let path = "[render]\nintegrator = 'path'\n";
    assert!(square_fields(&format!("{path}pixel_samples = {{ count = 5 }}")).is_empty());
    assert_eq!(
        square_fields(&format!("{path}pixel_samples = {{ pattern = 'grid', count = 4 }}")),
        [pixel]
    );
}

#[test]
fn values_in_other_layouts_can_be_set() {
    assert!(set_all(&small_view()) > 60);
    // Checks that `with_value` changes a document only if the value differs.
    let document = with_floats(&table(SCENE));
    let path: KeyPath = "shapes[0].radius".parse().unwrap();
    assert_ne!(with_value(&document, &path, &Value::from(0.25)), document);
    assert_eq!(with_value(&document, &path, &Value::from(0.5)), document);
}

#[test]
fn picks_have_names_lines_and_references() {
    let view = small_view();
    let ball = view.at([20, 15]);
    assert_eq!(
        (ball.name.as_str(), ball.at, &ball.gone),
        ("shapes[0]", Some([20, 15]), &None)
    );
    let groups: Vec<&str> = ball.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(groups, ["shapes[0]", "materials.\"dark red\"", "textures.squares"]);
    let group = &ball.groups[0];
    assert_eq!((group.kind.as_str(), group.line, group.more), ("sphere", 13, 0));
    assert_eq!(
        group.text,
        "# the ball\n[[shapes]]\ntype = 'sphere'\nmaterial = 'dark red'\ncenter = [0, 0, 0.5]\nradius = 0.5 # wide"
    );
    assert_eq!(ball.groups[1].line, 7);
    let radius = group.fields.iter().find(|field| field.name == "radius").unwrap();
    assert_eq!(radius.path, "shapes[0].radius");
    assert_eq!(
        (radius.value.clone(), radius.unit, radius.range),
        (Some(json!(0.5)), Some("units"), Some((1e-9, 1e9)))
    );
    assert!(
        radius
            .slider
            .is_some_and(|slider| slider.logarithmic && slider.from < 0.5 && slider.to > 0.5)
    );
    let fields = |view: &SceneView, name: &str| view.object(name, None).groups[0].fields.clone();
    let shininess = fields(&view, "materials.red")
        .into_iter()
        .find(|field| field.name == "shininess")
        .unwrap();
    assert_eq!((shininess.value, shininess.default), (None, Some(json!(16.0))));
    assert_eq!(view.at([20, 29]).name, "shapes[1]");
    assert_eq!(view.at([29, 10]).name, "lights[0]");
    let sky = view.at([0, 0]);
    assert_eq!((sky.name.as_str(), sky.note.is_some()), ("render", true));
    for (object, expected_reason) in [
        (view.at([40, 0]), "is outside the image"),
        (view.object("shapes[2]", None), "shapes[2] is not in the scene"),
        (view.object("environment", None), "environment is not in the scene"),
        (view.object("shapes", None), "shapes is not in the scene"),
        (view.object("] [", None), "is not in the scene"),
        (view.object("", None), "is not in the scene"),
    ] {
        assert!(
            object.groups.is_empty()
                && object
                    .gone
                    .as_ref()
                    .is_some_and(|reason| reason.contains(expected_reason)),
            "{object:?}"
        );
    }
}

#[test]
fn picks_equal_the_first_hits() {
    let view = small_view();
    let moved_scene = Scene::parse(&SCENE.replace("[0, -4, 0.5]", "[1, -4, 2]"), "s.toml").unwrap();
    let moved_view = SceneView {
        camera: pack(&moved_scene).camera,
        ..view.clone()
    };
    let mut different_picks = 0;
    for y in (0..30).step_by(3) {
        for x in (0..40).step_by(3) {
            let hit = pixel_first_hit(&pack(&moved_scene), UVec2::new(x, y));
            let expected = match hit.shape {
                NO_INDEX => "render".to_owned(),
                2 => "lights[0]".to_owned(),
                shape => format!("shapes[{shape}]"),
            };
            assert_eq!(moved_view.at([x, y]).name, expected);
            different_picks += usize::from(view.at([x, y]).name != expected);
        }
    }
    assert!(different_picks > 5, "the camera makes no difference");
}

#[test]
fn files_are_read_only_and_choices_accept_only_listed_names() {
    let view = scene_view(
        &std::fs::read_to_string("../../scenes/twisted-tube.toml").unwrap(),
        Path::new("../../scenes/twisted-tube.toml"),
        Overrides::default(),
    );
    let names = view.names();
    let mut files = 0;
    for (name, _) in view.objects("").objects {
        for field in view.object(&name, None).groups.iter().flat_map(|group| &group.fields) {
            if field.name.ends_with("file") {
                files += 1;
                assert!(field.fixed.is_some(), "{field:?}");
                assert!(field.value_of(&json!("other.obj"), &names).is_err());
            }
            if field.kind == wgray_scene::FieldKind::Choice && field.fixed.is_none() {
                assert!(field.value_of(&json!("/etc/passwd"), &names).is_err());
            }
        }
    }
    assert!(files > 0);
}

#[test]
fn overridden_values_are_read_only() {
    let overrides = Overrides {
        size: Some((20, 20)),
        define: vec![
            "camera.position[1]=-3".parse().unwrap(),
            "shapes.0.radius=0.4".parse().unwrap(),
        ],
        ..Overrides::default()
    };
    let view = scene_view(SCENE, Path::new("s.toml"), overrides);
    let fixed = |path: &str| view.field(&path.parse().unwrap()).unwrap().fixed;
    assert!(fixed("image.width").unwrap().contains("--size"));
    assert!(
        fixed("camera.position")
            .unwrap()
            .contains("--define camera.position[1]=-3")
    );
    assert!(fixed("shapes[0].radius").unwrap().contains("--define"));
    assert_eq!(fixed("shapes[0].center"), None);
    assert_eq!(fixed("image.exposure"), None);
    assert!(view.field(&"shapes[0].nothing".parse().unwrap()).is_none());
    assert!(view.field(&"shapes[9].radius".parse().unwrap()).is_none());
}

#[test]
fn objects_are_found_by_a_substring() {
    let view = small_view();
    let list = view.objects("RED");
    let names: Vec<&str> = list.objects.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        ["materials.\"dark red\"", "materials.red", "shapes[0]", "shapes[1]"]
    );
    assert_eq!(view.objects("").objects.len(), 9);
    let many = SCENE.to_owned() + &"[[shapes]]\ntype='sphere'\nmaterial='red'\ncenter=[9,9,9]\nradius=1\n".repeat(200);
    let list = scene_view(&many, Path::new("s.toml"), Overrides::default()).objects("sphere");
    assert_eq!((list.objects.len(), list.more), (MAX_LISTED, 201 - MAX_LISTED));
}

#[test]
fn a_camera_must_keep_the_keys_that_its_path_does_not_replace() {
    let required = |camera: &str| {
        let text = format!("image = {{ width = 4, height = 4 }}\n[camera]\n{camera}");
        let object = scene_view(&text, Path::new("a.toml"), Overrides::default()).object("camera", None);
        let fields = object.groups[0].fields.clone().into_iter();
        fields
            .filter(|field| field.required)
            .map(|field| field.name)
            .collect::<Vec<_>>()
    };
    let view = "position = [0, -4, 1]\nlook_at = [0, 0, 1]\nfov = 45\n";
    assert_eq!(required(view), ["position", "look_at", "fov"]);
    let keys = "path.keys = [{ frame = 1, position = [0, -4, 1], look_at = [0, 0, 1], fov = 45 }]";
    assert!(
        required(&format!("{view}{keys}"))
            .iter()
            .all(|name| name.starts_with("path"))
    );
}
