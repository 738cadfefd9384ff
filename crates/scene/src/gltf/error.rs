//! Errors of glTF files, with their locations.

use std::io;
use std::path::{Path, PathBuf};

use crate::ErrorPlace;
use crate::key_path::Segment;
use crate::tree::{Fault, ReadError};

/// An error of a glTF file. Messages begin with the location: `a.gltf: accessors[3]: count 9, element size 12, stride
/// 12 and offset 0 exceed the 96 bytes of bufferViews[1]`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GltfError {
    /// Unreadable file.
    #[error("{}: cannot be read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The I/O error.
        #[source]
        error: io::Error,
    },
    /// Malformed JSON.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line of the JSON, from 1.
        line: usize,
        /// Column in bytes, from 1.
        column: usize,
        /// The message of the parser.
        message: String,
    },
    /// Invalid byte of a binary file.
    #[error("{}: byte {offset}: {message}", path.display())]
    Byte {
        /// The file.
        path: PathBuf,
        /// Offset of the byte, from 0.
        offset: u64,
        /// The invalid value and the violated rule.
        message: String,
    },
    /// Invalid value of the JSON, or invalid data that the JSON refers to.
    #[error("{}: {key}: {message}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// Key path: `accessors[3].count`.
        key: String,
        /// The invalid value and the violated rule.
        message: String,
    },
    /// Missing scene, animation or variant.
    #[error("{}: {key}: {message}", path.display())]
    Choice {
        /// The file.
        path: PathBuf,
        /// The list: `scenes`, `animations` or `variants`.
        key: &'static str,
        /// The option: `gltf_scene`, `animation`, `variant` or `time`.
        option: &'static str,
        /// The selection and the available entries.
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

impl GltfError {
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
            GltfError::Choice { path, key, .. } => {
                place.key = Some((*key).to_owned());
                path
            }
            GltfError::Read { path, .. } | GltfError::Byte { path, .. } | GltfError::File { path, .. } => path,
        };
        place.file = Some(path.display().to_string());
        place
    }

    pub(crate) fn at(mut self, file: &Path) -> GltfError {
        match &mut self {
            GltfError::Read { path, .. }
            | GltfError::Syntax { path, .. }
            | GltfError::Byte { path, .. }
            | GltfError::Key { path, .. }
            | GltfError::Choice { path, .. }
            | GltfError::File { path, .. } => *path = file.to_owned(),
        }
        self
    }
}

/// An error that does not contain the path of its file.
#[derive(Debug)]
pub(super) struct GltfFault {
    pub location: Location,
    pub message: String,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Location {
    File,
    /// Line and column of the JSON, counted from 1.
    Line(usize, usize),
    Byte(u64),
    /// Key path in the JSON.
    Key(String),
}

/// Maximum length of a message or a key in characters.
const MAX_MESSAGE_LEN: usize = 1000;

impl GltfFault {
    pub fn new(location: Location, message: impl Into<String>) -> GltfFault {
        GltfFault {
            location,
            message: elide(message.into()),
        }
    }

    pub fn key(key: impl Into<String>, message: impl Into<String>) -> GltfFault {
        GltfFault::new(Location::Key(elide(key.into())), message)
    }

    pub fn file(message: impl Into<String>) -> GltfFault {
        GltfFault::new(Location::File, message)
    }

