//! GLB containers: a header and chunks (specification, section 4).

use std::ops::Range;

use super::error::{GltfFault, Location};
use crate::content::GLTF_MAGIC;

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

#[derive(Debug, PartialEq, Eq)]
pub(super) struct Chunks {
    pub json: Range<usize>,
    pub binary: Option<Range<usize>>,
}

/// Returns true if the bytes are a GLB file, independent of the file name.
pub(super) fn is_container(bytes: &[u8]) -> bool {
    bytes.starts_with(GLTF_MAGIC)
}

/// Finds the JSON and binary chunks. Chunks of other types, repeated chunks, and bytes beyond the declared length are
/// skipped.
pub(super) fn chunks(bytes: &[u8]) -> Result<Chunks, GltfFault> {
    if bytes.len() < HEADER {
        let rule = format!(
            "the file is truncated: it has {} of the {HEADER} bytes of the header",
            bytes.len()
        );
        return Err(GltfFault::new(Location::Byte(0), rule));
    }
    let version = word(bytes, 4);
    if version != 2 {
        let rule = format!("the version of the container is {version}; it must be 2");
        return Err(GltfFault::new(Location::Byte(4), rule));
    }
    let length = word(bytes, 8) as usize;
    if length > bytes.len() {
        let rule = format!("the file is truncated: it has {} of {length} bytes", bytes.len());
        return Err(GltfFault::new(Location::Byte(8), rule));
    }
    let mut json = None;
    let mut binary = None;
    let mut offset = HEADER;
    // A remainder shorter than a chunk header is padding.
    while length.saturating_sub(offset) >= CHUNK_HEADER {
        let (size, kind) = (word(bytes, offset) as usize, word(bytes, offset + 4));
        let start = offset + CHUNK_HEADER;
        if size > length - start {
            let rule = format!(
                "the chunk size {size} must be at most {}, the number of remaining bytes",
                length - start
            );
            return Err(GltfFault::new(Location::Byte(offset as u64), rule));
        }
        let range = start..start + size;
        match (kind, &json) {
            (JSON, None) => json = Some(range),
            (_, None) => {
                return Err(GltfFault::new(
                    Location::Byte(offset as u64),
                    "the first chunk must be JSON",
                ));
            }
            (BIN, Some(_)) if binary.is_none() => binary = Some(range),
            _ => {}
        }
        offset = start + size;
    }
    let json = json.ok_or_else(|| GltfFault::new(Location::Byte(HEADER as u64), "the file must have a JSON chunk"))?;
    Ok(Chunks { json, binary })
}

/// Returns a little-endian 32-bit word; the caller checks the bounds.
fn word(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes([bytes[offset], bytes[offset + 1], bytes[offset + 2], bytes[offset + 3]])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(length: u32, chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let mut bytes = GLTF_MAGIC.to_vec();
        for word in [2, length] {
            bytes.extend(word.to_le_bytes());
        }
        for (kind, data) in chunks {
            bytes.extend((data.len() as u32).to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(*data);
        }
        bytes
    }

    fn error_of(bytes: &[u8]) -> (Location, String) {
        let fault = chunks(bytes).unwrap_err();
        (fault.location, fault.message)
    }

    #[test]
    fn json_and_binary_chunks_are_found() {
        let bytes = glb(
            12 + 8 + 4 + 8 + 4 + 8 + 4,
            &[(JSON, b"{}  "), (7, b"1234"), (BIN, b"abcd")],
        );
        assert!(is_container(&bytes));
        let found = chunks(&bytes).unwrap();
        assert_eq!(&bytes[found.json], b"{}  ");
        assert_eq!(&bytes[found.binary.unwrap()], b"abcd");
        // A second BIN chunk and trailing bytes are skipped.
        let mut bytes = glb(12 + 8 + 4 + 8 + 1, &[(JSON, b"{}  "), (BIN, b"a"), (BIN, b"b")]);
        let found = chunks(&bytes).unwrap();
        assert_eq!(&bytes[found.binary.unwrap()], b"a");
        bytes[8] += 9;
        assert_eq!(&bytes[chunks(&bytes).unwrap().binary.unwrap()], b"a");
        assert_eq!(chunks(&glb(24, &[(JSON, b"{}  ")])).unwrap().binary, None);
    }

    #[test]
    fn invalid_headers_and_chunks_are_rejected() {
        let byte = |offset: u64, rule: &str| (Location::Byte(offset), rule.to_owned());
        assert_eq!(
            error_of(b"glTF"),
            byte(0, "the file is truncated: it has 4 of the 12 bytes of the header")
        );
        let mut bytes = glb(24, &[(JSON, b"{}  ")]);
        bytes[4] = 1;
        assert_eq!(
            error_of(&bytes),
            byte(4, "the version of the container is 1; it must be 2")
        );
        assert_eq!(
            error_of(&glb(25, &[(JSON, b"{}  ")])),
            byte(8, "the file is truncated: it has 24 of 25 bytes")
        );
        assert_eq!(
            error_of(&glb(23, &[(JSON, b"{}  ")])),
            byte(12, "the chunk size 4 must be at most 3, the number of remaining bytes")
        );
        let mut bytes = glb(24, &[(JSON, b"{}  ")]);
        bytes[12..16].fill(0xff);
        assert_eq!(
            error_of(&bytes),
            byte(
                12,
                "the chunk size 4294967295 must be at most 4, the number of remaining bytes"
            )
        );
        assert_eq!(
            error_of(&glb(24, &[(BIN, b"{}  ")])),
            byte(12, "the first chunk must be JSON")
        );
        assert_eq!(error_of(&glb(12, &[])), byte(12, "the file must have a JSON chunk"));
        assert_eq!(error_of(&glb(0, &[])), byte(12, "the file must have a JSON chunk"));
    }
}
