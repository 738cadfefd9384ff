//! Output targets, checked before rendering: regular files, which are replaced at the end; pipes, devices and standard
//! output, which are written directly.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io;
use std::path::{Path, PathBuf};

/// A target to write to. Error messages contain the name of the target.
#[derive(Debug)]
pub struct Output {
    name: String,
    pub(super) destination: Destination,
}

#[derive(Debug)]
pub(super) enum Destination {
    /// A regular file, which may not exist yet.
    File {
        /// The path, with symbolic links resolved.
        path: PathBuf,
        /// Identity and permissions of the existing file, if any.
        existing: Option<(Identity, Permissions)>,
    },
    /// A pipe or a device.
    Special {
        path: PathBuf,
        identity: Identity,
        /// The handle, once the pipe or device is open.
        file: Option<File>,
    },
    Standard(Stream),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    Output,
    Error,
}

/// Identity of a file, independent of its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    /// Device and inode.
    numbers: Option<(u64, u64)>,
    /// True for devices that several outputs can share, such as a terminal or `/dev/null`.
    is_character_device: bool,
}

impl Identity {
    fn of(data: &Metadata) -> Identity {
        #[cfg(unix)]
        {
            use std::os::unix::fs::{FileTypeExt, MetadataExt};
            Identity {
                numbers: Some((data.dev(), data.ino())),
                is_character_device: data.file_type().is_char_device(),
            }
        }
        #[cfg(not(unix))]
        {
            let _ = data;
            Identity {
                numbers: None,
                is_character_device: false,
            }
        }
    }

    fn is_same_file(&self, other: &Identity) -> bool {
        self.numbers.is_some() && self.numbers == other.numbers && !self.is_character_device
    }
}

/// Maximum number of symbolic links to follow, as in Linux.
const MAX_LINKS: usize = 40;

impl Output {
    /// Returns standard output.
    pub fn standard() -> Output {
        Output {
            name: "standard output".to_owned(),
            destination: Destination::Standard(Stream::Output),
        }
    }

    /// Resolves a path. Files are not modified, but must be writable.
    ///
    /// # Errors
    ///
    /// The path is a folder, the folder of the file does not exist, or the file is read-only or not writable.
    pub fn find(path: &Path) -> io::Result<Output> {
        let name = path.display().to_string();
        match resolve(path) {
            Ok(destination) => Ok(Output { name, destination }),
            Err(error) => Err(with_name(&name, &error)),
        }
    }

    /// Opens a pipe or a device now instead of in [`Pending::start`](super::Pending::start). Opening a pipe blocks
    /// until the pipe has a reader.
    ///
    /// # Errors
    ///
    /// The pipe or device cannot be opened.
    pub fn connect(&mut self) -> io::Result<()> {
        if let Destination::Special { path, file, .. } = &mut self.destination {
            *file = Some(open(path).map_err(|error| with_name(&self.name, &error))?);
        }
        Ok(())
    }

    /// Resolves the same file again, so that it can be rewritten.
    ///
    /// # Errors
    ///
    /// The errors of [`Output::find`]; also fails if the output is not a regular file.
    pub fn again(&self) -> io::Result<Output> {
        let resolved = match &self.destination {
            Destination::File { path, .. } => resolve(path),
            _ => Err(io::ErrorKind::Unsupported.into()),
        };
        match resolved {
            Ok(destination @ Destination::File { .. }) => Ok(Output {
                name: self.name.clone(),
                destination,
            }),
            Ok(_) => Err(with_name(&self.name, &io::Error::other("it is not a regular file"))),
            Err(error) => Err(with_name(&self.name, &error)),
        }
    }

    /// Returns the name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns true for a regular file, which may not exist yet.
    pub fn is_file(&self) -> bool {
        matches!(self.destination, Destination::File { .. })
    }

    /// Returns the path of a regular file, without symbolic links.
    pub fn path(&self) -> Option<&Path> {
        match &self.destination {
            Destination::File { path, .. } => Some(path),
            _ => None,
        }
    }

    /// Returns true if both outputs are the same file, pipe or stream, even under different names. Returns false for
    /// character devices, which can be shared.
    pub fn is_same(&self, other: &Output) -> bool {
        let same_path = self.path().is_some() && self.path() == other.path();
        let same_stream = match (&self.destination, &other.destination) {
            (Destination::Standard(a), Destination::Standard(b)) => a == b,
            _ => false,
        };
        let identities = self.identity().zip(other.identity());
        same_path || same_stream || identities.is_some_and(|(a, b)| a.is_same_file(&b))
    }

