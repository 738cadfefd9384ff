//! Violations of rules by values, each with the key path of the value.

use std::fmt;
use std::io;

use crate::key_path::{KeyPath, Segment, cut_to};

/// The location of an error, as far as known.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ErrorPlace {
    /// Name of the file.
    pub file: Option<String>,
    /// Line, counted from 1.
    pub line: Option<usize>,
    /// Column, counted from 1.
    pub column: Option<usize>,
    /// The key path of the value: `shapes[2].size`.
    pub key: Option<String>,
}

/// Maximum length of a message, in characters.
const MAX_MESSAGE_LEN: usize = 1000;

/// A value that violates a rule: `shapes[2].size: -1 must be from 1e-9 to 1e9`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Problem {
    /// The key path of the value.
    pub key: KeyPath,
    /// The value and the rule.
    pub message: String,
    /// True for damage to a file that a placeholder replaces unless [`Assets::strict`](super::Assets::strict) is set.
    pub(crate) is_damage: bool,
    /// True if the key is unknown.
    pub is_unknown_key: bool,
    /// The file, if the problem is a file that cannot be read.
    pub file: Option<UnreadableFile>,
    /// True if the key is the subject of the message, as in `camera.fov is missing`.
    pub(super) is_predicate: bool,
}

/// A file of a scene that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct UnreadableFile {
    /// The name of the file in the scene.
    pub name: String,
    /// The kind of the I/O error.
    pub kind: io::ErrorKind,
}

impl From<String> for Problem {
    fn from(message: String) -> Self {
        Problem::new(message)
    }
}

impl Problem {
    /// Creates a problem with a key.
    pub fn of(key: &str, message: impl Into<String>) -> Self {
        Self::new(message).at(key)
    }

    /// Prepends a key to the key path.
    pub fn inside(self, key: &str) -> Self {
        self.at(key)
    }

    /// Creates a problem without a key.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            key: KeyPath::default(),
            message: cut_to(MAX_MESSAGE_LEN, &message.into()).into_owned(),
            is_damage: false,
            is_unknown_key: false,
            file: None,
            is_predicate: false,
        }
    }

    /// Sets the file that cannot be read.
    pub(crate) fn with_file(self, name: &str, kind: io::ErrorKind) -> Self {
        let name = name.to_owned();
        Self {
            file: Some(UnreadableFile { name, kind }),
            ..self
        }
    }

    /// Creates a problem whose message continues the key, such as `is missing`.
    pub fn predicate(message: impl Into<String>) -> Self {
        Self {
            is_predicate: true,
            ..Self::new(message)
        }
    }

    /// Creates the problem of a damaged file.
    pub fn damage(message: impl Into<String>) -> Self {
        Self {
            is_damage: true,
            ..Self::new(message)
        }
    }
}

/// Maximum number of reported problems. Each section may collect this number, because [`Problems::into_error`] sorts
/// the problems of all sections by their locations in the file.
pub(crate) const MAX_PROBLEMS: usize = 20;

/// The problems of a description: at least one.
#[derive(Clone, Debug)]
pub struct Problems {
    pub first: Problem,
    /// Problems after the first.
    pub(crate) others: Vec<Problem>,
    /// Number of further problems, which are only counted.
    pub(crate) more: usize,
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

    /// Adds a problem; if the maximum is reached, only counts the problem.
    pub fn add(&mut self, problem: Problem) {
        match self.others.len() + 1 < MAX_PROBLEMS {
            true => self.others.push(problem),
            false => self.more += 1,
        }
    }

    fn extend(&mut self, section: Problems) {
        self.others.push(section.first);
        self.others.extend(section.others);
        self.more += section.more;
    }

    /// Keeps the first problem of each key.
    pub fn once_per_key(mut self) -> Problems {
        let mut keys = vec![self.first.key.clone()];
        self.others.retain(|problem| {
            let is_new = !keys.contains(&problem.key);
            keys.push(problem.key.clone());
            is_new
        });
        self
    }
}

/// Collects the problems of values that are checked independently.
#[derive(Debug, Default)]
pub struct Collector(Option<Problems>);

impl Collector {
    /// Returns the value; on failure, collects the problem and returns `None`.
    pub fn value<T>(&mut self, result: Result<T, Problem>) -> Option<T> {
        let add = |problem| match &mut self.0 {
            Some(problems) => problems.add(problem),
            empty => *empty = Some(problem.into()),
        };
        result.map_err(add).ok()
    }

    /// Returns the value; on failure, collects the problems and returns `None`.
    pub fn values<T>(&mut self, result: Result<T, Problems>) -> Option<T> {
        let add = |found: Problems| match &mut self.0 {
            Some(problems) => {
                problems.more += found.more;
                std::iter::once(found.first)
                    .chain(found.others)
                    .for_each(|problem| problems.add(problem));
            }
            empty => *empty = Some(found),
        };
        result.map_err(add).ok()
    }

    /// Returns the value; on failure, collects the problem and returns a default, which is unused because
    /// [`Collector::end`] returns the problem.
    pub fn or_default<T: Default>(&mut self, result: Result<T, Problem>) -> T {
        self.value(result).unwrap_or_default()
    }

    /// Returns the value if no problems were collected.
    pub fn end<T>(self, value: T) -> Result<T, Problems> {
        match self.0 {
            None => Ok(value),
            Some(problems) => Err(problems),
        }
    }
}

/// Returns both values, or the problems of both results.
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

/// Adds segments to the key path of a problem while the problem is returned:
/// `check(x).at("center").at(2).at("shapes")?`.
pub(crate) trait At {
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
