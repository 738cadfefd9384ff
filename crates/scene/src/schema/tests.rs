//! The tables of `docs/scene-format.md` are those of the schema. `WGRAY_TEST_RECORD=1` writes them.

use std::fs;
use std::path::Path;

use serde_json::{Value as Json, json};

use super::TITLE_SEPARATOR;
use super::generate::{generated, to_toml};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene-format.md");

/// A table of keys that several types share: the name, and the table and key of each row.
type Shared = (&'static str, &'static [&'static str]);

/// The table of a type omits a row that is also in the shared table.
static SHARED: [Shared; 4] = [
    (
        "camera",
        &[
            "camera-perspective.look_at",
            "camera-perspective.path",
            "camera-perspective.up",
        ],
    ),
    (
        "texture",
        &["texture-image.offset", "texture-image.rotate", "texture-image.scale"],
    ),
    (
        "material",
        &[
            "material-phong.emission",
            "material-phong.normal_map",
            "material-phong.visible",
        ],
    ),
    (
        "shape",
        &[
            "shape-sphere.material",
            "shape-mesh.matrix",
            "shape-mesh.rotate",
            "shape-mesh.scale",
            "shape-mesh.translate",
        ],
    ),
];

fn shared(name: &str) -> Option<&'static Shared> {
    SHARED.iter().find(|(shared_name, _)| *shared_name == name)
}

/// Splits the name of a key, such as `shape-mesh.scale`, into the table and the key.
fn table_and_key(name: &str) -> (&str, &str) {
    name.split_once('.').expect("a table and a key")
}

/// Returns the schema of a table of a scene file.
fn table_schema<'a>(root: &'a Json, name: &str) -> &'a Json {
    let top = &root["properties"];
    let path = &root["$defs"]["camera-perspective"]["properties"]["path"];
    match name {
        "image" | "render" | "environment" => &top[name],
        "adaptive" | "filter" => &top["render"]["properties"][name],
        "samples" => &top["render"]["properties"]["pixel_samples"]["anyOf"][0],
        "path" => path,
        "path-keys" => &path["properties"]["keys"]["items"],
        "meshes" => &top[name]["additionalProperties"],
        "instances" => &top[name]["items"],
        _ => &root["$defs"][name],
    }
}

/// Returns the schema of a key whose names have a table.
fn names_schema<'a>(root: &'a Json, name: &str) -> &'a Json {
    let (table, key) = table_and_key(name);
    &table_schema(root, table)["properties"][key]
}

/// Returns the rows of a table of keys: required keys in the order of the file, then the other keys.
fn key_rows(root: &Json, name: &str) -> Vec<String> {
    if let Some((_, keys)) = shared(name) {
        let keys = keys.iter().map(|key| table_and_key(key));
        return keys
            .map(|(table, key)| key_row(table_schema(root, table), key))
            .collect();
    }
    let schema = table_schema(root, name);
    let Some(properties) = schema["properties"].as_object() else {
        panic!("the schema has no table {name}");
    };
    let mut keys = required_keys(schema);
    let optional = properties.keys().map(String::as_str);
    keys.extend(optional.filter(|key| !required_keys(schema).contains(key)));
    keys.retain(|key| properties[*key].get("const").is_none()); // `type`
    let section = match name {
        "instances" => "shape",
        _ => name.split('-').next().unwrap_or(name),
    };
    let shared_rows = shared(section).map_or_else(Vec::new, |(shared_name, _)| key_rows(root, shared_name));
    let rows = keys.iter().map(|key| key_row(schema, key));
    rows.filter(|row| !shared_rows.contains(row)).collect()
}

/// Returns the required keys of a table. The keys of a camera are required unless it has a path.
fn required_keys(schema: &Json) -> Vec<&str> {
    let lists = [&schema["required"], &schema["anyOf"][0]["required"]];
    let keys = lists.into_iter().filter_map(Json::as_array).flatten();
    keys.filter_map(Json::as_str).collect()
}

fn key_row(schema: &Json, key: &str) -> String {
    let property = &schema["properties"][key];
    let (meaning, absent) = meaning(property);
    let default = match property.get("default") {
        _ if required_keys(schema).contains(&key) => "required".to_owned(),
        Some(value @ (Json::Number(_) | Json::Bool(_))) => to_toml(value),
        Some(value) => format!("`{}`", to_toml(value)),
        None => absent.unwrap_or_else(|| "none".to_owned()),
    };
    format!("| `{key}` | {} | {default} | {meaning} |", kind(property))
}

