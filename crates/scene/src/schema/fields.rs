//! Editable values of an object in a scene file, with the kind, unit, range and default from the schema.

use std::sync::OnceLock;

use serde::Serialize;
use serde_json::{Value as Json, json};
use toml::{Table, Value};

use super::range::{Slider, gap_of, range_of, slider};
use super::{TITLE_SEPARATOR, definition, file_schema};
use crate::CameraDescription;
use crate::key_path::{KeyPath, Segment, cut};

/// A value that is displayed, and can be edited unless `fixed` is set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Field {
    /// Path from the top of the file.
    pub path: String,
    /// Path relative to the object.
    pub name: String,
    /// Kind of the value.
    pub kind: Kind,
    /// Number of elements of a list; otherwise 1.
    pub length: usize,
    /// The value in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<Json>,
    /// The default of an absent value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<Json>,
    /// Unit of the numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// Minimum and maximum of the numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<(f64, f64)>,
    /// Open interval of invalid values within `range`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<(f64, f64)>,
    /// True if the value must be a square number.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub squares: bool,
    /// A slider for the value, or for the largest component of an emitter color.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slider: Option<Slider>,
    /// The allowed names, truncated if there are many.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<String>,
    /// Description of the key.
    pub about: String,
    /// True if the key must not be removed.
    pub required: bool,
    /// The reason why the value cannot be edited, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fixed: Option<String>,
}

/// The kind of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Any number.
    Number,
    /// An integer.
    Whole,
    /// Linear red, green and blue.
    Color,
    /// A list of numbers.
    Vector,
    /// One of several names.
    Choice,
    /// True or false.
    Switch,
    /// Any text.
    Text,
}

/// The names that keys of a scene may refer to.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// `[materials.NAME]`
    pub materials: Vec<String>,
    /// `[textures.NAME]`
    pub textures: Vec<String>,
    /// `[meshes.NAME]`
    pub meshes: Vec<String>,
}

/// Maximum number of names in [`Field::choices`].
const MAX_CHOICES: usize = 200;
/// Maximum number of elements of a list of lists or tables for which fields are created.
const MAX_ELEMENTS: usize = 32;

impl Names {
    /// Returns the section that contains the allowed names of a key.
    pub fn section(path: &KeyPath) -> Option<&'static str> {
        let key = |segment: &Segment| match segment {
            Segment::Key(key) => Some(key.clone()),
            Segment::Index(_) => None,
        };
        let [.., parent, last] = path.0.as_slice() else {
            return None;
        };
        // In a table `materials` of a shape, every value is the name of a material.
        if path.0.len() > 2 && key(parent).as_deref() == Some("materials") {
            return Some("materials");
        }
        match key(last).as_deref() {
            Some("material") => Some("materials"),
            Some("texture") => Some("textures"),
            Some("mesh") => Some("meshes"),
            _ => None,
        }
    }

    /// Returns the allowed names of a key.
    fn allowed(&self, path: &[Segment]) -> Option<&[String]> {
        match Names::section(&KeyPath(path.to_vec()))? {
            "materials" => Some(&self.materials),
            "textures" => Some(&self.textures),
            _ => Some(&self.meshes),
        }
    }
}

/// Returns the fields of an object, such as `[shapes, 3]` or `[camera]`, whose value is `table`. An object without a
/// schema has no fields.
pub fn fields(object: &KeyPath, table: &Value, names: &Names) -> Vec<Field> {
    static SCHEMA: OnceLock<Json> = OnceLock::new();
    let root = SCHEMA.get_or_init(file_schema);
    let Some(schema) = schema_of(root, object, table) else {
        return Vec::new();
    };
    let mut list = FieldList {
        names,
        object_len: object.0.len(),
        fields: Vec::new(),
    };
    let mut path = object.0.clone();
    list.add_value(
        schema,
        &mut path,
        &FieldContext {
            value: Some(table),
            default: None,
            required: true,
            about: "",
        },
    );
    list.fields
}

/// Returns the schema of an object, according to its `type`.
fn schema_of<'a>(root: &'a Json, object: &KeyPath, table: &Value) -> Option<&'a Json> {
    let Segment::Key(section) = object.0.first()? else {
        return None;
    };
    let section_schema = root.get("properties")?.get(section)?;
    let schema = match object.0.get(1) {
        None => section_schema,
        Some(Segment::Index(_)) => section_schema.get("items")?,
        Some(Segment::Key(_)) => section_schema.get("additionalProperties")?,
    };
    if schema.get("allOf").is_none() {
        return Some(schema);
    }
    let tag = match table.get("type") {
        Some(tag) => tag.as_str()?,
        None => CameraDescription::DEFAULT,
    };
    root.get("$defs")?.get(definition(section.trim_end_matches('s'), tag))
}

