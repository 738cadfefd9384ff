//! The images and meshes of a scene: in memory, or files in a folder or a source.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Problem;
use super::texture::Image;
use crate::file_system::{AssetSource, FileSystem, or_current};
use crate::mesh::Mesh;

/// Maximum size of an image file in bytes.
const MAX_FILE_BYTES: u64 = 512 << 20;

/// The images and meshes of a scene: images and meshes in memory, and the folder or source of files.
#[derive(Clone, Debug, PartialEq)]
pub struct Assets {
    /// Folder of the scene file; file names are relative to this folder.
    pub folder: PathBuf,
    /// Folder that must contain all files.
    pub root: PathBuf,
    /// Files outside of `root` that are allowed, by their absolute paths in the scene.
    pub elsewhere: BTreeSet<PathBuf>,
    /// Images in memory, by name. A texture uses an image in memory instead of a file with the same name.
    pub images: BTreeMap<String, Arc<Image>>,
    /// Encoded image files in memory, by name.
    pub encoded: BTreeMap<String, Arc<[u8]>>,
    /// Maximum side in texels of images in `encoded`. Larger images are halved in size until they fit.
    pub longest_side: Option<u32>,
    /// The reasons why image files are missing, by the names that textures use.
    pub(super) absent: BTreeMap<String, String>,
    /// Meshes in memory, by name.
    pub meshes: BTreeMap<String, Arc<Mesh>>,
    /// True to report damage to a file as an error, instead of using a placeholder with a warning.
    pub strict: bool,
    pub(super) file_system: FileSystem,
}

/// Location of an image or a mesh.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum AssetKey {
    /// A canonical path.
    File(PathBuf),
    Memory(String),
    Encoded(String),
}

impl Default for Assets {
    /// Returns the assets of the current folder, without images in memory.
    fn default() -> Self {
        Assets::beside(Path::new("."))
    }
}

impl Assets {
    /// Returns the assets of a folder, without images in memory.
    pub fn beside(folder: &Path) -> Assets {
        let folder = or_current(folder);
        Assets {
            folder: folder.to_owned(),
            root: folder.to_owned(),
            elsewhere: BTreeSet::new(),
            images: BTreeMap::new(),
            encoded: BTreeMap::new(),
            longest_side: None,
            absent: BTreeMap::new(),
            meshes: BTreeMap::new(),
            strict: false,
            file_system: FileSystem::Disk,
        }
    }

    /// Returns the assets of a source, without images in memory. `folder` is relative to the source.
    pub fn from_source(source: impl AssetSource + 'static) -> Assets {
        Assets {
            folder: PathBuf::new(),
            root: PathBuf::new(),
            file_system: FileSystem::of(Arc::new(source)),
            ..Assets::default()
        }
    }

    /// Returns these assets with file names relative to another folder. Unless the files are in a source, this folder
    /// must contain all files.
    pub(super) fn in_folder(&self, folder: &Path) -> Assets {
        let mut assets = Assets {
            folder: folder.to_owned(),
            ..self.clone()
        };
        if self.file_system.is_disk() {
            assets.folder = or_current(folder).to_owned();
            assets.root = assets.folder.clone();
        }
        assets
    }

    /// Returns a warning about damage to a file. The warning ends with `placeholder`, which names the replacement.
    ///
    /// # Errors
    ///
    /// The damage itself if [`Assets::strict`] is set.
    pub(super) fn tolerate(&self, damage: Problem, placeholder: &str) -> Result<String, Problem> {
        match self.strict {
            true => Err(damage),
            false => Ok(format!("{}; {placeholder}", damage.message)),
        }
    }

    /// Returns a file's name for messages: relative to the current folder if the file was named on the command line.
    fn display_name<'f>(&self, file: &'f str) -> &'f str {
        if !self.elsewhere.contains(Path::new(file)) {
            return file;
        }
        let current_folder = std::env::current_dir().ok();
        let relative =
            current_folder.and_then(|current_folder| Path::new(file).strip_prefix(current_folder).ok()?.to_str());
        relative.unwrap_or(file)
    }

    /// Returns the location of a file, or of an image in memory with this name.
    pub(super) fn find(&self, file: &str) -> Result<AssetKey, Problem> {
        if let Some(reason) = self.absent.get(file) {
            return Err(Problem::damage(reason));
        }
        if self.images.contains_key(file) {
            return Ok(AssetKey::Memory(file.to_owned()));
        }
        if self.encoded.contains_key(file) {
            return Ok(AssetKey::Encoded(file.to_owned()));
        }
        let path = self.file_system.canonical_file(&self.folder.join(file));
        let path = path.map_err(|error| {
            let similar = self.file_system.in_other_case(&self.folder, file);
            let similar = similar
                .as_deref()
                .map(|similar| similar.strip_prefix(&self.folder).unwrap_or(similar));
            let hint = similar.map_or_else(String::new, |name| format!("; did you mean {name:?}?"));
            Problem::damage(unreadable(self.display_name(file), &error) + &hint).with_file(file, error.kind())
        })?;
        let root = self.file_system.canonical_folder(&self.root).map_err(|error| {
            let root = self.root.display();
            format!("{file:?} must lie in the asset root, {root}, which cannot be found: {error}; check --asset-root")
        })?;
        if !path.starts_with(&root) && !self.elsewhere.contains(Path::new(file)) {
            let root = self.root.display();
            return Err(Problem::new(match self.root == self.folder {
                true => format!(
                    "{file:?} lies outside of the scene's folder, {root}; pass --asset-root with a folder that contains both"
                ),
                false => format!(
                    "{file:?} resolves to {}, which is outside the asset root {root}; pass another --asset-root",
                    path.display()
                ),
            }));
        }
        if !self.file_system.is_file(&path) {
            return Err(Problem::new(format!("{file:?} must be a file")));
        }
        Ok(AssetKey::File(path))
    }

    /// Reads an image file.
    pub(super) fn read(&self, file: &str, path: &Path) -> Result<Vec<u8>, Problem> {
        let read = self.file_system.read(path, MAX_FILE_BYTES);
        read.map_err(|error| match error.kind() {
            io::ErrorKind::FileTooLarge => {
                Problem::new(format!("{file:?} must not be larger than {} MiB", MAX_FILE_BYTES >> 20))
            }
            // A lack of memory is not damage, so no placeholder replaces the file.
            io::ErrorKind::OutOfMemory => Problem::new(unreadable(file, &error)).with_file(file, error.kind()),
            _ => Problem::damage(unreadable(file, &error)).with_file(file, error.kind()),
        })
    }
}

fn unreadable(file: &str, error: &io::Error) -> String {
    format!("{file:?} cannot be read: {error}")
}
