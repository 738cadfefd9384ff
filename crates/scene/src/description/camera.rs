//! `[camera]`: where the picture is seen from.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::tables::ReadError;
use super::tagged::{Tagged, tagged};
use super::{CameraPathDescription, one};
use crate::description::kinds::{Aperture, Blades, Degrees, FNumber, Fov, Length, Point, Vector};

tagged! {
    /// `[camera]`
    CameraDescription {
        /// All rays start at the camera's position.
        "perspective" => Perspective(PerspectiveDescription),
        /// All rays are parallel.
        "orthographic" => Orthographic(OrthographicDescription),
        /// Rays go from the camera's position in all directions.
        "panorama" => Panorama(PanoramaDescription),
    }
}

/// A pinhole camera, or one with a thin lens.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PerspectiveDescription {
    /// The centre of projection.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// The point in the middle of the picture.
    #[schemars(with = "Point")]
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    #[schemars(with = "Vector")]
    pub up: DVec3,
    /// Vertical field of view in degrees.
    #[schemars(with = "Fov")]
    pub fov: f64,
    /// Focal length of the lens in scene units, of which `f_number` is told; without effect otherwise.
    #[serde(default = "one")]
    #[schemars(with = "Length")]
    pub focal_length: f64,
    /// Diameter of the lens in scene units; 0 for a pinhole camera, which it is if nothing is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Aperture>")]
    pub aperture: Option<f64>,
    /// The focal length over the diameter, in place of `aperture`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<FNumber>")]
    pub f_number: Option<f64>,
    /// Distance of the plane that is sharp, along the view; that of `look_at` if nothing is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Length>")]
    pub focus_distance: Option<f64>,
    /// Corners of the lens, 3 to 16; 0 if it is round.
    #[serde(default)]
    #[schemars(with = "Blades")]
    pub blades: u32,
    /// In degrees, how far the corners are turned to the left, as seen in the picture; at 0 one is at the top.
    #[serde(default)]
    #[schemars(with = "Degrees")]
    pub blade_rotation: f64,
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
            aperture: None,
            f_number: None,
            focus_distance: None,
            blades: 0,
            blade_rotation: 0.0,
            path: None,
        }
    }
}

/// A camera of parallel rays.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OrthographicDescription {
    /// The middle of the image plane, where the rays start.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// The point in the middle of the picture.
    #[schemars(with = "Point")]
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    #[schemars(with = "Vector")]
    pub up: DVec3,
    /// Height of the seen rectangle in scene units.
    #[schemars(with = "Length")]
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

/// A camera that sees in all directions.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PanoramaDescription {
    /// Where all rays start.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// The point in the middle of the picture.
    #[schemars(with = "Point")]
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    #[schemars(with = "Vector")]
    pub up: DVec3,
    /// How it moves from frame to frame, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<CameraPathDescription>,
}

impl PanoramaDescription {
    /// A camera with z upwards.
    pub fn new(position: impl Into<DVec3>, look_at: impl Into<DVec3>) -> Self {
        Self {
            position: position.into(),
            look_at: look_at.into(),
            up: z_up(),
            path: None,
        }
    }
}

impl CameraDescription {
    /// What a file means that does not say of what type its camera is.
    pub(crate) const DEFAULT: &str = "perspective";

    /// How it moves from frame to frame, if it does.
    pub fn path(&self) -> Option<&CameraPathDescription> {
        match self {
            CameraDescription::Perspective(camera) => camera.path.as_ref(),
            CameraDescription::Orthographic(camera) => camera.path.as_ref(),
            CameraDescription::Panorama(camera) => camera.path.as_ref(),
        }
    }

    /// The camera with another path.
    pub fn with_path(mut self, path: impl Into<Option<CameraPathDescription>>) -> Self {
        match &mut self {
            CameraDescription::Perspective(camera) => camera.path = path.into(),
            CameraDescription::Orthographic(camera) => camera.path = path.into(),
            CameraDescription::Panorama(camera) => camera.path = path.into(),
        }
        self
    }
}

fn z_up() -> DVec3 {
    DVec3::Z
}
