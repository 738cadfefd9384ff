//! Detection of binary formats, for messages about files that should contain something else.

use crate::decode::Format;
use crate::gltf::is_binary_gltf;

/// Returns the name of a binary format, detected from the first bytes; `None` if they are of no known format.
pub fn binary_format(bytes: &[u8]) -> Option<&'static str> {
    match is_binary_gltf(bytes) {
        true => Some("binary glTF"),
        false => Format::of(bytes).map(Format::name),
    }
}
