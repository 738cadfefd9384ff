//! Errors of scene files and their locations.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::PathBuf;

use crate::gltf::GltfError;
use crate::mesh::MeshError;

/// An error of loading a scene. Every message starts with its location.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    // The field is not named `source`: its text is in the message, and must not be printed twice.
    #[error("{}: cannot be read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        error: io::Error,
    },
    /// The file is not valid TOML or JSON, or not in the form of a scene.
    #[error("{origin}:{line}:{column}: {message}")]
    Syntax {
        /// Name of the file.
        origin: String,
        /// Counted from 1.
        line: usize,
        /// In characters, counted from 1.
        column: usize,
        /// The message.
        message: String,
    },
    /// A value of the file is invalid.
    #[error("{origin}:{line}: {problem}")]
    Invalid {
        /// Name of the file.
        origin: String,
        /// Counted from 1.
        line: usize,
        /// The problem.
        problem: Problem,
    },
    /// Several values of the file are invalid, in the order of its lines. The message has one line for each.
    #[error("{}", self.lines())]
    Several {
        /// The first errors.
        errors: Vec<SceneError>,
        /// The number of further errors.
        more: usize,
    },
    /// The glTF file could not be loaded as a scene.
    #[error("{0}")]
    Gltf(GltfError),
    /// The mesh file could not be loaded as a scene.
    #[error("{0}")]
    Mesh(MeshError),
    /// The file has a format that cannot be read.
    #[error("{}: {message}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The format, and what to do.
        message: String,
    },
    /// A value that overrides one of the file is invalid; the key is the field of [`Overrides`](super::Overrides).
    #[error("{0}")]
    Override(Problem),
}

/// The location of an error, as far as it is known.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ErrorPlace {
    /// Name of the file.
    pub file: Option<String>,
    /// Counted from 1.
    pub line: Option<usize>,
    /// Counted from 1.
    pub column: Option<usize>,
    /// The key path of the value: `shapes[2].size`.
    pub key: Option<String>,
}

impl SceneError {
    /// Returns the location.
    pub fn place(&self) -> ErrorPlace {
        let of_file = |file: String| ErrorPlace {
            file: Some(file),
            ..ErrorPlace::default()
        };
        match self {
            SceneError::Read { path, .. } | SceneError::Unsupported { path, .. } => of_file(path.display().to_string()),
            SceneError::Mesh(error) => ErrorPlace {
                line: error.line(),
                ..of_file(error.path().display().to_string())
            },
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
            SceneError::Several { errors, .. } => errors.first().map(SceneError::place).unwrap_or_default(),
            SceneError::Gltf(error) => error.place(),
            SceneError::Override(_) => ErrorPlace::default(),
        }
    }

    /// Returns the errors of several values one by one, or this error, and a message about those that are not among them.
    pub fn each(&self) -> (&[SceneError], Option<String>) {
        match self {
            SceneError::Several { errors, more: 0 } => (errors, None),
            SceneError::Several { errors, more: 1 } => (errors, Some("and 1 more error".to_owned())),
            SceneError::Several { errors, more } => (errors, Some(format!("and {more} more errors"))),
            single => (std::slice::from_ref(single), None),
        }
    }

    fn lines(&self) -> String {
        let (errors, more) = self.each();
        let lines = errors.iter().map(SceneError::to_string).chain(more);
        lines.collect::<Vec<_>>().join("\n")
    }
}

/// A value that breaks a rule: `shapes[2].size: -1 must be finite and greater than 0`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Problem {
    /// The key path of the value.
    pub key: KeyPath,
    /// The value and the rule.
    pub message: String,
    /// True if it is damage to a file that the scene names, for which a stand-in exists ([`Assets::strict`](super::Assets::strict)).
    pub(crate) is_damage: bool,
    /// True if the key is unknown.
    pub is_unknown_key: bool,
    /// True if the key is the subject of the message, as in `camera.fov is missing`.
    pub(super) is_predicate: bool,
}

