//! The section `[camera]` of scene files.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::tagged::{Tagged, tagged};
use super::{CameraPathDescription, one};
use crate::description::kinds::*;

tagged! {
    /// The camera. The key `type` selects the variant.
    CameraDescription {
        /// Perspective projection.
        "perspective" => Perspective(PerspectiveDescription),
        /// Orthographic projection.
        "orthographic" => Orthographic(OrthographicDescription),
        /// Equirectangular projection of all directions.
        "panorama" => Panorama(PanoramaDescription),
    }
}

/// A perspective camera with a pinhole or a thin lens.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PerspectiveDescription {
    /// Center of projection.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// Point at the center of the image; must differ from `position`.
    #[schemars(with = "Point")]
    pub look_at: DVec3,
    /// Up direction in the image, not parallel to the view. In a vertical view, the default becomes +y.
    #[serde(default = "z_up")]
    #[schemars(with = "Vector")]
    pub up: DVec3,
    /// Vertical field of view in degrees.
    #[schemars(with = "Fov")]
    pub fov: f64,
    /// Focal length in scene units; only used with `f_number`.
    #[serde(default = "one")]
    #[schemars(with = "Length")]
    pub focal_length: f64,
    /// Diameter of the lens in scene units; 0 for a pinhole camera. If absent, 0 unless `f_number` is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Aperture>")]
    pub aperture: Option<f64>,
    /// Focal length divided by the diameter of the lens; replaces `aperture`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<FNumber>")]
    pub f_number: Option<f64>,
    /// Distance of the plane in focus, along the view direction. If absent, the distance of `look_at`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Length>")]
    pub focus_distance: Option<f64>,
    /// Number of corners of the lens; 0 for a round lens.
    #[serde(default)]
    #[schemars(with = "Blades")]
    pub blades: u32,
    /// Rotation of the corners in degrees, counter-clockwise in the image; at 0 one is at the top.
    #[serde(default)]
    #[schemars(with = "Degrees")]
    pub blade_rotation: f64,
    /// Animation of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<CameraPathDescription>,
}

impl PerspectiveDescription {
    /// Creates a camera with z up. `fov` is the vertical field of view in degrees.
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

/// An orthographic camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OrthographicDescription {
    /// Center of the image plane, where the rays start.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// Point at the center of the image; must differ from `position`.
    #[schemars(with = "Point")]
    pub look_at: DVec3,
    /// Up direction in the image, not parallel to the view. In a vertical view, the default becomes +y.
    #[serde(default = "z_up")]
    #[schemars(with = "Vector")]
    pub up: DVec3,
    /// Height of the image plane in scene units.
    #[schemars(with = "Length")]
    pub height: f64,
    /// Animation of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<CameraPathDescription>,
}

impl OrthographicDescription {
    /// Creates a camera with z up. `height` is the height of the image plane in scene units.
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

/// A camera with an equirectangular projection of all directions.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PanoramaDescription {
    /// Origin of all rays.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// Point at the center of the image; must differ from `position`.
    #[schemars(with = "Point")]
    pub look_at: DVec3,
    /// Up direction in the image, not parallel to the view. In a vertical view, the default becomes +y.
    #[serde(default = "z_up")]
    #[schemars(with = "Vector")]
    pub up: DVec3,
    /// Animation of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<CameraPathDescription>,
}

impl PanoramaDescription {
    /// Creates a camera with z up.
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
    /// Type of a camera without `type`.
    pub(crate) const DEFAULT: &str = "perspective";

    /// Returns the animation of the camera.
    pub fn path(&self) -> Option<&CameraPathDescription> {
        match self {
            CameraDescription::Perspective(camera) => camera.path.as_ref(),
            CameraDescription::Orthographic(camera) => camera.path.as_ref(),
            CameraDescription::Panorama(camera) => camera.path.as_ref(),
        }
    }

    /// Replaces the animation of the camera.
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
