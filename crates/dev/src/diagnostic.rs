//! Errors, as the terminal and the page show them.

use std::path::{Path, absolute};

use serde::Serialize;

use super::edit::Layout;
use wgray_render::error::{RenderError, ShaderError};
use wgray_render::excerpt;
use wgray_render::gpu::compose::Shaders;
use wgray_scene::{Problem, SceneError, Segment};

/// An error that the user can fix: its kind, its location, and the lines around it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// `shader`, `scene`, `file` or `device`.
    pub kind: &'static str,
    /// File, line and column, if known.
    pub place: Option<String>,
    /// The absolute path of the file, for an editor.
    pub file: Option<String>,
    /// Counted from 1.
    pub line: Option<usize>,
    /// In characters, counted from 1.
    pub column: Option<usize>,
    /// The message.
    pub message: String,
    /// The source line with the location marked, and its neighboring lines; `None` if there is no source text.
    pub excerpt: Option<String>,
}

impl Diagnostic {
    /// Returns an error without a location.
    pub fn plain(kind: &'static str, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            kind,
            place: None,
            file: None,
            line: None,
            column: None,
            message: message.into(),
            excerpt: None,
        }
    }

    /// Returns the diagnostics of a scene that cannot be read, with excerpts of its text.
    pub fn scene(error: &SceneError, text: &str) -> Vec<Diagnostic> {
        let layout = Layout::of(text).filter(|_| text.len() <= MAX_SEARCHED_BYTES);
        let (errors, more) = error.each();
        let shown = errors
            .iter()
            .map(|error| Diagnostic::of_value(error, text, layout.as_ref()));
        let omitted = more.map(|message| Diagnostic::plain("scene", message));
        shown.chain(omitted).collect()
    }

    /// Returns the diagnostic of an error that concerns one value or the whole file.
    fn of_value(error: &SceneError, text: &str, layout: Option<&Layout>) -> Diagnostic {
        let (origin, line, column) = match error {
            SceneError::Syntax {
                origin, line, column, ..
            } => (origin, *line, Some(*column)),
            SceneError::Invalid { origin, line, .. } => (origin, *line, None),
            SceneError::Read { .. } => return Diagnostic::plain("file", error.to_string()),
            _ => return Diagnostic::plain("scene", error.to_string()),
        };
        let location = match column {
            Some(column) => format!("{origin}:{line}:{column}"),
            None => format!("{origin}:{line}"),
        };
        let full_message = error.to_string();
        let message = full_message.strip_prefix(&format!("{location}: "));
        let message = message.unwrap_or(&full_message).to_string();
        let mark = match (error, column) {
            (_, Some(column)) => Some((column, 1)),
            (SceneError::Invalid { problem, .. }, None) => {
                layout.and_then(|layout| mark_of(layout, text, line, problem))
            }
            _ => None,
        };
        let column = mark.map(|(column, _)| column);
        Diagnostic {
            kind: "scene",
            excerpt: excerpt_of(text, line, mark).map(|excerpt| with_neighbors(text, line, &excerpt)),
            place: Some(column.map_or(format!("{origin}:{line}"), |column| format!("{origin}:{line}:{column}"))),
            file: absolute_path(Path::new(origin)),
            line: Some(line),
            column,
            message,
        }
    }

    /// Returns the diagnostic of an error in a shader. `folder` is the folder of the shaders, unless they are built in.
    pub fn shader(error: &ShaderError, shaders: &Shaders, folder: Option<&Path>) -> Diagnostic {
        let mut diagnostic = Diagnostic {
            place: Some(error.place.clone()),
            excerpt: error.excerpt.clone(),
            ..Diagnostic::plain("shader", error.message.clone())
        };
        let mut parts = error.place.rsplitn(3, ':');
        let (column, line, file) = (parts.next(), parts.next(), parts.next());
        let number = |part: Option<&str>| part.and_then(|part| part.parse().ok());
        let (Some(file), Some(line), Some(column)) = (file, number(line), number(column)) else {
            return diagnostic;
        };
        let text = shaders.text(file);
        if text.is_empty() {
            return diagnostic; // generated code
        }
        diagnostic.excerpt = diagnostic.excerpt.map(|excerpt| with_neighbors(text, line, &excerpt));
        (diagnostic.line, diagnostic.column) = (Some(line), Some(column));
        if let Some(folder) = folder {
            let path = folder.join(file);
            diagnostic.place = Some(format!("{}:{line}:{column}", path.display()));
            diagnostic.file = absolute_path(&path);
        }
        diagnostic
    }

    /// Returns the excerpt line with the error location and its mark, for a terminal.
    pub fn marked_line(&self) -> Option<String> {
        let lines: Vec<&str> = self.excerpt.as_ref()?.lines().collect();
        let mark = lines.iter().position(|line| line.starts_with(excerpt::NO_NUMBER))?;
        Some(lines[mark.checked_sub(1)?..=mark].join("\n"))
    }
}

