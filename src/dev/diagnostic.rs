//! What is wrong, as the terminal and the page show it.

use serde::Serialize;

use crate::error::{RenderError, ShaderError};
use crate::scene::SceneError;

/// An error that a person can mend: what kind of thing is wrong, where, and the lines around the place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// `shader`, `scene`, `file` or `device`.
    pub kind: &'static str,
    /// File, line and column, if it has a place.
    pub place: Option<String>,
    /// What is wrong.
    pub message: String,
    /// The source with the place marked, if there is one.
    pub excerpt: Option<String>,
}

impl Diagnostic {
    /// Something that has no place in a file.
    pub fn plain(kind: &'static str, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            kind,
            place: None,
            message: message.into(),
            excerpt: None,
        }
    }

    /// A scene that cannot be read, with the line of its text.
    pub fn scene(error: &SceneError, text: &str) -> Diagnostic {
        let (origin, line, column) = match error {
            SceneError::Syntax {
                origin, line, column, ..
            } => (origin, *line, Some(*column)),
            SceneError::Invalid { origin, line, .. } => (origin, *line, None),
            SceneError::Read { .. } => return Diagnostic::plain("file", error.to_string()),
            _ => return Diagnostic::plain("scene", error.to_string()),
        };
        let place = match column {
            Some(column) => format!("{origin}:{line}:{column}"),
            None => format!("{origin}:{line}"),
        };
        let whole = error.to_string();
        let message = whole.strip_prefix(&format!("{place}: ")).unwrap_or(&whole).to_string();
        Diagnostic {
            kind: "scene",
            excerpt: excerpt(text, line, column),
            place: Some(place),
            message,
        }
    }
}

/// A line of a text, counted from 1, with its number and a mark under a column.
fn excerpt(text: &str, line: usize, column: Option<usize>) -> Option<String> {
    let content = text.lines().nth(line.checked_sub(1)?)?;
    let indent = content.chars().take_while(|c| c.is_whitespace()).count();
    let (start, length) = match column {
        Some(column) => (column.saturating_sub(1), 1),
        None => (indent, content.trim().chars().count().max(1)),
    };
    Some(format!(
        "{line:>5} | {content}\n      | {}{}",
        " ".repeat(start),
        "^".repeat(length)
    ))
}

impl From<&ShaderError> for Diagnostic {
    fn from(error: &ShaderError) -> Diagnostic {
        Diagnostic {
            kind: "shader",
            place: Some(error.place.clone()),
            message: error.message.clone(),
            excerpt: error.excerpt.clone(),
        }
    }
}

impl From<&RenderError> for Diagnostic {
    fn from(error: &RenderError) -> Diagnostic {
        match error {
            RenderError::Shader(error) => error.into(),
            error => Diagnostic::plain("device", error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn a_scene_error_is_shown_with_its_line() {
        let text = "[image]\nwidth = 0\nheight = 4\n[camera]\nposition = [0, 1, 0]\nlook_at = [1, 0, 0]\nfov = 40\n";
        let error = Scene::parse(text, "s.toml").unwrap_err();
        let shown = Diagnostic::scene(&error, text);
        assert_eq!(shown.place.as_deref(), Some("s.toml:2"));
        assert_eq!(shown.message, "image.width: 0 must be from 1 to 65536");
        assert_eq!(shown.excerpt.as_deref(), Some("    2 | width = 0\n      | ^^^^^^^^^"));
        let text = "[image]\nwidth = = 2";
        let error = Scene::parse(text, "s.toml").unwrap_err();
        let shown = Diagnostic::scene(&error, text);
        assert_eq!(shown.place.as_deref(), Some("s.toml:2:9"));
        assert_eq!(shown.excerpt.as_deref(), Some("    2 | width = = 2\n      |         ^"));
    }
}
