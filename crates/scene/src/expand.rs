//! Validation of descriptions: glTF files are expanded first.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::gltf_shape::ExpandedScene;
use crate::problem::{Problem, Problems};
use crate::validate::integrator_note;
use crate::{Assets, Description, Note, Scene, ShapeDescription};

impl Description {
    /// Validates all values and returns the scene. File names are relative to the current folder.
    ///
    /// # Errors
    ///
    /// The first invalid value. [`Scene::parse`](super::Scene::parse) reports all invalid values.
    pub fn validate(&self) -> Result<Scene, Problem> {
        self.validate_with(&Assets::beside(Path::new(".")))
    }

    /// Validates all values and files, and returns the scene.
    ///
    /// # Errors
    ///
    /// The first invalid value.
    pub fn validate_with(&self, assets: &Assets) -> Result<Scene, Problem> {
        let scene = self.validate_and_list(assets, &mut BTreeSet::new());
        scene.map_err(|problems| problems.first)
    }

    /// Like [`Description::validate_with`], but returns all problems. Adds the files of the scene to `files`, even if
    /// there are problems.
    pub(crate) fn validate_and_list(&self, assets: &Assets, files: &mut BTreeSet<PathBuf>) -> Result<Scene, Problems> {
        files.extend(self.files_on_disk(assets));
        let integrator = self.integrator();
        let settings = self.settings(integrator);
        let has_gltf = self
            .shapes
            .iter()
            .any(|shape| matches!(shape, ShapeDescription::Gltf(_)));
        let expanded = match &settings {
            Ok(_) if has_gltf => Some(ExpandedScene::of(self, assets, files)),
            _ => None,
        };
        let mut scene = match expanded {
            None => self.validate_plain(settings, integrator, assets, files)?,
            Some(Err(problem)) => {
                let validated = self.validate_plain(Err(problem.into()), integrator, assets, files);
                validated.map_err(Problems::once_per_key)? // validation may report this problem again
            }
            Some(Ok(expanded)) => {
                // The glTF files may have added lights.
                let settings = expanded.description.settings(integrator);
                let scene = expanded
                    .description
                    .validate_plain(settings, integrator, &expanded.assets, files);
                let original = |problem| expanded.original_problem(self, problem);
                let mut scene = scene.map_err(|problems| problems.map(original).once_per_key())?;
                scene.notes.splice(0..0, expanded.notes);
                scene.imported = expanded.imported;
                scene
            }
        };
        let note = integrator_note(self).map(Note::from);
        scene.notes.splice(0..0, note);
        Ok(scene)
    }
}
