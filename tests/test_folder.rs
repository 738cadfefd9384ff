//! A temporary folder for a test.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A temporary folder that is deleted on drop. Test modules define how the program runs in the folder.
pub struct TestFolder {
    folder: TempDir,
}

impl TestFolder {
    /// Creates a folder with one file.
    pub fn with_file(name: &str, text: &str) -> TestFolder {
        let folder = TestFolder {
            folder: tempfile::tempdir().expect("a temporary folder"),
        };
        folder.write(name, text);
        folder
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

    /// Returns the sorted names of all files, hidden ones included, except those for which `is_ignored` returns true.
    pub fn files_except(&self, is_ignored: impl Fn(&str) -> bool) -> Vec<String> {
        let entries = fs::read_dir(self.folder()).expect("the folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|name| !is_ignored(name)).collect();
        names.sort();
        names
    }
}
