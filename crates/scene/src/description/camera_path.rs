//! `[camera.path]`: how the camera moves from frame to frame.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::description::kinds::{Aperture, Fov, FrameNumber, Length, Point, Vector};
/// The way of a camera through its keys. Before the first and after the last one it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraPathDescription {
    /// How it goes from key to key.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// At which frame it is where, in the order of their frames.
    #[schemars(length(min = 1))]
    pub keys: Vec<CameraKeyDescription>,
}

impl CameraPathDescription {
    /// A way through these keys.
    pub fn new(interpolation: Interpolation, keys: impl IntoIterator<Item = CameraKeyDescription>) -> Self {
        Self {
            interpolation,
            keys: keys.into_iter().collect(),
        }
    }
}

/// How values go from key to key.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Interpolation {
    /// Straight, and with a constant speed between two keys.
    #[default]
    Linear,
    /// On a curve without corners, whose speed does not jump.
    Smooth,
}

/// What the camera is like at one frame. Each value goes its own way through the keys that have it; what no key has is the
/// camera's own.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("minProperties" = 2))] // something beside the frame
pub struct CameraKeyDescription {
    /// Which frame; it may be a fraction.
    #[schemars(with = "FrameNumber")]
    pub frame: f64,
    /// The camera's position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>")]
    pub position: Option<DVec3>,
    /// The point in the middle of the picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>")]
    pub look_at: Option<DVec3>,
    /// Which way is up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub up: Option<DVec3>,
    /// Vertical field of view in degrees, of perspective cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Fov>")]
    pub fov: Option<f64>,
    /// Height of the seen rectangle in scene units, of orthographic cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Length>")]
    pub height: Option<f64>,
    /// Diameter of the lens in scene units, of perspective cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Aperture>")]
    pub aperture: Option<f64>,
    /// Distance of the plane that is sharp, of perspective cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Length>")]
    pub focus_distance: Option<f64>,
}

impl CameraKeyDescription {
    /// A key that says nothing yet.
    pub fn new(frame: f64) -> Self {
        Self {
            frame,
            position: None,
            look_at: None,
            up: None,
            fov: None,
            height: None,
            aperture: None,
            focus_distance: None,
        }
    }

    /// A key with the camera's position and what it looks at.
    pub fn looking(frame: f64, position: impl Into<DVec3>, look_at: impl Into<DVec3>) -> Self {
        Self {
            position: Some(position.into()),
            look_at: Some(look_at.into()),
            ..Self::new(frame)
        }
    }
}
