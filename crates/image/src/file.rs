//! Files that appear when they are whole: written under another name in the same folder, then renamed. What is no file gets
//! its bytes when all are there.

use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use super::output::{Output, Place, named, open};
use super::temporary;

/// A file in the making. It is removed when dropped; its errors name the file.
#[derive(Debug)]
pub struct Pending {
    name: String,
    output: BufWriter<Spool>,
    /// The first error, for encoders that pass over one.
    failure: Option<(io::ErrorKind, String)>,
}

/// Where the bytes are until all are there.
#[derive(Debug)]
enum Spool {
    /// Beside the file that it becomes, and the permissions of one that it replaces.
    Beside(NamedTempFile, PathBuf, Option<Permissions>),
    /// In a file without a name, which no end of the process leaves behind, and where they then go.
    Nameless(File, File),
}

impl Spool {
    fn file(&mut self) -> &mut File {
        match self {
            Spool::Beside(file, ..) => file.as_file_mut(),
            Spool::Nameless(file, _) => file,
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
    /// Starts what an output will be. What a process that was killed left of the same file is removed.
    ///
    /// # Errors
    ///
    /// Folders that may not be written, and what cannot be opened.
    pub fn start(output: Output) -> io::Result<Pending> {
        let name = output.name().to_owned();
        let spool = match output.place {
            Place::File { path, there } => {
                beside(&path).map(|file| Spool::Beside(file, path, there.map(|(_, permissions)| permissions)))
            }
            Place::Through { file: Some(file), .. } => nameless(file),
            Place::Through { path, file: None, .. } => open(&path).and_then(nameless),
            Place::Standard(stream) => stream.file().and_then(nameless),
        };
        Ok(Pending {
            output: BufWriter::new(spool.map_err(|error| named(&name, &error))?),
            name,
            failure: None,
        })
    }

    /// What messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Brings every byte to the disk, so that only the file's name is missing.
    pub fn complete(&mut self) -> io::Result<()> {
        self.flush()?;
        if let Some((kind, message)) = &self.failure {
            return Err(io::Error::new(*kind, message.clone()));
        }
        // A full or broken disk may say so only now.
        let result = match self.output.get_mut() {
            Spool::Beside(file, ..) => file.as_file().sync_data(),
            Spool::Nameless(..) => Ok(()),
        };
        self.noted(result)
    }

    /// Gives the file its name, in place of any file that has it; what is no file gets the bytes.
    pub fn finish(mut self) -> io::Result<()> {
        self.complete()?;
        let spool = self.output.into_inner().map_err(|error| error.into_error());
        let finished = spool.and_then(|spool| match spool {
            Spool::Beside(file, path, permissions) => {
                if let Some(permissions) = permissions {
                    file.as_file().set_permissions(permissions)?;
                }
                file.persist(path)?;
                Ok(())
            }
            Spool::Nameless(mut file, mut to) => {
                file.seek(SeekFrom::Start(0))?;
                io::copy(&mut file, &mut to)?;
                to.flush()
            }
        });
        finished.map_err(|error| named(&self.name, &error))
    }

    fn noted<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        result.map_err(|error| {
            let error = named(&self.name, &error);
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

fn nameless(to: File) -> io::Result<Spool> {
    let folder = std::env::temp_dir();
    let spool = tempfile::tempfile_in(&folder).map_err(|error| {
        let folder = folder.display();
        io::Error::new(
            error.kind(),
            format!("cannot create a temporary file in {folder} (TMPDIR): {error}"),
        )
    });
    Ok(Spool::Nameless(spool?, to))
}

/// The longest part of a file's name that a temporary name repeats, in bytes.
const LONGEST_NAME: usize = 120;

/// What stands before and after the random part of a temporary name: `.wgray-PID@HOST-` and `-NAME`.
struct Name {
    host: String,
    end: String,
}

impl Name {
    fn of(path: &Path) -> Name {
        let mut name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.truncate(name.floor_char_boundary(LONGEST_NAME));
        Name {
            host: host(),
            end: format!("-{name}"),
        }
    }

    fn start(&self, process: u32) -> String {
        format!(".wgray-{process}@{}-", self.host)
    }

    /// Whether this program, on this machine, made a file of this name on its way to the same file.
    fn fits(&self, file_name: &str) -> bool {
        let number = file_name.strip_prefix(".wgray-").and_then(|rest| rest.split_once('@'));
        let Some(Ok(process)) = number.map(|(number, _)| number.parse()) else {
            return false;
        };
        let random = file_name.strip_prefix(&self.start(process));
        let random = random.and_then(|rest| rest.strip_suffix(&self.end));
        random.is_some_and(|random| random.len() == RANDOM && random.bytes().all(|byte| byte.is_ascii_alphanumeric()))
    }
}

/// Characters of a temporary name that tell it from others of the same process.
const RANDOM: usize = 6;

/// A temporary file in the folder of what it becomes, locked as long as it is open: by that others know that its process
/// lives.
///
/// # Errors
///
/// Folders that may not be written.
pub fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let name = Name::of(path);
    remove_stale(folder, &name);
    let start = name.start(std::process::id());
    let mut builder = Builder::new();
    builder.prefix(&start).suffix(&name.end).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        // As for any new file: everybody may read and write but for what the umask forbids.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(Permissions::from_mode(0o666));
    }
    loop {
        let file = builder.tempfile_in(folder)?;
        // Where a file system has no locks nobody can take the file for stale either.
        let _ = file.as_file().lock();
        // Another process may have taken it for stale before the lock.
        if file.path().exists() {
            temporary::register(file.path());
            return Ok(file);
        }
    }
}

/// Removes what processes left that were killed on the way to the same file. Nothing here must end a render.
pub fn remove_stale_beside(path: &Path) {
    remove_stale(path.parent().unwrap_or(Path::new(".")), &Name::of(path));
}

fn remove_stale(folder: &Path, name: &Name) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let fits = entry.file_name().to_str().is_some_and(|file_name| name.fits(file_name));
        if !fits || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        // Whoever still writes it holds its lock.
        let Ok(file) = File::options().write(true).open(entry.path()) else {
            continue;
        };
        if file.try_lock().is_ok() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The machine's name, of letters that file names take.
fn host() -> String {
    #[cfg(unix)]
    let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(not(unix))]
    let name = std::env::var("COMPUTERNAME").unwrap_or_default();
    let allowed = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    name.chars().filter(allowed).take(64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_this_program_this_machine_and_this_file_fit() {
        let name = Name::of(Path::new("folder/out.png"));
        let host = host();
        assert!(name.fits(&format!("{}aB3dE6-out.png", name.start(123))));
        for other in [
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
            assert!(!name.fits(&other), "{other}");
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
