//! Builder of meshes in code, with validation.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::{Group, Mesh};
use crate::problem::Problem;

/// A builder of a mesh; [`Mesh::builder`] creates it. A second call of a method replaces the list of the first call.
#[derive(Clone, Debug, Default)]
pub struct MeshBuilder {
    mesh: Mesh,
}

impl Mesh {
    /// Returns a builder of a mesh.
    pub fn builder() -> MeshBuilder {
        MeshBuilder::default()
    }
}

impl MeshBuilder {
    /// Sets the positions of the vertices, relative to the center.
    #[must_use]
    pub fn positions(mut self, positions: &[[f32; 3]]) -> MeshBuilder {
        self.mesh.positions = positions.iter().copied().map(Vec3::from_array).collect();
        self
    }

    /// Sets the center, which positions are relative to: rounding errors are smallest near the center. The default is
    /// (0, 0, 0).
    #[must_use]
    pub fn center(mut self, center: impl Into<DVec3>) -> MeshBuilder {
        self.mesh.center = center.into();
        self
    }

    /// Sets the triangles: the indices of their vertices, counter-clockwise as seen from outside.
    #[must_use]
    pub fn triangles(mut self, triangles: &[[u32; 3]]) -> MeshBuilder {
        self.mesh.triangles = triangles.to_vec();
        self
    }

    /// Sets the unit normals of the vertices. Without normals, shading is flat.
    #[must_use]
    pub fn normals(mut self, normals: &[[f32; 3]]) -> MeshBuilder {
        self.mesh.normals = normals.iter().copied().map(Vec3::from_array).collect();
        self
    }

    /// Sets the texture coordinates of the vertices.
    #[must_use]
    pub fn uvs(mut self, uvs: &[[f32; 2]]) -> MeshBuilder {
        self.mesh.uvs = uvs.iter().copied().map(Vec2::from_array).collect();
        self
    }

    /// Sets the colors of the vertices: linear RGB from 0 to 1e6, and opacity from 0 to 1.
    #[must_use]
    pub fn colors(mut self, colors: &[[f32; 4]]) -> MeshBuilder {
        self.mesh.colors = colors.iter().copied().map(Vec4::from_array).collect();
        self
    }

    /// Sets the names of the groups, which can have different materials, and for each triangle the index of its group.
    #[must_use]
    pub fn groups(mut self, names: &[&str], group_of: &[u32]) -> MeshBuilder {
        let group = |name: &&str| Group {
            name: (*name).to_owned(),
            material: None,
        };
        self.mesh.groups = names.iter().map(group).collect();
        self.mesh.group_of = group_of.to_vec();
        self
    }

    /// Validates the mesh. A mesh without groups gets one group.
    ///
    /// # Errors
    ///
    /// The first violated rule: there are no triangles, an index is out of range, the length of a list is not the
    /// number of vertices, or a value is out of range.
    pub fn build(self) -> Result<Arc<Mesh>, Problem> {
        let mut mesh = self.mesh;
        if mesh.groups.is_empty() {
            mesh.groups.push(Group::default());
        }
        let mesh = Arc::new(mesh);
        match mesh.broken_rule() {
            None => Ok(mesh),
            Some(rule) => Err(Problem::new(rule)),
        }
    }
}
