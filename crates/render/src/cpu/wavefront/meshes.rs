//! The meshes of a scene in the form for batches of rays.

use rayon::prelude::*;

use super::super::bvh::traversal_mesh;
use super::super::traversal::BatchMesh;
use crate::records::Packed;

/// Maximum number of triangles of all meshes, which limits the memory to about 0.5 GB.
const MAX_TRIANGLES: usize = 4_000_000;

/// The meshes of a scene.
#[derive(Clone, Debug, Default)]
pub struct BatchMeshes {
    /// Empty if the meshes are too large.
    meshes: Vec<BatchMesh>,
}

impl BatchMeshes {
    pub fn new(scene: &Packed) -> BatchMeshes {
        BatchMeshes::with_limit(scene, MAX_TRIANGLES)
    }

    /// Converts the meshes of a scene with at most `max_triangles` triangles. Rays in larger scenes are traced one by
    /// one.
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

    /// Returns true if the meshes of the scene are too large.
    pub fn are_missing(&self, scene: &Packed) -> bool {
        self.meshes.len() < scene.bvh.meshes.len()
    }

    /// Returns the mesh of an instance.
    #[inline(always)]
    pub fn of_instance(&self, scene: &Packed, instance_index: u32) -> &BatchMesh {
        &self.meshes[scene.bvh.instances[instance_index as usize].mesh as usize]
    }
}
