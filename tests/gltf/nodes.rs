//! glTF scenes and nodes: transforms, instances, orientation.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use serde_json::json;
use wgray::mesh::Mesh;
use wgray::scene::{Geometry, Reflection, Scene, Shape};

use super::build::{Builder, Component, QUAD};
use super::read::{assert_corners, corners, plain_color, rejection, scene, scene_with_keys, triangles};

fn mapped_quad(map: impl Fn(DVec3) -> DVec3) -> [[[f64; 3]; 3]; 2] {
    let p = QUAD.map(|corner| map(DVec3::from_array(corner)).to_array());
    [[p[0], p[1], p[2]], [p[0], p[2], p[3]]]
}

#[test]
fn transforms_of_nodes_are_multiplied_from_the_root() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    let inner = DMat4::from_cols_array(&[
        0.5, 0.1, 0.0, 0.0, 0.2, 1.5, 0.3, 0.0, 0.0, -0.4, 2.0, 0.0, 1.0, 2.0, 3.0, 1.0,
    ]);
    let leaf = builder.add("nodes", json!({ "mesh": mesh, "matrix": inner.to_cols_array() }));
    let outer = json!({
        "translation": [4, 5, 6], "rotation": rotation.to_array(), "scale": [1, 2, 0.5], "children": [leaf],
    });
    builder.root_node(outer);
    // The non-uniform scale of the outer node shears the transform of the leaf.
    let map = DAffine3::from_scale_rotation_translation(DVec3::new(1.0, 2.0, 0.5), rotation, DVec3::new(4.0, 5.0, 6.0));
    let expected = mapped_quad(|p| map.transform_point3(inner.transform_point3(p)));
    let scene = scene(&builder, "hierarchy");
    assert_corners(&scene, &expected);
    for triangle in triangles(&scene) {
        for normal in triangle.normals {
            assert!(normal.distance(triangle.geometric_normal()) < 1e-5, "{triangle:?}");
        }
    }
}

#[test]
fn mirrored_meshes_keep_their_outside() {
    for (name, scale) in [
        ("one", [-1.0, 1.0, 1.0]),
        ("three", [-2.0, -2.0, -2.0]),
        ("two", [-1.0, -1.0, 1.0]),
    ] {
        let mut builder = Builder::new();
        let mesh = builder.quad(None);
        builder.root_node(json!({ "mesh": mesh, "scale": scale }));
        let scene = scene(&builder, &format!("mirrored-{name}"));
        assert_corners(&scene, &mapped_quad(|p| p * DVec3::from_array(scale)));
        // A negative determinant reverses the winding order (glTF 2.0, 3.7.4).
        let front = DVec3::new(0.0, 0.0, if name == "three" { -1.0 } else { 1.0 });
        for triangle in triangles(&scene) {
            assert_eq!(triangle.geometric_normal(), front, "{name}");
            assert!(
                triangle.normals.iter().all(|normal| normal.distance(front) < 1e-6),
                "{name}"
            );
        }
    }
}

#[test]
fn nodes_with_zero_scale_are_skipped() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    builder.root_node(json!({ "mesh": mesh, "scale": [0, 0, 0] }));
    builder.root_node(json!({ "mesh": mesh, "translation": [0, 1, 0] }));
    assert_corners(&scene(&builder, "flat-node"), &mapped_quad(|p| p + DVec3::Y));
}

