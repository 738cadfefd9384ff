//! `[camera.path]`: a camera animation with keys.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::description::kinds::*;

/// A camera animation with keys. Before the first key and after the last key, the camera does not move.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraPathDescription {
    /// Interpolation between keys.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// Keys in ascending order of their frames; at least one.
    #[schemars(length(min = 1))]
    pub keys: Vec<CameraKeyDescription>,
}

impl CameraPathDescription {
    /// Creates a path through these keys.
    pub fn new(interpolation: Interpolation, keys: impl IntoIterator<Item = CameraKeyDescription>) -> Self {
        Self {
            interpolation,
            keys: keys.into_iter().collect(),
        }
    }
}

/// Interpolation between keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Interpolation {
    /// Linear, with constant speed between two keys.
    #[default]
    Linear,
    /// A smooth curve with continuous velocity.
    Smooth,
}

/// The camera at one frame. Each value is interpolated between the keys that set it; values that no key sets come from
/// the camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("minProperties" = 2))] // at least one value
pub struct CameraKeyDescription {
    /// Frame number; may be a fraction. At least 1e-6 above that of the previous key.
    #[schemars(with = "FrameNumber")]
    pub frame: f64,
    /// Position of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>")]
    pub position: Option<DVec3>,
    /// Point at the center of the image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>")]
    pub look_at: Option<DVec3>,
    /// Up direction. Its components are interpolated without normalization.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub up: Option<DVec3>,
    /// Vertical field of view in degrees; only for perspective cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Fov>")]
    pub fov: Option<f64>,
    /// Height of the image plane in scene units; only for orthographic cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Length>")]
    pub height: Option<f64>,
    /// Diameter of the lens in scene units, which replaces `f_number`; only for perspective cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Aperture>")]
    pub aperture: Option<f64>,
    /// Distance of the plane in focus; only for perspective cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Length>")]
    pub focus_distance: Option<f64>,
}

impl CameraKeyDescription {
    /// Creates a key without values.
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

    /// Creates a key with a position and a look-at point.
    pub fn looking(frame: f64, position: impl Into<DVec3>, look_at: impl Into<DVec3>) -> Self {
        Self {
            position: Some(position.into()),
            look_at: Some(look_at.into()),
            ..Self::new(frame)
        }
    }
}
