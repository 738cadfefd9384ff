//! Bounds of meshes away from the origin, compared with the vertices of the file in f64.

use serde_json::json;
use wgray::DVec3;
use wgray::scene::Scene;

use crate::gltf::build::{Builder, Packing, QUAD};
use crate::random::Random;

fn bounds_of(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    })
}

fn assert_bounds(scene: &Scene, expected: (DVec3, DVec3), case: &str) {
    let (low, high) = scene.bounds().expect("bounds");
    let size = (expected.1 - expected.0).max_element();
    for (found, corner) in [(low, expected.0), (high, expected.1)] {
        // Stored positions have 24 significant bits.
        let error = (found - corner).abs().max_element();
        assert!(error <= 1e-6 * size, "{case}: {found}, expected {corner}");
    }
}

const SCENE_START: &str = "image = { width = 4, height = 4 }\n\
                    camera = { position = [0, -5, 0], look_at = [0, 0, 0], fov = 40 }\n\
                    materials.m = { type = 'phong', color = [0.5, 0.5, 0.5] }\n";

/// Returns an OBJ file of random triangles, and its vertices.
fn cloud(random: &Random, center: DVec3, size: f64) -> (String, Vec<DVec3>) {
    let coordinate = || size * random.between(-1.0, 1.0);
    let points: Vec<DVec3> = (0..30)
        .map(|_| center + DVec3::new(coordinate(), coordinate(), coordinate()))
        .collect();
    let mut text = String::new();
    for p in &points {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for i in 0..10 {
        text += &format!("f {} {} {}\n", 3 * i + 1, 3 * i + 2, 3 * i + 3);
    }
    (text, points)
}

#[test]
fn meshes_away_from_the_origin_have_exact_bounds() {
    let random = Random::new(81);
    let folder = tempfile::tempdir().unwrap();
    for (i, (center, size)) in [
        (DVec3::new(10.5, 0.5, 0.0), 0.5),
        (DVec3::new(-300.0, 20.0, 7.0), 2.0),
        (DVec3::new(0.0, 0.0, 1e5), 1.0),
        (DVec3::ZERO, 3.0),
    ]
    .into_iter()
    .enumerate()
    {
        let (text, points) = cloud(&random, center, size);
        std::fs::write(folder.path().join(format!("{i}.obj")), text).unwrap();
        let path = folder.path().join("scene.toml");
        let file = format!("file = '{i}.obj'\n");
        let transform = "material = 'm'\nscale = [2, 1, -3]\nrotate = [0, 0, 90]\ntranslate = [5, 6, 7]\n";
        // The scaled coordinates are rotated by 90 degrees around z: x' = -y, y' = x.
        let transformed = |p: &DVec3| DVec3::new(-p.y + 5.0, 2.0 * p.x + 6.0, -3.0 * p.z + 7.0);

        let shape = format!("{SCENE_START}[[shapes]]\ntype = 'mesh'\n{file}{transform}");
        std::fs::write(&path, shape).unwrap();
        let scene = Scene::load(&path).unwrap();
        assert_bounds(&scene, bounds_of(points.iter().map(transformed)), "a shape");

        let instances = format!(
            "{SCENE_START}[meshes.a]\n{file}[[instances]]\nmesh = 'a'\n{transform}[[instances]]\nmesh = 'a'\nmaterial = 'm'\n"
        );
        std::fs::write(&path, instances).unwrap();
        let scene = Scene::load(&path).unwrap();
        let all_points = points.iter().map(transformed).chain(points.iter().copied());
        assert_bounds(&scene, bounds_of(all_points), "two instances");
        let instance_bounds = scene.shapes[1].geometry.bounds().expect("bounds");
        let expected = bounds_of(points.iter().copied());
        assert!(
            (instance_bounds.0 - expected.0).abs().max_element() < 1e-5 * size,
            "{instance_bounds:?} {expected:?}"
        );
    }
}

#[test]
fn gltf_files_have_exact_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = Builder::new();
    let positions = QUAD.map(|[x, y, z]| [x + 20.0, y - 7.0, z + 3.0]);
    let position = file.floats(&positions);
    let mesh = file.quad_with(json!({ "POSITION": position }), None);
    file.root_node(json!({ "mesh": mesh, "translation": [1, 2, 3], "scale": [2, 2, 2] }));
    let path = file.write(folder.path(), "away", Packing::Binary);
    let scene = Scene::load(&path).unwrap();
    // glTF's (x, y, z) is (x, -z, y) in scene coordinates.
    let to_scene = |[x, y, z]: [f64; 3]| DVec3::new(2.0 * x + 1.0, -(2.0 * z + 3.0), 2.0 * y + 2.0);
    assert_bounds(&scene, bounds_of(positions.into_iter().map(to_scene)), "glTF");
}
