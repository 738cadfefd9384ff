//! The meshes of `examples/make_mesh.rs`.

use std::fs;

use wgray::mesh::{Mesh, Normals};

use super::load;

#[path = "../../examples/make_mesh.rs"]
#[allow(dead_code, reason = "the tests do not call `main`")]
mod make_mesh;

/// Returns true if each edge is used equally often in both directions. Vertices at the same position are merged.
fn is_closed(mesh: &Mesh) -> bool {
    let mut edges = std::collections::HashMap::new();
    for triangle in &mesh.triangles {
        let p = triangle.map(|vertex| mesh.positions[vertex as usize].to_array().map(f32::to_bits));
        for (from, to) in [(p[0], p[1]), (p[1], p[2]), (p[2], p[0])] {
            *edges.entry((from, to)).or_insert(0) += 1;
            *edges.entry((to, from)).or_insert(0) -= 1;
        }
    }
    edges.values().all(|sum| *sum == 0)
}

/// Returns six times the volume, which is positive if the triangles are counterclockwise.
fn volume_times_6(mesh: &Mesh) -> f64 {
    let position = |vertex: u32| mesh.positions[vertex as usize].as_dvec3();
    let volume = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(position);
        a.dot(b.cross(c))
    };
    mesh.triangles.iter().map(volume).sum()
}

#[test]
fn the_knot_file_matches_the_example() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/meshes/knot.obj");
    assert!(
        fs::read_to_string(path).unwrap() == make_mesh::knot(),
        "{path} differs from the output of examples/make_mesh.rs"
    );
}

#[test]
fn the_knot_is_closed_and_rests_on_the_floor() {
    let text = make_mesh::knot();
    assert!(text.len() < 400_000);
    let mesh = load("knot.obj", &text, None).unwrap();
    assert_eq!(mesh.notes, Vec::<String>::new());
    assert!((4000..8000).contains(&mesh.triangles.len()));
    assert!(is_closed(&mesh) && volume_times_6(&mesh) > 0.0);
    assert_eq!(
        (mesh.normals.len(), mesh.uvs.len()),
        (mesh.positions.len(), mesh.positions.len())
    );
    let min_z = mesh.positions.iter().map(|p| p.z).fold(f32::INFINITY, f32::min);
    let max_radius = mesh
        .positions
        .iter()
        .map(|p| p.x.abs().max(p.y.abs()))
        .fold(0.0, f32::max);
    assert_eq!((min_z, max_radius), (0.0, 0.4));
    // Analytic and averaged normals agree.
    let smooth = load("knot.obj", &text, Some(Normals::Smooth)).unwrap();
    let position = |mesh: &Mesh, i: usize, k: usize| mesh.positions[mesh.triangles[i][k] as usize];
    let normal = |mesh: &Mesh, i: usize, k: usize| mesh.normals[mesh.triangles[i][k] as usize];
    for (i, k) in (0..mesh.triangles.len()).flat_map(|i| (0..3).map(move |k| (i, k))) {
        assert_eq!(position(&mesh, i, k), position(&smooth, i, k));
        assert!(normal(&mesh, i, k).dot(normal(&smooth, i, k)) > 0.98);
    }
}

#[test]
fn large_meshes_are_valid_and_of_the_requested_size() {
    let folder = tempfile::tempdir().unwrap();
    for count in [1000, 30_000] {
        let mut rocks = Vec::new();
        for (triangles, is_rock) in [(make_mesh::rock(count), true), (make_mesh::terrain(count), false)] {
            for name in ["a.obj", "a.ply", "a.stl"] {
                let path = folder.path().join(name);
                fs::write(&path, triangles.to_bytes(name).unwrap()).unwrap();
                let mesh = Mesh::load(&path, None).unwrap();
                assert_eq!(mesh.notes, Vec::<String>::new());
                let ratio = mesh.triangles.len() as f64 / count as f64;
                assert!((0.9..1.1).contains(&ratio), "{ratio}");
                assert_eq!(is_closed(&mesh), is_rock);
                if is_rock {
                    assert!(volume_times_6(&mesh) > 0.0);
                    rocks.push(mesh);
                }
            }
        }
        assert!(
            volume_times_6(&rocks[0]) == volume_times_6(&rocks[1])
                && volume_times_6(&rocks[0]) == volume_times_6(&rocks[2])
        );
    }
}