fn absolute_path(path: &Path) -> Option<String> {
    absolute(path).ok()?.to_str().map(str::to_string)
}

/// Returns the excerpt of a line (counted from 1) together with its neighboring lines.
fn with_neighbors(text: &str, line: usize, excerpt: &str) -> String {
    let numbered = |line: usize| Some(excerpt::numbered(line, text.lines().nth(line.checked_sub(1)?)?));
    let before = line.checked_sub(1).and_then(numbered);
    let after = numbered(line + 1);
    let lines = before.into_iter().chain([excerpt.to_string()]).chain(after);
    lines.collect::<Vec<_>>().join("\n")
}

/// Texts above this size are not searched for the column of a value.
const MAX_SEARCHED_BYTES: usize = 1 << 20;

/// Returns the column and length of the invalid value or unknown key if it is on this line.
fn mark_of(layout: &Layout, text: &str, line: usize, problem: &Problem) -> Option<(usize, usize)> {
    let range = match (problem.is_unknown_key, problem.key.0.last()) {
        (true, Some(Segment::Key(key))) => layout
            .extent(&problem.key)
            .map(|extent| extent.start..extent.start + key.len()),
        _ => layout.value(&problem.key),
    }?;
    let before = text.get(..range.start)?;
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let length = text.get(range)?.lines().next()?.chars().count().max(1);
    (before.matches('\n').count() + 1 == line).then_some((before[start..].chars().count() + 1, length))
}

/// Formats a line (counted from 1) with its number and a mark (column and length). Without a `mark`, the full line is
/// marked.
fn excerpt_of(text: &str, line: usize, mark: Option<(usize, usize)>) -> Option<String> {
    let content = text.lines().nth(line.checked_sub(1)?)?;
    let indent = content.chars().take_while(|c| c.is_whitespace()).count();
    let (start, length) = match mark {
        Some((column, length)) => (column.saturating_sub(1), length),
        None => (indent, content.trim().chars().count().max(1)),
    };
    Some(excerpt::marked(line, content, start, length))
}

