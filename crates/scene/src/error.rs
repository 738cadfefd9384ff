//! Errors of scene files and their locations.

use std::io;
use std::path::PathBuf;

use crate::gltf::GltfError;
use crate::mesh::MeshError;
use crate::problem::{ErrorPlace, MAX_PROBLEMS, Problem, Problems};

/// The reason why a scene cannot be loaded. Every message starts with the location of the error or the name of the
/// override.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        #[source]
        error: io::Error,
    },
    /// The file is too large or not valid TOML or JSON, or a JSON scene has invalid keys or types.
    #[error("{origin}:{line}:{column}: {message}")]
    Syntax {
        /// Name of the file.
        origin: String,
        /// Line, counted from 1.
        line: usize,
        /// Column in characters, counted from 1.
        column: usize,
        /// The message.
        message: String,
    },
    /// A value of the file is invalid.
    #[error("{origin}:{line}: {problem}")]
    Invalid {
        /// Name of the file.
        origin: String,
        /// Line, counted from 1.
        line: usize,
        /// The problem.
        problem: Problem,
    },
    /// Several values of the file are invalid. The errors are in file order; the message has a line for each error.
    #[error("{}", self.lines())]
    Several {
        /// The first errors.
        errors: Vec<SceneError>,
        /// The number of further errors.
        more: usize,
    },
    /// The glTF file could not be loaded as a scene.
    #[error(transparent)]
    Gltf(GltfError),
    /// The mesh file could not be loaded as a scene.
    #[error(transparent)]
    Mesh(MeshError),
    /// The file has a format that cannot be read.
    #[error("{}: {message}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The format, and advice for the user.
        message: String,
    },
    /// An override is invalid; the key of the problem is the field of [`Overrides`](super::Overrides), `camera.path` for a
    /// camera path that was created in code, or `name` for the name of a scene in memory.
    #[error("{0}")]
    Override(Problem),
}

impl SceneError {
    /// Returns true if memory was exhausted while a file was read.
    pub fn is_out_of_memory(&self) -> bool {
        let kind = match self {
            SceneError::Read { error, .. }
            | SceneError::Mesh(MeshError::Read { error, .. })
            | SceneError::Gltf(GltfError::Read { error, .. }) => Some(error.kind()),
            SceneError::Invalid { problem, .. } => problem.file.as_ref().map(|file| file.kind),
            SceneError::Several { errors, .. } => return errors.iter().any(SceneError::is_out_of_memory),
            _ => None,
        };
        kind == Some(io::ErrorKind::OutOfMemory)
    }

    /// Returns the location of the error, or of the first error.
    pub fn place(&self) -> ErrorPlace {
        let in_file = |file: String| ErrorPlace {
            file: Some(file),
            ..ErrorPlace::default()
        };
        match self {
            SceneError::Read { path, .. } | SceneError::Unsupported { path, .. } => in_file(path.display().to_string()),
            SceneError::Mesh(error) => ErrorPlace {
                line: error.line(),
                ..in_file(error.path().display().to_string())
            },
            SceneError::Syntax {
                origin, line, column, ..
            } => ErrorPlace {
                line: Some(*line),
                column: Some(*column),
                ..in_file(origin.clone())
            },
            SceneError::Invalid { origin, line, problem } => ErrorPlace {
                line: Some(*line),
                key: Some(problem.key.to_string()).filter(|key| !key.is_empty()),
                ..in_file(origin.clone())
            },
            SceneError::Several { errors, .. } => errors.first().map(SceneError::place).unwrap_or_default(),
            SceneError::Gltf(error) => error.place(),
            SceneError::Override(_) => ErrorPlace::default(),
        }
    }

    /// Returns the errors of [`SceneError::Several`], or else this error, and a message if further errors exist.
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

impl Problems {
    /// Converts problems to an error, in the order of their offsets in the text.
    pub fn into_error(
        self,
        offset_of: impl Fn(&Problem) -> usize,
        error: impl Fn(usize, Problem) -> SceneError,
    ) -> SceneError {
        let mut located: Vec<(usize, Problem)> = (std::iter::once(self.first).chain(self.others))
            .map(|problem| (offset_of(&problem), problem))
            .collect();
        located.sort_by_key(|(offset, _)| *offset);
        let more = self.more + located.len().saturating_sub(MAX_PROBLEMS);
        located.truncate(MAX_PROBLEMS);
        let mut errors: Vec<SceneError> = located
            .into_iter()
            .map(|(offset, problem)| error(offset, problem))
            .collect();
        match (errors.len(), more) {
            (1, 0) => errors.remove(0),
            _ => SceneError::Several { errors, more },
        }
    }
}
