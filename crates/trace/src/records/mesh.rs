//! Packed meshes: triangles in leaf order, and vertex attributes in rows.

use bytemuck::cast_slice;
use glam::{UVec4, Vec3, Vec4};

use super::Node;
use crate::bvh::{DecodedMesh, DecodedOnce};

/// A packed mesh, in object space.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedMesh {
    /// BVH over the triangles.
    pub nodes: Vec<Node>,
    /// Vertex indices and triangle index, in leaf order.
    pub triangles: Vec<UVec4>,
    /// Position and texture coordinate u of each vertex.
    pub vertices: Vec<Vec4>,
    /// Normal (0 if the mesh has no normals) and texture coordinate v of each vertex; empty if the mesh has neither
    /// normals nor texture coordinates.
    pub attributes: Vec<Vec4>,
    /// Tangents along u and v of each vertex, or empty.
    pub tangents: Vec<[Vec4; 2]>,
    /// Linear RGB and opacity of each vertex, or empty.
    pub colors: Vec<Vec4>,
    /// Further texture coordinates, two sets per row, with the rows of a vertex in sequence; or empty.
    pub more_uvs: Vec<Vec4>,
    /// Group of each triangle, in triangle order; empty for a single group.
    pub groups: Vec<u32>,
    /// Lower corner of the bounding box.
    pub low: Vec3,
    /// Upper corner of the bounding box.
    pub high: Vec3,
    /// The form for traversal on the CPU.
    pub decoded: DecodedOnce<DecodedMesh>,
}

impl PackedMesh {
    /// Returns the size of all lists in bytes.
    pub fn bytes(&self) -> u64 {
        self.lists().map(|bytes| bytes.len() as u64).sum()
    }

    /// Returns all lists. The pattern names every field, so that the compiler rejects a forgotten field.
    pub fn lists(&self) -> impl Iterator<Item = &[u8]> {
        let PackedMesh {
            nodes,
            triangles,
            vertices,
            attributes,
            tangents,
            colors,
            more_uvs,
            groups,
            low: _,
            high: _,
            decoded: _,
        } = self;
        let lists: [&[u8]; 8] = [
            cast_slice(nodes),
            cast_slice(triangles),
            cast_slice(vertices),
            cast_slice(attributes),
            cast_slice(tangents),
            cast_slice(colors),
            cast_slice(more_uvs),
            cast_slice(groups),
        ];
        lists.into_iter()
    }

    /// Returns the largest absolute coordinate of the bounding box.
    pub fn size(&self) -> f32 {
        self.low.abs().max(self.high.abs()).max_element()
    }
}
