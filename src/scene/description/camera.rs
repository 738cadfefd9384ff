//! `[camera]`: where the picture is seen from.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::tagged::{ReadError, Tagged, tagged};
use super::{CameraPathDescription, one};

tagged! {
    /// `[camera]`
    CameraDescription {
        /// All rays start at the camera's position.
        "perspective" => Perspective(PerspectiveDescription),
        /// All rays are parallel.
        "orthographic" => Orthographic(OrthographicDescription),
    }
}

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PerspectiveDescription {
    /// The centre of projection.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    pub up: DVec3,
    /// Vertical field of view in degrees.
    pub fov: f64,
    /// Distance of the image plane, without effect in a pinhole camera.
    #[serde(default = "one")]
    pub focal_length: f64,
    /// How it moves from frame to frame, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<CameraPathDescription>,
}

impl PerspectiveDescription {
    /// A camera with z upwards. `fov` is vertical, in degrees.
    pub fn new(position: impl Into<DVec3>, look_at: impl Into<DVec3>, fov: f64) -> Self {
        Self {
            position: position.into(),
            look_at: look_at.into(),
            up: z_up(),
            fov,
            focal_length: one(),
            path: None,
        }
    }
}

/// A camera of parallel rays.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OrthographicDescription {
    /// The middle of the image plane, where the rays start.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    pub up: DVec3,
    /// Height of the seen rectangle in scene units.
    pub height: f64,
    /// How it moves from frame to frame, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<CameraPathDescription>,
}

impl OrthographicDescription {
    /// A camera with z upwards. `height` is that of the seen rectangle, in scene units.
    pub fn new(position: impl Into<DVec3>, look_at: impl Into<DVec3>, height: f64) -> Self {
        Self {
            position: position.into(),
            look_at: look_at.into(),
            up: z_up(),
            height,
            path: None,
        }
    }
}

impl CameraDescription {
    /// How it moves from frame to frame, if it does.
    pub fn path(&self) -> Option<&CameraPathDescription> {
        match self {
            CameraDescription::Perspective(camera) => camera.path.as_ref(),
            CameraDescription::Orthographic(camera) => camera.path.as_ref(),
        }
    }

    /// The camera with another path.
    pub fn with_path(mut self, path: impl Into<Option<CameraPathDescription>>) -> Self {
        match &mut self {
            CameraDescription::Perspective(camera) => camera.path = path.into(),
            CameraDescription::Orthographic(camera) => camera.path = path.into(),
        }
        self
    }
}

fn z_up() -> DVec3 {
    DVec3::Z
}
