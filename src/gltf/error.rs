//! What can be wrong with a glTF file, and where.

use std::io;
use std::path::{Path, PathBuf};

use crate::scene::ErrorPlace;

/// Why there is no model. Every message begins with the place: `a.gltf: accessors[3]: 9 elements of 12 bytes, 12 apart, from byte
/// 0 on; bufferViews[1] has 96 bytes`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GltfError {
    /// A file cannot be read.
    // The field is not named `source`: its text is in the message, and must not be printed twice.
    #[error("{}: cannot be read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: io::Error,
    },
    /// The file's JSON is none.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Counted from 1, in the JSON.
        line: usize,
        /// In bytes, counted from 1.
        column: usize,
        /// What the parser says.
        message: String,
    },
    /// A byte of a binary file breaks a rule.
    #[error("{}: byte {offset}: {message}", path.display())]
    Byte {
        /// The file.
        path: PathBuf,
        /// Counted from 0.
        offset: u64,
        /// The value and the rule.
        message: String,
    },
    /// A value of the JSON, or what it stands for, breaks a rule.
    #[error("{}: {key}: {message}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// The way to the value: `accessors[3].count`.
        key: String,
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

impl GltfError {
    /// Where it is.
    pub(crate) fn place(&self) -> ErrorPlace {
        let mut place = ErrorPlace::default();
        let path = match self {
            GltfError::Syntax { path, line, column, .. } => {
                (place.line, place.column) = (Some(*line), Some(*column));
                path
            }
            GltfError::Key { path, key, .. } => {
                place.key = Some(key.clone());
                path
            }
            GltfError::Read { path, .. } | GltfError::Byte { path, .. } | GltfError::File { path, .. } => path,
        };
        place.file = Some(path.display().to_string());
        place
    }
}

/// An error before it knows its file.
#[derive(Debug)]
pub(super) struct Fault {
    pub place: Place,
    pub message: String,
}

/// A place in a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// All of it.
    File,
    /// A line and a column of the JSON, counted from 1.
    Line(usize, usize),
    /// A byte, counted from 0.
    Byte(u64),
    /// A value of the JSON.
    Key(String),
}

/// The longest message and the longest key, in characters: what a file says may be in them.
const LONGEST: usize = 1000;

impl Fault {
    pub fn new(place: Place, message: impl Into<String>) -> Fault {
        Fault {
            place,
            message: cut(message.into()),
        }
    }

    /// A fault of a value of the JSON.
    pub fn key(key: impl Into<String>, message: impl Into<String>) -> Fault {
        Fault::new(Place::Key(cut(key.into())), message)
    }

    /// A fault of the whole file.
    pub fn file(message: impl Into<String>) -> Fault {
        Fault::new(Place::File, message)
    }

    pub fn of(self, path: &Path) -> GltfError {
        let (path, message) = (path.to_owned(), self.message);
        match self.place {
            Place::File => GltfError::File { path, message },
            Place::Line(line, column) => GltfError::Syntax {
                path,
                line,
                column,
                message,
            },
            Place::Byte(offset) => GltfError::Byte { path, offset, message },
            Place::Key(key) => GltfError::Key { path, key, message },
        }
    }
}

/// A text without its middle where it is long.
fn cut(text: String) -> String {
    let count = text.chars().count();
    if count <= LONGEST {
        return text;
    }
    let start: String = text.chars().take(LONGEST * 2 / 3).collect();
    let end: String = text.chars().skip(count - LONGEST / 4).collect();
    format!("{start}...{end}")
}

/// A name that a file gives, for a message: quoted, without its middle where it is long.
pub(super) fn shown(name: &str) -> String {
    const LONGEST: usize = 60;
    let count = name.chars().count();
    if count <= LONGEST {
        return format!("{name:?}");
    }
    let start: String = name.chars().take(LONGEST * 2 / 3).collect();
    let end: String = name.chars().skip(count - LONGEST / 4).collect();
    format!("{:?}", format!("{start}...{end}"))
}
