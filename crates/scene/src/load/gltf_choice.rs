//! The parts of a glTF file that are shown.

use crate::error::SceneError;
use crate::gltf::GltfError;
use crate::problem::Problem;
use crate::{Selection, View};

/// What is shown of a glTF file, and from where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GltfChoice {
    /// Which of its scenes; without, the one that the file names, else the first.
    pub scene: Option<Selection>,
    /// Which of its cameras; without, the first, if there is any.
    pub camera: Option<Selection>,
    /// From where it is seen as a whole, in place of any camera of its own; if it has none, [`View::Corner`].
    pub view: Option<View>,
    /// At which second of an animation.
    pub time: Option<f64>,
    /// Which of its animations; without, the first, where a time is said.
    pub animation: Option<Selection>,
    /// Which of its variants of materials.
    pub variant: Option<Selection>,
}

impl GltfChoice {
    /// The first thing that is chosen, as a command line calls it.
    pub(crate) fn first(&self) -> Option<&'static str> {
        let all = [
            (self.scene.is_some(), "gltf_scene"),
            (self.camera.is_some(), "camera"),
            (self.view.is_some(), "view"),
            (self.time.is_some(), "time"),
            (self.animation.is_some(), "animation"),
            (self.variant.is_some(), "variant"),
        ];
        let chosen = all.into_iter().find(|(is_chosen, _)| *is_chosen);
        chosen.map(|(_, name)| name)
    }

    /// Returns an error of the file, or of the option that chooses something that it does not have.
    pub(super) fn told(&self, error: GltfError) -> SceneError {
        let given = |option: &str| match option {
            "gltf_scene" => self.scene.is_some(),
            "animation" => self.animation.is_some(),
            "variant" => self.variant.is_some(),
            _ => self.time.is_some(),
        };
        match error {
            GltfError::Choice { option, message, .. } if given(option) => {
                SceneError::Override(Problem::of(option, message))
            }
            error => SceneError::Gltf(error),
        }
    }
}
