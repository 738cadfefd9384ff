//! Meshes as both backends read them: triangles in the order of a BVH's leaves, vertices in rows.

use glam::{UVec4, Vec3, Vec4};

use super::Node;

/// A mesh as both backends read it, in its own space.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedMesh {
    /// The tree over its triangles.
    pub nodes: Vec<Node>,
    /// The triangles in the order of the tree's leaves: the numbers of three vertices, and the triangle's own.
    pub triangles: Vec<UVec4>,
    /// Each vertex's position, and its u.
    pub vertices: Vec<Vec4>,
    /// Each vertex's normal, 0 if there is none, and its v; empty if there are neither normals nor texture coordinates.
    pub attributes: Vec<Vec4>,
    /// Each vertex's tangents along u and along v, for normal maps; or empty.
    pub tangents: Vec<[Vec4; 2]>,
    /// Each vertex's colour, linear RGB and opacity; or empty.
    pub colors: Vec<Vec4>,
    /// Each vertex's further texture coordinates, two sets in a row, all of a vertex's rows together; or empty.
    pub more_uvs: Vec<Vec4>,
    /// Each triangle's group, in the order of the triangles; none if there is one group alone.
    pub groups: Vec<u32>,
    /// The lower corner of its box.
    pub low: Vec3,
    /// The upper corner of its box.
    pub high: Vec3,
}

impl PackedMesh {
    /// The memory that it takes.
    pub fn bytes(&self) -> u64 {
        let lists = [
            size_of_val(self.nodes.as_slice()),
            size_of_val(self.triangles.as_slice()),
            size_of_val(self.vertices.as_slice()),
            size_of_val(self.attributes.as_slice()),
            size_of_val(self.tangents.as_slice()),
            size_of_val(self.colors.as_slice()),
            size_of_val(self.more_uvs.as_slice()),
            size_of_val(self.groups.as_slice()),
        ];
        lists.iter().map(|bytes| *bytes as u64).sum()
    }

    /// Its largest coordinate.
    pub fn size(&self) -> f32 {
        self.low.abs().max(self.high.abs()).max_element()
    }
}
