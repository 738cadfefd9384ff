//! Selection of the parts of a glTF file to render.

use crate::error::SceneError;
use crate::gltf::GltfError;
use crate::problem::Problem;
use crate::{Selection, View};

/// The parts of a glTF file that are rendered, and the view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GltfChoice {
    /// The scene; `None` selects the default scene of the file, or else the first scene.
    pub scene: Option<Selection>,
    /// The camera; `None` selects the first camera, if the file has cameras.
    pub camera: Option<Selection>,
    /// A view of the entire model instead of a camera of the file. If `None` and the file has no camera, the view is
    /// [`View::Corner`].
    pub view: Option<View>,
    /// The time of the animation in seconds.
    pub time: Option<f64>,
    /// The animation; `None` selects the first animation if `time` is set.
    pub animation: Option<Selection>,
    /// The material variant.
    pub variant: Option<Selection>,
}

impl GltfChoice {
    /// Returns the name of the first option that is set.
    pub(crate) fn first_option(&self) -> Option<&'static str> {
        let options = [
            (self.scene.is_some(), "gltf_scene"),
            (self.camera.is_some(), "camera"),
            (self.view.is_some(), "view"),
            (self.time.is_some(), "time"),
            (self.animation.is_some(), "animation"),
            (self.variant.is_some(), "variant"),
        ];
        let first = options.into_iter().find(|(is_set, _)| *is_set);
        first.map(|(_, name)| name)
    }

    /// Converts an error to an error of the file, or of the option that selects a missing part.
    pub(super) fn error(&self, error: GltfError) -> SceneError {
        let is_set = |option: &str| match option {
            "gltf_scene" => self.scene.is_some(),
            "animation" => self.animation.is_some(),
            "variant" => self.variant.is_some(),
            _ => self.time.is_some(),
        };
        match error {
            GltfError::Choice { option, message, .. } if is_set(option) => {
                SceneError::Override(Problem::of(option, message))
            }
            error => SceneError::Gltf(error),
        }
    }
}
