//! File access of loaders: the files of the operating system, or those of an [`AssetSource`].

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

use wgray_image::memory::fallible;

/// A source of the files to which a scene refers: textures, environment maps, meshes, MTL files and glTF buffers.
///
/// Names are relative paths with `/` as separator, without components `.` and `..`. The files must not change while a
/// scene is loaded from the source.
pub trait AssetSource: Send + Sync {
    /// Returns the contents of a file.
    ///
    /// # Errors
    ///
    /// There is no file with this name ([`io::ErrorKind::NotFound`]), or the file cannot be read.
    fn read(&self, name: &str) -> io::Result<Arc<[u8]>>;

    /// Returns true if there is a file with this name. The default implementation reads the file.
    fn contains(&self, name: &str) -> bool {
        self.read(name).is_ok()
    }

    /// Returns the name of a file that differs from `name` at most in the case of letters. The default implementation
    /// returns `None`.
    fn find_ignoring_case(&self, name: &str) -> Option<String> {
        let _ = name;
        None
    }
}

/// A source without files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoFiles;

impl AssetSource for NoFiles {
    fn read(&self, _: &str) -> io::Result<Arc<[u8]>> {
        Err(io::Error::new(
            io::ErrorKind::NotFound,
            "the scene is loaded without a source of files",
        ))
    }
}

/// Files in memory, by name.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct MemoryFiles {
    files: BTreeMap<String, Arc<[u8]>>,
}

impl MemoryFiles {
    /// Returns a source without files.
    pub fn new() -> MemoryFiles {
        MemoryFiles::default()
    }

    /// Adds a file, or replaces the file with this name. Components `.` of the name are removed.
    #[must_use]
    pub fn with(mut self, name: &str, bytes: impl Into<Arc<[u8]>>) -> MemoryFiles {
        self.insert(name, bytes);
        self
    }

    /// Adds a file, or replaces the file with this name. Components `.` of the name are removed.
    pub fn insert(&mut self, name: &str, bytes: impl Into<Arc<[u8]>>) {
        let name = normalized(Path::new(name)).and_then(|path| source_name(&path));
        // A file with an invalid name is dropped, because no scene can request it.
        if let Ok(name) = name {
            self.files.insert(name, bytes.into());
        }
    }
}

impl AssetSource for MemoryFiles {
    fn read(&self, name: &str) -> io::Result<Arc<[u8]>> {
        let missing = || io::Error::new(io::ErrorKind::NotFound, "there is no such file in memory");
        self.files.get(name).cloned().ok_or_else(missing)
    }

    fn contains(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    fn find_ignoring_case(&self, name: &str) -> Option<String> {
        let name = name.to_lowercase();
        self.files
            .keys()
            .find(|file_name| file_name.to_lowercase() == name)
            .cloned()
    }
}

impl fmt::Debug for MemoryFiles {
    /// Formats the names and sizes of the files.
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let sizes = self.files.iter().map(|(name, bytes)| (name, bytes.len()));
        formatter.debug_map().entries(sizes).finish()
    }
}

/// The files in a folder and its subfolders. Symbolic links to other folders are refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FolderFiles {
    folder: PathBuf,
}

impl FolderFiles {
    /// Returns the files of a folder.
    pub fn new(folder: impl Into<PathBuf>) -> FolderFiles {
        FolderFiles { folder: folder.into() }
    }

    fn path(&self, name: &str) -> io::Result<PathBuf> {
        let path = self.folder.join(name).canonicalize()?;
        let folder = or_current(&self.folder).canonicalize()?;
        match path.starts_with(folder) {
            true => Ok(path),
            false => Err(io::Error::new(
                io::ErrorKind::PermissionDenied,
                "it is outside of the folder",
            )),
        }
    }
}

impl AssetSource for FolderFiles {
    fn read(&self, name: &str) -> io::Result<Arc<[u8]>> {
        read_file(&self.path(name)?, u64::MAX).map(Arc::from)
    }

    fn contains(&self, name: &str) -> bool {
        self.path(name).is_ok_and(|path| path.is_file())
    }

    fn find_ignoring_case(&self, name: &str) -> Option<String> {
        let path = in_other_case(&self.folder, name)?;
        let name = source_name(path.strip_prefix(&self.folder).ok()?).ok()?;
        self.contains(&name).then_some(name)
    }
}

/// Length and modification time of a file.
pub(crate) type FileStamp = Option<(u64, SystemTime)>;