impl From<&RenderError> for Diagnostic {
    fn from(error: &RenderError) -> Diagnostic {
        Diagnostic::plain("device", error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgray_scene::Scene;

    fn single_diagnostic(error: &SceneError, text: &str) -> Diagnostic {
        let mut diagnostics = Diagnostic::scene(error, text);
        assert_eq!(diagnostics.len(), 1, "{diagnostics:?}");
        diagnostics.remove(0)
    }

    #[test]
    fn every_error_of_a_scene_is_shown_with_its_line() {
        let text = "[image]\nwidth = 0\nheight = 4\n[camera]\nposition = [0, 1, 0]\nlook_at = [1, 0, 0]\nfov = 190\n";
        let shown = Diagnostic::scene(&Scene::parse(text, "s.toml").unwrap_err(), text);
        let locations: Vec<_> = shown
            .iter()
            .map(|error| (error.place.as_deref(), error.column))
            .collect();
        assert_eq!(
            locations,
            [(Some("s.toml:2:9"), Some(9)), (Some("s.toml:7:7"), Some(7))]
        );
        assert_eq!(
            shown[1].marked_line().as_deref(),
            Some("    7 | fov = 190\n      |       ^^^")
        );
        let many = format!("{text}{}", "[[lights]]\ntype = 'point'\n".repeat(30));
        let shown = Diagnostic::scene(&Scene::parse(&many, "s.toml").unwrap_err(), &many);
        assert_eq!(shown.len(), 21);
        assert_eq!(
            (shown[20].message.as_str(), &shown[20].place),
            ("and 10 more errors", &None)
        );
    }

    #[test]
    fn a_scene_error_is_shown_with_its_line() {
        let text = "[image]\nwidth = 0\nheight = 4\n[camera]\nposition = [0, 1, 0]\nlook_at = [1, 0, 0]\nfov = 40\n";
        let error = Scene::parse(text, "s.toml").unwrap_err();
        let shown = single_diagnostic(&error, text);
        assert_eq!(shown.place.as_deref(), Some("s.toml:2:9"));
        assert_eq!(shown.message, "image.width: 0 must be from 1 to 65536");
        let lines = "    1 | [image]\n    2 | width = 0\n      |         ^\n    3 | height = 4";
        assert_eq!(shown.excerpt.as_deref(), Some(lines));
        assert_eq!(
            shown.marked_line().as_deref(),
            Some("    2 | width = 0\n      |         ^")
        );
        assert!(Path::new(shown.file.as_ref().unwrap()).is_absolute() && shown.file.unwrap().ends_with("s.toml"));
        assert_eq!((shown.line, shown.column), (Some(2), Some(9)));
        let unknown = text.replace("fov", "  fovv");
        let shown = single_diagnostic(
            &Scene::parse(&unknown.replace("= 0", "= 4"), "s.toml").unwrap_err(),
            &unknown,
        );
        assert_eq!((shown.line, shown.column), (Some(7), Some(3)));
        assert_eq!(
            shown.marked_line().as_deref(),
            Some("    7 |   fovv = 40\n      |   ^^^^")
        );
        // An error about a missing key marks the full line.
        let missing = text.replace("width = 0\n", "");
        let shown = single_diagnostic(&Scene::parse(&missing, "s.toml").unwrap_err(), &missing);
        assert_eq!(shown.column, None);
        let text = "[image]\nwidth = = 2";
        let error = Scene::parse(text, "s.toml").unwrap_err();
        let shown = single_diagnostic(&error, text);
        assert_eq!(shown.place.as_deref(), Some("s.toml:2:9"));
        let lines = "    1 | [image]\n    2 | width = = 2\n      |         ^";
        assert_eq!(
            shown.excerpt.as_deref(),
            Some(lines),
            "the excerpt continues after the last line"
        );
        assert_eq!((shown.line, shown.column), (Some(2), Some(9)));
    }

    #[test]
    fn a_shader_error_is_shown_between_its_neighboring_lines() {
        let text = "// first\n\nfn a() { b }\n| c\n";
        let shaders = Shaders::built_in().with("phong.wgsl", text.to_string());
        let error = |place: &str| ShaderError {
            place: place.to_string(),
            message: "no".to_string(),
            excerpt: Some("    3 | fn a() { b }\n      |          ^".to_string()),
        };
        let shown = Diagnostic::shader(&error("phong.wgsl:3:10"), &shaders, Some(Path::new("/s")));
        assert_eq!(shown.place.as_deref(), Some("/s/phong.wgsl:3:10"));
        assert_eq!(
            (shown.file.as_deref(), shown.line, shown.column),
            (Some("/s/phong.wgsl"), Some(3), Some(10))
        );
        let lines = "    2 |\n    3 | fn a() { b }\n      |          ^\n    4 | | c";
        assert_eq!(shown.excerpt.as_deref(), Some(lines));
        assert_eq!(shown.marked_line(), error("").excerpt);
        let built_in = Diagnostic::shader(&error("phong.wgsl:3:10"), &shaders, None);
        assert_eq!(
            (built_in.place.as_deref(), built_in.file),
            (Some("phong.wgsl:3:10"), None)
        );
        // Generated code has no file that can be opened.
        let generated = Diagnostic::shader(
            &error("crates/trace/src/records/layout.rs:3:10"),
            &shaders,
            Some(Path::new("/s")),
        );
        assert_eq!((generated.file, generated.line), (None, None));
        assert_eq!(generated.excerpt, error("").excerpt);
    }
}
