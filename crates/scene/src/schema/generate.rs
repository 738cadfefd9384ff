//! Generates the JSON Schema of scene files from the types of descriptions.

use std::fs;

use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use super::{TITLE_SEPARATOR, definition, file_schema};
use crate::description::tagged::Tagged as _;
use crate::{CameraDescription, Description, ViewTransform};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/schema/scene.json");

/// Returns the schema of the types, with titles that contain the kinds of values.
pub(super) fn generated() -> Value {
    // Subschemas are inlined, because editors ignore descriptions next to a reference.
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings
        .into_generator()
        .into_root_schema_for::<Description>()
        .to_value();
    make_camera_keys_optional(&mut schema);
    finish(&mut schema);
    schema
}

/// Makes the key `type` of the camera optional. Also makes the required keys of a camera optional if the camera has a
/// path, because the keys of the path may set these values.
fn make_camera_keys_optional(schema: &mut Value) {
    let camera = &mut schema["properties"]["camera"];
    camera["properties"]["type"]["default"] = json!(CameraDescription::DEFAULT);
    let tags = CameraDescription::TYPES;
    if let Some(camera) = camera.as_object_mut() {
        camera.remove("required");
    }
    for condition in camera["allOf"].as_array_mut().into_iter().flatten() {
        let premise = &mut condition["if"];
        if premise["properties"]["type"]["const"] == CameraDescription::DEFAULT {
            *premise = json!({ "properties": premise["properties"] });
        }
    }
    for tag in tags {
        let Some(type_schema) = schema["$defs"][definition("camera", tag)].as_object_mut() else {
            continue;
        };
        if let Some(required) = type_schema.remove("required") {
            let alternatives = json!([{ "required": required }, { "required": ["path"] }]);
            type_schema.insert("anyOf".to_owned(), alternatives);
        }
    }
}

/// Adds kinds, ranges and defaults to all descriptions. Removes null, which TOML does not support, and the formats of
/// Rust's number types.
fn finish(schema: &mut Value) {
    match schema {
        Value::Array(list) => list.iter_mut().for_each(finish),
        Value::Object(_) => {
            remove_null(schema);
            collect_names(schema);
            append_kind(schema);
            if let Some(Value::Object(properties)) = schema.get_mut("properties") {
                for property in properties.values_mut() {
                    finish(property);
                    append_default(property);
                }
            }
            let Some(object) = schema.as_object_mut() else { return };
            object.remove("format");
            for (key, value) in object.iter_mut() {
                if key != "properties" && key != "default" {
                    finish(value);
                }
            }
        }
        _ => {}
    }
}

/// Removes null, which TOML does not support.
fn remove_null(schema: &mut Value) {
    let null = json!("null");
    let types = schema.get_mut("type");
    if let Some(Value::Array(list)) = types {
        list.retain(|name| *name != null);
        if let [name] = list.as_slice() {
            schema["type"] = name.clone();
        }
    }
    if let Some(Value::Array(list)) = schema.get_mut("enum") {
        list.retain(|name| !name.is_null());
    }
    let Some(object) = schema.as_object_mut() else { return };
    for keyword in ["anyOf", "oneOf"] {
        let Some(Value::Array(list)) = object.get_mut(keyword) else {
            continue;
        };
        list.retain(|alternative| alternative.get("type") != Some(&null));
        if let [Value::Object(alternative)] = list.as_slice() {
            let alternative = alternative.clone();
            object.remove(keyword);
            for (key, value) in alternative {
                object.entry(key).or_insert(value);
            }
        }
    }
    if object.get("default") == Some(&Value::Null) {
        object.remove("default");
    }
}

/// Converts alternatives with descriptions to a list of names, which all editors support.
fn collect_names(schema: &mut Value) {
    let Some(object) = schema.as_object_mut() else { return };
    let Some(Value::Array(list)) = object.get("oneOf") else {
        return;
    };
    let pairs = list.iter().map(|alternative| {
        Some((
            alternative.get("const")?.clone(),
            alternative.get("description")?.clone(),
        ))
    });
    let Some(pairs) = pairs.collect::<Option<Vec<_>>>() else {
        return;
    };
    let (names, descriptions): (Vec<Value>, Vec<Value>) = pairs.into_iter().unzip();
    object.remove("oneOf");
    object.insert("type".to_owned(), json!("string"));
    object.insert("enum".to_owned(), Value::Array(names));
    object.insert("enumDescriptions".to_owned(), Value::Array(descriptions));
}

/// Appends the kind of a value to its description.
fn append_kind(schema: &mut Value) {
    let Some(object) = schema.as_object_mut() else { return };
    let mut text = match object.get("description") {
        Some(Value::String(text)) => text.split_whitespace().collect::<Vec<_>>().join(" "),
        _ => String::new(),
    };
    if let Some(Value::String(kind)) = object.get("title") {
        let (label, range) = kind.split_once(TITLE_SEPARATOR).unwrap_or((kind, ""));
        let has_label = label.is_empty() || text.to_lowercase().contains(label);
        let addition = [label, range]
            .into_iter()
            .filter(|part| !part.is_empty() && (*part != label || !has_label));
        let addition = addition.collect::<Vec<_>>().join(", ");
        let period = if text.is_empty() || text.ends_with('.') {
            ""
        } else {
            "."
        };
        if let Some(first) = addition.get(..1) {
            text = format!("{text}{period} {}{}.", first.to_uppercase(), &addition[1..]);
        }
    }
    if !text.is_empty() {
        object.insert("description".to_owned(), Value::String(text.trim().to_owned()));
    }
}

/// Maximum number of keys of a table that is displayed as a default.
const MAX_SHOWN_KEYS: usize = 3;

fn append_default(property: &mut Value) {
    let Some(object) = property.as_object_mut() else { return };
    match (object.get("default"), object.get("description")) {
        // The keys of a section have their own defaults.
        (Some(Value::Object(table)), _) if table.is_empty() || table.len() > MAX_SHOWN_KEYS => {
            object.remove("default");
        }
        (Some(Value::Array(list)), _) if list.is_empty() => {
            object.remove("default");
        }
        (Some(default), Some(Value::String(text))) => {
            let text = format!("{text} Default: {}.", to_toml(default));
            object.insert("description".to_owned(), Value::String(text));
        }
        _ => {}
    }
}

pub(super) fn to_toml(value: &Value) -> String {
    match value {
        Value::Object(table) => {
            let pairs: Vec<String> = table
                .iter()
                .map(|(key, value)| format!("{key} = {}", to_toml(value)))
                .collect();
            format!("{{ {} }}", pairs.join(", "))
        }
        Value::Array(list) => {
            let items: Vec<String> = list.iter().map(to_toml).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), |x| x.to_string()),
        other => other.to_string(),
    }
}

#[test]
fn the_file_has_the_schema_of_the_types() {
    let expected = generated();
    if std::env::var_os("WGRAY_TEST_RECORD").is_some_and(|value| value == "1") {
        return fs::write(FILE, format!("{expected:#}\n")).unwrap();
    }
    assert!(file_schema() == expected, "WGRAY_TEST_RECORD=1 writes {FILE}");
}

#[test]
fn the_schema_has_all_view_transforms() {
    let names = &generated()["properties"]["image"]["properties"]["view_transform"]["enum"];
    assert_eq!(*names, json!(ViewTransform::ALL.map(ViewTransform::name)));
}
