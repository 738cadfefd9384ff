//! What can be wrong with a mesh file, and where.

use std::io;
use std::path::{Path, PathBuf};

/// Why there is no mesh. Every message begins with the place: `bunny.obj:17: vertex 9 of the face does not exist; there are 8
/// so far`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file cannot be read.
    // The field is not named `source`: its text is in the message, and must not be printed twice.
    #[error("{}: cannot be read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: io::Error,
    },
    /// A line of a text breaks a rule.
    #[error("{}:{line}: {message}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// The value and the rule.
        message: String,
    },
    /// A byte of a binary file breaks a rule.
    #[error("{}: byte {offset}: {message}", path.display())]
    Byte {
        /// The file.
        path: PathBuf,
        /// Counted from 0.
        offset: usize,
        /// The value and the rule.
        message: String,
    },
    /// The file as a whole breaks a rule.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The value and the rule.
        message: String,
    },
}

impl MeshError {
    /// Returns the file.
    pub fn path(&self) -> &Path {
        match self {
            MeshError::Read { path, .. }
            | MeshError::Line { path, .. }
            | MeshError::Byte { path, .. }
            | MeshError::File { path, .. } => path,
        }
    }

    /// Returns the line, counted from 1, if the error has one.
    pub fn line(&self) -> Option<usize> {
        match self {
            MeshError::Line { line, .. } => Some(*line),
            _ => None,
        }
    }

    /// Returns the error with another path to the same file.
    pub(crate) fn at(mut self, other: &Path) -> MeshError {
        match &mut self {
            MeshError::Read { path, .. }
            | MeshError::Line { path, .. }
            | MeshError::Byte { path, .. }
            | MeshError::File { path, .. } => *path = other.to_owned(),
        }
        self
    }
}

/// An error before it knows its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub place: Place,
    pub message: String,
    /// True if the file has no triangle to render.
    pub is_empty: bool,
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// All of it.
    File,
    /// A line of a text, counted from 1.
    Line(usize),
    /// A byte of a binary file, counted from 0.
    Byte(usize),
}

impl Place {
    pub fn fault(self, message: impl Into<String>) -> Fault {
        Fault {
            place: self,
            message: message.into(),
            is_empty: false,
        }
    }
}

impl Fault {
    /// Returns the fault of a file without triangles. `reason` continues the message.
    pub fn empty(reason: &str) -> Fault {
        Fault {
            is_empty: true,
            ..Place::File.fault(format!("has no triangles{reason}"))
        }
    }

    pub fn of(self, path: &Path) -> MeshError {
        let (path, message) = (path.to_owned(), self.message);
        match self.place {
            Place::File => MeshError::File { path, message },
            Place::Line(line) => MeshError::Line { path, line, message },
            Place::Byte(offset) => MeshError::Byte { path, offset, message },
        }
    }
}

/// A word of a file for a message: quoted, without its middle where it is long.
pub(super) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 60;
    if word.len() <= LONGEST {
        return format!("{:?}", String::from_utf8_lossy(word));
    }
    let (start, end) = (&word[..LONGEST * 2 / 3], &word[word.len() - LONGEST / 3..]);
    format!(
        "{:?}",
        format!("{}...{}", String::from_utf8_lossy(start), String::from_utf8_lossy(end))
    )
}

/// A number for a message, without rows of zeros.
pub(super) fn shown_number(x: f64) -> String {
    match x == 0.0 || (1e-5..1e15).contains(&x.abs()) {
        true => format!("{x}"),
        false => format!("{x:e}"),
    }
}
