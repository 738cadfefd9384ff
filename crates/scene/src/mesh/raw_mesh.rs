//! Mesh data of a file of any format, before triangulation and the removal of degenerate triangles.

use crate::note::Note;
use glam::{DVec3, Vec2, Vec3, Vec4};

use super::damage::Defects;
use super::error::{Location, MeshFault, format_number};
use super::polygon::Polygon;
use super::{Group, MAX_COORDINATE, MAX_ELEMENTS, Mesh, build};

/// A mesh in file coordinates.
#[derive(Default)]
pub(crate) struct RawMesh {
    pub positions: Vec<DVec3>,
    /// Unit normal of each vertex (zero if invalid), or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of each vertex, or empty.
    pub uvs: Vec<Vec2>,
    pub more_uvs: Vec<Vec<Vec2>>,
    /// Linear RGB and opacity of each vertex, or empty.
    pub colors: Vec<Vec4>,
    /// In the format of [`Mesh::tangents`](super::Mesh::tangents), or empty.
    pub tangents: Vec<Vec4>,
    pub triangles: Vec<[u32; 3]>,
    /// Fans of polygons with more than three corners.
    pub(super) polygons: Vec<Polygon>,
    pub groups: Vec<Group>,
    /// The first triangle and the group of each run of triangles.
    pub runs: Vec<(usize, u32)>,
    pub notes: Vec<Note>,
    /// The reason why the file has no triangles, if known.
    pub(super) no_triangles_reason: Option<&'static str>,
    pub(super) defects: Defects,
}

impl RawMesh {
    /// Assigns the following triangles to a group.
    pub fn begin_group(&mut self, group: u32) {
        if self.runs.last().is_none_or(|(_, last)| *last != group) {
            self.runs.push((self.triangles.len(), group));
        }
    }

    /// Builds the mesh with its normals; `None` if all triangles have zero area. The error is the violated rule.
    pub(crate) fn finish(self) -> Result<Option<Mesh>, String> {
        match build::build_mesh(self, None) {
            Ok(mesh) => Ok(Some(mesh)),
            Err(fault) if fault.is_empty => Ok(None),
            Err(fault) => Err(fault.message),
        }
    }

    /// Adds a face as a triangle fan.
    #[inline]
    pub(super) fn face(&mut self, corners: &[u32], location: Location) -> Result<(), MeshFault> {
        let &[first, ref rest @ ..] = corners else {
            return Ok(());
        };
        let count = rest.len().saturating_sub(1);
        if self.triangles.len() + count > MAX_ELEMENTS {
            return Err(location.fault(format!("there must be at most {MAX_ELEMENTS} triangles")));
        }
        if count > 1 {
            self.polygons.push(Polygon {
                first: self.triangles.len() as u32,
                count: count as u32,
            });
        }
        let triangles = rest.windows(2).map(|pair| [first, pair[0], pair[1]]);
        self.triangles.extend(triangles);
        Ok(())
    }
}

pub(super) fn counted(count: usize, singular: &str, plural: &str) -> Note {
    format!("{count} {}", if count == 1 { singular } else { plural }).into()
}

/// Checks a coordinate. -0 becomes +0, so that equal coordinates have equal bits. The error is the value and the rule.
#[inline]
pub(super) fn coordinate(x: f64) -> Result<f64, String> {
    if x.abs() <= MAX_COORDINATE {
        Ok(x + 0.0)
    } else {
        Err(format!("{} must be from -1e9 to 1e9", format_number(x)))
    }
}

#[inline]
pub(super) fn texture_coordinate(x: f64) -> Result<f32, String> {
    if (x as f32).is_finite() {
        Ok(x as f32)
    } else {
        Err(format!("{} must be finite as a 32-bit float", format_number(x)))
    }
}

/// Normalizes a vector. A vector that is zero or not finite becomes zero.
pub(crate) fn unit(normal: DVec3) -> Vec3 {
    let largest = normal.abs().max_element();
    if !(largest > 0.0 && normal.is_finite()) {
        return Vec3::ZERO;
    }
    // Scaled before normalization, because the squares of the components can overflow or underflow.
    (normal / largest).normalize().as_vec3()
}
