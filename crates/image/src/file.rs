//! Atomic file output. Regular files are written under a temporary name in the same folder, then renamed. For pipes and
//! devices, all bytes are copied at the end.

use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use super::output::{Destination, Output, open, with_name};
use super::temporary;

/// An unfinished output, which is deleted when dropped. Error messages contain the name of the output.
#[derive(Debug)]
pub struct Pending {
    name: String,
    output: BufWriter<Spool>,
    /// The first error, because some encoders ignore errors.
    failure: Option<(io::ErrorKind, String)>,
}

#[derive(Debug)]
enum Spool {
    /// A temporary file in the folder of the target, the path of the target, and the permissions of the file to
    /// replace.
    Named(NamedTempFile, PathBuf, Option<Permissions>),
    /// An anonymous file, which disappears with the process, and the pipe or device that receives the bytes of this
    /// file.
    Anonymous(File, File),
}

impl Spool {
    fn file(&mut self) -> &mut File {
        match self {
            Spool::Named(file, ..) => file.as_file_mut(),
            Spool::Anonymous(file, _) => file,
        }
    }
}

impl Write for Spool {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

impl Seek for Spool {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file().seek(to)
    }
}

impl Pending {
    /// Starts writing an output, after deleting temporary files that killed processes left for the same target.
    ///
    /// # Errors
    ///
    /// The folder cannot be written, or the pipe or device cannot be opened.
    pub fn start(output: Output) -> io::Result<Pending> {
        let name = output.name().to_owned();
        let spool = match output.destination {
            Destination::File { path, existing } => {
                create_beside(&path).map(|file| Spool::Named(file, path, existing.map(|(_, permissions)| permissions)))
            }
            Destination::Special { file: Some(file), .. } => spool_anonymously(file),
            Destination::Special { path, file: None, .. } => open(&path).and_then(spool_anonymously),
            Destination::Standard(stream) => stream.file().and_then(spool_anonymously),
        };
        Ok(Pending {
            output: BufWriter::new(spool.map_err(|error| with_name(&name, &error))?),
            name,
            failure: None,
        })
    }

    /// Returns the name of the output, as in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Flushes all bytes to the disk, so that [`Pending::finish`] only has to rename or copy the file.
    pub fn complete(&mut self) -> io::Result<()> {
        self.flush()?;
        if let Some((kind, message)) = &self.failure {
            return Err(io::Error::new(*kind, message.clone()));
        }
        // A full or faulty disk may report an error only now.
        let result = match self.output.get_mut() {
            Spool::Named(file, ..) => file.as_file().sync_data(),
            Spool::Anonymous(..) => Ok(()),
        };
        self.record_error(result)
    }

    /// Renames the file to its target, replacing an existing file; copies the bytes to a pipe or device.
    pub fn finish(mut self) -> io::Result<()> {
        self.complete()?;
        let spool = self.output.into_inner().map_err(|error| error.into_error());
        let result = spool.and_then(|spool| match spool {
            Spool::Named(file, path, permissions) => {
                if let Some(permissions) = permissions {
                    file.as_file().set_permissions(permissions)?;
                }
                file.persist(path)?;
                Ok(())
            }
            Spool::Anonymous(mut file, mut target) => {
                file.seek(SeekFrom::Start(0))?;
                io::copy(&mut file, &mut target)?;
                target.flush()
            }
        });
        result.map_err(|error| with_name(&self.name, &error))
    }

    fn record_error<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        result.map_err(|error| {
            let error = with_name(&self.name, &error);
            self.failure.get_or_insert_with(|| (error.kind(), error.to_string()));
            error
        })
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.output.write(bytes);
        self.record_error(result)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.output.flush();
        self.record_error(result)
    }
}

impl Seek for Pending {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let result = self.output.seek(to);
        self.record_error(result)
    }
}

fn spool_anonymously(target: File) -> io::Result<Spool> {
    let folder = std::env::temp_dir();
    let spool = tempfile::tempfile_in(&folder).map_err(|error| {
        let folder = folder.display();
        io::Error::new(
            error.kind(),
            format!("cannot create a temporary file in {folder} (TMPDIR): {error}"),
        )
    });
    Ok(Spool::Anonymous(spool?, target))
}

/// Maximum length in bytes of the target's name within a temporary name.
const MAX_NAME_BYTES: usize = 120;

