//! Where something is written to, looked at before anything is done: a file that will be replaced, or a pipe, a device or
//! standard output, which is written through.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io;
use std::path::{Path, PathBuf};

/// A place to write to. Its errors name it.
#[derive(Debug)]
pub struct Output {
    name: String,
    pub(super) place: Place,
}

#[derive(Debug)]
pub(super) enum Place {
    /// A regular file, there or not yet.
    File {
        /// Its path, without links.
        path: PathBuf,
        /// The file that is there now: what tells it from others, and its permissions.
        there: Option<(Identity, Permissions)>,
    },
    /// A pipe or a device.
    Through {
        path: PathBuf,
        identity: Identity,
        /// It, once it is open.
        file: Option<File>,
    },
    /// What the program was started with.
    Standard(Stream),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    Output,
    Error,
}

/// What tells a file from others, whatever its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    /// Device and inode, where there are such.
    numbers: Option<(u64, u64)>,
    /// Takes what it is given and mixes nothing: a terminal, `/dev/null`.
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

    fn is(&self, other: &Identity) -> bool {
        self.numbers.is_some() && self.numbers == other.numbers && !self.is_character_device
    }
}

/// As many links in a row as systems follow.
const LINKS: usize = 40;

impl Output {
    /// Standard output.
    pub fn standard() -> Output {
        Output {
            name: "standard output".to_owned(),
            place: Place::Standard(Stream::Output),
        }
    }

    /// What a path leads to. A file is not touched, but it must be possible to write it.
    ///
    /// # Errors
    ///
    /// Folders, files in folders that are not there, and files that may not be written, by their mode alone too.
    pub fn find(path: &Path) -> io::Result<Output> {
        let name = path.display().to_string();
        match place(path) {
            Ok(place) => Ok(Output { name, place }),
            Err(error) => Err(named(&name, &error)),
        }
    }

    /// Opens what is written through, before [`Pending::start`](super::Pending::start) would; a pipe waits for its reader.
    ///
    /// # Errors
    ///
    /// What cannot be opened.
    pub fn connect(&mut self) -> io::Result<()> {
        if let Place::Through { path, file, .. } = &mut self.place {
            *file = Some(open(path).map_err(|error| named(&self.name, &error))?);
        }
        Ok(())
    }

    /// Returns the same file as it is now, so that it can be written once more.
    ///
    /// # Errors
    ///
    /// The errors of [`Output::find`], and anything that is not a regular file.
    pub fn again(&self) -> io::Result<Output> {
        let again = match &self.place {
            Place::File { path, .. } => place(path),
            _ => Err(io::ErrorKind::Unsupported.into()),
        };
        match again {
            Ok(place @ Place::File { .. }) => Ok(Output {
                name: self.name.clone(),
                place,
            }),
            Ok(_) => Err(named(&self.name, &io::Error::other("it is not a regular file"))),
            Err(error) => Err(named(&self.name, &error)),
        }
    }

    /// What messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it is a regular file, there or not yet; else it is written through.
    pub fn is_file(&self) -> bool {
        matches!(self.place, Place::File { .. })
    }

    /// The file's path, without links; none for what is no file.
    pub fn path(&self) -> Option<&Path> {
        match &self.place {
            Place::File { path, .. } => Some(path),
            _ => None,
        }
    }

    /// Whether two outputs would be one: the same file or pipe under any names. A terminal and `/dev/null` take both.
    pub fn is_same(&self, other: &Output) -> bool {
        let same_path = self.path().is_some() && self.path() == other.path();
        let same_stream = match (&self.place, &other.place) {
            (Place::Standard(a), Place::Standard(b)) => a == b,
            _ => false,
        };
        let identities = self.identity().zip(other.identity());
        same_path || same_stream || identities.is_some_and(|(a, b)| a.is(&b))
    }

    /// Whether writing would change this file, under any of its names.
    pub fn is_input(&self, path: &Path) -> bool {
        let same_path = self.path().is_some() && fs::canonicalize(path).ok().as_deref() == self.path();
        let input = fs::metadata(path).ok().map(|data| Identity::of(&data));
        same_path || self.identity().zip(input).is_some_and(|(a, b)| a.is(&b))
    }

    fn identity(&self) -> Option<Identity> {
        match &self.place {
            Place::File { there, .. } => there.as_ref().map(|(identity, _)| identity.clone()),
            Place::Through { identity, .. } => Some(identity.clone()),
            Place::Standard(stream) => {
                let data = stream.file().and_then(|file| file.metadata());
                data.ok().map(|data| Identity::of(&data))
            }
        }
    }
}

impl Stream {
    /// Another handle to it, which has no buffer.
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

/// Opens what is there for writing; it is neither made nor cut short.
pub(super) fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

fn place(path: &Path) -> io::Result<Place> {
    if path.as_os_str().as_encoded_bytes().ends_with(b"/") {
        return Err(folder());
    }
    let mut path = path.to_owned();
    for _ in 0..=LINKS {
        let Some(file_name) = path.file_name() else {
            return Err(folder());
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
            return Ok(Place::Standard(stream));
        }
        match fs::symlink_metadata(&path) {
            Ok(data) if data.is_symlink() => {
                let target = fs::read_link(&path)?;
                if path.starts_with("/proc") && target.is_relative() {
                    break; // a pipe that is open: `pipe:[123]` is no name to follow
                }
                path = parent.join(target);
            }
            _ => break,
        }
    }
    match fs::metadata(&path) {
        Ok(data) if data.is_dir() => Err(folder()),
        Ok(data) if data.is_file() => {
            if data.permissions().readonly() {
                let message = "it is read-only; make it writable or choose another name";
                return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
            }
            open(&path)?;
            let there = Some((Identity::of(&data), data.permissions()));
            Ok(Place::File { path, there })
        }
        Ok(data) => Ok(Place::Through {
            identity: Identity::of(&data),
            path,
            file: None,
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Place::File { path, there: None }),
        Err(error) => Err(error),
    }
}

/// Which of the program's own streams a path is: what `/dev/stdout` and `/dev/fd/1` lead to. Opening that path again would
/// write from the start of a file that the shell has opened to go on in.
fn stream(path: &Path) -> Option<Stream> {
    let own = PathBuf::from(format!("/proc/{}/fd", std::process::id()));
    if path.parent() != Some(&own) {
        return None;
    }
    match path.file_name()?.to_str()? {
        "1" => Some(Stream::Output),
        "2" => Some(Stream::Error),
        _ => None,
    }
}

fn folder() -> io::Error {
    io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")
}

/// An error in words that name what cannot be written.
pub(super) fn named(name: &str, error: &io::Error) -> io::Error {
    let text = error.to_string();
    // tempfile adds the temporary name, which means nothing to the user
    let reason = text.split(" at path ").next().unwrap_or_default();
    io::Error::new(error.kind(), format!("{name}: cannot be written: {reason}"))
}