    pub fn of(self, path: &Path) -> GltfError {
        let (path, message) = (path.to_owned(), self.message);
        match self.location {
            Location::File => GltfError::File { path, message },
            Location::Line(line, column) => GltfError::Syntax {
                path,
                line,
                column,
                message,
            },
            Location::Byte(offset) => GltfError::Byte { path, offset, message },
            Location::Key(key) => GltfError::Key { path, key, message },
        }
    }
}

fn elide(text: String) -> String {
    let count = text.chars().count();
    if count <= MAX_MESSAGE_LEN {
        return text;
    }
    let start: String = text.chars().take(MAX_MESSAGE_LEN * 2 / 3).collect();
    let end: String = text.chars().skip(count - MAX_MESSAGE_LEN / 4).collect();
    format!("{start}...{end}")
}

/// Returns the key path of an error in the value at `key`.
pub(super) fn key_within(key: &str, error: &ReadError) -> String {
    match error.key.0.first() {
        None => key.to_owned(),
        Some(Segment::Key(_)) => format!("{key}.{}", error.key),
        Some(Segment::Index(_)) => format!("{key}{}", error.key),
    }
}

/// Returns the message of an error in terms of JSON.
pub(super) fn json_message(error: ReadError) -> String {
    let (found, expected) = match error.fault {
        Fault::UnknownKey(_) => return "unknown key".to_owned(),
        Fault::MissingKey(key) => return format!("{} is required", quoted(key)),
        Fault::Other(message) => return message.replace('`', "\""),
        Fault::Mismatch { found, expected } => (found, expected),
    };
    let digits: String = expected.chars().filter(char::is_ascii_digit).collect();
    let expected = match &*expected {
        "f32" | "f64" => "a number".to_owned(),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a non-negative integer".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a string" | "a borrowed string" | "string" => "a string".to_owned(),
        _ if expected.starts_with("index into ") => "an index".to_owned(),
        "a sequence" => "a list".to_owned(),
        "a map" | "map" => "an object".to_owned(),
        _ if expected.starts_with("struct ") => "an object".to_owned(),
        _ if expected.starts_with("an array of length ") || expected.starts_with("a tuple of size ") => {
            format!("a list of {digits} values")
        }
        other => other.to_owned(),
    };
    format!("expected {expected}, found {found}")
}

/// Quotes a name for a message, with the middle elided if it is long.
pub(super) fn quoted(name: &str) -> String {
    const MAX_LEN: usize = 60;
    let count = name.chars().count();
    if count <= MAX_LEN {
        return format!("{name:?}");
    }
    let start: String = name.chars().take(MAX_LEN * 2 / 3).collect();
    let end: String = name.chars().skip(count - MAX_LEN / 4).collect();
    format!("{:?}", format!("{start}...{end}"))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::json_message;
    use crate::tree;

    #[test]
    fn type_errors_are_reported_in_terms_of_json() {
        #[derive(serde::Deserialize, Debug)]
        #[expect(dead_code, reason = "the fields only produce errors")]
        struct View {
            name: String,
            length: u32,
            position: [f32; 3],
            list: Vec<f32>,
            is_on: bool,
        }
        let valid = json!({ "name": "a", "length": 1, "position": [1, 2, 3], "list": [1], "is_on": true });
        serde_json::from_value::<View>(valid.clone()).unwrap();
        for (key, value, expected) in [
            ("name", json!(3), "expected a string, found 3"),
            (
                "length",
                json!("\u{1b}[31m"),
                "expected a non-negative integer, found \"\\u{1b}[31m\"",
            ),
            ("length", json!(-1), "expected a non-negative integer, found -1"),
            ("length", json!(1.5), "expected a non-negative integer, found 1.5"),
            ("length", json!({}), "expected a non-negative integer, found an object"),
            (
                "position",
                json!([1, 2]),
                "expected a list of 3 values, found a list of 2 values",
            ),
            (
                "position",
                json!([1]),
                "expected a list of 3 values, found a list of 1 value",
            ),
            ("position", json!({}), "expected a list of 3 values, found an object"),
            ("list", json!(null), "expected a list, found null"),
            (
                "list",
                json!(["x, expected y"]),
                "expected a number, found \"x, expected y\"",
            ),
            ("is_on", json!(0), "expected true or false, found 0"),
        ] {
            let mut invalid = valid.clone();
            invalid[key] = value;
            let error = tree::read::<View>(invalid).unwrap_err();
            assert_eq!(error.key.to_string().split('[').next(), Some(key));
            assert_eq!(json_message(error), expected);
        }
        for (value, expected) in [
            (json!([1, 2, 3]), "expected an object, found a list"),
            (json!([]), "expected an object, found a list"),
            (json!("x"), "expected an object, found \"x\""),
            (json!({}), "\"name\" is required"),
        ] {
            let message = json_message(tree::read::<View>(value).unwrap_err());
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