struct FieldContext<'a> {
    value: Option<&'a Value>,
    default: Option<&'a Json>,
    required: bool,
    about: &'a str,
}

struct FieldList<'a> {
    names: &'a Names,
    /// Length of the object's path.
    object_len: usize,
    fields: Vec<Field>,
}

impl FieldList<'_> {
    fn add_value(&mut self, schema: &Json, path: &mut Vec<Segment>, context: &FieldContext) {
        let mut branches = Vec::new();
        alternatives(schema, &mut branches);
        let Some(chosen) = choose(&branches, context) else {
            return;
        };
        let about = match schema.get("description").and_then(Json::as_str) {
            Some(description) => description,
            None => context.about,
        };
        let context = FieldContext { about, ..*context };
        match chosen.get("type").and_then(Json::as_str) {
            Some("object") => self.add_table(chosen, path, &context),
            Some("array") => self.add_list(chosen, path, &context),
            Some("number") => self.add_field(Kind::Number, chosen, path, &context),
            Some("integer") => self.add_field(Kind::Whole, chosen, path, &context),
            Some("boolean") => self.add_field(Kind::Switch, chosen, path, &context),
            Some("string") => self.add_field(Kind::Text, chosen, path, &context),
            _ => {}
        }
        // A value that may also be arbitrary text cannot be edited.
        let is_free_text =
            |branch: &&Json| branch.get("type") == Some(&json!("string")) && branch.get("enum").is_none();
        if branches.len() > 1
            && branches.iter().any(is_free_text)
            && let Some(field) = self.fields.last_mut()
            && field.path == KeyPath(path.clone()).exact()
        {
            field.fixed.get_or_insert_with(|| FREE_TEXT.to_owned());
        }
    }

    fn add_table(&mut self, schema: &Json, path: &mut Vec<Segment>, context: &FieldContext) {
        let table = context.value.and_then(Value::as_table);
        let required = required_keys(schema, table);
        for (key, key_schema) in schema.get("properties").and_then(Json::as_object).into_iter().flatten() {
            if key_schema.get("const").is_some() {
                continue; // `type`
            }
            // Setting a key of a missing table creates the table, so no other key may be required.
            if table.is_none() && required.iter().any(|name| name != key) {
                continue;
            }
            let default = match (key_schema.get("default"), context.default) {
                (_, Some(table_default)) if table.is_none() => table_default.get(key).or(key_schema.get("default")),
                (key_default, _) => key_default,
            };
            path.push(Segment::from(key.as_str()));
            let context = FieldContext {
                value: table.and_then(|table| table.get(key)),
                default,
                required: table.is_some() && required.contains(&key.as_str()),
                about: "",
            };
            self.add_value(key_schema, path, &context);
            path.pop();
        }
        if let Some(key_schema) = schema
            .get("additionalProperties")
            .filter(|key_schema| key_schema.is_object())
        {
            for (key, value) in table.into_iter().flatten().take(MAX_ELEMENTS) {
                path.push(Segment::from(key.as_str()));
                let context = FieldContext {
                    value: Some(value),
                    default: None,
                    required: false,
                    about: context.about,
                };
                self.add_value(key_schema, path, &context);
                path.pop();
            }
        }
    }

    fn add_list(&mut self, schema: &Json, path: &mut Vec<Segment>, context: &FieldContext) {
        let Some(items) = schema.get("items") else { return };
        if let Some("number" | "integer") = items.get("type").and_then(Json::as_str) {
            let is_color = label_and_range(schema).0.starts_with(COLOR_LABEL_PREFIX);
            let kind = if is_color { Kind::Color } else { Kind::Vector };
            return self.add_field(kind, schema, path, context);
        }
        let elements = context.value.and_then(Value::as_array);
        for (i, value) in elements.into_iter().flatten().enumerate().take(MAX_ELEMENTS) {
            path.push(Segment::from(i));
            let about = context.about;
            self.add_value(
                items,
                path,
                &FieldContext {
                    value: Some(value),
                    default: None,
                    required: true,
                    about,
                },
            );
            path.pop();
        }
    }

    fn add_field(&mut self, kind: Kind, schema: &Json, path: &[Segment], context: &FieldContext) {
        let key = KeyPath(path.to_vec());
        let numbers = schema.get("items").unwrap_or(schema);
        let value = context.value.map(json_of);
        let length = match value.as_ref().or(context.default).and_then(Json::as_array) {
            Some(list) => list.len(),
            None => schema.get("minItems").and_then(Json::as_u64).unwrap_or(1) as usize,
        };
        let choices = match schema.get("enum").and_then(Json::as_array) {
            Some(names) => Some(
                names
                    .iter()
                    .filter_map(Json::as_str)
                    .map(str::to_owned)
                    .collect::<Vec<_>>(),
            ),
            None if kind == Kind::Text => self
                .names
                .allowed(path)
                .map(|names| names.iter().take(MAX_CHOICES).cloned().collect()),
            None => None,
        };
        let is_choice = choices.is_some();
        if value.is_none() && choices.as_ref().is_some_and(Vec::is_empty) {
            return; // no name exists to which the key could refer
        }
        let kind = if is_choice { Kind::Choice } else { kind };
        let mut choices = choices.unwrap_or_default();
        if let (true, Some(Json::String(name))) = (is_choice, &value)
            && !choices.contains(name)
        {
            choices.insert(0, name.clone());
        }
        let unit = unit_of(schema);
        let is_number = matches!(kind, Kind::Number | Kind::Whole | Kind::Color | Kind::Vector);
        let range = is_number.then(|| range_of(numbers)).flatten();
        let gap = is_number.then(|| gap_of(numbers)).flatten();
        let current = value.as_ref().or(context.default);
        let slider = match kind {
            Kind::Number | Kind::Whole => slider(numbers, kind == Kind::Whole, unit, current.and_then(Json::as_f64)),
            Kind::Color if is_emitter_color(path) => {
                let list = current.and_then(Json::as_array).into_iter().flatten();
                slider(numbers, false, unit, list.filter_map(Json::as_f64).reduce(f64::max))
            }
            _ => None,
        };
        self.fields.push(Field {
            path: key.exact(),
            name: KeyPath(path[self.object_len..].to_vec()).exact(),
            kind,
            length,
            value,
            default: context.default.cloned(),
            unit,
            range,
            gap,
            squares: false,
            slider,
            choices,
            about: context.about.to_owned(),
            required: context.required,
            fixed: (kind == Kind::Text).then(|| FREE_TEXT.to_owned()),
        });
    }
}

