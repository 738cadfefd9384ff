//! The section `[environment]` of scene files.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Rotation, one};
use crate::description::kinds::*;

/// The environment, for `integrator = "path"`: exactly one of `color`, `file` and `name`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["color"] }, { "required": ["file"] }, { "required": ["name"] }]))]
pub struct EnvironmentDescription {
    /// Radiance from all directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Rgb>")]
    pub color: Option<DVec3>,
    /// An equirectangular image, relative to the scene file's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub file: Option<String>,
    /// A built-in environment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<EnvironmentName>,
    /// Factor of the radiance.
    #[serde(default = "one")]
    #[schemars(with = "EnvironmentScale")]
    pub scale: f64,
    /// Rotation: degrees about z, counter-clockwise as seen from above, or as for meshes; each angle from -360 to 360
    /// degrees. If absent, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<EnvironmentRotation>,
    /// Visible to the camera.
    #[serde(default = "default_true")]
    pub visible: bool,
    /// Radiance that the camera sees instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Rgb>")]
    pub background: Option<DVec3>,
    /// Elevation of the sun of `"sky"`, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Elevation>", extend("default" = 40))]
    pub sun_elevation: Option<f64>,
    /// Azimuth of the sun of `"sky"`: degrees from +x towards +y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Degrees>", extend("default" = 0))]
    pub sun_azimuth: Option<f64>,
    /// Turbidity of `"sky"`; 1 is clean air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Turbidity>", extend("default" = 2))]
    pub turbidity: Option<f64>,
}

impl EnvironmentDescription {
    /// Creates an environment of constant radiance, in linear RGB.
    pub fn new(color: impl Into<DVec3>) -> Self {
        Self {
            color: Some(color.into()),
            ..Self::empty()
        }
    }

    /// Creates an environment from an equirectangular image, relative to the scene file's folder.
    pub fn image(file: impl Into<String>) -> Self {
        Self {
            file: Some(file.into()),
            ..Self::empty()
        }
    }

    /// Creates a built-in environment.
    pub fn named(name: EnvironmentName) -> Self {
        Self {
            name: Some(name),
            ..Self::empty()
        }
    }

    fn empty() -> Self {
        Self {
            color: None,
            file: None,
            name: None,
            scale: 1.0,
            rotate: None,
            visible: true,
            background: None,
            sun_elevation: None,
            sun_azimuth: None,
            turbidity: None,
        }
    }
}

/// Built-in environments, computed by formulas. In a file, the names are in snake case: `"studio"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum EnvironmentName {
    /// A gray photo studio with area lights.
    Studio,
    /// A clear sky with a sun.
    Sky,
}

impl EnvironmentName {
    /// All built-in environments.
    pub const ALL: [EnvironmentName; 2] = [EnvironmentName::Studio, EnvironmentName::Sky];

    /// Returns the name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            EnvironmentName::Studio => "studio",
            EnvironmentName::Sky => "sky",
        }
    }
}

/// A rotation of the environment, counter-clockwise when the axis points towards the viewer (right-hand rule).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "must be a number of degrees, a list of 3 angles in degrees or a table such as { axis = [0, 0, 1], degrees = 90 }"
)]
pub enum EnvironmentRotation {
    /// About the z axis, in degrees.
    Degrees(#[schemars(with = "Degrees")] f64),
    /// Any rotation that a mesh accepts.
    Any(Rotation),
}

fn default_true() -> bool {
    true
}
