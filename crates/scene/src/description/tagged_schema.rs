//! JSON Schema of tables whose key `type` selects their schema.

use schemars::{Schema, SchemaGenerator};
use serde_json::{Map, Value, json};

use crate::schema::definition;

/// Returns the schema of a table whose key `type` selects one of several types. Each type has a tag, a description and
/// a schema, which becomes a definition named after `section`.
pub(crate) fn tagged(generator: &mut SchemaGenerator, section: &str, types: Vec<(&str, &str, Schema)>) -> Schema {
    let tags: Vec<&str> = types.iter().map(|(tag, ..)| *tag).collect();
    let descriptions: Vec<&str> = types.iter().map(|(_, description, _)| description.trim()).collect();
    let key = json!({ "description": "The type.", "type": "string", "enum": tags, "enumDescriptions": descriptions });
    // A condition for each type, so that editors report an error at the invalid key. `anyOf` serves completion in
    // editors that ignore conditions.
    let mut alternatives = vec![json!({})];
    let mut conditions = Vec::new();
    for (tag, description, schema) in types {
        let mut schema = schema.to_value();
        let mut properties = Map::new();
        properties.insert(
            "type".to_owned(),
            json!({ "description": description.trim(), "const": tag }),
        );
        if let Some(Value::Object(body_properties)) = schema.get_mut("properties") {
            properties.append(body_properties);
        }
        schema["properties"] = Value::Object(properties);
        let name = definition(section, tag);
        let reference = json!({ "$ref": format!("#/$defs/{name}") });
        conditions.push(json!({
            "if": { "properties": { "type": { "const": tag } }, "required": ["type"] },
            "then": reference.clone(),
        }));
        alternatives.push(reference);
        generator.definitions_mut().insert(name, schema);
    }
    let schema = json!({
        "type": "object",
        "properties": { "type": key },
        "required": ["type"],
        "allOf": conditions,
        "anyOf": alternatives,
    });
    schema.try_into().unwrap_or_default()
}
