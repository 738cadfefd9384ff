//! glTF files in memory, for tests.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use super::document::Document;
use super::error::GltfFault;
use super::uri::Folder;
use crate::file_system::FileSystem;

pub fn container(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut data = binary.to_vec();
    data.resize(data.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + 8 + data.len();
    let mut bytes = b"glTF".to_vec();
    let word = |x: usize| (x as u32).to_le_bytes();
    bytes.extend([word(2), word(length), word(text.len())].concat());
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend(word(data.len()));
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes
}

/// Reads a glTF file from memory. The file must not refer to other files.
pub fn read(bytes: Vec<u8>) -> Result<Document, GltfFault> {
    Document::read(
        bytes,
        Path::new("/none/a.gltf"),
        Folder {
            file_system: FileSystem::Disk,
            folder: "/none".into(),
            root: "/none".into(),
        },
        &mut BTreeSet::new(),
    )
}

/// Returns JSON with one buffer, the binary chunk of a GLB container.
pub fn json_of(binary: &[u8], views: Value, accessors: Value) -> Value {
    json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": views,
        "accessors": accessors,
    })
}

pub fn document(binary: &[u8], views: Value, accessors: Value) -> Document {
    read(container(&json_of(binary, views, accessors), binary)).unwrap()
}

/// Returns a document with one accessor; its buffer view contains all bytes.
pub fn accessor(binary: &[u8], accessor: Value) -> Document {
    let views = json!([{ "buffer": 0, "byteLength": binary.len() }]);
    document(binary, views, json!([accessor]))
}
