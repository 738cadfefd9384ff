//! Cameras of glTF files, and the automatic camera of files without cameras.

use glam::{DQuat, DVec3};
use serde_json::{Value, json};
use wgray::Scene;
use wgray::scene::{Overrides, Projection};

use super::build::{Builder, Packing};
use super::read::{assert_near, to_file, triangles};
use crate::test_folder::TestFolder;

/// Returns a quad and a camera on a rotated node below a scaled node.
fn quad_with_camera(camera: Value) -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    builder.root_node(json!({ "mesh": mesh }));
    let camera = builder.add("cameras", camera);
    let rotation = DQuat::from_rotation_y(0.5).to_array();
    let node = builder.add(
        "nodes",
        json!({ "camera": camera, "rotation": rotation, "translation": [0, 0, 1] }),
    );
    builder.root_node(json!({ "translation": [1, 2, 3], "scale": [2, 2, 2], "children": [node] }));
    builder
}

fn load(builder: &Builder, name: &str) -> Scene {
    let folder = TestFolder::with_file("a", "");
    let file = builder.write(folder.folder(), name, Packing::Binary);
    Scene::load(&file).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_turntable_of_a_tilted_camera_is_level() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    builder.root_node(json!({ "mesh": mesh }));
    let camera = builder.add(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }),
    );
    let tilt = DQuat::from_rotation_x(-0.4).to_array();
    builder.root_node(json!({ "camera": camera, "rotation": tilt, "translation": [0, 2, 5] }));
    let folder = TestFolder::with_file("a", "");
    let file = builder.write(folder.folder(), "tilted", Packing::Binary);
    let overrides = Overrides {
        turntable: Some(5),
        ..Overrides::default()
    };
    let scene = Scene::load_with(&file, &overrides).unwrap();
    for frame in 1..=5 {
        let camera = scene.camera_at(f64::from(frame)).unwrap();
        assert_near([camera.position.z, camera.right.z], [2.0, 0.0]);
        assert!(
            camera.forward.z < -0.3 && camera.up.z > 0.9,
            "frame {frame}: {camera:?}"
        );
    }
}

#[test]
fn the_camera_of_a_file_is_placed_by_its_node() {
    let perspectives = [
        (
            "camera",
            json!({ "yfov": 0.7, "znear": 0.1, "zfar": 100, "aspectRatio": 2 }),
        ),
        ("camera-infinite", json!({ "yfov": 0.7, "znear": 0.1 })),
    ];
    for (name, perspective) in perspectives {
        let is_wide = perspective["aspectRatio"].is_number();
        let builder = quad_with_camera(json!({ "type": "perspective", "perspective": perspective }));
        let scene = load(&builder, name);
        assert_eq!((scene.width, scene.height), (720, if is_wide { 360 } else { 720 }));
        let camera = scene.camera;
        assert_near(to_file(camera.position).to_array(), [1.0, 2.0, 5.0]);
        // The camera looks along -z of its node; the node's scale is ignored.
        let forward = DQuat::from_rotation_y(0.5) * -DVec3::Z;
        assert_near(to_file(camera.forward).to_array(), forward.to_array());
        assert_near(to_file(camera.up).to_array(), [0.0, 1.0, 0.0]);
        let right = DQuat::from_rotation_y(0.5) * DVec3::X;
        assert_near(to_file(camera.right).to_array(), right.to_array());
        match camera.projection {
            Projection::Perspective { fov } => assert_near([fov], [0.7]),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn an_orthographic_camera_sees_twice_its_ymag() {
    let camera = json!({ "type": "orthographic", "orthographic": { "xmag": 3, "ymag": 2, "znear": 0, "zfar": 10 } });
    let camera = load(&quad_with_camera(camera), "camera-orthographic").camera;
    match camera.projection {
        Projection::Orthographic { height } => assert_near([height], [4.0]),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_file_without_a_camera_is_framed() {
    for (i, scale) in [
        [1.0, 1.0, 1.0],
        [1e-3, 1.0, 1.0],
        [1e4, 1e4, 1e4],
        [1e-5, 1e-5, 1e-5],
        [50.0, 0.1, 1.0],
    ]
    .into_iter()
    .enumerate()
    {
        let mut builder = Builder::new();
        let mesh = builder.quad(None);
        builder.root_node(json!({ "mesh": mesh, "scale": scale, "translation": [3, -7, 2] }));
        builder.root_node(
            json!({ "mesh": mesh, "scale": scale, "translation": [3, -7, 2], "rotation": [0, 0.6, 0, 0.8] }),
        );
        let scene = load(&builder, &format!("framed-{i}"));
        let camera = &scene.camera;
        let Projection::Perspective { fov } = camera.projection else {
            panic!("{:?}", camera.projection);
        };
        let mut max_extent: f64 = 0.0;
        for corner in triangles(&scene).iter().flat_map(|triangle| triangle.corners) {
            let to_corner = corner - to_file(camera.position);
            let depth = to_corner.dot(to_file(camera.forward));
            assert!(depth > 0.0);
            for axis in [camera.right, camera.up] {
                max_extent = max_extent.max((to_corner.dot(to_file(axis)) / depth / (fov / 2.0).tan()).abs());
            }
        }
        // The model lies inside the image and covers at least half of its width or height.
        assert!(max_extent < 1.0 && max_extent > 0.5, "{scale:?}: {max_extent}");
        assert!(to_file(camera.forward).z < 0.0, "{:?}", camera.forward);
    }
}