/// Returns the keys that must not be removed from a table: the keys that the schema requires, and the keys that all
/// satisfied alternatives of `anyOf` require.
fn required_keys<'a>(schema: &'a Json, table: Option<&Table>) -> Vec<&'a str> {
    let keys_of = |schema: &'a Json| -> Vec<&'a str> {
        let list = schema.get("required").and_then(Json::as_array).into_iter().flatten();
        list.filter_map(Json::as_str).collect()
    };
    let mut required = keys_of(schema);
    let alternatives = schema
        .get("anyOf")
        .and_then(Json::as_array)
        .into_iter()
        .flatten()
        .map(keys_of);
    let mut satisfied = alternatives.filter(|keys| {
        keys.iter()
            .all(|key| table.is_some_and(|table| table.contains_key(*key)))
    });
    if let Some(mut common) = satisfied.next() {
        satisfied.for_each(|keys| common.retain(|key| keys.contains(key)));
        required.extend(common);
    }
    required
}

/// The reason why text cannot be edited: the text may be a file name.
const FREE_TEXT: &str = "names and files can only be changed in the scene file";

impl Field {
    /// Converts an edited value to TOML.
    ///
    /// # Errors
    ///
    /// The value has the wrong kind. Ranges are validated together with the scene.
    pub fn value_of(&self, edited: &Json, names: &Names) -> Result<Value, String> {
        if let Some(reason) = &self.fixed {
            return Err(reason.clone());
        }
        let parse_number = |edited: &Json| edited.as_f64().filter(|x| x.is_finite()).map(Value::from);
        let converted = match self.kind {
            Kind::Number => parse_number(edited).ok_or("a number".to_owned()),
            Kind::Whole => {
                let integer = edited.as_i64().or(edited
                    .as_f64()
                    .filter(|x| x.fract() == 0.0 && x.abs() < 1e15)
                    .map(|x| x as i64));
                integer.map(Value::from).ok_or("a whole number".to_owned())
            }
            Kind::Color | Kind::Vector => {
                let list = edited.as_array().filter(|list| list.len() == self.length);
                let list = list.and_then(|list| list.iter().map(parse_number).collect::<Option<Vec<Value>>>());
                list.map(Value::from)
                    .ok_or(format!("a list of {} numbers", self.length))
            }
            Kind::Switch => edited.as_bool().map(Value::from).ok_or("true or false".to_owned()),
            Kind::Choice | Kind::Text => {
                let path = self.path.parse::<KeyPath>().map_err(|problem| problem.to_string())?;
                let is_known = |text: &&str| {
                    let is_name = names
                        .allowed(&path.0)
                        .is_some_and(|names| names.iter().any(|name| name == text));
                    is_name || self.choices.iter().any(|choice| choice == text)
                };
                let text = edited.as_str().filter(is_known);
                text.map(Value::from).ok_or("one of the allowed names".to_owned())
            }
        };
        converted.map_err(|rule| format!("{} must be {rule}", cut(&edited.to_string())))
    }
}

