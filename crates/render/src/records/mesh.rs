//! Packed meshes: triangles in the order of the leaves of a BVH, and vertex attributes in rows.

use bytemuck::cast_slice;
use glam::{UVec4, Vec3, Vec4};

use super::Node;

/// A packed mesh, in object space.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedMesh {
    /// The BVH over its triangles.
    pub nodes: Vec<Node>,
    /// The triangles in the order of the leaves: the indices of three vertices, and the index of the triangle.
    pub triangles: Vec<UVec4>,
    /// Position and u of each vertex.
    pub vertices: Vec<Vec4>,
    /// Normal, or 0, and v of each vertex; empty without normals and texture coordinates.
    pub attributes: Vec<Vec4>,
    /// Tangents along u and v of each vertex, for normal maps; or empty.
    pub tangents: Vec<[Vec4; 2]>,
    /// Color of each vertex, linear RGB and opacity; or empty.
    pub colors: Vec<Vec4>,
    /// Further texture coordinates of each vertex, two sets per row, the rows of a vertex together; or empty.
    pub more_uvs: Vec<Vec4>,
    /// Group of each triangle, in the order of the triangles; empty if there is a single group.
    pub groups: Vec<u32>,
    /// The lower corner of its bounding box.
    pub low: Vec3,
    /// The upper corner of its bounding box.
    pub high: Vec3,
}

impl PackedMesh {
    /// Returns its size in bytes.
    pub fn bytes(&self) -> u64 {
        self.lists().map(|bytes| bytes.len() as u64).sum()
    }

    /// Returns all lists. Every field is named, so that a new one cannot be forgotten.
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

    /// Returns its largest absolute coordinate.
    pub fn size(&self) -> f32 {
        self.low.abs().max(self.high.abs()).max_element()
    }
}
