//! Parsing of glTF JSON to [`Root`], with size limits, repairs and validation.

use gltf_json::camera::Type;
use gltf_json::validation::{Checked, Error, Validate as _};
use gltf_json::{Path, Root};
use serde_json::{Map, Number, Value};

use crate::content::binary_format;
use crate::tree;

use super::error::{GltfFault, Location, json_message, quoted};

/// Maximum length of the JSON in bytes. The limit is high because data URIs are long.
pub(super) const MAX_JSON_BYTES: usize = 512 << 20;
/// Maximum number of objects. An object takes up to 1 KiB of memory.
const MAX_OBJECTS: usize = 2 << 20;
/// Maximum number of elements of objects and arrays.
const MAX_VALUES: usize = 32 << 20;

/// Keys of indices and OpenGL codes. The crate `gltf-json` truncates 64-bit values of these keys to 32 bits.
const INDEX_KEYS: &[&str] = &[
    "attributes",
    "buffer",
    "bufferView",
    "camera",
    "children",
    "componentType",
    "index",
    "indices",
    "input",
    "inverseBindMatrices",
    "joints",
    "light",
    "magFilter",
    "material",
    "mesh",
    "minFilter",
    "mode",
    "node",
    "nodes",
    "output",
    "sampler",
    "scene",
    "skeleton",
    "skin",
    "source",
    "target",
    "targets",
    "texCoord",
    "wrapS",
    "wrapT",
];

pub(super) fn root(text: &[u8], notes: &mut Vec<String>) -> Result<Root, GltfFault> {
    if let Some(format) = binary_format(text) {
        return Err(GltfFault::file(format!("the file has the format {format}, not glTF")));
    }
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    // Some exporters pad the JSON chunk with zeros.
    let text = text.trim_ascii_end().trim_suffix_zeros();
    if text.len() > MAX_JSON_BYTES {
        return Err(GltfFault::file(format!(
            "the JSON has {} bytes; it must have at most {MAX_JSON_BYTES}",
            text.len()
        )));
    }
    check_size(text)?;
    let mut value: Value = serde_json::from_slice(text).map_err(|error| {
        let message = error.to_string();
        let message = message.split(" at line ").next().unwrap_or_default();
        let message = match message {
            "recursion limit exceeded" => "lists and objects must be nested at most 127 levels deep",
            other => other,
        };
        GltfFault::new(Location::Line(error.line().max(1), error.column().max(1)), message)
    })?;
    let Value::Object(top) = &mut value else {
        return Err(GltfFault::new(Location::Line(1, 1), "the JSON must be an object"));
    };
    check_version(top)?;
    normalize(&mut value, None).map_err(|(key, rule)| GltfFault::key(key.trim_start_matches('.'), rule))?;
    repair(&mut value, notes);
    let root: Root = tree::read(value).map_err(|error| GltfFault::key(error.key.to_string(), json_message(error)))?;
    check(&root)?;
    Ok(root)
}

trait TrimZeros {
    fn trim_suffix_zeros(&self) -> &[u8];
}

impl TrimZeros for [u8] {
    fn trim_suffix_zeros(&self) -> &[u8] {
        let end = self.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
        &self[..end]
    }
}

/// Limits the number of objects and values, because parsed JSON can need far more memory than its text.
fn check_size(text: &[u8]) -> Result<(), GltfFault> {
    let (mut objects, mut values) = (0usize, 0usize);
    let mut bytes = text.iter();
    while let Some(byte) = bytes.next() {
        match byte {
            b'"' => {
                while let Some(byte) = bytes.next() {
                    match byte {
                        b'\\' => drop(bytes.next()),
                        b'"' => break,
                        _ => {}
                    }
                }
            }
            b'{' => objects += 1,
            b'[' | b',' => values += 1,
            _ => {}
        }
    }
    let too_many = |count: usize, kind: &str, max: usize| {
        GltfFault::file(format!("the JSON has {count} {kind}; it must have at most {max}"))
    };
    if objects > MAX_OBJECTS {
        return Err(too_many(objects, "objects", MAX_OBJECTS));
    }
    match values > MAX_VALUES {
        true => Err(too_many(values, "values", MAX_VALUES)),
        false => Ok(()),
    }
}

