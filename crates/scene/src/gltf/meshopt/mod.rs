//! Buffer views compressed with `EXT_meshopt_compression` or its superset `KHR_meshopt_compression` (Khronos Group,
//! specifications of the extensions).
//!
//! wgray has its own decoder because the crate `meshopt-rs` 0.1.2 only supports version 0 of the bitstream and does not
//! check filters.

mod attributes;
mod filter;
mod indices;

use serde::Deserialize;
use serde_json::{Map, Value};

use self::filter::Filter;
use super::error::{GltfFault, json_message, key_within, quoted};
use crate::tree;

/// Names of the extensions, in order of precedence.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Compression {
    /// Name of the extension.
    pub name: &'static str,
    pub buffer: usize,
    pub offset: u64,
    pub length: u64,
    stride: usize,
    count: usize,
    mode: Mode,
    filter: Filter,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct MeshoptExtension {
    buffer: u32,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

/// Returns the compression of a buffer view of `length` bytes; `None` if the view is not compressed.
pub(super) fn parse_compression(
    key: &str,
    extensions: &Map<String, Value>,
    length: u64,
) -> Result<Option<Compression>, GltfFault> {
    let Some((name, extension)) = NAMES.iter().find_map(|name| Some((*name, extensions.get(*name)?))) else {
        return Ok(None);
    };
    let key = format!("{key}.extensions.{name}");
    let extension: MeshoptExtension =
        tree::read(extension.clone()).map_err(|error| GltfFault::key(key_within(&key, &error), json_message(error)))?;
    let fault = |field: &str, value: &dyn std::fmt::Display, rule: &str| {
        Err(GltfFault::key(format!("{key}.{field}"), format!("{value} {rule}")))
    };
    let stride = extension.byte_stride;
    let mode = match extension.mode.as_str() {
        "ATTRIBUTES" => Mode::Attributes,
        "TRIANGLES" => Mode::Triangles,
        "INDICES" => Mode::Indices,
        other => return fault("mode", &quoted(other), "must be ATTRIBUTES, TRIANGLES or INDICES"),
    };
    let filter = match extension.filter.as_deref().unwrap_or("NONE") {
        "NONE" => Filter::None,
        "OCTAHEDRAL" => Filter::Octahedral,
        "QUATERNION" => Filter::Quaternion,
        "EXPONENTIAL" => Filter::Exponential,
        "COLOR" => Filter::Color,
        other => {
            let rule = "must be NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR";
            return fault("filter", &quoted(other), rule);
        }
    };
    let rule = match mode {
        Mode::Attributes if !(4..=256).contains(&stride) || !stride.is_multiple_of(4) => {
            "must be a multiple of 4, from 4 to 256"
        }
        Mode::Triangles | Mode::Indices if stride != 2 && stride != 4 => "must be 2 or 4 for indices",
        _ => match filter {
            Filter::Octahedral | Filter::Color if stride != 4 && stride != 8 => "must be 4 or 8 for this filter",
            Filter::Quaternion if stride != 8 => "must be 8 for this filter",
            _ => "",
        },
    };
    if !rule.is_empty() {
        return fault("byteStride", &stride, rule);
    }
    if mode != Mode::Attributes && filter != Filter::None {
        return fault("filter", &"a filter", "requires the mode ATTRIBUTES");
    }
    if mode == Mode::Triangles && !extension.count.is_multiple_of(3) {
        return fault("count", &extension.count, "must be a multiple of 3");
    }
    if extension.count.checked_mul(stride) != Some(length) {
        let rule = format!("times byteStride {stride} must be {length}, the size of the view");
        return fault("count", &extension.count, &rule);
    }
    let Ok(count) = usize::try_from(extension.count) else {
        return fault(
            "count",
            &extension.count,
            "must fit into the address space of this machine",
        );
    };
    Ok(Some(Compression {
        name,
        buffer: extension.buffer as usize,
        offset: extension.byte_offset,
        length: extension.byte_length,
        stride: stride as usize,
        count,
        mode,
        filter,
    }))
}

impl Compression {
    pub fn size(&self) -> u64 {
        self.count as u64 * self.stride as u64
    }

    /// Decodes the stream. The error is the violated rule.
    pub fn decode(&self, stream: &[u8]) -> Result<Vec<u8>, &'static str> {
        match self.mode {
            Mode::Triangles => indices::triangles(stream, self.count, self.stride),
            Mode::Indices => indices::indices(stream, self.count, self.stride),
            Mode::Attributes => {
                let mut bytes = attributes::attributes(stream, self.count, self.stride)?;
                self.filter.apply(&mut bytes, self.stride);
                Ok(bytes)
            }
        }
    }
}

const TOO_SHORT: &str = "the stream must contain all elements";
const TOO_LONG: &str = "the stream must end after the last element";

#[cfg(test)]
mod tests;
