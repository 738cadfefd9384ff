//! What the readers of all formats make: triangles as the file has them, in the file's coordinates.

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::error::{Fault, Place, shown_number};
use super::{Group, LARGEST_COORDINATE, MOST, Mesh, finish};

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
    pub groups: Vec<Group>,
    /// The first triangles of runs of one group each, and their groups.
    pub runs: Vec<(usize, u32)>,
    /// What a user should know.
    pub notes: Vec<String>,
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
            Err(fault) if fault.message.starts_with(finish::NO_TRIANGLES) => Ok(None),
            Err(fault) => Err(fault.message),
        }
    }

    /// Adds a triangle.
    #[inline]
    pub(super) fn push(&mut self, triangle: [u32; 3], place: Place) -> Result<(), Fault> {
        if self.triangles.len() >= MOST {
            return Err(place.fault(format!("there must be at most {MOST} triangles")));
        }
        self.triangles.push(triangle);
        Ok(())
    }
}

/// A number of things for a note: as one thing is told, or as several are.
pub(super) fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// A polygon's triangles: a fan from its first vertex.
#[derive(Default)]
pub(super) struct Fan {
    first: u32,
    last: u32,
    pub count: usize,
}

impl Fan {
    /// Takes the next vertex; from the third on there is a triangle.
    #[inline]
    pub fn next(&mut self, vertex: u32) -> Option<[u32; 3]> {
        let triangle = [self.first, self.last, vertex];
        if self.count == 0 {
            self.first = vertex;
        }
        self.last = vertex;
        self.count += 1;
        (self.count > 2).then_some(triangle)
    }
}

/// Checks a coordinate of a position. Zero loses its sign, so that equal coordinates have equal bits. The error is the
/// value and the rule.
#[inline]
pub(super) fn coordinate(x: f64) -> Result<f64, String> {
    if x.abs() <= LARGEST_COORDINATE {
        Ok(x + 0.0)
    } else {
        Err(format!("{} must be finite, from -1e9 to 1e9", shown_number(x)))
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
