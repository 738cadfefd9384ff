//! A folder of its own for a test, in which the program runs.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// The folder, which goes with the value. What is run in it, and how, is said where it is used.
pub struct TestFolder {
    folder: TempDir,
}

impl TestFolder {
    /// A folder with one file in it.
    pub fn with_file(name: &str, text: &str) -> TestFolder {
        let place = TestFolder {
            folder: tempfile::tempdir().expect("a temporary folder"),
        };
        place.write(name, text);
        place
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("a file");
    }

    /// The names of all files but some, hidden ones too, sorted.
    pub fn files_but(&self, known: impl Fn(&str) -> bool) -> Vec<String> {
        let entries = fs::read_dir(self.folder()).expect("the folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|name| !known(name)).collect();
        names.sort();
        names
    }
}