    /// Returns true if writing would change an input file, even if the paths differ.
    pub fn is_input(&self, path: &Path) -> bool {
        let same_path = self.path().is_some() && fs::canonicalize(path).ok().as_deref() == self.path();
        let input = fs::metadata(path).ok().map(|data| Identity::of(&data));
        same_path || self.identity().zip(input).is_some_and(|(a, b)| a.is_same_file(&b))
    }

    fn identity(&self) -> Option<Identity> {
        match &self.destination {
            Destination::File { existing, .. } => existing.as_ref().map(|(identity, _)| identity.clone()),
            Destination::Special { identity, .. } => Some(identity.clone()),
            Destination::Standard(stream) => {
                let data = stream.file().and_then(|file| file.metadata());
                data.ok().map(|data| Identity::of(&data))
            }
        }
    }
}

impl Stream {
    /// Returns an unbuffered handle.
    pub(super) fn file(self) -> io::Result<File> {
        #[cfg(unix)]
        {
            use std::os::fd::AsFd;
            let descriptor = match self {
                Stream::Output => io::stdout().as_fd().try_clone_to_owned(),
                Stream::Error => io::stderr().as_fd().try_clone_to_owned(),
            };
            descriptor.map(File::from)
        }
        #[cfg(windows)]
        {
            use std::os::windows::io::AsHandle;
            let handle = match self {
                Stream::Output => io::stdout().as_handle().try_clone_to_owned(),
                Stream::Error => io::stderr().as_handle().try_clone_to_owned(),
            };
            handle.map(File::from)
        }
        #[cfg(not(any(unix, windows)))]
        {
            Err(io::ErrorKind::Unsupported.into())
        }
    }
}

/// Opens an existing file for writing, without truncating it.
pub(super) fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

fn resolve(path: &Path) -> io::Result<Destination> {
    if path.as_os_str().as_encoded_bytes().ends_with(b"/") {
        return Err(folder_error());
    }
    let mut path = path.to_owned();
    for _ in 0..=MAX_LINKS {
        let Some(file_name) = path.file_name() else {
            return Err(folder_error());
        };
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = fs::canonicalize(parent.unwrap_or(Path::new("."))).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => {
                let parent = parent.unwrap_or(Path::new(".")).display();
                io::Error::new(error.kind(), format!("the folder {parent} does not exist"))
            }
            _ => error,
        })?;
        path = parent.join(file_name);
        if let Some(stream) = stream(&path) {
            return Ok(Destination::Standard(stream));
        }
        match fs::symlink_metadata(&path) {
            Ok(data) if data.is_symlink() => {
                let target = fs::read_link(&path)?;
                if path.starts_with("/proc") && target.is_relative() {
                    break; // an open pipe: `pipe:[123]` is not a path
                }
                path = parent.join(target);
            }
            _ => break,
        }
    }
    match fs::metadata(&path) {
        Ok(data) if data.is_dir() => Err(folder_error()),
        Ok(data) if data.is_file() => {
            if data.permissions().readonly() {
                let message = "it is read-only; make it writable or choose another name";
                return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
            }
            open(&path)?;
            let existing = Some((Identity::of(&data), data.permissions()));
            Ok(Destination::File { path, existing })
        }
        Ok(data) => Ok(Destination::Special {
            identity: Identity::of(&data),
            path,
            file: None,
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Destination::File { path, existing: None }),
        Err(error) => Err(error),
    }
}

/// Returns the standard stream of a path such as `/dev/stdout` or `/dev/fd/1`. If the path were opened instead, a file
/// to which the shell appends would be overwritten.
fn stream(path: &Path) -> Option<Stream> {
    let descriptors = PathBuf::from(format!("/proc/{}/fd", std::process::id()));
    if path.parent() != Some(&descriptors) {
        return None;
    }
    match path.file_name()?.to_str()? {
        "1" => Some(Stream::Output),
        "2" => Some(Stream::Error),
        _ => None,
    }
}

fn folder_error() -> io::Error {
    io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")
}

/// Adds the name of the output to an error.
pub(super) fn with_name(name: &str, error: &io::Error) -> io::Error {
    let text = error.to_string();
    // The crate `tempfile` adds the temporary name, which means nothing to the user.
    let reason = text.split(" at path ").next().unwrap_or_default();
    io::Error::new(error.kind(), format!("{name}: cannot be written: {reason}"))
}
