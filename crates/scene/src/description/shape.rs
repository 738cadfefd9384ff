//! Shapes of scene files.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::gltf::GltfDescription;
use super::mesh::MeshDescription;
use super::tagged::{Tagged, tagged};
use crate::description::kinds::*;

tagged! {
    /// A shape. The key `type` selects the variant.
    #[non_exhaustive]
    ShapeDescription {
        /// A rectangle.
        "rectangle" => Rectangle(RectangleDescription),
        /// A disk.
        "disk" => Disk(DiskDescription),
        /// An ellipsoid.
        "ellipsoid" => Ellipsoid(EllipsoidDescription),
        /// A sphere.
        "sphere" => Sphere(SphereDescription),
        /// A cylinder with caps.
        "cylinder" => Cylinder(CylinderDescription),
        /// A triangle.
        "triangle" => Triangle(TriangleDescription),
        /// A tetrahedron.
        "tetrahedron" => Tetrahedron(TetrahedronDescription),
        /// An infinite plane.
        "plane" => Plane(PlaneDescription),
        /// A triangle mesh from a file.
        "mesh" => Mesh(MeshDescription),
        /// A glTF file: meshes, materials and lights.
        "gltf" => Gltf(GltfDescription),
    }
}

/// A rectangle.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleDescription {
    /// Name of the material.
    pub material: String,
    /// Center.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Lengths along the tangent and the bitangent.
    #[schemars(with = "Size")]
    pub size: [f64; 2],
    /// Normal.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Direction of the first edge. If absent, x, or y if the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl RectangleDescription {
    /// Creates a rectangle. `size` contains the lengths along the tangent and the bitangent.
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
    /// Name of the material.
    pub material: String,
    /// Center.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Radius.
    #[schemars(with = "Length")]
    pub radius: f64,
    /// Normal.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Direction of u. If absent, x, or y if the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl DiskDescription {
    /// Creates a disk.
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

/// An ellipsoid: the unit sphere, transformed by the matrix with the columns a, b and c, then moved to the center.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidDescription {
    /// Name of the material.
    pub material: String,
    /// Center.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// First semi-axis, with its length.
    #[schemars(with = "Vector")]
    pub a: DVec3,
    /// Second semi-axis, not parallel to `a`.
    #[schemars(with = "Vector")]
    pub b: DVec3,
    /// Third semi-axis, not in the plane of `a` and `b`.
    #[schemars(with = "Vector")]
    pub c: DVec3,
}

impl EllipsoidDescription {
    /// Creates an ellipsoid by its semi-axes.
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
    /// Name of the material.
    pub material: String,
    /// Center.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Radius.
    #[schemars(with = "Length")]
    pub radius: f64,
}

impl SphereDescription {
    /// Creates a sphere.
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
    /// Name of the material.
    pub material: String,
    /// Center of the cap where v is 0.
    #[schemars(with = "Point")]
    pub start: DVec3,
    /// Center of the cap where v is 1; at least 1e-9 from `start`.
    #[schemars(with = "Point")]
    pub end: DVec3,
    /// Radius.
    #[schemars(with = "Length")]
    pub radius: f64,
    /// Direction from the axis where u is 0. If absent, x, or y if the axis is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl CylinderDescription {
    /// Creates a cylinder from the centers of its caps.
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
    /// Name of the material.
    pub material: String,
    /// Vertices v0, v1 and v2, counter-clockwise as seen from outside; not on one line.
    #[schemars(with = "Points3")]
    pub vertices: [DVec3; 3],
}

impl TriangleDescription {
    /// Creates a triangle. The vertices are counter-clockwise as seen from outside.
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
    /// Name of the material.
    pub material: String,
    /// Vertices v0, v1, v2 and v3, not in one plane.
    #[schemars(with = "Points4")]
    pub vertices: [DVec3; 4],
}

impl TetrahedronDescription {
    /// Creates a tetrahedron.
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
    /// Name of the material.
    pub material: String,
    /// A point of the plane, where (u, v) is (0, 0).
    #[schemars(with = "Point")]
    pub point: DVec3,
    /// Normal.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Direction of u. If absent, x, or y if the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
}

impl PlaneDescription {
    /// Creates a plane.
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
