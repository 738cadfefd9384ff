//! Error types of scenes, devices and renders.

use thiserror::Error;

pub use wgray_render::error::{DeviceError, RenderError, ShaderError, ShaderErrors};
use wgray_scene::{Problem, SceneError};

/// An error of loading a scene, rendering it, or saving the image.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid scene file.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An invalid description that was created in code.
    #[error(transparent)]
    Description(#[from] Problem),
    /// A render option that is invalid, or that the scene or the device does not support.
    #[error("{0}")]
    Option(Problem),
    /// An image that could not be rendered or written.
    #[error(transparent)]
    Render(#[from] RenderError),
}
