//! Files of random scenes: meshes and images.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;

use crate::meshes::procedural::TriangleMesh;
use crate::random::Random;
use crate::textures::write_exr;

/// Environment maps next to the meshes: name, width and height.
pub const ENVIRONMENT_MAPS: &[(&str, u32, u32)] = &[("dot.exr", 1, 1), ("odd.exr", 5, 3), ("wide.exr", 64, 32)];

/// Mesh files: name, has texture coordinates, has normals. Failing tests write their scenes to the same folder.
pub const MESHES: &[(&str, bool, bool)] = &[
    ("soup.obj", true, false),
    ("slivers.obj", false, false),
    ("ball.obj", true, true),
    ("cube.obj", true, false),
    ("rock.obj", true, true),
    ("painted.ply", true, true),
];

/// Returns the folder of random scenes and their meshes, created at the first call.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<&Path> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let random = Random::new(21);
        for (name, has_uvs, has_normals) in MESHES {
            let triangle_mesh = match *name {
                "soup.obj" => TriangleMesh::soup(60, &random),
                "slivers.obj" => TriangleMesh::slivers(40, &random),
                "ball.obj" | "painted.ply" => TriangleMesh::icosphere(1),
                "cube.obj" => TriangleMesh::cube(),
                _ => bumpy(&random),
            };
            let uvs: Vec<[f64; 2]> = triangle_mesh
                .points
                .iter()
                .map(|p| [p.x * 0.7 + p.z, p.y - 0.3 * p.x])
                .collect();
            let normals: Vec<DVec3> = triangle_mesh.points.iter().map(|p| p.normalize()).collect();
            let text = match *name {
                "painted.ply" => painted(&triangle_mesh, &normals, &uvs, &random),
                _ => triangle_mesh.obj(has_normals.then_some(&normals), has_uvs.then_some(&uvs)),
            };
            // Renaming is atomic: concurrent readers see a complete file.
            let temporary = folder.join(format!("{name}.{}", std::process::id()));
            fs::write(&temporary, text).expect("a writable folder");
            fs::rename(&temporary, folder.join(name)).expect("a writable folder");
        }
        for (name, width, height) in ENVIRONMENT_MAPS {
            let temporary = folder.join(format!("{}.{name}", std::process::id()));
            let value = || random.pick(&[0.0, 0.1, 0.5, 1.0, 30.0]);
            write_exr(&temporary, *width, *height, |_, _| [value(), value(), value()]);
            fs::rename(&temporary, folder.join(name)).expect("a writable folder");
        }
        folder
    })
}

/// Returns a PLY file with vertex colors, some of which are 0 or above 1.
fn painted(triangle_mesh: &TriangleMesh, normals: &[DVec3], uvs: &[[f64; 2]], random: &Random) -> String {
    let names = [
        "x", "y", "z", "nx", "ny", "nz", "u", "v", "red", "green", "blue", "alpha",
    ];
    let properties: String = names.iter().map(|name| format!("property float {name}\n")).collect();
    let (vertices, faces) = (triangle_mesh.points.len(), triangle_mesh.triangles.len());
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\n{properties}element face {faces}\n\
         property list uchar int vertex_indices\nend_header\n"
    );
    for ((p, n), [u, v]) in triangle_mesh.points.iter().zip(normals).zip(uvs) {
        let [r, g, b] = [0, 1, 2].map(|_| random.pick(&[0.0, 0.3, 1.0, 2.5]));
        let a = random.pick(&[0.0, 0.5, 0.9, 1.0]);
        text += &format!(
            "{} {} {} {} {} {} {u} {v} {r} {g} {b} {a}\n",
            p.x, p.y, p.z, n.x, n.y, n.z
        );
    }
    for [a, b, c] in &triangle_mesh.triangles {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

fn bumpy(random: &Random) -> TriangleMesh {
    let mut triangle_mesh = TriangleMesh::icosphere(2);
    triangle_mesh
        .points
        .iter_mut()
        .for_each(|p| *p *= random.between(0.4, 1.3));
    triangle_mesh
}
