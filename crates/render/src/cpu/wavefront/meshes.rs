//! The meshes of a scene, converted for traversal by batches of rays.

use rayon::prelude::*;

use super::super::bvh::traversal_mesh;
use super::super::traversal::BatchMesh;
use crate::records::Packed;

/// Maximum total number of triangles. It limits the memory of the converted meshes to about 0.5 GB.
const MAX_TRIANGLES: usize = 4_000_000;

/// The converted meshes of a scene.
#[derive(Clone, Debug, Default)]
pub struct BatchMeshes {
    /// Empty if the scene has too many triangles.
    meshes: Vec<BatchMesh>,
}

impl BatchMeshes {
    pub fn new(scene: &Packed) -> BatchMeshes {
        BatchMeshes::with_limit(scene, MAX_TRIANGLES)
    }

    /// Converts the meshes of a scene with at most `max_triangles` triangles. Meshes of larger scenes are not
    /// converted; their rays are traced one by one.
    pub fn with_limit(scene: &Packed, max_triangles: usize) -> BatchMeshes {
        let meshes = &scene.bvh.meshes;
        if meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>() > max_triangles {
            return BatchMeshes::default();
        }
        let meshes = meshes.par_iter().map(|mesh| BatchMesh::new(&traversal_mesh(mesh)));
        BatchMeshes {
            meshes: meshes.collect(),
        }
    }

    /// Returns true if the meshes were not converted because the scene has too many triangles.
    pub fn are_not_converted(&self, scene: &Packed) -> bool {
        self.meshes.len() < scene.bvh.meshes.len()
    }

    /// Returns the mesh of an instance.
    #[inline(always)]
    pub fn of_instance(&self, scene: &Packed, instance_index: u32) -> &BatchMesh {
        &self.meshes[scene.bvh.instances[instance_index as usize].mesh as usize]
    }
}
