//! Detection of binary formats, for messages about files that should contain something else.

use crate::decode::Format;

/// The first bytes of a binary glTF file.
pub const GLTF_MAGIC: &[u8] = b"glTF";

/// Returns the name of a binary format, detected from the first bytes; `None` if they are of no known format.
pub fn binary_format(bytes: &[u8]) -> Option<&'static str> {
    match bytes.starts_with(GLTF_MAGIC) {
        true => Some("binary glTF"),
        false => Format::of(bytes).map(Format::name),
    }
}
