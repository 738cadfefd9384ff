//! Decoding of the meshes of a scene for faster traversal.

use bytemuck::cast_slice;
use rayon::prelude::*;

use crate::bvh::DecodedMesh;
use crate::records::{Packed, PackedMesh};

/// Maximum total number of triangles. It limits the memory of the decoded meshes to about 0.5 GB.
const MAX_TRIANGLES: usize = 4_000_000;

/// Decodes the meshes of a scene, unless they have too many triangles.
pub fn decode_meshes(scene: &Packed) {
    decode_meshes_up_to(scene, MAX_TRIANGLES);
}

/// Decodes the meshes of a scene with at most `max_triangles` triangles.
pub fn decode_meshes_up_to(scene: &Packed, max_triangles: usize) {
    let meshes = &scene.bvh.meshes;
    if meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>() <= max_triangles {
        meshes.par_iter().for_each(|mesh| {
            mesh.decoded.get_or_init(|| decoded(mesh));
        });
    }
}

/// Returns true if all meshes of a scene are decoded.
pub fn are_decoded(scene: &Packed) -> bool {
    scene.bvh.meshes.iter().all(|mesh| mesh.decoded.get().is_some())
}

/// Returns the mesh of an instance, if it is decoded.
#[inline(always)]
pub fn decoded_mesh(scene: &Packed, instance_index: u32) -> Option<&DecodedMesh> {
    let mesh = scene.bvh.instances[instance_index as usize].mesh;
    scene.bvh.meshes[mesh as usize].decoded.get()
}

fn decoded(mesh: &PackedMesh) -> DecodedMesh {
    DecodedMesh::new(
        cast_slice(&mesh.nodes),
        cast_slice(&mesh.vertices),
        cast_slice(&mesh.triangles),
    )
}
