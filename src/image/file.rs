//! Files that appear when they are whole: written under another name in the same folder, then renamed.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// A file in the making. It is removed when dropped; its errors name the file.
#[derive(Debug)]
pub struct Pending {
    path: PathBuf,
    output: BufWriter<NamedTempFile>,
    /// The first error, for encoders that pass over one.
    failure: Option<(io::ErrorKind, String)>,
}

impl Pending {
    /// Starts a file that will have this path.
    pub fn create(path: &Path) -> io::Result<Pending> {
        if path.is_dir() {
            return Err(named(path, &io::ErrorKind::IsADirectory.into()));
        }
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        let mut builder = Builder::new();
        builder.prefix(".wgray-");
        #[cfg(unix)]
        {
            // As for any new file: everybody may read and write but for what the umask forbids.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(folder).map_err(|error| named(path, &error))?;
        Ok(Pending {
            path: path.to_owned(),
            output: BufWriter::new(file),
            failure: None,
        })
    }

    /// Gives the file its name, in place of any file that has it.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()?;
        if let Some((kind, message)) = self.failure {
            return Err(io::Error::new(kind, message));
        }
        let file = self
            .output
            .into_inner()
            .map_err(|error| named(&self.path, error.error()))?;
        file.persist(&self.path)
            .map_err(|error| named(&self.path, &error.error))?;
        Ok(())
    }

    fn noted<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        result.map_err(|error| {
            let error = named(&self.path, &error);
            self.failure.get_or_insert_with(|| (error.kind(), error.to_string()));
            error
        })
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.output.write(bytes);
        self.noted(result)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.output.flush();
        self.noted(result)
    }
}

impl Seek for Pending {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let result = self.output.seek(to);
        self.noted(result)
    }
}

fn named(path: &Path, error: &io::Error) -> io::Error {
    let text = error.to_string();
    // tempfile adds the temporary name, which means nothing to the user
    let reason = text.split(" at path ").next().unwrap_or_default();
    io::Error::new(error.kind(), format!("{}: cannot be written: {reason}", path.display()))
}