/// Pattern of a temporary name: `.wgray-PID@HOST-RANDOM-NAME`.
struct TemporaryName {
    host: String,
    suffix: String,
}

impl TemporaryName {
    fn of(path: &Path) -> TemporaryName {
        let mut name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.truncate(name.floor_char_boundary(MAX_NAME_BYTES));
        TemporaryName {
            host: host(),
            suffix: format!("-{name}"),
        }
    }

    fn prefix(&self, process: u32) -> String {
        format!(".wgray-{process}@{}-", self.host)
    }

    /// Returns true if this program created the file name on this machine for this target.
    fn matches(&self, file_name: &str) -> bool {
        let number = file_name.strip_prefix(".wgray-").and_then(|rest| rest.split_once('@'));
        let Some(Ok(process)) = number.map(|(number, _)| number.parse()) else {
            return false;
        };
        let random = file_name.strip_prefix(&self.prefix(process));
        let random = random.and_then(|rest| rest.strip_suffix(&self.suffix));
        random
            .is_some_and(|random| random.len() == RANDOM_LEN && random.bytes().all(|byte| byte.is_ascii_alphanumeric()))
    }
}

/// Length of the random part of a temporary name.
const RANDOM_LEN: usize = 6;

/// Creates a temporary file in the folder of its target. The file is locked while it is in use.
///
/// # Errors
///
/// The folder cannot be written.
pub fn create_beside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let name = TemporaryName::of(path);
    remove_stale(folder, &name);
    let prefix = name.prefix(std::process::id());
    let mut builder = Builder::new();
    builder.prefix(&prefix).suffix(&name.suffix).rand_bytes(RANDOM_LEN);
    #[cfg(unix)]
    {
        // The default mode of new files, before the umask is applied.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(Permissions::from_mode(0o666));
    }
    loop {
        let file = builder.tempfile_in(folder)?;
        // If file locks are not supported, no other process can lock the file in order to delete it.
        let _ = file.as_file().lock();
        // Another process may have deleted the file before it was locked.
        if file.path().exists() {
            temporary::register(file.path());
            return Ok(file);
        }
    }
}

/// Deletes temporary files that killed processes left for the same target. Ignores all errors.
pub fn remove_stale_beside(path: &Path) {
    remove_stale(path.parent().unwrap_or(Path::new(".")), &TemporaryName::of(path));
}

fn remove_stale(folder: &Path, name: &TemporaryName) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let is_match = entry
            .file_name()
            .to_str()
            .is_some_and(|file_name| name.matches(file_name));
        if !is_match || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        // A process that is still writing the file holds the lock.
        let Ok(file) = File::options().write(true).open(entry.path()) else {
            continue;
        };
        if file.try_lock().is_ok() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Returns the host name, reduced to characters that are safe in file names.
fn host() -> String {
    #[cfg(unix)]
    let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(not(unix))]
    let name = std::env::var("COMPUTERNAME").unwrap_or_default();
    let is_allowed = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    name.chars().filter(is_allowed).take(64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn temporary_names_match_program_machine_and_target() {
        let name = TemporaryName::of(Path::new("folder/out.png"));
        let host = host();
        assert!(name.matches(&format!("{}aB3dE6-out.png", name.prefix(123))));
        for file_name in [
            format!(".wgray-123@{host}-aB3dE6-out.exr"),
            format!(".wgray-123@{host}-aB3dE6-other-out.png"),
            format!(".wgray-123@{host}-aB3d-out.png"),
            format!(".wgray-123@{host}x-aB3dE6-out.png"),
            format!(".wgray-12a@{host}-aB3dE6-out.png"),
            format!(".wgray-@{host}-aB3dE6-out.png"),
            format!("wgray-123@{host}-aB3dE6-out.png"),
            ".wgray-aB3dE6".to_owned(),
            "out.png".to_owned(),
        ] {
            assert!(!name.matches(&file_name), "{file_name}");
        }
    }

    #[test]
    fn temporary_names_of_long_names_are_not_too_long() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["x".repeat(255), "é".repeat(127)] {
            let path = folder.path().join(name);
            let mut pending = Pending::start(Output::find(&path).unwrap()).unwrap();
            pending.write_all(b"new").unwrap();
            pending.finish().unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"new");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
