//! Locations of the keys of a scene file, for messages.

use toml::de::{DeTable, DeValue};

use super::parts::{MAX_PART_BYTES, Parts};
use super::syntax::line_number;
use crate::defines::Defines;
use crate::error::SceneError;
use crate::key_path::{KeyPath, Segment};
use crate::problem::{Problem, Problems};

/// Converts problems of values to an error, located in the text or at a define.
pub fn invalid(text: &str, origin: &str, problems: Problems, defines: &Defines) -> SceneError {
    if let Some(error) = problems.define_error(defines) {
        return error;
    }
    let keys = Keys::of(text);
    let error = |offset: usize, problem: Problem| SceneError::Invalid {
        origin: origin.to_owned(),
        line: line_number(text, offset),
        problem,
    };
    problems.into_error(|problem| keys.offset(&problem.key), error)
}

/// Returns the line of the camera's path, counted from 1.
pub fn line_of_path(text: &str) -> usize {
    let path = KeyPath(["camera", "path"].map(Segment::from).to_vec());
    line_number(text, Keys::of(text).offset(&path))
}

/// A parsed text with the locations of its keys.
enum Keys<'a> {
    Document(DeValue<'a>),
    /// The parts of a text that is too large to parse as a whole.
    Parts(Parts<'a>),
}

impl<'a> Keys<'a> {
    fn of(text: &'a str) -> Keys<'a> {
        match text.len() > MAX_PART_BYTES {
            true => Keys::Parts(Parts::of(text)),
            false => Keys::Document(document(text)),
        }
    }

    /// Returns the byte offset of the key at a path, or of the innermost existing table that would contain the key.
    fn offset(&self, path: &KeyPath) -> usize {
        let parts = match self {
            Keys::Document(document) => return offset_in(document, path),
            Keys::Parts(parts) => parts,
        };
        match parts.find(path) {
            Some((part, path)) => part.range.start + offset_in(&document(parts.text(part)), &path),
            None => {
                let rest = parts.rest();
                rest.file_offset(offset_in(&document(&rest.text), path))
            }
        }
    }
}

/// Parses a text, keeping the locations of keys; returns an empty table if the text cannot be parsed.
fn document(text: &str) -> DeValue<'_> {
    DeValue::Table(
        DeTable::parse(text)
            .map(|document| document.into_inner())
            .unwrap_or_default(),
    )
}

/// Returns the byte offset in `document` of the key at a path, or of the innermost existing ancestor.
fn offset_in(document: &DeValue, path: &KeyPath) -> usize {
    let mut offset = 0;
    let mut value = document;
    for segment in &path.0 {
        let entry = match (segment, value) {
            (Segment::Key(name), DeValue::Table(table)) => {
                let pair = table.iter().find(|(key, _)| key.get_ref() == name);
                pair.map(|(key, value)| (key.span(), value))
            }
            (Segment::Index(index), DeValue::Array(array)) => array.get(*index).map(|value| (value.span(), value)),
            _ => None,
        };
        let Some((span, inner)) = entry else { break };
        offset = span.start;
        value = inner.get_ref();
    }
    offset
}
