//! Warnings about scenes and their files.

use std::fmt;

/// A warning about a scene or one of its files, as in `rock.ply:8: face 3: must have at least 3 vertices, not 2; the
/// face was removed`.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Note {
    /// The name by which the scene refers to the file; `None` for the loaded file itself.
    pub file: Option<String>,
    /// The line in this file, counted from 1.
    pub line: Option<usize>,
    /// The message.
    pub message: String,
}

impl Note {
    /// Returns the note as a note about `file`, which the loaded file refers to.
    pub(crate) fn in_file(self, file: &str) -> Note {
        Note {
            file: Some(file.to_owned()),
            ..self
        }
    }

    /// Removes the name of the file if it is `name`, the name of the loaded file.
    pub(crate) fn without_loaded_file(mut self, name: &str) -> Note {
        self.file = self.file.filter(|file| file != name);
        self
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match (&self.file, self.line) {
            (Some(file), Some(line)) => write!(f, "{file}:{line}: ")?,
            (Some(file), None) => write!(f, "{file}: ")?,
            (None, Some(line)) => write!(f, "line {line}: ")?,
            (None, None) => {}
        }
        f.write_str(&self.message)
    }
}

impl PartialEq<str> for Note {
    fn eq(&self, other: &str) -> bool {
        self.to_string().as_str() == other
    }
}

impl PartialEq<&str> for Note {
    fn eq(&self, other: &&str) -> bool {
        self == *other
    }
}

impl PartialEq<String> for Note {
    fn eq(&self, other: &String) -> bool {
        self == other.as_str()
    }
}

impl From<String> for Note {
    fn from(message: String) -> Note {
        Note {
            message,
            ..Note::default()
        }
    }
}

impl From<&str> for Note {
    fn from(message: &str) -> Note {
        message.to_owned().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_begin_with_their_location() {
        let note = Note {
            line: Some(8),
            ..Note::from("the face was removed")
        };
        assert_eq!(note.to_string(), "line 8: the face was removed");
        let in_file = note.in_file("a.obj");
        assert_eq!(in_file.to_string(), "a.obj:8: the face was removed");
        assert_eq!(in_file.clone().without_loaded_file("b.obj"), in_file);
        assert_eq!(
            in_file.without_loaded_file("a.obj").to_string(),
            "line 8: the face was removed"
        );
        assert_eq!(Note::from("x").in_file("a.obj").to_string(), "a.obj: x");
    }
}
