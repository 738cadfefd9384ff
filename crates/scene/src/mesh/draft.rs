//! What the readers of all formats make: triangles as the file has them, in the file's coordinates.

use crate::note::Note;
use glam::{DVec3, Vec2, Vec3, Vec4};

use super::damage::Damages;
use super::error::{Fault, Place, shown_number};
use super::polygon::Polygon;
use super::{Group, MAX_COORDINATE, MOST, Mesh, finish};

/// A mesh as its file has it.
#[derive(Default)]
pub(crate) struct Draft {
    pub positions: Vec<DVec3>,
    /// A unit normal for each vertex, zero where the file has none that is one; or empty.
    pub normals: Vec<Vec3>,
    /// For each vertex, or empty.
    pub uvs: Vec<Vec2>,
    /// Further sets of texture coordinates, each for each vertex.
    pub more_uvs: Vec<Vec<Vec2>>,
    /// Linear RGB and opacity for each vertex, or empty.
    pub colors: Vec<Vec4>,
    /// For each vertex, or empty, as [`Mesh::tangents`](super::Mesh::tangents) has them.
    pub tangents: Vec<Vec4>,
    pub triangles: Vec<[u32; 3]>,
    /// The fans among the triangles that stand for polygons of more than three corners.
    pub(super) polygons: Vec<Polygon>,
    pub groups: Vec<Group>,
    /// The first triangles of runs of one group each, and their groups.
    pub runs: Vec<(usize, u32)>,
    /// What a user should know.
    pub notes: Vec<Note>,
    /// Why the file may have no triangles.
    pub(super) without_triangles: Option<&'static str>,
    pub(super) damages: Damages,
}

impl Draft {
    /// Adds triangles to another group from here on.
    pub fn begin(&mut self, group: u32) {
        if self.runs.last().is_none_or(|(_, last)| *last != group) {
            self.runs.push((self.triangles.len(), group));
        }
    }

    /// The mesh, with the normals that are there; None if no triangle has an area. The error is what rule is broken.
    pub(crate) fn finish(self) -> Result<Option<Mesh>, String> {
        match finish::finish(self, None) {
            Ok(mesh) => Ok(Some(mesh)),
            Err(fault) if fault.is_empty => Ok(None),
            Err(fault) => Err(fault.message),
        }
    }

    /// Adds a face of three corners or more as a fan from its first corner.
    #[inline]
    pub(super) fn face(&mut self, corners: &[u32], place: Place) -> Result<(), Fault> {
        let &[first, ref others @ ..] = corners else {
            return Ok(());
        };
        let count = others.len().saturating_sub(1);
        if self.triangles.len() + count > MOST {
            return Err(place.fault(format!("there must be at most {MOST} triangles")));
        }
        if count > 1 {
            self.polygons.push(Polygon {
                first: self.triangles.len() as u32,
                count: count as u32,
            });
        }
        let triangles = others.windows(2).map(|pair| [first, pair[0], pair[1]]);
        self.triangles.extend(triangles);
        Ok(())
    }
}

/// A number of things for a note: as one thing is told, or as several are.
pub(super) fn counted(count: usize, one: &str, several: &str) -> Note {
    format!("{count} {}", if count == 1 { one } else { several }).into()
}

/// Checks a coordinate of a position. Zero loses its sign, so that equal coordinates have equal bits. The error is the
/// value and the rule.
#[inline]
pub(super) fn coordinate(x: f64) -> Result<f64, String> {
    if x.abs() <= MAX_COORDINATE {
        Ok(x + 0.0)
    } else {
        Err(format!("{} must be from -1e9 to 1e9", shown_number(x)))
    }
}

/// Checks a texture coordinate. The error is the value and the rule.
#[inline]
pub(super) fn texture_coordinate(x: f64) -> Result<f32, String> {
    if (x as f32).is_finite() {
        Ok(x as f32)
    } else {
        Err(format!("{} must be finite as a 32-bit float", shown_number(x)))
    }
}

/// A normal of length 1; zero where there is none.
pub(crate) fn unit(normal: DVec3) -> Vec3 {
    let largest = normal.abs().max_element();
    if !(largest > 0.0 && normal.is_finite()) {
        return Vec3::ZERO;
    }
    // Neither the smallest nor the largest numbers have squares.
    (normal / largest).normalize().as_vec3()
}
