//! Decoding of the BVHs of a scene for faster traversal.

use bytemuck::cast_slice;
use rayon::prelude::*;

use crate::bvh::{Aabb, DecodedMesh, decode_items};
use crate::records::{Packed, PackedMesh};

/// Maximum total number of items and triangles. It limits the memory of the decoded BVHs to about 0.5 GB.
const MAX_LEAVES: usize = 4_000_000;

/// Decodes the BVHs of a scene, unless they have too many items and triangles.
pub fn decode_bvhs(scene: &Packed) {
    decode_bvhs_up_to(scene, MAX_LEAVES);
}

/// Decodes the BVHs of a scene with at most `max_leaves` items and triangles in total.
pub fn decode_bvhs_up_to(scene: &Packed, max_leaves: usize) {
    let bvh = &scene.bvh;
    let triangles: usize = bvh.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    if bvh.items.len() + triangles > max_leaves {
        return;
    }
    bvh.meshes
        .par_iter()
        .for_each(|mesh| mesh.decoded.init(|| decoded(mesh)));
    bvh.decoded.init(|| {
        decode_items(cast_slice(&bvh.nodes), |i| Aabb {
            low: bvh.items[i].low,
            high: bvh.items[i].high,
        })
    });
}

/// Returns true if all BVHs of a scene are decoded.
pub fn are_decoded(scene: &Packed) -> bool {
    let bvh = &scene.bvh;
    let has_nodes = bvh.decoded.get().is_some_and(|nodes| nodes.len() == bvh.nodes.len());
    has_nodes && bvh.meshes.iter().all(|mesh| mesh.decoded.get().is_some())
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
