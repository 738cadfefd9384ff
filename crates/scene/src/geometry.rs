//! Geometry of shapes, and their bounding boxes.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use super::mesh::Mesh;

/// The minimum and maximum corners of a box.
pub type Bounds = (DVec3, DVec3);

/// The points `center + x u + y v` for x, y in -1..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Parallelogram {
    /// Center.
    pub center: DVec3,
    /// Half the first edge: half the width along the tangent.
    pub u: DVec3,
    /// Half the second edge: half the height along the bitangent, normal x tangent.
    pub v: DVec3,
}

/// A shape with its material.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Shape {
    /// Geometry.
    pub geometry: Geometry,
    /// Index into [`Scene::materials`](crate::Scene::materials).
    pub material: usize,
}

/// The geometry of a shape, in world space.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// A rectangle with the normal u x v.
    Rectangle(Parallelogram),
    /// A disk with the normal u x v: the points of the parallelogram with x² + y² <= 1.
    Disk(Parallelogram),
    /// An ellipsoid or a sphere: the points `center + x a + y b + z c` with x² + y² + z² = 1.
    Ellipsoid {
        /// Center.
        center: DVec3,
        /// Semi-axes, linearly independent.
        axes: [DVec3; 3],
    },
    /// A capped cylinder: the surface of the points `center + x a + y b + z c` with x² + y² <= 1 and |z| <= 1.
    Cylinder {
        /// Center.
        center: DVec3,
        /// Two radii and half of the axis, perpendicular to each other.
        axes: [DVec3; 3],
    },
    /// Triangles with a common shape index: a single triangle, or the four faces of a tetrahedron. Vertices are
    /// counter-clockwise as seen from outside: the normal is (v1 - v0) x (v2 - v1).
    Triangles(Vec<[DVec3; 3]>),
    /// A triangle mesh.
    Mesh {
        /// The mesh.
        mesh: Arc<Mesh>,
        /// Object-to-world transform; invertible.
        to_world: DAffine3,
        /// For each group of the mesh, an index into [`Scene::materials`](crate::Scene::materials).
        materials: Vec<usize>,
    },
    /// An infinite plane.
    Plane {
        /// A point of the plane, the origin of the texture coordinates.
        point: DVec3,
        /// Unit tangent: the direction of u.
        tangent: DVec3,
        /// Unit normal x tangent: the direction of v.
        bitangent: DVec3,
    },
}

impl Parallelogram {
    /// Returns the corners.
    pub fn corners(&self) -> [DVec3; 4] {
        [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)].map(|(a, b)| self.center + self.u * a + self.v * b)
    }
}

impl Geometry {
    /// Returns the value of `type` in a scene file; distinguishes spheres from ellipsoids, and triangles from
    /// tetrahedra.
    pub fn name(&self) -> &'static str {
        match self {
            Geometry::Rectangle(_) => "rectangle",
            Geometry::Disk(_) => "disk",
            Geometry::Ellipsoid { axes, .. } if is_sphere(axes) => "sphere",
            Geometry::Ellipsoid { .. } => "ellipsoid",
            Geometry::Cylinder { .. } => "cylinder",
            Geometry::Triangles(all) if all.len() == 1 => "triangle",
            Geometry::Triangles(_) => "tetrahedron",
            Geometry::Mesh { .. } => "mesh",
            Geometry::Plane { .. } => "plane",
        }
    }

    /// Translates the geometry.
    pub fn translate(&mut self, offset: DVec3) {
        match self {
            Geometry::Rectangle(shape) | Geometry::Disk(shape) => shape.center += offset,
            Geometry::Ellipsoid { center, .. } | Geometry::Cylinder { center, .. } => *center += offset,
            Geometry::Triangles(triangles) => triangles.iter_mut().flatten().for_each(|v| *v += offset),
            Geometry::Mesh { to_world, .. } => to_world.translation += offset,
            Geometry::Plane { point, .. } => *point += offset,
        }
    }

    /// Returns the bounding box, or `None` for a plane, which is infinite.
    pub fn bounds(&self) -> Option<Bounds> {
        match self {
            Geometry::Rectangle(shape) => centered(shape.center, shape.u.abs() + shape.v.abs()),
            Geometry::Disk(shape) => centered(shape.center, half_extents(&[shape.u, shape.v])),
            Geometry::Ellipsoid { center, axes } => centered(*center, half_extents(axes)),
            Geometry::Cylinder {
                center,
                axes: [a, b, c],
            } => centered(*center, half_extents(&[*a, *b]) + c.abs()),
            Geometry::Triangles(triangles) => {
                let points = triangles.iter().flatten().map(|point| (*point, *point));
                points.reduce(join)
            }
            Geometry::Mesh { mesh, to_world, .. } => {
                let transform = |point: &Vec3| to_world.transform_point3(point.as_dvec3() + mesh.center);
                let points = mesh.positions.par_iter().map(transform);
                points.map(|point| (point, point)).reduce_with(join)
            }
            Geometry::Plane { .. } => None,
        }
    }

    /// Calls `point` with points whose projections onto a unit vector bound the projection of the geometry. For a mesh,
    /// the points are the corners of the bounding box. For a plane, which is infinite, the only point is its origin.
    pub fn each_extreme(&self, direction: DVec3, mut point: impl FnMut(DVec3)) {
        let mut both_ends = |center: DVec3, half_length: f64| {
            point(center + direction * half_length);
            point(center - direction * half_length);
        };
        let half_extent = |axes: &[DVec3]| axes.iter().map(|axis| axis.dot(direction).powi(2)).sum::<f64>().sqrt();
        match self {
            Geometry::Rectangle(rectangle) => rectangle.corners().into_iter().for_each(point),
            Geometry::Disk(disk) => both_ends(disk.center, half_extent(&[disk.u, disk.v])),
            Geometry::Ellipsoid { center, axes } => both_ends(*center, half_extent(axes)),
            Geometry::Cylinder {
                center,
                axes: [a, b, c],
            } => {
                both_ends(*center, half_extent(&[*a, *b]) + c.dot(direction).abs());
            }
            Geometry::Triangles(triangles) => triangles.iter().flatten().for_each(|vertex| point(*vertex)),
            Geometry::Mesh { mesh, to_world, .. } => {
                mesh.corners()
                    .for_each(|corner| point(to_world.transform_point3(corner)));
            }
            Geometry::Plane { point: origin, .. } => point(*origin),
        }
    }
}

/// Returns true if the semi-axes belong to an unrotated sphere.
fn is_sphere(axes: &[DVec3; 3]) -> bool {
    *axes == [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * axes[0].x)
}

/// Returns the bounding box of two boxes.
pub(crate) fn join((low, high): Bounds, (other_low, other_high): Bounds) -> Bounds {
    (low.min(other_low), high.max(other_high))
}

/// Returns the box with this center and half extent.
fn centered(center: DVec3, half_extent: DVec3) -> Option<Bounds> {
    Some((center - half_extent, center + half_extent))
}

/// Returns the half extents of the bounding box of a disk or ellipsoid: for each coordinate axis, the norm of the
/// components of the semi-axes.
fn half_extents(axes: &[DVec3]) -> DVec3 {
    axes.iter().map(|axis| axis * axis).sum::<DVec3>().map(f64::sqrt)
}