/// Appends the schemas of nested `anyOf` lists, or the schema if it has no such list.
fn alternatives<'a>(schema: &'a Json, found: &mut Vec<&'a Json>) {
    match (schema.get("type"), schema.get("anyOf").and_then(Json::as_array)) {
        (None, Some(all)) => all.iter().for_each(|alternative| alternatives(alternative, found)),
        _ => found.push(schema),
    }
}

/// Returns the alternative that matches the value or its default; otherwise, the first alternative.
fn choose<'a>(branches: &[&'a Json], context: &FieldContext) -> Option<&'a Json> {
    let has_type = |branch: &Json, names: &[&str]| {
        let name = branch.get("type").and_then(Json::as_str);
        name.is_some_and(|name| names.contains(&name))
    };
    let types: &[&str] = match (context.value, context.default) {
        (Some(Value::Table(_)), _) => &["object"],
        (Some(Value::Array(_)), _) => &["array"],
        (Some(Value::Integer(_)), _) => &["number", "integer"],
        (Some(Value::Float(_)), _) => &["number"],
        (Some(Value::String(_)), _) => &["string"],
        (Some(Value::Boolean(_)), _) => &["boolean"],
        (Some(Value::Datetime(_)), _) => return None,
        (None, Some(Json::Array(_))) => &["array"],
        (None, Some(Json::Number(_))) => &["number", "integer"],
        (None, Some(Json::String(_))) => &["string"],
        (None, Some(Json::Bool(_))) => &["boolean"],
        (None, _) => return branches.first().copied(),
    };
    branches.iter().find(|branch| has_type(branch, types)).copied()
}

/// Prefix of the labels of colors in the schema.
const COLOR_LABEL_PREFIX: &str = "linear red";

/// Splits the title of a schema into a label and a range.
fn label_and_range(schema: &Json) -> (&str, &str) {
    let title = schema.get("title").and_then(Json::as_str).unwrap_or_default();
    title.split_once(TITLE_SEPARATOR).unwrap_or((title, ""))
}

fn unit_of(schema: &Json) -> Option<&'static str> {
    let (label, _) = label_and_range(schema);
    let units = [
        ("degrees", "°"),
        ("pixels", "px"),
        ("stops", "stops"),
        ("seconds", "s"),
        ("linear", "linear"),
        ("for each scene unit", "per unit"),
        ("scene units", "units"),
    ];
    units
        .into_iter()
        .find(|(word, _)| label.contains(word))
        .map(|(_, unit)| unit)
}

/// Returns true for colors of emitters, whose components may exceed 1.
fn is_emitter_color(path: &[Segment]) -> bool {
    let is_key_in = |segment: Option<&Segment>, names: &[&str]| match segment {
        Some(Segment::Key(key)) => names.contains(&key.as_str()),
        _ => false,
    };
    is_key_in(path.first(), &["lights", "environment", "render"]) || is_key_in(path.last(), &["emission"])
}

fn json_of(value: &Value) -> Json {
    match value {
        Value::String(text) => json!(text),
        Value::Integer(x) => json!(x),
        Value::Float(x) => json!(x),
        Value::Boolean(x) => json!(x),
        Value::Datetime(time) => json!(time.to_string()),
        Value::Array(list) => list.iter().map(json_of).collect(),
        Value::Table(table) => {
            let pairs = table.iter().map(|(key, value)| (key.clone(), json_of(value)));
            Json::Object(pairs.collect())
        }
    }
}
