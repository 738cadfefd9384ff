//! The JSON Schema of scene files, derived from the types that parse them (`description/`) and the limits that
//! validation uses (`limits.rs`).

pub(crate) mod fields;
pub(crate) mod range;

use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use super::description::kinds::SPLIT;
use super::description::tagged::Tagged as _;
use super::description::tagged_schema::definition;
use super::{CameraDescription, Description};

/// Returns a JSON Schema (draft 2020-12) of scene files in TOML, for completion and validation in editors.
///
/// All files that the schema rejects are invalid. The schema does not include rules that involve several values, such
/// as a camera whose `look_at` is its position, nor rules about references to names.
pub fn schema() -> String {
    let mut schema = of_files();
    without_kinds(&mut schema);
    schema["title"] = json!("wgray scene");
    schema["description"] = json!("A scene of wgray, version ".to_owned() + env!("CARGO_PKG_VERSION") + ".");
    format!("{schema:#}\n")
}

fn of_files() -> Value {
    // Subschemas are inlined, because editors ignore descriptions next to a reference.
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings
        .into_generator()
        .into_root_schema_for::<Description>()
        .to_value();
    of_camera(&mut schema);
    finish(&mut schema);
    schema
}

/// Removes the kinds, because the descriptions contain them.
fn without_kinds(schema: &mut Value) {
    match schema {
        Value::Array(all) => all.iter_mut().for_each(without_kinds),
        Value::Object(all) => {
            all.retain(|key, value| key != "title" || !value.is_string());
            all.values_mut().for_each(without_kinds);
        }
        _ => {}
    }
}

/// If a camera has no `type`, it is perspective. Required keys may be in the keys of the camera's path.
fn of_camera(schema: &mut Value) {
    let camera = &mut schema["properties"]["camera"];
    camera["properties"]["type"]["default"] = json!(CameraDescription::DEFAULT);
    let tags = CameraDescription::TYPES;
    if let Some(camera) = camera.as_object_mut() {
        camera.remove("required");
    }
    for condition in camera["allOf"].as_array_mut().into_iter().flatten() {
        let of = &mut condition["if"];
        if of["properties"]["type"]["const"] == CameraDescription::DEFAULT {
            *of = json!({ "properties": of["properties"] });
        }
    }
    for tag in tags {
        let Some(of_type) = schema["$defs"][definition("camera", tag)].as_object_mut() else {
            continue;
        };
        if let Some(required) = of_type.remove("required") {
            let either = json!([{ "required": required }, { "required": ["path"] }]);
            of_type.insert("anyOf".to_owned(), either);
        }
    }
}

/// Adds kinds, ranges and defaults to all descriptions. Removes what TOML does not support, and formats of Rust.
fn finish(schema: &mut Value) {
    match schema {
        Value::Array(all) => all.iter_mut().for_each(finish),
        Value::Object(_) => {
            without_null(schema);
            names(schema);
            append_kind(schema);
            if let Some(Value::Object(properties)) = schema.get_mut("properties") {
                for property in properties.values_mut() {
                    finish(property);
                    append_default(property);
                }
            }
            let Some(all) = schema.as_object_mut() else { return };
            all.remove("format");
            for (key, value) in all.iter_mut() {
                if key != "properties" && key != "default" {
                    finish(value);
                }
            }
        }
        _ => {}
    }
}

/// Removes null, which TOML does not support.
fn without_null(schema: &mut Value) {
    let null = json!("null");
    let types = schema.get_mut("type");
    if let Some(Value::Array(list)) = types {
        list.retain(|name| *name != null);
        if let [one] = list.as_slice() {
            schema["type"] = one.clone();
        }
    }
    if let Some(Value::Array(list)) = schema.get_mut("enum") {
        list.retain(|name| !name.is_null());
    }
    let Some(all) = schema.as_object_mut() else { return };
    for word in ["anyOf", "oneOf"] {
        let Some(Value::Array(list)) = all.get_mut(word) else {
            continue;
        };
        list.retain(|one| one.get("type") != Some(&null));
        if let [Value::Object(one)] = list.as_slice() {
            let one = one.clone();
            all.remove(word);
            for (key, value) in one {
                all.entry(key).or_insert(value);
            }
        }
    }
    if all.get("default") == Some(&Value::Null) {
        all.remove("default");
    }
}

/// Converts alternatives with descriptions to a list of names, which all editors support.
fn names(schema: &mut Value) {
    let Some(all) = schema.as_object_mut() else { return };
    let Some(Value::Array(list)) = all.get("oneOf") else {
        return;
    };
    let parts = list
        .iter()
        .map(|one| Some((one.get("const")?.clone(), one.get("description")?.clone())));
    let Some(parts) = parts.collect::<Option<Vec<_>>>() else {
        return;
    };
    let (names, descriptions): (Vec<Value>, Vec<Value>) = parts.into_iter().unzip();
    all.remove("oneOf");
    all.insert("type".to_owned(), json!("string"));
    all.insert("enum".to_owned(), Value::Array(names));
    all.insert("enumDescriptions".to_owned(), Value::Array(descriptions));
}

/// Appends the kind of a value to its description.
fn append_kind(schema: &mut Value) {
    let Some(all) = schema.as_object_mut() else { return };
    let mut text = match all.get("description") {
        Some(Value::String(text)) => text.split_whitespace().collect::<Vec<_>>().join(" "),
        _ => String::new(),
    };
    if let Some(Value::String(kind)) = all.get("title") {
        let (words, range) = kind.split_once(SPLIT).unwrap_or((kind, ""));
        let has_words = words.is_empty() || text.to_lowercase().contains(words);
        let more = [words, range]
            .into_iter()
            .filter(|part| !part.is_empty() && (*part != words || !has_words));
        let more = more.collect::<Vec<_>>().join(", ");
        let end = if text.is_empty() || text.ends_with('.') {
            ""
        } else {
            "."
        };
        if let Some(first) = more.get(..1) {
            text = format!("{text}{end} {}{}.", first.to_uppercase(), &more[1..]);
        }
    }
    if !text.is_empty() {
        all.insert("description".to_owned(), Value::String(text.trim().to_owned()));
    }
}

/// Maximum number of keys of a table that is displayed as a default.
const MAX_SHOWN_KEYS: usize = 3;

fn append_default(property: &mut Value) {
    let Some(all) = property.as_object_mut() else { return };
    match (all.get("default"), all.get("description")) {
        // The keys of a section have their own defaults.
        (Some(Value::Object(table)), _) if table.is_empty() || table.len() > MAX_SHOWN_KEYS => {
            all.remove("default");
        }
        (Some(Value::Array(list)), _) if list.is_empty() => {
            all.remove("default");
        }
        (Some(default), Some(Value::String(text))) => {
            let text = format!("{text} Default: {}.", toml_of(default));
            all.insert("description".to_owned(), Value::String(text));
        }
        _ => {}
    }
}

fn toml_of(value: &Value) -> String {
    match value {
        Value::Object(table) => {
            let pairs: Vec<String> = table
                .iter()
                .map(|(key, value)| format!("{key} = {}", toml_of(value)))
                .collect();
            format!("{{ {} }}", pairs.join(", "))
        }
        Value::Array(list) => {
            let all: Vec<String> = list.iter().map(toml_of).collect();
            format!("[{}]", all.join(", "))
        }
        Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), |x| x.to_string()),
        other => other.to_string(),
    }
}
