//! What a scene file says of what surrounds the scene.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Rotation, one};
use crate::description::kinds::{Degrees, Elevation, EnvironmentScale, Rgb, Turbidity};

/// What surrounds the scene, for `integrator = "path"`: one of `color`, `file` and `name`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["color"] }, { "required": ["file"] }, { "required": ["name"] }]))]
pub struct EnvironmentDescription {
    /// Radiance from everywhere; linear RGB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Rgb>")]
    pub color: Option<DVec3>,
    /// An equirectangular image, relative to the scene file's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub file: Option<String>,
    /// One of the program's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<EnvironmentName>,
    /// Factor of the radiance.
    #[serde(default = "one")]
    #[schemars(with = "EnvironmentScale")]
    pub scale: f64,
    /// How it is turned: by degrees about the z axis, counter-clockwise as seen from above, or as a mesh is, each angle from -360 to 360
    /// degrees. If absent, not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<EnvironmentRotation>,
    /// Whether the camera sees it.
    #[serde(default = "yes")]
    pub visible: bool,
    /// The radiance that the camera sees in its place; linear RGB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Rgb>")]
    pub background: Option<DVec3>,
    /// How high the sun of `"sky"` stands, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Elevation>", extend("default" = 40))]
    pub sun_elevation: Option<f64>,
    /// Where the sun of `"sky"` stands: degrees from +x towards +y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Degrees>", extend("default" = 0))]
    pub sun_azimuth: Option<f64>,
    /// How hazy `"sky"` is: light that air and haze take from a ray, relative to clean air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Turbidity>", extend("default" = 2))]
    pub turbidity: Option<f64>,
}

impl EnvironmentDescription {
    /// This radiance from everywhere, in linear RGB.
    pub fn new(color: impl Into<DVec3>) -> Self {
        Self {
            color: Some(color.into()),
            ..Self::nothing()
        }
    }

    /// An equirectangular image, relative to the scene file's folder.
    pub fn image(file: impl Into<String>) -> Self {
        Self {
            file: Some(file.into()),
            ..Self::nothing()
        }
    }

    /// One of the program's own.
    pub fn named(name: EnvironmentName) -> Self {
        Self {
            name: Some(name),
            ..Self::nothing()
        }
    }

    fn nothing() -> Self {
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

/// Surroundings that the program makes by a formula. In a file the names are in snake case: `"studio"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EnvironmentName {
    /// A grey room with lamps, as of a photographer.
    Studio,
    /// A clear sky with a sun.
    Sky,
}

impl EnvironmentName {
    /// All of them.
    pub const ALL: [EnvironmentName; 2] = [EnvironmentName::Studio, EnvironmentName::Sky];

    /// The name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            EnvironmentName::Studio => "studio",
            EnvironmentName::Sky => "sky",
        }
    }
}

/// How surroundings are turned, counter-clockwise as seen against an axis.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "must be a number of degrees, a list of 3 angles in degrees or a table such as { axis = [0, 0, 1], degrees = 90 }"
)]
pub enum EnvironmentRotation {
    /// About the z axis, in degrees.
    Degrees(#[schemars(with = "Degrees")] f64),
    /// In any way that a mesh may be turned.
    Any(Rotation),
}

fn yes() -> bool {
    true
}
