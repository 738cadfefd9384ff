//! Meshes and instances of scene files.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use toml::Table;

use crate::description::kinds::*;
use crate::mesh::Normals;

/// A mesh file and its import settings.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshFileDescription {
    /// An OBJ, PLY or STL file, relative to the scene file.
    #[schemars(length(min = 1))]
    pub file: String,
    /// Shading normals. If absent, `"file"` if the file has normals, else `"flat"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normals: Option<Normals>,
    /// Axis of the file that becomes the scene's z axis.
    #[serde(default)]
    pub up: Up,
}

impl MeshFileDescription {
    /// Creates default settings for a file, relative to the scene file's folder.
    pub fn new(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            normals: None,
            up: Up::default(),
        }
    }
}

/// A mesh file with a material and a placement.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("not" = { "required": ["matrix"], "anyOf": [{ "required": ["scale"] }, { "required": ["rotate"] }, { "required": ["translate"] }] }))]
pub struct MeshDescription {
    /// An OBJ, PLY or STL file, relative to the scene file.
    #[schemars(length(min = 1))]
    pub file: String,
    /// Shading normals. If absent, `"file"` if the file has normals, else `"flat"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normals: Option<Normals>,
    /// Axis of the file that becomes the scene's z axis.
    #[serde(default)]
    pub up: Up,
    /// Material of all groups that `materials` does not name. If absent, the file's own, else gray.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Materials for parts of the mesh: each key is the name of a group or material in the file, each value the name of
    /// a material of the scene.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, String>,
    /// Translation, applied last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>", extend("default" = [0, 0, 0]))]
    pub translate: Option<DVec3>,
    /// Rotation, applied after the scale: about x, y and z, or about one axis; each angle from -360 to 360 degrees. If
    /// absent, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<Rotation>,
    /// Factors, each from 1e-6 to 1e6, or from -1e6 to -1e-6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 1))]
    pub scale: Option<Scale>,
    /// Affine transform, which replaces `scale`, `rotate` and `translate`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Matrix>")]
    pub matrix: Option<Vec<[f64; 4]>>,
}

impl MeshDescription {
    /// Creates a mesh without a transform. `file` is relative to the scene file's folder.
    pub fn new(material: impl Into<String>, file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            normals: None,
            up: Up::default(),
            material: Some(material.into()),
            materials: BTreeMap::new(),
            translate: None,
            rotate: None,
            scale: None,
            matrix: None,
        }
    }
}

/// An instance of a mesh of `[meshes.NAME]`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("not" = { "required": ["matrix"], "anyOf": [{ "required": ["scale"] }, { "required": ["rotate"] }, { "required": ["translate"] }] }))]
pub struct InstanceDescription {
    /// Name of the mesh.
    pub mesh: String,
    /// Material of all groups that `materials` does not name. If absent, the file's own, else gray.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Materials for parts of the mesh: each key is the name of a group or material in the file, each value the name of
    /// a material of the scene.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, String>,
    /// Translation, applied last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>", extend("default" = [0, 0, 0]))]
    pub translate: Option<DVec3>,
    /// Rotation, applied after the scale: about x, y and z, or about one axis; each angle from -360 to 360 degrees. If
    /// absent, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<Rotation>,
    /// Factors, each from 1e-6 to 1e6, or from -1e6 to -1e-6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 1))]
    pub scale: Option<Scale>,
    /// Affine transform, which replaces `scale`, `rotate` and `translate`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Matrix>")]
    pub matrix: Option<Vec<[f64; 4]>>,
}

impl InstanceDescription {
    /// Creates an instance without a transform.
    pub fn new(material: impl Into<String>, mesh: impl Into<String>) -> Self {
        Self {
            mesh: mesh.into(),
            material: Some(material.into()),
            materials: BTreeMap::new(),
            translate: None,
            rotate: None,
            scale: None,
            matrix: None,
        }
    }
}

/// The axis of a file that becomes the scene's z axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Up {
    /// (x, y, z) becomes (y, z, x).
    X,
    /// (x, y, z) becomes (x, -z, y).
    Y,
    /// Unchanged coordinates.
    #[default]
    Z,
}

/// A rotation in degrees, counter-clockwise when the axis points towards the viewer (right-hand rule).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "must be a list of 3 angles in degrees or a table such as { axis = [0, 0, 1], degrees = 90 }"
)]
pub enum Rotation {
    /// About the x axis, then the y axis, then the z axis.
    Angles(#[schemars(with = "Angles")] DVec3),
    /// About one axis.
    About(#[serde(deserialize_with = "table")] RotationAbout),
}

/// Reads a table. Code derived for an untagged enum would also accept a list of values.
fn table<'de, D: Deserializer<'de>>(deserializer: D) -> Result<RotationAbout, D::Error> {
    Table::deserialize(deserializer)?.try_into().map_err(D::Error::custom)
}

/// A rotation about an axis.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotationAbout {
    /// Axis; any length.
    #[schemars(with = "Vector")]
    pub axis: DVec3,
    /// Angle in degrees.
    #[schemars(with = "Degrees")]
    pub degrees: f64,
}

/// Factors of the coordinates; none is 0.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "must be a number or a list of 3 numbers")]
pub enum Scale {
    /// One factor for all axes.
    All(#[schemars(with = "Factor")] f64),
    /// One factor per axis.
    Each(#[schemars(with = "Factor3")] DVec3),
}