/// The files that loaders read: files on disk, or files of an asset source, whose paths are relative.
#[derive(Clone, Default)]
pub(crate) enum FileSystem {
    /// The file system of the operating system.
    #[default]
    Disk,
    Source(Arc<SourceFiles>),
}

/// A source, and the scene or model file whose bytes are loaded from memory.
pub(crate) struct SourceFiles {
    source: Arc<dyn AssetSource>,
    loaded: Option<(String, Arc<[u8]>)>,
    id: u64,
}

impl SourceFiles {
    fn read(&self, name: &str) -> io::Result<Arc<[u8]>> {
        match &self.loaded {
            Some((loaded, bytes)) if loaded == name => Ok(Arc::clone(bytes)),
            _ => self.source.read(name),
        }
    }

    fn contains(&self, name: &str) -> bool {
        self.loaded.as_ref().is_some_and(|(loaded, _)| loaded == name) || self.source.contains(name)
    }
}

impl fmt::Debug for FileSystem {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        match self {
            FileSystem::Disk => formatter.write_str("Disk"),
            FileSystem::Source(files) => write!(formatter, "Source({})", files.id),
        }
    }
}

impl PartialEq for FileSystem {
    fn eq(&self, other: &FileSystem) -> bool {
        self.id() == other.id()
    }
}

impl FileSystem {
    pub fn of(source: Arc<dyn AssetSource>) -> FileSystem {
        FileSystem::with_file(source, None)
    }

    /// Returns the files of a source, and a file at `path` with these bytes.
    pub fn with_loaded(source: Arc<dyn AssetSource>, path: &Path, bytes: Arc<[u8]>) -> io::Result<FileSystem> {
        let name = source_name(&normalized(path)?)?;
        Ok(FileSystem::with_file(source, Some((name, bytes))))
    }

    fn with_file(source: Arc<dyn AssetSource>, loaded: Option<(String, Arc<[u8]>)>) -> FileSystem {
        static LAST_ID: AtomicU64 = AtomicU64::new(0);
        let id = LAST_ID.fetch_add(1, Ordering::Relaxed) + 1;
        FileSystem::Source(Arc::new(SourceFiles { source, loaded, id }))
    }

    pub fn is_disk(&self) -> bool {
        matches!(self, FileSystem::Disk)
    }

    /// Returns a number that distinguishes sources; 0 for the file system of the operating system.
    pub fn id(&self) -> u64 {
        match self {
            FileSystem::Disk => 0,
            FileSystem::Source(files) => files.id,
        }
    }

    /// Returns the canonical path of an existing file.
    pub fn canonical_file(&self, path: &Path) -> io::Result<PathBuf> {
        let FileSystem::Source(files) = self else {
            return path.canonicalize();
        };
        let path = normalized(path)?;
        let name = source_name(&path)?;
        if !files.contains(&name) {
            files.read(&name)?;
        }
        Ok(path)
    }

    /// Returns the canonical path of a folder.
    pub fn canonical_folder(&self, path: &Path) -> io::Result<PathBuf> {
        match self {
            FileSystem::Disk => or_current(path).canonicalize(),
            FileSystem::Source(_) => normalized(path),
        }
    }

    pub fn is_file(&self, path: &Path) -> bool {
        match self {
            FileSystem::Disk => path.is_file(),
            FileSystem::Source(files) => {
                let name = normalized(path).and_then(|path| source_name(&path));
                name.is_ok_and(|name| files.contains(&name))
            }
        }
    }

    /// Reads a file. The error has the kind [`io::ErrorKind::FileTooLarge`] if the file has more than `max_bytes`.
    pub fn read(&self, path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
        let FileSystem::Source(files) = self else {
            return read_file(path, max_bytes);
        };
        let bytes = files.read(&source_name(&normalized(path)?)?)?;
        if bytes.len() as u64 > max_bytes {
            return Err(too_large(max_bytes));
        }
        let mut copy = Vec::new();
        fallible(|| copy.try_reserve_exact(bytes.len()))?;
        copy.extend_from_slice(&bytes);
        Ok(copy)
    }

    /// Returns a stamp that changes when the file changes; `None` if the file does not exist. Files of a source do not
    /// change.
    pub fn stamp(&self, path: &Path) -> FileStamp {
        match self {
            FileSystem::Disk => {
                let metadata = fs::metadata(path).ok()?;
                Some((metadata.len(), metadata.modified().ok()?))
            }
            FileSystem::Source(_) => self.is_file(path).then_some((0, SystemTime::UNIX_EPOCH)),
        }
    }

