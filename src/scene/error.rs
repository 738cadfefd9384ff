//! What can be wrong with a scene file, and where.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::PathBuf;

use crate::gltf::GltfError;

/// Why there is no scene. Every message begins with the place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    // The field is not named `source`: its text is in the message, and must not be printed twice.
    #[error("{}: cannot be read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: io::Error,
    },
    /// The file is no TOML, or JSON of another form than a scene's.
    #[error("{origin}:{line}:{column}: {message}")]
    Syntax {
        /// Name of the file.
        origin: String,
        /// Counted from 1.
        line: usize,
        /// In characters, counted from 1.
        column: usize,
        /// What the parser says.
        message: String,
    },
    /// The file describes no scene.
    #[error("{origin}:{line}: {problem}")]
    Invalid {
        /// Name of the file.
        origin: String,
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        problem: Problem,
    },
    /// A glTF file is no scene.
    #[error("{0}")]
    Gltf(GltfError),
    /// A value that stands in for one of the file is bad; the key is the field of [`Overrides`](super::Overrides).
    #[error("{0}")]
    Override(Problem),
}

/// Where an error is, as far as that is known.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ErrorPlace {
    /// Name of the file.
    pub file: Option<String>,
    /// Counted from 1.
    pub line: Option<usize>,
    /// Counted from 1.
    pub column: Option<usize>,
    /// The way to the value: `shapes[2].size`.
    pub key: Option<String>,
}

impl SceneError {
    /// Where it is.
    pub fn place(&self) -> ErrorPlace {
        let of_file = |file: String| ErrorPlace {
            file: Some(file),
            ..ErrorPlace::default()
        };
        match self {
            SceneError::Read { path, .. } => of_file(path.display().to_string()),
            SceneError::Syntax {
                origin, line, column, ..
            } => ErrorPlace {
                line: Some(*line),
                column: Some(*column),
                ..of_file(origin.clone())
            },
            SceneError::Invalid { origin, line, problem } => ErrorPlace {
                line: Some(*line),
                key: Some(problem.key.to_string()).filter(|key| !key.is_empty()),
                ..of_file(origin.clone())
            },
            SceneError::Gltf(error) => error.place(),
            SceneError::Override(_) => ErrorPlace::default(),
        }
    }
}

/// A value that breaks a rule: `shapes[2].size: -1 must be finite and greater than 0`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Problem {
    /// Where it stands.
    pub key: KeyPath,
    /// The value and the rule.
    pub message: String,
    /// Whether it is damage to a file that the scene names, for which a stand-in exists ([`Assets::strict`](super::Assets::strict)).
    pub(crate) is_damage: bool,
    /// Whether the key is the subject of the message, as in `camera.fov is missing`.
    pub(super) is_predicate: bool,
}

impl From<String> for Problem {
    fn from(message: String) -> Self {
        Problem::new(message)
    }
}

impl Problem {
    /// A problem of one key.
    pub(crate) fn of(key: &str, message: impl Into<String>) -> Self {
        Self::new(message).at(key)
    }

    /// The problem of a key inside of another one.
    pub(crate) fn inside(self, key: &str) -> Self {
        self.at(key)
    }

    pub(super) fn new(message: impl Into<String>) -> Self {
        Self {
            key: KeyPath::default(),
            message: cut_to(LONGEST_MESSAGE, &message.into()).into_owned(),
            is_damage: false,
            is_predicate: false,
        }
    }

    /// Creates a problem whose message continues the key, such as `is missing`.
    pub(super) fn predicate(message: impl Into<String>) -> Self {
        Self {
            is_predicate: true,
            ..Self::new(message)
        }
    }

    /// Returns the problem of a damaged file.
    pub(super) fn damage(message: impl Into<String>) -> Self {
        Self {
            is_damage: true,
            ..Self::new(message)
        }
    }
}

/// The longest value or key in a message, and the longest message, in characters.
const LONGEST: usize = 60;
const LONGEST_MESSAGE: usize = 1000;
/// The most steps of a way to a value that are shown.
const MOST_SEGMENTS: usize = 20;

/// A value or a key for a message: where it is long, its start and its end.
pub(crate) fn cut(text: &str) -> Cow<'_, str> {
    cut_to(LONGEST, text)
}

/// A text without its middle where it is longer than so many characters.
pub(super) fn cut_to(longest: usize, text: &str) -> Cow<'_, str> {
    let count = text.chars().count();
    if count <= longest {
        return text.into();
    }
    let kept = longest - 3;
    let start: String = text.chars().take(kept - kept / 3).collect();
    let end: String = text.chars().skip(count - kept / 3).collect();
    format!("{start}...{end}").into()
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.key.0.is_empty() {
            f.write_str(&self.message)
        } else {
            let colon = if self.is_predicate { "" } else { ":" };
            write!(f, "{}{colon} {}", self.key, self.message)
        }
    }
}

impl std::error::Error for Problem {}

/// The way from the top of a file to a value: `shapes[2].size`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyPath(pub(crate) Vec<Segment>);

/// A step of a [`KeyPath`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Segment {
    Key(String),
    Index(usize),
}

impl From<&str> for Segment {
    fn from(key: &str) -> Self {
        Segment::Key(key.to_owned())
    }
}

impl From<usize> for Segment {
    fn from(index: usize) -> Self {
        Segment::Index(index)
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let end = self.0.len().saturating_sub(MOST_SEGMENTS / 2);
        for (i, segment) in self.0.iter().enumerate() {
            if self.0.len() > MOST_SEGMENTS && (MOST_SEGMENTS / 2..end).contains(&i) {
                if i == MOST_SEGMENTS / 2 {
                    f.write_str("...")?;
                }
                continue;
            }
            match segment {
                Segment::Index(index) => write!(f, "[{index}]")?,
                Segment::Key(key) => {
                    if i > 0 {
                        f.write_str(".")?;
                    }
                    let shown = cut(key);
                    if !key.is_empty() && key.chars().all(bare) {
                        f.write_str(&shown)?;
                    } else {
                        write!(f, "{shown:?}")?;
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(feature = "dev")]
impl KeyPath {
    /// The path as a scene file has it, whatever its length: what is read back as the same path.
    pub(crate) fn exact(&self) -> String {
        let mut text = String::new();
        for segment in &self.0 {
            match segment {
                Segment::Index(index) => text.push_str(&format!("[{index}]")),
                Segment::Key(key) => {
                    if !text.is_empty() {
                        text.push('.');
                    }
                    text.push_str(&written_key(key));
                }
            }
        }
        text
    }
}

/// A key as TOML has it: bare, or in quotes.
#[cfg(feature = "dev")]
fn written_key(key: &str) -> std::borrow::Cow<'_, str> {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(is_bare) {
        return key.into();
    }
    let escaped = key.chars().map(|c| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04X}", c as u32),
        c => c.to_string(),
    });
    format!("\"{}\"", escaped.collect::<String>()).into()
}

/// Says, on the way up, where a problem is, so that no path is built while all is well:
/// `check(x).at("center").at(2).at("shapes")?`.
pub(super) trait At {
    /// Puts a step in front of the problem's path.
    fn at(self, segment: impl Into<Segment>) -> Self;
}

impl At for Problem {
    fn at(mut self, segment: impl Into<Segment>) -> Self {
        self.key.0.insert(0, segment.into());
        self
    }
}

impl<T> At for Result<T, Problem> {
    fn at(self, segment: impl Into<Segment>) -> Self {
        self.map_err(|problem| problem.at(segment))
    }
}