#[test]
fn meshes_flattened_along_their_normal_are_kept() {
    let flattened = |scale: [f64; 3]| {
        let mut builder = Builder::new();
        let mesh = builder.quad(None);
        builder.root_node(json!({ "mesh": mesh, "translation": [0, 0, 2], "scale": scale }));
        scene(&builder, "flattened")
    };
    // The area of the quad is not 0, but a scale is 0 or below the minimum scale of an instance.
    for (scale, factor) in [([1.0, 1.0, 0.0], 1.0), ([1e-7; 3], 1e-7), ([-1e-7; 3], -1e-7)] {
        let scene = flattened(scale);
        assert_corners(&scene, &mapped_quad(|p| p * factor + 2.0 * DVec3::Z));
        assert!(
            scene.notes.iter().all(|note| !note.message.contains("skipped")),
            "{:?}",
            scene.notes
        );
    }
    // The area of the mesh is 0. Animations hide meshes by such scales.
    for scale in [[1.0, 0.0, 1.0], [0.0; 3], [1e-12; 3]] {
        let scene = flattened(scale);
        assert!(scene.shapes.is_empty());
        assert!(
            scene
                .notes
                .iter()
                .any(|note| note.message.contains("1 of 1 instances of meshes are skipped"))
        );
    }
}

#[test]
fn a_mesh_of_several_nodes_is_stored_once() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    for x in 0..5 {
        builder.root_node(json!({ "mesh": mesh, "translation": [3 * x, 0, 0] }));
    }
    let scene = scene(&builder, "instances");
    let meshes = meshes(&scene);
    assert_eq!(meshes.len(), 5);
    assert!(meshes.iter().all(|mesh| Arc::ptr_eq(mesh, meshes[0])));
    let expected: Vec<_> = (0..5)
        .flat_map(|x| mapped_quad(|p| p + DVec3::new(3.0 * f64::from(x), 0.0, 0.0)))
        .collect();
    assert_corners(&scene, &expected);
}

fn meshes(scene: &Scene) -> Vec<&Arc<Mesh>> {
    fn mesh(shape: &Shape) -> Option<&Arc<Mesh>> {
        match &shape.geometry {
            Geometry::Mesh { mesh, .. } => Some(mesh),
            _ => None,
        }
    }
    scene.shapes.iter().filter_map(mesh).collect()
}

#[test]
fn instances_of_a_node_are_below_it() {
    let mut builder = Builder::new();
    builder.requires("EXT_mesh_gpu_instancing");
    let mesh = builder.quad(None);
    let quarter = std::f64::consts::FRAC_1_SQRT_2;
    let translation = builder.samples(&[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
    let rotation = builder.samples(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, quarter, quarter]]);
    let scale = builder.samples(&[[1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]);
    let attributes = json!({ "TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale });
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    builder.root_node(json!({ "mesh": mesh, "scale": [1, 1, 2], "translation": [0, 10, 0], "extensions": instancing }));
    let first = mapped_quad(|p| p + DVec3::new(0.0, 10.0, 0.0));
    // The second instance is scaled, rotated by 90 degrees and translated; then the transform of the node applies.
    let second = mapped_quad(|p| DVec3::new(-p.y + 3.0, 2.0 * p.x + 10.0, p.z));
    assert_corners(&scene(&builder, "gpu-instancing"), &[first, second].concat());
}

#[test]
fn instance_rotations_may_be_normalized_integers() {
    let mut builder = Builder::new();
    builder.requires("EXT_mesh_gpu_instancing");
    let mesh = builder.quad(None);
    let flat: Vec<f64> = [[0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
        .iter()
        .flatten()
        .map(|x| (x * 32767.0_f64).round())
        .collect();
    let rotation = builder.accessor("VEC4", Component::I16, &flat);
    builder.get("accessors")[rotation]["normalized"] = json!(true);
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "ROTATION": rotation } } });
    builder.root_node(json!({ "mesh": mesh, "extensions": instancing }));
    let first = mapped_quad(|p| DVec3::new(-p.x, -p.y, p.z));
    let second = mapped_quad(|p| DVec3::new(-p.x, p.y, -p.z));
    assert_corners(&scene(&builder, "gpu-instancing-i16"), &[first, second].concat());
}

fn two_scenes() -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    for x in [0, 10, 20] {
        builder.add("nodes", json!({ "mesh": mesh, "translation": [x, 0, 0] }));
    }
    builder.add("scenes", json!({ "nodes": [0], "name": "first" }));
    builder.add("scenes", json!({ "nodes": [1], "name": "second" }));
    builder
}

