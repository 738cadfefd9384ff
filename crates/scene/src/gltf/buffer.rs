//! glTF buffers and buffer views (specification, section 3.6).

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::OnceLock;

use gltf_json::Root;

use super::budget::{Budget, Resource};
use super::error::GltfFault;
use super::json::out_of_range;
use super::meshopt::{self, Compression};
use super::uri::{self, Folder};

/// Maximum size of a file, and of all buffers in total.
pub(super) const MAX_BUFFER_BYTES: u64 = 8 << 30;

enum Bytes {
    /// No buffer view refers to the buffer.
    Unused,
    /// A range of the GLB file.
    Chunk(Range<usize>),
    /// Bytes of a file or a data URI.
    Read(Vec<u8>),
}

pub(super) struct Buffers {
    file: Vec<u8>,
    buffers: Vec<Bytes>,
    compressed: Vec<Option<Compression>>,
    /// Decompressed buffer views, filled on first use.
    decoded: Vec<OnceLock<Vec<u8>>>,
    total: u64,
}

impl Buffers {
    /// Reads the referenced buffers, and removes data URIs from `root`. `chunk` is the binary chunk of the GLB file
    /// `file`.
    pub fn read(
        root: &mut Root,
        file: Vec<u8>,
        chunk: Option<Range<usize>>,
        folder: &Folder,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<Buffers, GltfFault> {
        let mut used = vec![false; root.buffers.len()];
        let mut compressed = Vec::with_capacity(root.buffer_views.len());
        for (i, view) in root.buffer_views.iter().enumerate() {
            let compression = match &view.extensions {
                Some(all) => meshopt::parse_compression(&format!("bufferViews[{i}]"), &all.others, view.byte_length.0)?,
                None => None,
            };
            // The core `buffer` is a fallback for loaders without the extension.
            let buffer = compression.map_or(view.buffer.value(), |compression| compression.buffer);
            match used.get_mut(buffer) {
                Some(used) => *used = true,
                None => {
                    return Err(out_of_range(
                        format!("bufferViews[{i}]"),
                        buffer,
                        "buffers",
                        root.buffers.len(),
                    ));
                }
            }
            compressed.push(compression);
        }
        let mut total = 0;
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (i, buffer) in root.buffers.iter_mut().enumerate() {
            if !used[i] {
                buffers.push(Bytes::Unused);
                continue;
            }
            let length = buffer.byte_length.0;
            let key = || format!("buffers[{i}]");
            let (bytes, size) = match (buffer.uri.take(), &chunk) {
                (Some(data), _) if uri::is_data(&data) => {
                    let bytes = uri::data(&data).map_err(|rule| GltfFault::key(format!("buffers[{i}].uri"), rule))?;
                    let size = bytes.len();
                    (Bytes::Read(bytes), size)
                }
                (Some(name), _) => {
                    let fault = |rule| GltfFault::key(format!("buffers[{i}].uri"), rule);
                    let path = folder.find(&name).map_err(|error| fault(error.into()))?;
                    let remaining = MAX_BUFFER_BYTES.saturating_sub(total);
                    let bytes = folder
                        .read(&path, remaining)
                        .map_err(|error| fault(format!("{name:?} cannot be read: {error}")))?;
                    files.insert(path);
                    let size = bytes.len();
                    buffer.uri = Some(name);
                    (Bytes::Read(bytes), size)
                }
                (None, Some(chunk)) if i == 0 => (Bytes::Chunk(chunk.clone()), chunk.len()),
                (None, _) => return Err(GltfFault::key(key(), "has no uri, but buffer views refer to it")),
            };
            total = total.saturating_add(size as u64);
            if total > MAX_BUFFER_BYTES {
                let rule = format!("all buffers together must have at most {MAX_BUFFER_BYTES} bytes");
                return Err(GltfFault::key(key(), rule));
            }
            if length > size as u64 {
                let rule = format!("{length} must be at most {size}, the size of the data");
                return Err(GltfFault::key(format!("buffers[{i}].byteLength"), rule));
            }
            buffers.push(bytes);
        }
        Ok(Buffers {
            file,
            buffers,
            total,
            compressed,
            decoded: root.buffer_views.iter().map(|_| OnceLock::new()).collect(),
        })
    }

    pub fn total(&self) -> u64 {
        self.total
    }

    /// Charges the decompressed views to `budget`.
    pub fn check(&self, budget: &Budget) -> Result<(), GltfFault> {
        for (i, compression) in self.compressed.iter().enumerate() {
            let size = compression.map_or(0, |compression| compression.size());
            let charge = budget.take(Resource::Decompressed, size);
            charge.map_err(|rule| GltfFault::key(format!("bufferViews[{i}]"), rule))?;
        }
        Ok(())
    }

    /// Returns the first `byteLength` bytes of a buffer.
    fn buffer(&self, root: &Root, index: usize) -> Result<&[u8], GltfFault> {
        let key = || format!("buffers[{index}]");
        let (Some(bytes), Some(buffer)) = (self.buffers.get(index), root.buffers.get(index)) else {
            return Err(out_of_range(key(), index, "buffers", root.buffers.len()));
        };
        let bytes = match bytes {
            Bytes::Chunk(range) => self.file.get(range.clone()),
            Bytes::Read(bytes) => Some(bytes.as_slice()),
            Bytes::Unused => None,
        };
        let length = usize::try_from(buffer.byte_length.0).ok();
        bytes
            .and_then(|bytes| bytes.get(..length?))
            .ok_or_else(|| GltfFault::key(key(), "has no data"))
    }

    /// Returns the bytes of a buffer view, decompressed if the view is compressed.
    pub fn view(&self, root: &Root, index: usize) -> Result<&[u8], GltfFault> {
        let view = (root.buffer_views.get(index))
            .ok_or_else(|| out_of_range("bufferViews", index, "buffer views", root.buffer_views.len()))?;
        if let (Some(Some(compression)), Some(decoded)) = (self.compressed.get(index), self.decoded.get(index)) {
            if let Some(bytes) = decoded.get() {
                return Ok(bytes);
            }
            let key = format!("bufferViews[{index}].extensions.{}", compression.name);
            let stream = self.byte_range(root, &key, compression.buffer, compression.offset, compression.length)?;
            let bytes = compression.decode(stream).map_err(|rule| GltfFault::key(key, rule))?;
            return Ok(decoded.get_or_init(|| bytes));
        }
        let offset = view.byte_offset.unwrap_or_default().0;
        self.byte_range(
            root,
            &format!("bufferViews[{index}]"),
            view.buffer.value(),
            offset,
            view.byte_length.0,
        )
    }

    /// Returns a range of the bytes of a buffer. `key` is the location for errors.
    fn byte_range(&self, root: &Root, key: &str, buffer: usize, offset: u64, length: u64) -> Result<&[u8], GltfFault> {
        let bytes = self.buffer(root, buffer)?;
        let end = offset.checked_add(length).filter(|end| *end <= bytes.len() as u64);
        let end = end.ok_or_else(|| {
            let size = bytes.len();
            GltfFault::key(
                key,
                format!("offset {offset} and length {length} exceed the {size} bytes of buffers[{buffer}]"),
            )
        })?;
        Ok(&bytes[offset as usize..end as usize])
    }
}
