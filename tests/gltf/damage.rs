//! Damaged parts of glTF files are replaced or skipped with a warning; with `strict`, such files are rejected.

use std::path::Path;

use serde_json::json;
use wgray::scene::{Color, Overrides, Reflection, Scene, TextureKind, Value};

use super::build::{Builder, Component, Packing, QUAD, QUAD_INDICES};
use crate::test_folder::TestFolder;

fn load(file: &Path, strict: bool) -> Result<Scene, String> {
    let overrides = Overrides {
        strict,
        ..Overrides::default()
    };
    Scene::load_with(file, &overrides).map_err(|error| error.to_string())
}

fn triangle_count(scene: &Scene) -> usize {
    let meshes = wgray_render::pack::pack(scene).bvh.meshes;
    meshes.iter().map(|mesh| mesh.triangles.len()).sum()
}

#[test]
fn a_missing_texture_leaves_the_factor() {
    let folder = TestFolder::with_file("a", "");
    std::fs::write(folder.folder().join("broken.png"), b"\x89PNG\r\n\x1a\nno more").unwrap();
    for (uri, reason) in [
        ("missing.png", "images[0].uri: \"missing.png\" cannot be read: "),
        (
            "data:image/png;base64,*",
            "images[0].uri: the data URI must be base64: ",
        ),
        ("broken.png", "\"images[0]\" is damaged or truncated: "),
        (
            "data:image/png;base64,",
            "\"images[0]\" must be a PNG, JPEG, WebP or KTX2 file",
        ),
    ] {
        let mut builder = Builder::new();
        let image = builder.add("images", json!({ "uri": uri }));
        let texture = builder.add("textures", json!({ "source": image }));
        let info = json!({ "index": texture });
        let material = builder.add(
            "materials",
            json!({
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 0.25, 1, 1], "baseColorTexture": info,
                    "metallicRoughnessTexture": info, "roughnessFactor": 0.75,
                },
                "normalTexture": info, "emissiveTexture": info, "emissiveFactor": [1, 1, 1],
            }),
        );
        let mesh = builder.quad(Some(material));
        builder.root_node(json!({ "mesh": mesh }));
        let file = builder.write_invalid(folder.folder(), "texture", Packing::Binary);
        let scene = load(&file, false).unwrap();
        assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
        let note = &scene.notes[0];
        assert!(
            note.message.starts_with(reason) && note.message.ends_with("; the texture is replaced by its factor"),
            "{note}"
        );
        let Reflection::Principled(principled) = &scene.materials[0].reflection else {
            panic!("{:?}", scene.materials);
        };
        let constant = |texture: usize| match scene.textures[texture].kind {
            TextureKind::Constant(color) => color.to_array(),
            ref other => panic!("{other:?}"),
        };
        let Color::Texture(base) = principled.base_color else {
            panic!("{principled:?}");
        };
        assert_eq!(constant(base), [0.5, 0.25, 1.0]);
        let Value::Texture(rough, _) = principled.roughness else {
            panic!("{principled:?}");
        };
        assert_eq!(constant(rough), [1.0, 0.75, 1.0]);
        assert_eq!(
            (scene.materials[0].emission, scene.materials[0].normal_map),
            (Color::BLACK, None)
        );
        let error = load(&file, true).unwrap_err();
        assert!(error.starts_with(&format!("{}: {reason}", file.display())), "{error}");
    }
}

#[test]
fn triangles_with_invalid_positions_are_skipped() {
    let folder = TestFolder::with_file("a", "");
    for (invalid_vertex, valid_triangles) in [(0, 0), (1, 1), (3, 1), (4, 2)] {
        for value in [f64::NAN, f64::INFINITY, -2e9] {
            let mut builder = Builder::new();
            let mut points = QUAD.to_vec();
            points.push([9.0, 9.0, 0.0]); // an unused vertex
            points[invalid_vertex][1] = value;
            let position = builder.attribute(Component::F32, false, &points);
            let indices = builder.indices(&QUAD_INDICES);
            let primitive = json!({ "attributes": { "POSITION": position }, "indices": indices });
            let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
            builder.root_node(json!({ "mesh": mesh }));
            let valid_mesh = builder.quad(None);
            builder.root_node(json!({ "mesh": valid_mesh }));
            // JSON cannot represent NaN, so `min` and `max` cover only the valid vertices.
            builder.get("accessors")[position]["min"] = json!([-1, -1, 0]);
            builder.get("accessors")[position]["max"] = json!([9, 9, 0]);
            let file = builder.write_invalid(folder.folder(), "positions", Packing::Binary);
            let scene = load(&file, false).unwrap();
            let context = format!("{invalid_vertex} {value}: {:?}", scene.notes);
            assert_eq!(triangle_count(&scene), valid_triangles + 2, "{context}");
            let rule = "a vertex with a coordinate that is beyond 1e9 or not finite";
            let message = match valid_triangles {
                0 => format!("meshes[0].primitives[0].attributes.POSITION: 2 triangles have {rule}"),
                1 => format!("meshes[0].primitives[0].attributes.POSITION: 1 triangle has {rule}"),
                _ => String::new(),
            };
            let strict = load(&file, true);
            if message.is_empty() {
                assert!(scene.notes.is_empty() && strict.is_ok(), "{context}");
                continue;
            }
            let note = &scene.notes[0];
            assert!(
                note.message.starts_with(&message) && note.message.ends_with(" skipped"),
                "{context}"
            );
            assert_eq!(strict.unwrap_err(), format!("{}: {message}", file.display()));
        }
    }
}

#[test]
fn a_node_may_have_any_scale() {
    let folder = TestFolder::with_file("a", "");
    for scale in [1e-8, 1e-6, 1e6, 1e8] {
        let mut builder = Builder::new();
        let mesh = builder.quad(None);
        builder.root_node(json!({ "mesh": mesh, "scale": [scale, scale, scale] }));
        let file = builder.write(folder.folder(), "scaled", Packing::Binary);
        let scene = load(&file, true).unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        assert_eq!(triangle_count(&scene), 2, "{scale}");
        let (low, high) = scene.bounds().expect("bounds");
        let size = high - low;
        assert!(
            (size.max_element() / (2.0 * scale) - 1.0).abs() < 1e-6,
            "{scale}: {size}"
        );
    }
    // The second node scales its mesh beyond the limit of coordinates, 1e9.
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    builder.root_node(json!({ "mesh": mesh }));
    builder.root_node(json!({ "mesh": mesh, "scale": [1e12, 1e12, 1e12] }));
    let file = builder.write(folder.folder(), "large", Packing::Binary);
    let scene = load(&file, false).unwrap();
    assert_eq!(triangle_count(&scene), 2);
    assert_eq!(
        scene.notes,
        [
            "meshes[0].primitives[0].attributes.POSITION: 2 triangles have a vertex with a coordinate that is beyond 1e9 or \
             not finite; they are skipped"
        ]
    );
}