/// Checks the version (specification, section 3.2). The caller checks it first, because the meaning of all other keys
/// depends on the version.
fn check_version(top: &Map<String, Value>) -> Result<(), GltfFault> {
    let asset = top.get("asset").and_then(Value::as_object);
    let asset = asset.ok_or_else(|| GltfFault::key("asset", "must be an object with the version"))?;
    let number = |text: &str| {
        let (major, minor) = text.split_once('.')?;
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    };
    let member = |key: &str| asset.get(key).filter(|value| !value.is_null());
    let version = member("version").ok_or_else(|| GltfFault::key("asset.version", "is required"))?;
    match version.as_str().and_then(number) {
        Some((2, _)) => {}
        _ => {
            return Err(GltfFault::key(
                "asset.version",
                format!("{} is not supported; convert the file to glTF 2.0", text_of(version)),
            ));
        }
    }
    match member("minVersion") {
        None => Ok(()),
        Some(min_version) => match min_version.as_str().and_then(number) {
            Some(min_version) if min_version <= (2, 0) => Ok(()),
            _ => Err(GltfFault::key(
                "asset.minVersion",
                format!(
                    "{} must be at most \"2.0\", the supported version",
                    text_of(min_version)
                ),
            )),
        },
    }
}

fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => quoted(text),
        Value::Object(_) => "an object".to_owned(),
        Value::Array(_) => "a list".to_owned(),
        other => other.to_string(),
    }
}

/// Removes `extras`, converts integral floats to integers, and checks that numbers fit 32 bits. The error is a key path
/// and a rule.
fn normalize(value: &mut Value, index: Option<&str>) -> Result<(), (String, String)> {
    match value {
        Value::Object(map) => {
            map.remove("extras");
            for (key, value) in map {
                // All numbers inside `attributes` and `targets` are indices.
                let is_index = INDEX_KEYS.contains(&key.as_str());
                let inherited = index.filter(|outer| ["attributes", "targets"].contains(outer));
                let index = if is_index { Some(key.as_str()) } else { inherited };
                normalize(value, index).map_err(|(path, rule)| (format!(".{key}{path}"), rule))?;
            }
        }
        Value::Array(list) => {
            for (i, value) in list.iter_mut().enumerate() {
                normalize(value, index).map_err(|(path, rule)| (format!("[{i}]{path}"), rule))?;
            }
        }
        Value::Number(number) => {
            if let Some(x) = number.as_f64().filter(|_| number.is_f64()) {
                if !(x.abs() <= f64::from(f32::MAX)) {
                    return Err((String::new(), format!("{x:e} exceeds the range of a 32-bit number")));
                }
                if x.fract() == 0.0 && (0.0..9.007_199_254_740_992e15).contains(&x) {
                    *number = Number::from(x as u64);
                }
            }
            let is_too_large = number.as_u64().is_some_and(|x| x > u64::from(u32::MAX));
            if index.is_some() && is_too_large {
                return Err((String::new(), format!("{number} must be at most {}", u32::MAX)));
            }
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
    Ok(())
}

/// Rewrites valid JSON that the crate `gltf-json` rejects, and corrects unambiguous errors.
fn repair(top: &mut Value, notes: &mut Vec<String>) {
    for scene in list(top, "scenes") {
        set_default(scene, "nodes", Value::Array(Vec::new()));
    }
    for view in list(top, "bufferViews") {
        let is_zero = |stride: &Value| stride.as_u64() == Some(0);
        if let Value::Object(view) = view
            && view.get("byteStride").is_some_and(is_zero)
        {
            view.remove("byteStride");
        }
    }
    let mut ignored = 0;
    for animation in list(top, "animations") {
        set_default(animation, "channels", Value::Array(Vec::new()));
        set_default(animation, "samplers", Value::Array(Vec::new()));
        if let Some(Value::Array(channels)) = animation.get_mut("channels") {
            let count = channels.len();
            channels.retain(|channel| !targets_extension(channel));
            ignored += count - channels.len();
        }
    }
    if ignored > 0 {
        let rule = match ignored {
            1 => "channel with a target other than a node is ignored",
            _ => "channels with targets other than nodes are ignored",
        };
        notes.push(format!("animations: {ignored} {rule}"));
    }
}

/// Returns true for channels that do not animate a core property of a node, but belong to an extension such as
/// `KHR_animation_pointer` (specification, section 3.11).
fn targets_extension(channel: &Value) -> bool {
    let Some(Value::Object(target)) = channel.get("target") else {
        return false;
    };
    let core = ["translation", "rotation", "scale", "weights"];
    let has_node = target.get("node").is_some_and(|node| !node.is_null());
    let path = target.get("path").and_then(Value::as_str);
    !has_node || path.is_some_and(|path| !core.contains(&path))
}

fn list<'a>(object: &'a mut Value, key: &str) -> &'a mut [Value] {
    match object.get_mut(key) {
        Some(Value::Array(list)) => list,
        _ => &mut [],
    }
}

