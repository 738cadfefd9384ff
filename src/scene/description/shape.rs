//! What a scene file says of shapes.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::tagged::{ReadError, Tagged, tagged};

tagged! {
    /// `[[shapes]]`
    ShapeDescription {
        /// A rectangle.
        "rectangle" => Rectangle(RectangleDescription),
        /// A disk.
        "disk" => Disk(DiskDescription),
        /// An ellipsoid by its half axes.
        "ellipsoid" => Ellipsoid(EllipsoidDescription),
        /// A sphere.
        "sphere" => Sphere(SphereDescription),
        /// A triangle.
        "triangle" => Triangle(TriangleDescription),
        /// Four triangles.
        "tetrahedron" => Tetrahedron(TetrahedronDescription),
        /// An infinite plane.
        "plane" => Plane(PlaneDescription),
    }
}

/// A rectangle.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    pub center: DVec3,
    /// Lengths along the tangent and along the bitangent.
    pub size: [f64; 2],
    /// Perpendicular to the rectangle; any length.
    pub normal: DVec3,
    /// Along the first edge; any length.
    pub tangent: DVec3,
}

/// A disk.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DiskDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
    /// Perpendicular to the disk; any length.
    pub normal: DVec3,
    /// Direction of the texture coordinate u; any length. If absent, x, or y where the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tangent: Option<DVec3>,
}

/// An ellipsoid: the image of the unit sphere under the linear map with the columns a, b, c.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    pub center: DVec3,
    /// First half axis.
    pub a: DVec3,
    /// Second half axis.
    pub b: DVec3,
    /// Third half axis, the pole of the texture coordinates.
    pub c: DVec3,
}

/// A sphere.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SphereDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

/// A triangle.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TriangleDescription {
    /// Name of its material.
    pub material: String,
    /// Counter-clockwise as seen from outside.
    pub vertices: [DVec3; 3],
}

/// A tetrahedron.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TetrahedronDescription {
    /// Name of its material.
    pub material: String,
    /// Its corners.
    pub vertices: [DVec3; 4],
}

/// An infinite plane.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneDescription {
    /// Name of its material.
    pub material: String,
    /// A point of it, the origin of its texture coordinates.
    pub point: DVec3,
    /// Perpendicular to the plane; any length.
    pub normal: DVec3,
    /// Direction of the texture coordinate u; any length.
    pub tangent: DVec3,
}