    /// Resolves a file name in a folder. If the file does not exist (for example, because the path is from another
    /// machine), tries the last path component, and then a case-insensitive match.
    pub fn resolve(&self, folder: &Path, name: &str) -> PathBuf {
        let slashes = name.replace('\\', "/"); // Windows paths
        let file_name = slashes.rsplit('/').next().unwrap_or(&slashes);
        let candidates = [name, &slashes, file_name].map(|name| folder.join(name));
        let [_, with_slashes, _] = &candidates;
        let found = candidates.iter().find(|path| self.is_file(path)).cloned();
        let found = found.or_else(|| self.in_other_case(folder, &slashes));
        found
            .or_else(|| self.in_other_case(folder, file_name))
            .unwrap_or_else(|| with_slashes.clone())
    }

    /// Returns an existing file whose path differs from `path` at most in the case of letters.
    pub fn in_other_case(&self, folder: &Path, path: &str) -> Option<PathBuf> {
        match self {
            FileSystem::Disk => in_other_case(folder, path),
            FileSystem::Source(files) => {
                let name = source_name(&normalized(&folder.join(path)).ok()?).ok()?;
                files.source.find_ignoring_case(&name).map(PathBuf::from)
            }
        }
    }

    /// Returns the path of a folder. On disk, an empty path is replaced by `.`.
    pub fn folder<'p>(&self, path: &'p Path) -> &'p Path {
        if self.is_disk() { or_current(path) } else { path }
    }
}

fn in_other_case(folder: &Path, path: &str) -> Option<PathBuf> {
    let (parents, name) = path.rsplit_once('/').unwrap_or(("", path));
    let mut folder = folder.to_owned();
    for parent in parents.split('/').filter(|parent| !parent.is_empty()) {
        let exact = folder.join(parent);
        folder = match exact.is_dir() {
            true => exact,
            false => entry_in_other_case(&folder, parent, Path::is_dir)?,
        };
    }
    entry_in_other_case(&folder, name, Path::is_file)
}

/// Returns the path, or the current folder if the path is empty.
pub(crate) fn or_current(path: &Path) -> &Path {
    match path.as_os_str().is_empty() {
        true => Path::new("."),
        false => path,
    }
}

/// Resolves the components `.` and `..` of a path in a source.
fn normalized(path: &Path) -> io::Result<PathBuf> {
    let refused = |rule: &str| io::Error::new(io::ErrorKind::InvalidInput, rule);
    let mut normalized = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::Normal(part) => normalized.push(part),
            Component::ParentDir => {
                if !normalized.pop() {
                    return Err(refused("it must not leave the source of the files"));
                }
            }
            Component::RootDir | Component::Prefix(_) => return Err(refused("it must be a relative path")),
        }
    }
    Ok(normalized)
}

/// Returns the name of a normalized path in a source.
fn source_name(path: &Path) -> io::Result<String> {
    let parts: Option<Vec<&str>> = path.components().map(|part| part.as_os_str().to_str()).collect();
    let invalid = || io::Error::new(io::ErrorKind::InvalidInput, "it must be UTF-8");
    parts.map(|parts| parts.join("/")).ok_or_else(invalid)
}

fn too_large(max_bytes: u64) -> io::Error {
    let message = format!("it is larger than {max_bytes} bytes");
    io::Error::new(io::ErrorKind::FileTooLarge, message)
}

fn read_file(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    // Checked before opening, because opening a pipe blocks until the pipe has a writer.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it must be a file"));
    }
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() || metadata.len() > max_bytes {
        return Err(too_large(max_bytes));
    }
    let mut bytes = Vec::new();
    fallible(|| bytes.try_reserve_exact(metadata.len() as usize))?;
    file.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > max_bytes {
        true => Err(too_large(max_bytes)),
        false => Ok(bytes),
    }
}

fn entry_in_other_case(folder: &Path, name: &str, accepts: fn(&Path) -> bool) -> Option<PathBuf> {
    let folder = or_current(folder);
    let name = name.to_lowercase();
    let entries = fs::read_dir(folder).ok()?.filter_map(Result::ok);
    let matches = entries.filter(|entry| entry.file_name().to_string_lossy().to_lowercase() == name);
    matches
        .map(|entry| folder.join(entry.file_name()))
        .filter(|path| accepts(path))
        .min()
}
