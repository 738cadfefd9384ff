//! A validated glTF document: JSON, buffers and encoded images.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use gltf_json::Root;

use super::budget::Budget;
use super::buffer::{Buffers, MAX_BUFFER_BYTES};
use super::error::{GltfError, GltfFault};
use super::json::out_of_range;
use super::uri::{self, Folder, UriError};
use super::{extension, glb, json};
use crate::file_system::{FileSystem, or_current};

/// Maximum size of an image file in bytes.
const MAX_IMAGE_BYTES: u64 = 512 << 20;
/// Texture extensions with further image formats, in three.js's order of precedence.
const SOURCE_EXTENSIONS: [&str; 2] = ["KHR_texture_basisu", "EXT_texture_webp"];
/// Maximum total size of all image reads in bytes.
const MAX_IMAGES_BYTES: u64 = 4 << 30;

/// An open file. JSON indices (except in raw extension data) and enumerations are valid, and all numbers are finite.
/// The node hierarchy and other values are not validated yet.
pub(super) struct Document {
    /// The JSON, from which the data URIs of buffers have been removed.
    pub json: Root,
    pub path: PathBuf,
    pub notes: Vec<String>,
    pub budget: Budget,
    folder: Folder,
    buffers: Buffers,
    /// Total size of all image reads in bytes.
    image_bytes_read: AtomicU64,
}

enum ImageFault {
    /// The image is missing or unreadable.
    Missing(String),
    /// The image or the reference to it is invalid, or the image is too large.
    Invalid(GltfFault),
}

impl From<GltfFault> for ImageFault {
    fn from(fault: GltfFault) -> Self {
        ImageFault::Invalid(fault)
    }
}

