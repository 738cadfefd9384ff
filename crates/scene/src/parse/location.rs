//! Locations of the keys of a scene file, for messages.

use toml::de::{DeTable, DeValue};

use super::parts::{LARGEST, Parts};
use super::syntax::line_number;
use crate::defines::Defines;
use crate::error::SceneError;
use crate::key_path::{KeyPath, Segment};
use crate::problem::{Problem, Problems};

/// Converts problems of values to an error, located in the text or at a define.
pub fn invalid(text: &str, origin: &str, problems: Problems, defines: &Defines) -> SceneError {
    if let Some(error) = problems.of_define(defines) {
        return error;
    }
    let keys = Keys::of(text);
    let invalid = |at: usize, problem: Problem| SceneError::Invalid {
        origin: origin.to_owned(),
        line: line_number(text, at),
        problem,
    };
    problems.into_error(|problem| keys.place(&problem.key), invalid)
}

/// Returns the line of the camera's path, counted from 1.
pub fn line_of_path(text: &str) -> usize {
    let path = KeyPath(["camera", "path"].map(Segment::from).to_vec());
    line_number(text, Keys::of(text).place(&path))
}

enum Keys<'a> {
    Whole(DeValue<'a>),
    /// The parts of a text that is too large to parse as a whole.
    Parts(Parts<'a>),
}

impl<'a> Keys<'a> {
    fn of(text: &'a str) -> Keys<'a> {
        match text.len() > LARGEST {
            true => Keys::Parts(Parts::of(text)),
            false => Keys::Whole(document(text)),
        }
    }

    /// Returns the byte offset of the key at a path, or of the innermost existing table that would contain it.
    fn place(&self, path: &KeyPath) -> usize {
        let parts = match self {
            Keys::Whole(document) => return place_in(document, path),
            Keys::Parts(parts) => parts,
        };
        match parts.find(path) {
            Some((part, path)) => part.place.start + place_in(&document(parts.text(part)), &path),
            None => {
                let rest = parts.rest();
                rest.place(place_in(&document(&rest.text), path))
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

fn place_in(document: &DeValue, path: &KeyPath) -> usize {
    let mut at = 0;
    let mut value = document;
    for segment in &path.0 {
        let step = match (segment, value) {
            (Segment::Key(name), DeValue::Table(table)) => {
                let entry = table.iter().find(|(key, _)| key.get_ref() == name);
                entry.map(|(key, value)| (key.span(), value))
            }
            (Segment::Index(index), DeValue::Array(array)) => array.get(*index).map(|value| (value.span(), value)),
            _ => None,
        };
        let Some((span, inner)) = step else { break };
        at = span.start;
        value = inner.get_ref();
    }
    at
}
