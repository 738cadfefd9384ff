//! Errors of mesh files, with their locations.

use std::io;
use std::path::{Path, PathBuf};

/// An error of a mesh file. Messages begin with the location: `bunny.obj:17: the face refers to vertex 9, which does
/// not exist; defined so far: 8`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// Unreadable file.
    #[error("{}: cannot be read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The I/O error.
        #[source]
        error: io::Error,
    },
    /// Invalid line of a text file.
    #[error("{}:{line}: {message}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line from 1.
        line: usize,
        /// The invalid value and the violated rule.
        message: String,
    },
    /// Invalid byte of a binary file.
    #[error("{}: byte {offset}: {message}", path.display())]
    Byte {
        /// The file.
        path: PathBuf,
        /// Offset of the byte, from 0.
        offset: usize,
        /// The invalid value and the violated rule.
        message: String,
    },
    /// Error without a location in the file.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The violated rule.
        message: String,
    },
}

impl MeshError {
    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        match self {
            MeshError::Read { path, .. }
            | MeshError::Line { path, .. }
            | MeshError::Byte { path, .. }
            | MeshError::File { path, .. } => path,
        }
    }

    /// Returns the line from 1, if known.
    pub fn line(&self) -> Option<usize> {
        match self {
            MeshError::Line { line, .. } => Some(*line),
            _ => None,
        }
    }

    pub(crate) fn at(mut self, file: &Path) -> MeshError {
        match &mut self {
            MeshError::Read { path, .. }
            | MeshError::Line { path, .. }
            | MeshError::Byte { path, .. }
            | MeshError::File { path, .. } => *path = file.to_owned(),
        }
        self
    }
}

/// An error that does not contain the path of its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MeshFault {
    pub location: Location,
    pub message: String,
    /// True if the fault is that no triangles remain.
    pub is_empty: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Location {
    File,
    /// Line from 1.
    Line(usize),
    /// Byte offset.
    Byte(usize),
}

impl Location {
    pub fn fault(self, message: impl Into<String>) -> MeshFault {
        MeshFault {
            location: self,
            message: message.into(),
            is_empty: false,
        }
    }
}

impl MeshFault {
    /// Returns the error for a file without triangles; `reason` continues the message.
    pub fn empty(reason: &str) -> MeshFault {
        MeshFault {
            is_empty: true,
            ..Location::File.fault(format!("has no triangles{reason}"))
        }
    }

    pub fn of(self, path: &Path) -> MeshError {
        let (path, message) = (path.to_owned(), self.message);
        match self.location {
            Location::File => MeshError::File { path, message },
            Location::Line(line) => MeshError::Line { path, line, message },
            Location::Byte(offset) => MeshError::Byte { path, offset, message },
        }
    }
}

/// Quotes a word for a message, with the middle elided if it is long.
pub(super) fn quoted(word: &[u8]) -> String {
    const MAX_LEN: usize = 60;
    if word.len() <= MAX_LEN {
        return format!("{:?}", String::from_utf8_lossy(word));
    }
    let (start, end) = (&word[..MAX_LEN * 2 / 3], &word[word.len() - MAX_LEN / 3..]);
    format!(
        "{:?}",
        format!("{}...{}", String::from_utf8_lossy(start), String::from_utf8_lossy(end))
    )
}

/// Formats a number; very large and very small numbers in scientific notation.
pub(super) fn format_number(x: f64) -> String {
    match x == 0.0 || (1e-5..1e15).contains(&x.abs()) {
        true => format!("{x}"),
        false => format!("{x:e}"),
    }
}