/// Returns the rows of a table of names.
fn name_rows(root: &Json, name: &str) -> Vec<String> {
    let schema = names_schema(root, name);
    let list = |keyword: &str| schema[keyword].as_array().cloned().unwrap_or_default();
    let pairs = list("enum").into_iter().zip(list("enumDescriptions"));
    let rows = pairs.map(|(name, about)| {
        let about = about.as_str().unwrap_or_default().trim_end_matches('.');
        format!("| `{name}` | {about} |")
    });
    rows.collect()
}

/// Splits the title of a schema into the label and the range.
fn title(schema: &Json) -> Option<(&str, &str)> {
    let title = schema.get("title")?.as_str()?;
    Some(title.split_once(TITLE_SEPARATOR).unwrap_or((title, "")))
}

/// Returns the meaning of a key, and the value if the key is absent. The schema appends the kind and the default to a
/// description; they have their own columns.
fn meaning(property: &Json) -> (String, Option<String>) {
    let mut text = property["description"].as_str().unwrap_or_default();
    if let Some(default) = property.get("default") {
        let suffix = format!(" Default: {}.", to_toml(default));
        text = text.strip_suffix(suffix.as_str()).unwrap_or(text);
    }
    let (label, range) = title(property).unwrap_or_default();
    let long = [label, range].into_iter().filter(|part| !part.is_empty());
    for addition in [long.collect::<Vec<_>>().join(", "), range.to_owned()] {
        let Some(first) = addition.get(..1) else { continue };
        let suffix = format!(" {}{}.", first.to_uppercase(), &addition[1..]);
        if let Some(rest) = text.strip_suffix(suffix.as_str()) {
            text = rest;
            break;
        }
    }
    let (text, absent) = match text.split_once("If absent, ") {
        Some((before, rest)) => {
            let (value, after) = rest.split_once(". ").unwrap_or((rest, ""));
            let text = format!("{before}{after}");
            (text, Some(value.trim_end_matches('.').to_owned()))
        }
        None => (text.to_owned(), None),
    };
    let text = match value_range(property) {
        Some(range) => text.replace(&format!(", {range}"), ""),
        None => text,
    };
    (text.trim().trim_end_matches('.').to_owned(), absent)
}

/// Returns the range of a key that accepts a number or a texture.
fn value_range(property: &Json) -> Option<&str> {
    let alternatives = property.get("anyOf")?.as_array()?;
    let [plain, texture] = alternatives.as_slice() else {
        return None;
    };
    texture["properties"].get("texture")?;
    property
        .get("title")
        .is_none()
        .then(|| title(plain).unwrap_or_default().1)
}

/// Returns the type and the range of a key.
fn kind(property: &Json) -> String {
    if value_range(property).is_some() {
        return "number or texture".to_owned();
    }
    if let Some((label, range)) = title(property) {
        let name = short_label(label);
        let is_usual = [
            ("length", "1e-9 to 1e9"),
            ("two lengths", "1e-9 to 1e9"),
            ("color", "0 to 1e6"),
        ]
        .iter()
        .any(|usual| *usual == (name.trim_end_matches(" or texture"), range));
        let is_implied = ["point", "direction", "three points", "four points"].contains(&name.as_str());
        let range = if is_usual || is_implied { "" } else { range };
        let parts = [name.as_str(), range].into_iter().filter(|part| !part.is_empty());
        return parts.collect::<Vec<_>>().join(", ");
    }
    let mut names = Vec::new();
    alternatives(property, &mut names);
    names.join(", or ")
}

/// Maximum number of names in a cell. Longer lists have their own tables.
const MAX_CHOICES: usize = 5;

/// Appends the type of a schema, or the types of its alternatives.
fn alternatives(schema: &Json, names: &mut Vec<String>) {
    let choices = schema.get("enum").and_then(Json::as_array);
    let nested = schema.get("anyOf").and_then(Json::as_array);
    let has = |path: &[&str]| path.iter().try_fold(schema, |value, key| value.get(key)).is_some();
    let name = match (schema["type"].as_str(), title(schema)) {
        (_, Some((label, _))) => match short_label(label) {
            label if label.is_empty() => "number".to_owned(),
            label => label,
        },
        _ if choices.is_some_and(|choices| choices.len() > MAX_CHOICES) => "name".to_owned(),
        _ if choices.is_some() => {
            let quoted = choices.into_iter().flatten().map(|choice| format!("`{choice}`"));
            quoted.collect::<Vec<_>>().join(", ")
        }
        (None, _) if nested.is_some() => {
            for inner in nested.into_iter().flatten() {
                alternatives(inner, names);
            }
            return;
        }
        (Some("boolean"), _) => "boolean".to_owned(),
        (Some("string"), _) if has(&["minLength"]) => "path".to_owned(),
        (Some("string"), _) => "name".to_owned(),
        (Some("array"), _) if has(&["items", "enum"]) => "a list of two".to_owned(),
        (Some("array"), _) => "list of tables".to_owned(),
        (Some("object"), _) if has(&["properties", "strength"]) => "normal map".to_owned(),
        (Some("object"), _) if has(&["properties", "texture"]) => "texture".to_owned(),
        (Some("object"), _) if has(&["additionalProperties", "type"]) => "table of names".to_owned(),
        (Some("object"), _) => "table".to_owned(),
        _ => panic!("a schema without a type: {schema}"),
    };
    names.push(name);
}