impl From<String> for Problem {
    fn from(message: String) -> Self {
        Problem::new(message)
    }
}

impl Problem {
    /// Creates a problem of one key.
    pub fn of(key: &str, message: impl Into<String>) -> Self {
        Self::new(message).at(key)
    }

    /// Prepends a key to the path.
    pub fn inside(self, key: &str) -> Self {
        self.at(key)
    }

    /// Returns a problem without a key.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            key: KeyPath::default(),
            message: cut_to(MAX_MESSAGE_LEN, &message.into()).into_owned(),
            is_damage: false,
            is_unknown_key: false,
            is_predicate: false,
        }
    }

    /// Creates a problem whose message continues the key, such as `is missing`.
    pub fn predicate(message: impl Into<String>) -> Self {
        Self {
            is_predicate: true,
            ..Self::new(message)
        }
    }

    /// Returns the problem of a damaged file.
    pub fn damage(message: impl Into<String>) -> Self {
        Self {
            is_damage: true,
            ..Self::new(message)
        }
    }
}

/// Maximum number of problems that are reported. Of each section that many are kept, because the order of the sections in the
/// file is unknown until all are checked.
const MAX_PROBLEMS: usize = 20;

/// The problems of a description: at least one.
#[derive(Clone, Debug)]
pub struct Problems {
    pub first: Problem,
    others: Vec<Problem>,
    /// The number of further problems.
    more: usize,
}

impl From<Problem> for Problems {
    fn from(first: Problem) -> Self {
        Problems {
            first,
            others: Vec::new(),
            more: 0,
        }
    }
}

impl Problems {
    pub fn iter(&self) -> impl Iterator<Item = &Problem> {
        std::iter::once(&self.first).chain(&self.others)
    }

    pub fn map(self, change: impl Fn(Problem) -> Problem) -> Problems {
        Problems {
            first: change(self.first),
            others: self.others.into_iter().map(change).collect(),
            more: self.more,
        }
    }

    /// Returns true if further problems are only counted.
    pub fn is_full(&self) -> bool {
        self.others.len() + 1 >= MAX_PROBLEMS
    }

    /// Adds a problem, or only counts it if there are enough.
    pub fn add(&mut self, problem: Problem) {
        match self.others.len() + 1 < MAX_PROBLEMS {
            true => self.others.push(problem),
            false => self.more += 1,
        }
    }

    /// Adds all problems of another section.
    fn extend(&mut self, section: Problems) {
        self.others.push(section.first);
        self.others.extend(section.others);
        self.more += section.more;
    }

    /// Keeps the first problem of each key.
    pub fn once_per_key(mut self) -> Problems {
        let mut known = vec![self.first.key.clone()];
        self.others.retain(|problem| {
            let is_new = !known.contains(&problem.key);
            known.push(problem.key.clone());
            is_new
        });
        self
    }

    /// Returns the error, with the problems in the order of their places in a text.
    pub fn into_error(
        self,
        place: impl Fn(&Problem) -> usize,
        error: impl Fn(usize, Problem) -> SceneError,
    ) -> SceneError {
        let mut all: Vec<(usize, Problem)> = (std::iter::once(self.first).chain(self.others))
            .map(|problem| (place(&problem), problem))
            .collect();
        all.sort_by_key(|(at, _)| *at);
        let more = self.more + all.len().saturating_sub(MAX_PROBLEMS);
        all.truncate(MAX_PROBLEMS);
        let mut errors: Vec<SceneError> = all.into_iter().map(|(at, problem)| error(at, problem)).collect();
        match (errors.len(), more) {
            (1, 0) => errors.remove(0),
            _ => SceneError::Several { errors, more },
        }
    }
}

/// Collects the problems of values that are checked independently.
#[derive(Debug, Default)]
pub struct Collector(Option<Problems>);

