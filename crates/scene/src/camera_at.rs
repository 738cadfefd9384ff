//! The validated camera at a frame of a camera path.

use crate::camera_path::CameraPath;
use crate::error::SceneError;
use crate::problem::{At as _, Problem};
use crate::scene::{Camera, Scene};

impl CameraPath {
    /// Returns the camera at a frame. The keys of problems are relative to `camera`.
    pub(crate) fn at(&self, frame: f64) -> Result<Camera, Problem> {
        let camera = self.description(frame).validate_frame();
        camera.map_err(|problem| Problem::new(format!("at frame {frame}, {problem}")).at("path"))
    }
}

impl Scene {
    /// Returns the camera at a frame; [`Scene::camera`] if the camera is not animated. The frames of an animation or of a
    /// turntable ([`Overrides::turntable`](crate::Overrides::turntable)) count from 1. A frame may be fractional. Before
    /// its first and after its last key, a value of the camera is that of this key.
    ///
    /// # Errors
    ///
    /// The camera has no valid view, for example because the camera path passes through the target point; or the
    /// frame is not finite.
    pub fn camera_at(&self, frame: f64) -> Result<Camera, SceneError> {
        let Some(path) = &self.camera_path else {
            return Ok(self.camera);
        };
        if !frame.is_finite() {
            return Err(SceneError::Override(Problem::of(
                "frame",
                format!("{frame} must be finite"),
            )));
        }
        path.at(frame).map_err(|problem| match &path.location {
            Some((origin, line)) => SceneError::Invalid {
                origin: origin.clone(),
                line: *line,
                problem: problem.at("camera"),
            },
            None => SceneError::Override(problem.at("camera")),
        })
    }
}