impl Document {
    /// Opens a file. Referenced files must be inside `root`. Adds the paths of the file and of the referenced files to
    /// `files`, even on errors.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is invalid, requires an unsupported extension, or has a missing or truncated buffer.
    pub fn open(
        path: &Path,
        root: &Path,
        file_system: &FileSystem,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<Document, GltfError> {
        files.insert(path.to_owned());
        let file = file_system
            .read(path, MAX_BUFFER_BYTES)
            .map_err(|error| GltfError::Read {
                path: path.to_owned(),
                error,
            })?;
        let folder = Folder {
            file_system: file_system.clone(),
            folder: or_current(path.parent().unwrap_or(Path::new(""))).to_owned(),
            root: or_current(root).to_owned(),
        };
        Document::read(file, path, folder, files).map_err(|fault| fault.of(path))
    }

    pub(super) fn read(
        file: Vec<u8>,
        path: &Path,
        folder: Folder,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<Document, GltfFault> {
        if file.is_empty() {
            return Err(GltfFault::file("the file is empty"));
        }
        let mut notes = Vec::new();
        let (mut json, json_size, file, chunk) = match glb::is_container(&file) {
            true => {
                let chunks = glb::chunks(&file)?;
                let json_size = chunks.json.len();
                (
                    json::root(&file[chunks.json], &mut notes)?,
                    json_size,
                    file,
                    chunks.binary,
                )
            }
            false => (json::root(&file, &mut notes)?, file.len(), Vec::new(), None),
        };
        extension::check(&json, &mut notes)?;
        for image in &json.images {
            if let Some(name) = image.uri.as_ref().filter(|name| !uri::is_data(name))
                && let Ok(path) = folder.find(name)
            {
                files.insert(path);
            }
        }
        let buffers = Buffers::read(&mut json, file, chunk, &folder, files)?;
        let budget = Budget::of(buffers.total().saturating_add(json_size as u64));
        buffers.check(&budget)?;
        Ok(Document {
            json,
            path: path.to_owned(),
            notes,
            budget,
            folder,
            buffers,
            image_bytes_read: AtomicU64::new(0),
        })
    }

    pub fn fault(&self, key: impl Into<String>, message: impl Into<String>) -> GltfError {
        GltfFault::key(key, message).of(&self.path)
    }

    /// Returns the bytes of a buffer view, decompressed if the view is compressed.
    #[cfg(test)]
    pub fn view(&self, view: usize) -> Result<&[u8], GltfError> {
        self.view_bytes(view).map_err(|fault| fault.of(&self.path))
    }

    pub(super) fn view_bytes(&self, view: usize) -> Result<&[u8], GltfFault> {
        self.buffers.view(&self.json, view)
    }

    /// Returns the image of a texture: the image of the first extension in [`SOURCE_EXTENSIONS`] that is present, or
    /// the core source.
    pub fn image_of(&self, texture: usize) -> Result<usize, GltfError> {
        self.source_of(texture).map_err(|fault| fault.of(&self.path))
    }

    fn source_of(&self, index: usize) -> Result<usize, GltfFault> {
        let textures = &self.json.textures;
        let texture =
            (textures.get(index)).ok_or_else(|| out_of_range("textures", index, "textures", textures.len()))?;
        let key = format!("textures[{index}]");
        let extensions = texture.extensions.as_ref().map(|all| &all.others);
        let source_from_extension = SOURCE_EXTENSIONS
            .iter()
            .find_map(|name| Some((name, extensions?.get(*name)?.get("source")?)));
        if let Some((name, source)) = source_from_extension {
            let count = self.json.images.len();
            let source = source.as_u64().and_then(|source| usize::try_from(source).ok());
            let source = source.filter(|source| *source < count).ok_or_else(|| {
                let rule = format!("must be the index of an image; number of images: {count}");
                GltfFault::key(format!("{key}.extensions.{name}.source"), rule)
            })?;
            // Without the feature `formats`, only the core source can be decoded.
            if cfg!(feature = "formats") || self.json.get(texture.source).is_none() {
                return Ok(source);
            }
        }
        // The crate `gltf-json` represents a missing source by an index that is out of range.
        match self.json.get(texture.source) {
            Some(_) => Ok(texture.source.value()),
            None => Err(match extensions.and_then(extension::unsupported) {
                Some(name) => extension::only_data_fault(&key, name),
                None => GltfFault::key(key, "has no source"),
            }),
        }
    }

    /// Returns the encoded bytes of an image, or the reason why it is missing.
    ///
    /// # Errors
    ///
    /// The image is invalid, too large, or outside of the asset root.
    pub fn image_bytes(&self, image: usize) -> Result<Result<Arc<[u8]>, String>, GltfError> {
        match self.encoded(image) {
            Ok(bytes) => Ok(Ok(bytes)),
            Err(ImageFault::Missing(reason)) => Ok(Err(format!("images[{image}].uri: {reason}"))),
            Err(ImageFault::Invalid(fault)) => Err(fault.of(&self.path)),
        }
    }

    fn encoded(&self, index: usize) -> Result<Arc<[u8]>, ImageFault> {
        let images = &self.json.images;
        let image = images
            .get(index)
            .ok_or_else(|| out_of_range("images", index, "images", images.len()))?;
        let fault = |rule| GltfFault::key(format!("images[{index}].uri"), rule);
        if let Some(view) = image.buffer_view {
            let bytes = self.view_bytes(view.value())?;
            self.charge_image(index, bytes.len() as u64)?;
            return Ok(bytes.into());
        }
        let Some(name) = &image.uri else {
            let key = format!("images[{index}]");
            let unsupported = image
                .extensions
                .as_ref()
                .and_then(|all| extension::unsupported(&all.others));
            return Err(ImageFault::Invalid(match unsupported {
                Some(name) => extension::only_data_fault(&key, name),
                None => GltfFault::key(key, "has neither a uri nor a bufferView"),
            }));
        };
        let bytes = match uri::is_data(name) {
            true => uri::data(name).map_err(ImageFault::Missing)?,
            false => {
                let path = self.folder.find(name).map_err(|error| match error {
                    UriError::Absent(reason) => ImageFault::Missing(reason),
                    UriError::Invalid(rule) => ImageFault::Invalid(fault(rule)),
                })?;
                self.folder.read(&path, MAX_IMAGE_BYTES).map_err(|error| {
                    let reason = format!("{} cannot be read: {error}", super::error::quoted(name));
                    match error.kind() {
                        io::ErrorKind::FileTooLarge | io::ErrorKind::OutOfMemory => ImageFault::Invalid(fault(reason)),
                        _ => ImageFault::Missing(reason),
                    }
                })?
            }
        };
        self.charge_image(index, bytes.len() as u64)?;
        Ok(bytes.into())
    }

    /// Checks the size of an image, and the total size of all reads, because several textures may reference an image.
    fn charge_image(&self, index: usize, bytes: u64) -> Result<(), GltfFault> {
        let total = self
            .image_bytes_read
            .fetch_add(bytes, Ordering::Relaxed)
            .saturating_add(bytes);
        let fault = |rule: String| Err(GltfFault::key(format!("images[{index}]"), rule));
        match (bytes > MAX_IMAGE_BYTES, total > MAX_IMAGES_BYTES) {
            (true, _) => fault(format!(
                "{bytes} bytes; an image must have at most {MAX_IMAGE_BYTES} bytes"
            )),
            (_, true) => fault(format!(
                "all images together must have at most {MAX_IMAGES_BYTES} bytes"
            )),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
