//! Mesh files and their errors, procedural meshes, tangents, and watertight intersection through any BVH.

mod bad_input;
mod bounds;
mod damage;
mod in_code;
mod make_mesh_example;
mod materials;
mod model;
mod polygons;
pub mod procedural;
mod readers;
mod sphere;
mod tangents;
mod trees;
mod vertices;
mod watertight;

use wgray::mesh::{Mesh, Normals};

/// Writes a mesh file and loads it. Error messages begin with the name of the file.
pub fn load(name: &str, bytes: impl AsRef<[u8]>, normals: Option<Normals>) -> Result<Mesh, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    Mesh::load(&path, normals).map_err(|error| {
        let message = error.to_string();
        let prefix = format!("{}/", folder.path().display());
        message
            .strip_prefix(&prefix)
            .unwrap_or_else(|| panic!("{message}"))
            .to_string()
    })
}

/// Returns triangle corners in file coordinates.
pub fn corners(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
    let position = |vertex: u32| (mesh.positions[vertex as usize].as_dvec3() + mesh.center).to_array();
    mesh.triangles.iter().map(|triangle| triangle.map(position)).collect()
}
