//! What a scene file says of shapes.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::gltf::GltfDescription;
use super::mesh::MeshDescription;
use super::tables::ReadError;
use super::tagged::{Tagged, tagged};
use crate::description::kinds::{Length, Point, Points3, Points4, Size, Vector};

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
        /// A cylinder with caps.
        "cylinder" => Cylinder(CylinderDescription),
        /// A triangle.
        "triangle" => Triangle(TriangleDescription),
        /// Four triangles.
        "tetrahedron" => Tetrahedron(TetrahedronDescription),
        /// An infinite plane.
        "plane" => Plane(PlaneDescription),
        /// A mesh of triangles, from a file.
        "mesh" => Mesh(MeshDescription),
        /// A glTF file: meshes, materials and lights.
        "gltf" => Gltf(GltfDescription),
    }
}

/// A rectangle.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Lengths along the tangent and along the bitangent.
    #[schemars(with = "Size")]
    pub size: [f64; 2],
    /// Perpendicular to the rectangle; any length.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Along the first edge; any length. If absent, x, or y where the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl RectangleDescription {
    /// A rectangle of this material, middle, size along tangent and bitangent, normal and tangent.
    pub fn new(
        material: impl Into<String>,
        center: impl Into<DVec3>,
        size: [f64; 2],
        normal: impl Into<DVec3>,
        tangent: impl Into<DVec3>,
    ) -> Self {
        Self {
            material: material.into(),
            center: center.into(),
            size,
            normal: normal.into(),
            tangent: Some(tangent.into()),
        }
    }
}

/// A disk.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiskDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Its radius.
    #[schemars(with = "Length")]
    pub radius: f64,
    /// Perpendicular to the disk; any length.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Direction of the texture coordinate u; any length. If absent, x, or y where the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl DiskDescription {
    /// A disk of this material, middle, radius and normal.
    pub fn new(material: impl Into<String>, center: impl Into<DVec3>, radius: f64, normal: impl Into<DVec3>) -> Self {
        Self {
            material: material.into(),
            center: center.into(),
            radius,
            normal: normal.into(),
            tangent: None,
        }
    }
}

/// An ellipsoid: the image of the unit sphere under the linear map with the columns a, b, c.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// First half axis.
    #[schemars(with = "Vector")]
    pub a: DVec3,
    /// Second half axis.
    #[schemars(with = "Vector")]
    pub b: DVec3,
    /// Third half axis, the pole of the texture coordinates.
    #[schemars(with = "Vector")]
    pub c: DVec3,
}

impl EllipsoidDescription {
    /// An ellipsoid of this material, middle and half axes.
    pub fn new(
        material: impl Into<String>,
        center: impl Into<DVec3>,
        a: impl Into<DVec3>,
        b: impl Into<DVec3>,
        c: impl Into<DVec3>,
    ) -> Self {
        Self {
            material: material.into(),
            center: center.into(),
            a: a.into(),
            b: b.into(),
            c: c.into(),
        }
    }
}

/// A sphere.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Its radius.
    #[schemars(with = "Length")]
    pub radius: f64,
}

impl SphereDescription {
    /// A sphere of this material, middle and radius.
    pub fn new(material: impl Into<String>, center: impl Into<DVec3>, radius: f64) -> Self {
        Self {
            material: material.into(),
            center: center.into(),
            radius,
        }
    }
}

/// A cylinder with caps.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderDescription {
    /// Name of its material.
    pub material: String,
    /// The center of the cap where the texture coordinate v is 0.
    #[schemars(with = "Point")]
    pub start: DVec3,
    /// The center of the cap where v is 1.
    #[schemars(with = "Point")]
    pub end: DVec3,
    /// Its radius.
    #[schemars(with = "Length")]
    pub radius: f64,
    /// Direction from the axis in which the texture coordinate u is 0; any length. If absent, x, or y where the axis is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl CylinderDescription {
    /// A cylinder of this material, centers of the caps, and radius.
    pub fn new(material: impl Into<String>, start: impl Into<DVec3>, end: impl Into<DVec3>, radius: f64) -> Self {
        Self {
            material: material.into(),
            start: start.into(),
            end: end.into(),
            radius,
            tangent: None,
        }
    }
}

/// A triangle.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TriangleDescription {
    /// Name of its material.
    pub material: String,
    /// Counter-clockwise as seen from outside.
    #[schemars(with = "Points3")]
    pub vertices: [DVec3; 3],
}

impl TriangleDescription {
    /// A triangle of this material and vertices, counter-clockwise as seen from outside.
    pub fn new(material: impl Into<String>, vertices: [impl Into<DVec3>; 3]) -> Self {
        Self {
            material: material.into(),
            vertices: vertices.map(Into::into),
        }
    }
}

/// A tetrahedron.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TetrahedronDescription {
    /// Name of its material.
    pub material: String,
    /// Its corners.
    #[schemars(with = "Points4")]
    pub vertices: [DVec3; 4],
}

impl TetrahedronDescription {
    /// A tetrahedron of this material and corners.
    pub fn new(material: impl Into<String>, vertices: [impl Into<DVec3>; 4]) -> Self {
        Self {
            material: material.into(),
            vertices: vertices.map(Into::into),
        }
    }
}

/// An infinite plane.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneDescription {
    /// Name of its material.
    pub material: String,
    /// A point of it, the origin of its texture coordinates.
    #[schemars(with = "Point")]
    pub point: DVec3,
    /// Perpendicular to the plane; any length.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Direction of the texture coordinate u; any length. If absent, x, or y where the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl PlaneDescription {
    /// A plane of this material, through a point, with this normal and tangent.
    pub fn new(
        material: impl Into<String>,
        point: impl Into<DVec3>,
        normal: impl Into<DVec3>,
        tangent: impl Into<DVec3>,
    ) -> Self {
        Self {
            material: material.into(),
            point: point.into(),
            normal: normal.into(),
            tangent: Some(tangent.into()),
        }
    }
}