#[test]
fn one_of_several_scenes_is_shown() {
    let quad_at = |x: f64| mapped_quad(|p| p + DVec3::X * x);
    let mut builder = two_scenes();
    assert_corners(&scene(&builder, "scenes-first"), &quad_at(0.0));
    builder.set("scene", json!(1));
    assert_corners(&scene(&builder, "scenes-second"), &quad_at(10.0));
    assert_corners(
        &scene_with_keys(&builder, "scenes-named", "scene = \"first\""),
        &quad_at(0.0),
    );
    assert_corners(
        &scene_with_keys(&builder, "scenes-numbered", "scene = 0"),
        &quad_at(0.0),
    );
    for keys in ["scene = \"third\"", "scene = 2"] {
        let message = rejection(&builder, keys);
        assert!(message.contains("first") && message.contains("second"), "{message}");
    }
}

#[test]
fn cyclic_nodes_are_rejected() {
    let mut builder = two_scenes();
    builder.get("nodes")[0]["children"] = json!([1]);
    builder.get("nodes")[1]["children"] = json!([0]);
    let message = rejection(&builder, "");
    assert!(message.contains("nodes"), "{message}");
    // The node is its own child.
    let mut builder = two_scenes();
    builder.get("nodes")[0]["children"] = json!([0]);
    assert!(rejection(&builder, "").contains("nodes"));
}

#[test]
fn long_chains_of_nodes_are_supported() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    let mut node = builder.add("nodes", json!({ "mesh": mesh, "translation": [0.001, 0, 0] }));
    for _ in 0..999 {
        node = builder.add("nodes", json!({ "children": [node], "translation": [0.001, 0, 0] }));
    }
    builder.add("scenes", json!({ "nodes": [node] }));
    assert_corners(&scene(&builder, "chain"), &mapped_quad(|p| p + DVec3::X));
}

#[test]
fn names_may_be_missing_or_equal() {
    let mut builder = Builder::new();
    for (i, name) in [Some("same"), Some("same"), None, None].into_iter().enumerate() {
        let level = 0.25 * (i as f64 + 1.0);
        let mut material = json!({ "pbrMetallicRoughness": { "baseColorFactor": [level, level, level, 1] } });
        let mut node = json!({ "translation": [0, 0, i] });
        if let Some(name) = name {
            material["name"] = json!(name);
            node["name"] = json!(name);
        }
        let material = builder.add("materials", material);
        let mesh = builder.quad(Some(material));
        if let Some(name) = name {
            builder.get("meshes")[mesh]["name"] = json!(name);
        }
        node["mesh"] = json!(mesh);
        builder.root_node(node);
    }
    let scene = scene(&builder, "names");
    let levels: Vec<f64> = triangles(&scene)
        .iter()
        .step_by(2)
        .map(|triangle| match &scene.materials[triangle.material].reflection {
            Reflection::Principled(principled) => plain_color(principled.base_color)[0],
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(levels, [0.25, 0.5, 0.75, 1.0]);
}

#[test]
fn a_file_may_be_translated_rotated_and_scaled() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    builder.root_node(json!({ "mesh": mesh, "translation": [1, 0, 0] }));
    // The z axis of the scene is the y axis of the file.
    let keys = "scale = 2\nrotate = { axis = [0, 0, 1], degrees = 90 }\ntranslate = [0, 0, 5]";
    let rotation = DMat3::from_axis_angle(DVec3::Y, std::f64::consts::FRAC_PI_2);
    let expected = mapped_quad(|p| rotation * (2.0 * (p + DVec3::X)) + 5.0 * DVec3::Y);
    assert_corners(&scene_with_keys(&builder, "moved", keys), &expected);
    assert_eq!(
        corners(&scene_with_keys(
            &builder,
            "moved",
            "matrix = [[1, 0, 0, 3], [0, 1, 0, 0], [0, 0, 1, 0]]"
        ))[0][0]
            .x,
        3.0
    );
}
