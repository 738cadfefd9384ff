//! Options for a file that is rendered without a scene: `fov`, `orbit`, `up` and `ground`.

use std::path::PathBuf;

use glam::DVec3;
use serde_json::json;
use wgray::Scene;
use wgray::scene::{Geometry, GltfChoice, Orbit, Overrides, Presentation, Projection, View};

use super::build::{Builder, Packing};
use super::read::triangles;
use crate::test_folder::TestFolder;

/// Writes a model of a spike from the origin to 3 along an axis.
fn write_spike(folder: &TestFolder, axis: DVec3, has_camera: bool) -> PathBuf {
    let mut builder = Builder::new();
    let side = axis.any_orthonormal_vector() * 0.25;
    let points = [side, -side, axis * 3.0].map(|p| p.to_array());
    let position = builder.floats(&points);
    let primitive = json!({ "attributes": { "POSITION": position } });
    let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
    builder.root_node(json!({ "mesh": mesh }));
    if has_camera {
        let lens = json!({ "yfov": 0.7, "znear": 0.1 });
        let camera = builder.add("cameras", json!({ "type": "perspective", "perspective": lens }));
        builder.root_node(json!({ "camera": camera, "translation": [0, 0, 9] }));
    }
    builder.write(folder.folder(), "spike", Packing::Binary)
}

fn load(file: &PathBuf, presentation: Presentation, view: Option<View>) -> Result<Scene, String> {
    let overrides = Overrides {
        presentation,
        gltf: GltfChoice {
            view,
            ..GltfChoice::default()
        },
        ..Overrides::default()
    };
    Scene::load_with(file, &overrides).map_err(|error| error.to_string())
}

#[test]
fn any_axis_can_point_up() {
    let folder = TestFolder::with_file("a", "");
    for (name, axis) in [
        ("x", DVec3::X),
        ("-x", DVec3::NEG_X),
        ("Y", DVec3::Y),
        ("-y", DVec3::NEG_Y),
        ("+z", DVec3::Z),
        ("-z", DVec3::NEG_Z),
    ] {
        let file = write_spike(&folder, axis, false);
        let presentation = Presentation {
            up: Some(name.parse().unwrap()),
            ..Presentation::default()
        };
        let scene = load(&file, presentation, Some(View::Front)).unwrap();
        let triangle = triangles(&scene)[0].corners;
        // After the rotation, the spike points along +y, the up axis of glTF files.
        assert!(triangle[2].distance(DVec3::Y * 3.0) < 1e-6, "{name}: {triangle:?}");
        // The camera frames the model in its new orientation.
        let camera = scene.camera;
        assert!(camera.position.z > 0.0 && camera.position.z < 3.0, "{name}: {camera:?}");
        assert_eq!(camera.forward.z, 0.0, "{name}");
    }
    assert_eq!(
        "w".parse::<wgray::scene::UpAxis>().unwrap_err(),
        "must be x, y, z, -x, -y or -z"
    );
}

#[test]
fn the_ground_lies_below_the_model() {
    let folder = TestFolder::with_file("a", "");
    for (up, min_z) in [("y", 0.0), ("-y", -3.0), ("x", 0.0)] {
        let file = write_spike(&folder, DVec3::Y, false);
        let presentation = Presentation {
            ground: true,
            up: Some(up.parse().unwrap()),
            ..Presentation::default()
        };
        let scene = load(&file, presentation, None).unwrap();
        let disks: Vec<_> = scene
            .shapes
            .iter()
            .filter_map(|shape| match &shape.geometry {
                Geometry::Disk(disk) => Some((disk.center, disk.u.length(), shape.material)),
                _ => None,
            })
            .collect();
        let [(center, radius, material)] = disks[..] else {
            panic!("{up}: {:?}", scene.shapes);
        };
        assert_eq!(scene.material_names[material], "ground");
        let gap_to_model = min_z - center.z;
        assert!(gap_to_model > 0.0 && gap_to_model < 1e-3, "{up}: {center}");
        assert!(radius > 10.0, "{radius}");
        // The camera frames the model, not the ground.
        let without_ground = Presentation {
            ground: false,
            ..presentation
        };
        assert_eq!(scene.camera, load(&file, without_ground, None).unwrap().camera);
    }
}

#[test]
fn a_ground_that_hides_the_model_is_reported() {
    let folder = TestFolder::with_file("a", "");
    let file = write_spike(&folder, DVec3::Y, false);
    let notes = |ground, view| {
        let presentation = Presentation {
            ground,
            ..Presentation::default()
        };
        load(&file, presentation, Some(view)).unwrap().notes
    };
    let [note] = &notes(true, View::Bottom)[..] else {
        panic!("{:?}", notes(true, View::Bottom))
    };
    assert!(
        note.message
            .starts_with("the camera is below the ground, which hides the model"),
        "{note}"
    );
    for (ground, view) in [(false, View::Bottom), (true, View::Top), (true, View::Front)] {
        assert_eq!(notes(ground, view), Vec::<String>::new(), "{ground} {view:?}");
    }
}

#[test]
fn the_automatic_camera_is_adjusted() {
    let folder = TestFolder::with_file("a", "");
    let file = write_spike(&folder, DVec3::Y, true);
    let with_fov = |fov| Presentation {
        fov: Some(fov),
        ..Presentation::default()
    };
    let scene = load(&file, with_fov(50.0), Some(View::Front)).unwrap();
    let Projection::Perspective { fov: found } = scene.camera.projection else {
        panic!("{:?}", scene.camera);
    };
    assert!((found.to_degrees() - 50.0).abs() < 1e-9, "{found}");
    let orbit = Presentation {
        orbit: Some(Orbit {
            azimuth: 90.0,
            elevation: 0.0,
        }),
        ..Presentation::default()
    };
    let camera = load(&file, orbit, None).unwrap().camera;
    assert!(camera.forward.distance(DVec3::NEG_X) < 1e-9, "{camera:?}");
    for invalid_fov in [0.5, 171.0, f64::NAN] {
        let message = load(&file, with_fov(invalid_fov), Some(View::Front)).unwrap_err();
        assert_eq!(message, format!("fov: {invalid_fov} must be from 1 to 170 degrees"));
    }
    let rule = "only applies to the automatic camera, and the file has its own camera; add --view or --orbit";
    assert_eq!(load(&file, with_fov(50.0), None).unwrap_err(), format!("fov: {rule}"));
    let up = Presentation {
        up: Some("z".parse().unwrap()),
        ..Presentation::default()
    };
    assert_eq!(load(&file, up, None).unwrap_err(), format!("up: {rule}"));
    // The option `ground` also applies to files with a camera.
    let ground = Presentation {
        ground: true,
        ..Presentation::default()
    };
    load(&file, ground, None).unwrap();
}
