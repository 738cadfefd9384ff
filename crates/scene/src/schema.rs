//! The JSON Schema of scene files. `schema/scene.json` is generated from the types of descriptions (`description/`) and
//! the limits that validation uses (`limits.rs`) by a test, so that programs need no code for it.

pub(crate) mod fields;
pub(crate) mod range;

use serde_json::{Value, json};

/// The schema, with titles that contain the kinds of values.
const FILE_SCHEMA: &str = include_str!("schema/scene.json");

/// Separator of a kind's label and its range, in schema titles.
pub(crate) const TITLE_SEPARATOR: &str = "|";

/// Returns a JSON Schema (draft 2020-12) of scene files in TOML, for completion and validation in editors.
///
/// Every file that the schema rejects is invalid. The schema does not include rules that involve several values, such
/// as a camera whose `look_at` is its position, nor rules about references to names.
pub fn schema() -> String {
    let mut schema = file_schema();
    remove_titles(&mut schema);
    schema["title"] = json!("wgray scene");
    schema["description"] = json!("A scene of wgray, version ".to_owned() + env!("CARGO_PKG_VERSION") + ".");
    format!("{schema:#}\n")
}

/// Returns the schema, with titles that contain the kinds of values.
fn file_schema() -> Value {
    serde_json::from_str(FILE_SCHEMA).unwrap_or_default() // a test compares it with the types
}

/// Removes the titles. The kinds in the titles are also in the descriptions.
fn remove_titles(schema: &mut Value) {
    match schema {
        Value::Array(list) => list.iter_mut().for_each(remove_titles),
        Value::Object(object) => {
            object.retain(|key, value| key != "title" || !value.is_string());
            object.values_mut().for_each(remove_titles);
        }
        _ => {}
    }
}

/// Returns the name of the definition of a type, such as `camera-perspective`. `section` is the name of a section or of
/// its Rust type.
pub(crate) fn definition(section: &str, tag: &str) -> String {
    format!("{}-{tag}", section.trim_end_matches("Description").to_lowercase())
}

#[cfg(test)]
mod generate;
#[cfg(test)]
mod tests;
