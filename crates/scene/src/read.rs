//! Parses scene files in TOML or JSON to descriptions.

use std::path::Path;

use crate::defines::Defines;
use crate::error::SceneError;
use crate::parse::is_json_scene;
use crate::{Description, course};

impl Description {
    /// Parses a scene file without validating its values. `origin` is the file's name in messages. If the name ends in
    /// `.json`, the text is JSON, otherwise TOML.
    ///
    /// # Errors
    ///
    /// The text is invalid TOML or JSON, has unknown or missing keys, unknown types, or values of the wrong type.
    pub fn parse(text: &str, origin: &str) -> Result<Self, SceneError> {
        Description::parse_with(text, origin, &mut Defines::new(&[]))
    }

    pub(crate) fn parse_with(text: &str, origin: &str, defines: &mut Defines) -> Result<Self, SceneError> {
        match is_json_scene(Path::new(origin)) {
            true => course::read(text, origin, defines),
            false => Description::parse_toml(text, origin, defines),
        }
    }
}