fn set_default(object: &mut Value, key: &str, value: Value) {
    if let Value::Object(map) = object
        && map.get(key).is_none_or(Value::is_null)
    {
        map.insert(key.to_owned(), value);
    }
}

/// Checks indices, enumerations and required keys.
fn check(root: &Root) -> Result<(), GltfFault> {
    // Attributes, animation channels and cameras are checked first, because `root.validate` assumes valid values.
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            for (name, accessor) in &primitive.attributes {
                if accessor.value() >= root.accessors.len() {
                    let key = format!("meshes[{i}].primitives[{k}].attributes.{}", name.to_string());
                    return Err(out_of_range(key, accessor.value(), "accessors", root.accessors.len()));
                }
            }
        }
    }
    for (i, animation) in root.animations.iter().enumerate() {
        for (k, channel) in animation.channels.iter().enumerate() {
            let node = channel.target.node.value();
            if node >= root.nodes.len() {
                let key = format!("animations[{i}].channels[{k}].target.node");
                return Err(out_of_range(key, node, "nodes", root.nodes.len()));
            }
            if matches!(channel.target.path, Checked::Invalid) {
                let key = format!("animations[{i}].channels[{k}].target.path");
                return Err(GltfFault::key(key, "must be translation, rotation, scale or weights"));
            }
        }
    }
    for (i, camera) in root.cameras.iter().enumerate() {
        let (is_present, name) = match camera.type_ {
            Checked::Valid(Type::Perspective) => (camera.perspective.is_some(), "perspective"),
            Checked::Valid(Type::Orthographic) => (camera.orthographic.is_some(), "orthographic"),
            Checked::Invalid => continue,
        };
        if !is_present {
            return Err(GltfFault::key(
                format!("cameras[{i}].{name}"),
                "is required by the type of the camera",
            ));
        }
    }
    let mut first_error = None;
    root.validate(root, Path::new, &mut |path, error| {
        if first_error.is_none() {
            let path = path().0;
            if !is_allowed(&path, error) {
                first_error = Some((path, error));
            }
        }
    });
    match first_error {
        None => Ok(()),
        Some((path, error)) => Err(GltfFault::key(
            path,
            match error {
                Error::IndexOutOfBounds => "the index is out of range",
                Error::Invalid => "unknown value",
                Error::Missing => "is required",
                Error::Oversize => "is too large for this machine",
                Error::Unsupported => "unsupported extension",
            },
        )),
    }
}

/// Returns the error for an index beyond the end of a list of `count` entries. `list_name` is for example `accessors`.
pub(super) fn out_of_range(key: impl Into<String>, index: usize, list_name: &str, count: usize) -> GltfFault {
    GltfFault::key(key, format!("{index} is out of range; number of {list_name}: {count}"))
}

/// Returns true for validation errors of the crate `gltf-json` that this importer tolerates.
fn is_allowed(path: &str, error: Error) -> bool {
    let starts_with = |prefix: &str| path.starts_with(prefix);
    match error {
        // `extension::check` checks required extensions.
        Error::Unsupported => starts_with("extensionsRequired["),
        // The elements of accessors without a buffer view are zero. The importer does not use the bounds of positions,
        // and skips primitives without positions.
        Error::Missing => {
            starts_with("accessors[") && path.ends_with("].bufferView")
                || starts_with("meshes[") && path.contains("attributes[\"POSITION\"]")
        }
        // The importer ignores application-specific attributes. The limits of `byteStride` only matter to GPUs.
        Error::Invalid => {
            starts_with("meshes[") && path.contains(".attributes[")
                || starts_with("bufferViews[") && path.ends_with("].byteStride")
        }
        Error::IndexOutOfBounds | Error::Oversize => false,
    }
}
