//! The JSON Schema of tables whose key `type` says which they are.

use schemars::{Schema, SchemaGenerator};
use serde_json::{Map, Value, json};

/// A table that its key `type` tells apart: `shape` is what it is of. Each type has its tag, its description and its own schema, which
/// becomes one of the definitions.
pub(crate) fn tagged(generator: &mut SchemaGenerator, shape: &str, types: Vec<(&str, &str, Schema)>) -> Schema {
    let tags: Vec<&str> = types.iter().map(|(tag, ..)| *tag).collect();
    let told: Vec<&str> = types.iter().map(|(_, told, _)| told.trim()).collect();
    let key = json!({ "description": "The type.", "type": "string", "enum": tags, "enumDescriptions": told });
    // A condition for each type, so that a mistake is told at its key. Some editors complete by no conditions: for them alone all types
    // stand beside what everything is.
    let mut all = vec![json!({})];
    let mut conditions = Vec::new();
    for (tag, told, schema) in types {
        let mut schema = schema.to_value();
        let mut properties = Map::new();
        properties.insert("type".to_owned(), json!({ "description": told.trim(), "const": tag }));
        if let Some(Value::Object(own)) = schema.get_mut("properties") {
            properties.append(own);
        }
        schema["properties"] = Value::Object(properties);
        let name = definition(shape, tag);
        let reference = json!({ "$ref": format!("#/$defs/{name}") });
        conditions.push(json!({
            "if": { "properties": { "type": { "const": tag } }, "required": ["type"] },
            "then": reference.clone(),
        }));
        all.push(reference);
        generator.definitions_mut().insert(name, schema);
    }
    let schema = json!({
        "type": "object",
        "properties": { "type": key },
        "required": ["type"],
        "allOf": conditions,
        "anyOf": all,
    });
    schema.try_into().unwrap_or_default()
}

/// The name of a type's definition: `camera-perspective`.
pub(crate) fn definition(shape: &str, tag: &str) -> String {
    format!("{}-{tag}", shape.trim_end_matches("Description").to_lowercase())
}