impl Collector {
    /// Returns a value, or `None` and keeps its problem.
    pub fn value<T>(&mut self, checked: Result<T, Problem>) -> Option<T> {
        let add = |problem| match &mut self.0 {
            Some(problems) => problems.add(problem),
            none => *none = Some(problem.into()),
        };
        checked.map_err(add).ok()
    }

    /// Returns a value, or `None` and keeps its problems.
    pub fn values<T>(&mut self, checked: Result<T, Problems>) -> Option<T> {
        let add = |found: Problems| match &mut self.0 {
            Some(problems) => {
                problems.more += found.more;
                std::iter::once(found.first)
                    .chain(found.others)
                    .for_each(|problem| problems.add(problem));
            }
            none => *none = Some(found),
        };
        checked.map_err(add).ok()
    }

    /// Returns a value, or a default that is not used, because [`Collector::end`] returns the problem.
    pub fn or_default<T: Default>(&mut self, checked: Result<T, Problem>) -> T {
        self.value(checked).unwrap_or_default()
    }

    /// Returns a value if there are no problems.
    pub fn end<T>(self, value: T) -> Result<T, Problems> {
        match self.0 {
            None => Ok(value),
            Some(problems) => Err(problems),
        }
    }
}

/// Returns both values, or the problems of both.
pub fn both<A, B>(a: Result<A, impl Into<Problems>>, b: Result<B, impl Into<Problems>>) -> Result<(A, B), Problems> {
    match (a.map_err(Into::into), b.map_err(Into::into)) {
        (Ok(a), Ok(b)) => Ok((a, b)),
        (Err(problems), Ok(_)) | (Ok(_), Err(problems)) => Err(problems),
        (Err(mut problems), Err(others)) => {
            problems.extend(others);
            Err(problems)
        }
    }
}

/// Maximum length of a value or key in a message, and of a message, in characters.
const MAX_VALUE_LEN: usize = 60;
const MAX_MESSAGE_LEN: usize = 1000;
/// Maximum number of segments of a key path that are printed.
const MAX_SEGMENTS: usize = 20;

/// Returns a value or key for a message: only its start and end if it is long.
pub fn cut(text: &str) -> Cow<'_, str> {
    cut_to(MAX_VALUE_LEN, text)
}

/// Removes the middle of a text that is longer than this number of characters.
pub fn cut_to(longest: usize, text: &str) -> Cow<'_, str> {
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

/// The key path of a value: `shapes[2].size`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyPath(pub Vec<Segment>);

/// A segment of a [`KeyPath`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Segment {
    /// A key of a table.
    Key(String),
    /// An index into a list.
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
        let end = self.0.len().saturating_sub(MAX_SEGMENTS / 2);
        for (i, segment) in self.0.iter().enumerate() {
            if self.0.len() > MAX_SEGMENTS && (MAX_SEGMENTS / 2..end).contains(&i) {
                if i == MAX_SEGMENTS / 2 {
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

impl KeyPath {
    /// Returns the path as it is written in a scene file, at any length. Parsing it returns the same path.
    pub fn exact(&self) -> String {
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

/// Returns a key as it is written in TOML: bare or quoted.
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

/// Adds the location of a problem while it is returned, so that no path is built without one:
/// `check(x).at("center").at(2).at("shapes")?`.
pub(super) trait At {
    /// Prepends a segment to the path of the problem.
    fn at(self, segment: impl Into<Segment>) -> Self;
}

impl At for Problem {
    fn at(mut self, segment: impl Into<Segment>) -> Self {
        self.key.0.insert(0, segment.into());
        self
    }
}

impl At for Problems {
    fn at(self, segment: impl Into<Segment>) -> Self {
        let segment = segment.into();
        self.map(|problem| problem.at(segment.clone()))
    }
}

impl<T, P: At> At for Result<T, P> {
    fn at(self, segment: impl Into<Segment>) -> Self {
        self.map_err(|problem| problem.at(segment))
    }
}