/// Returns the short name of a kind; the page defines these names.
fn short_label(label: &str) -> String {
    let (plain, texture) = match label.strip_suffix(", or a texture") {
        Some(plain) => (plain, " or texture"),
        None => (label, ""),
    };
    let name = match plain {
        "a point in scene units, three numbers" => "point",
        "a direction, three numbers that are not all 0" => "direction",
        "three points in scene units" => "three points",
        "four points in scene units" => "four points",
        "a length in scene units" | "in scene units" => "length",
        "two lengths in scene units" => "two lengths",
        "linear red, green and blue" => "color",
        "for red, green and blue" | "for red, green and blue, for each scene unit" => "three numbers",
        "three angles in degrees" => "three angles",
        "a whole number" => "integer",
        "a frame" => "number",
        "a number" => "index",
        "a metal's name" => "name",
        other => other.strip_prefix("in ").unwrap_or(other),
    };
    format!("{name}{texture}")
}

/// Returns the page with the tables of the schema between its markers, such as `<!--keys:image-->` and
/// `<!--end-->`.
fn with_tables(page: &str, root: &Json) -> String {
    let mut text = String::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        text += line;
        text += "\n";
        let marker = line.strip_prefix("<!--").and_then(|rest| rest.strip_suffix("-->"));
        let rows = match marker.and_then(|marker| marker.split_once(':')) {
            Some(("keys", name)) => {
                text += "| key | type | default | meaning |\n|---|---|---|---|\n";
                key_rows(root, name)
            }
            Some(("names", name)) => {
                text += "| name | meaning |\n|---|---|\n";
                name_rows(root, name)
            }
            _ => continue,
        };
        assert!(!rows.is_empty(), "{line}: the table has no rows");
        for row in rows {
            text += &row;
            text += "\n";
        }
        assert!(lines.any(|line| line == "<!--end-->"), "{line}: no end");
        text += "<!--end-->\n";
    }
    text
}

#[test]
fn the_page_has_the_tables_of_the_schema() {
    let path = Path::new(PAGE);
    let found = fs::read_to_string(path).unwrap();
    let expected = with_tables(&found, &generated());
    if std::env::var_os("WGRAY_TEST_RECORD").is_some_and(|value| value == "1") {
        return fs::write(path, expected).unwrap();
    }
    for (found, expected) in found.lines().zip(expected.lines()) {
        assert_eq!(found, expected, "WGRAY_TEST_RECORD=1 writes the tables");
    }
    assert_eq!(
        found.lines().count(),
        expected.lines().count(),
        "WGRAY_TEST_RECORD=1 writes the tables"
    );
}

#[test]
fn every_table_of_the_schema_has_a_marker() {
    let page = fs::read_to_string(PAGE).unwrap();
    let root = generated();
    let types = root["$defs"].as_object().unwrap().keys().map(String::as_str);
    // A type whose rows are all in the shared table has no table.
    let types = types.filter(|name| !key_rows(&root, name).is_empty());
    let sections = ["image", "render", "environment", "meshes", "instances"];
    let parts = ["path", "path-keys", "samples", "filter", "adaptive"];
    let shared_names = SHARED.map(|(name, _)| name);
    let names = types.chain(sections).chain(parts).chain(shared_names);
    let missing: Vec<&str> = names
        .filter(|name| !page.contains(&format!("\n<!--keys:{name}-->\n")))
        .collect();
    assert!(missing.is_empty(), "no table in the page: {missing:?}");
}

#[test]
fn a_changed_schema_changes_the_table() {
    let mut root = generated();
    let page = "<!--keys:image-->\n<!--end-->\n";
    let row = "| `width` | pixels, 1 to 65536 | required | Width |\n";
    assert!(!with_tables(page, &root).contains(row));
    root["properties"]["image"]["properties"]["width"]["description"] = json!("Width.");
    assert!(with_tables(page, &root).contains(row));
}
