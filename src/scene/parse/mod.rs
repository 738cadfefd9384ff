//! Parses scene files to a [`Description`], and finds the line of a key path.

#[cfg(feature = "dev")]
mod change;
mod parts;
mod syntax;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use self::parts::{Broken, Kind, LARGEST, Parts};
use super::Integrator;
use super::course;
use super::define::Defines;
use super::description::tables::{self, ReadError};
use super::description::tagged::Tagged;
use super::description::{
    CameraDescription, CameraKeyDescription, CameraPathDescription, Description, InstanceDescription, LightDescription,
    MaterialDescription, MeshFileDescription, ShapeDescription, TextureDescription,
};
use super::error::{At, KeyPath, Problem, SceneError, Segment, cut};
use super::limits::{BLADES, DEEPEST, MOST, UV_SETS};
use super::suggest;
use super::validate::depths;

#[cfg(feature = "dev")]
pub(crate) use change::{Pieces, Places};
pub(super) use syntax::{NOT_UTF8, encoding, syntax_error};

impl Description {
    /// Parses a scene file without validating its values. `origin` is the name of the file in messages; if it ends in `.json`, the text is
    /// JSON.
    ///
    /// # Errors
    ///
    /// Invalid TOML or JSON, unknown and missing keys, unknown types, and values of the wrong type.
    pub fn parse(text: &str, origin: &str) -> Result<Self, SceneError> {
        Description::parse_with(text, origin, &mut Defines::new(&[]))
    }

    /// Returns the description with the defined values.
    pub(super) fn defined(&self, defines: &mut Defines) -> Result<Description, Problem> {
        let mut file = Table::try_from(self).map_err(|error| Problem::new(error.to_string()))?;
        let put = defines.put(&[], &mut file, |_| false);
        put.and_then(|()| read_file(file))
            .map_err(|problem| problem.at("define"))
    }

    /// Parses a scene file with the defined values.
    pub(super) fn parse_with(text: &str, origin: &str, defines: &mut Defines) -> Result<Self, SceneError> {
        if course::is_course(Path::new(origin)) {
            return course::read(text, origin, defines);
        }
        let broken = |broken: Broken| syntax_error(text, origin, broken.at, &broken.message);
        let parts = Parts::of(text);
        if let Some(large) = parts.too_large() {
            return Err(broken(large));
        }
        let read = match read_parts(&parts, defines).map_err(broken)? {
            Some(read) => read,
            None if text.len() > LARGEST => match defines.left() {
                Some(key) => Err(defines.not_there(key)),
                None => return Err(broken(Broken::whole(text))),
            },
            None => {
                let mut file = toml::from_str(text).map_err(|error| broken(Broken::of(0, &error)))?;
                defines.restart();
                let put = defines.put(&[], &mut file, |_| false);
                put.and_then(|()| read_file(file))
            }
        };
        read.map_err(|problem| invalid(text, origin, problem, defines))
    }
}

/// Returns the error of an invalid value, of the text or of a define.
pub(super) fn invalid(text: &str, origin: &str, problem: Problem, defines: &Defines) -> SceneError {
    if defines.brought(&problem.key) {
        return SceneError::Override(problem.at("define"));
    }
    SceneError::Invalid {
        origin: origin.to_owned(),
        line: locate(text, &problem.key),
        problem,
    }
}

/// Returns the line, from 1, of the key at a path, or of the innermost table that exists.
fn locate(text: &str, path: &KeyPath) -> usize {
    let at = match text.len() > LARGEST {
        true => place_in_parts(&Parts::of(text), path),
        false => place_in(text, path),
    };
    line_number(text, at)
}

/// Returns the line, from 1, of the path of the camera.
pub(super) fn line_of_path(text: &str) -> usize {
    locate(text, &KeyPath(["camera", "path"].map(Segment::from).to_vec()))
}

/// Returns the byte offset of the key at a path, in a text that is too large to parse at once.
fn place_in_parts(parts: &Parts, path: &KeyPath) -> usize {
    match parts.find(path) {
        Some((part, path)) => part.place.start + place_in(parts.text(part), &path),
        None => {
            let rest = parts.rest();
            rest.place(place_in(&rest.text, path))
        }
    }
}

/// Returns the byte offset of the key at a path.
fn place_in(text: &str, path: &KeyPath) -> usize {
    let Ok(document) = DeTable::parse(text) else {
        return 0;
    };
    let mut at = 0;
    let mut value = &DeValue::Table(document.into_inner());
    for segment in &path.0 {
        let step = match (segment, value) {
            (Segment::Key(name), DeValue::Table(table)) => {
                let entry = table.iter().find(|(key, _)| key.get_ref() == name);
                entry.map(|(key, value)| (key.span(), value))
            }
            (Segment::Index(index), DeValue::Array(array)) => array.get(*index).map(|value| (value.span(), value)),
            _ => None,
        };
        let Some((span, inner)) = step else { break };
        at = span.start;
        value = inner.get_ref();
    }
    at
}

fn line_number(text: &str, at: usize) -> usize {
    let newlines = text.bytes().take(at).filter(|&byte| byte == b'\n');
    1 + newlines.count()
}

/// The sections of a file, not yet parsed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sections {
    image: Table,
    camera: Table,
    #[serde(default)]
    render: Table,
    environment: Option<Table>,
    #[serde(default)]
    textures: BTreeMap<String, Table>,
    #[serde(default)]
    materials: BTreeMap<String, Table>,
    #[serde(default)]
    lights: Vec<Table>,
    #[serde(default)]
    shapes: Vec<Table>,
    #[serde(default)]
    meshes: BTreeMap<String, Table>,
    #[serde(default)]
    instances: Vec<Table>,
}

fn read_file(file: Table) -> Result<Description, Problem> {
    let sections: Sections = read(file)?;
    Ok(Description {
        image: read(sections.image).at("image")?,
        camera: read_camera(sections.camera).at("camera")?,
        render: read(sections.render).at("render")?,
        environment: sections.environment.map(read).transpose().at("environment")?,
        textures: read_map(sections.textures, tagged).at("textures")?,
        materials: read_map(sections.materials, tagged).at("materials")?,
        lights: read_list(sections.lights, tagged).at("lights")?,
        shapes: read_list(sections.shapes, tagged).at("shapes")?,
        meshes: read_map(sections.meshes, read).at("meshes")?,
        instances: read_list(sections.instances, read).at("instances")?,
    })
}

/// Parses a camera. A missing value is taken from the first key of its path that has one.
fn read_camera(mut camera: Table) -> Result<CameraDescription, Problem> {
    if let Some(Value::Table(path)) = camera.get("path") {
        // First, so that an error in a key is reported there.
        let path: CameraPathDescription = read(path.clone()).at("path")?;
        let point = |point: DVec3| Value::from(point.to_array().to_vec());
        let first = |of: fn(&CameraKeyDescription) -> Option<DVec3>| path.keys.iter().find_map(of).map(point);
        let points = [
            ("position", first(|key| key.position)),
            ("look_at", first(|key| key.look_at)),
            ("up", first(|key| key.up)),
        ];
        let number = |of: fn(&CameraKeyDescription) -> Option<f64>| path.keys.iter().find_map(of).map(Value::from);
        let mut numbers = match camera.get("type").and_then(Value::as_str) {
            Some("orthographic") => vec![("height", number(|key| key.height))],
            Some("panorama") => vec![],
            _ => vec![
                ("fov", number(|key| key.fov)),
                ("focus_distance", number(|key| key.focus_distance)),
                ("aperture", number(|key| key.aperture)),
            ],
        };
        if camera.contains_key("f_number") {
            numbers.retain(|(name, _)| *name != "aperture");
        }
        for (name, value) in points.into_iter().chain(numbers) {
            if let (false, Some(value)) = (camera.contains_key(name), value) {
                camera.insert(name.to_owned(), value);
            }
        }
    }
    read_tagged(camera, Some(CameraDescription::DEFAULT))
}

/// The parts of one kind, or the first problem among them.
type Read<T> = Result<T, Problem>;

/// Parses a file part by part. Returns `None` if the parts depend on each other, so that the file must be parsed at once.
fn read_parts(parts: &Parts, defines: &mut Defines) -> Result<Option<Read<Description>>, Broken> {
    let rest = parts.read_rest();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut names = BTreeSet::new();
    let mut textures: Read<BTreeMap<String, TextureDescription>> = Ok(BTreeMap::new());
    let mut materials: Read<BTreeMap<String, MaterialDescription>> = Ok(BTreeMap::new());
    let mut lights: Read<Vec<LightDescription>> = Ok(Vec::new());
    let mut shapes: Read<Vec<ShapeDescription>> = Ok(Vec::new());
    let mut meshes: Read<BTreeMap<String, MeshFileDescription>> = Ok(BTreeMap::new());
    let mut instances: Read<Vec<InstanceDescription>> = Ok(Vec::new());
    for part in parts.parts.iter() {
        match &rest {
            // Errors are reported in the order of the text.
            Err(broken) if broken.at < part.place.start => break,
            Ok(rest) if rest.contains_key(part.kind.name()) => return Ok(None),
            _ => {}
        }
        let Some((name, mut table)) = parts.read(part)? else {
            return Ok(None);
        };
        let count = counts.entry(part.kind.name()).or_default();
        let step = name.as_deref().map_or(Segment::Index(*count), Segment::from);
        *count += 1;
        if let Err(problem) = defines.put(&[Segment::from(part.kind.name()), step], &mut table, |_| false) {
            return Ok(Some(Err(problem)));
        }
        if let Some(name) = &name
            && !names.insert((part.kind.name(), name.clone()))
        {
            return parts.twice(name, part).map_or(Ok(None), Err);
        }
        match (part.kind, name) {
            (Kind::Textures, Some(name)) => add_named(&mut textures, name, table, tagged),
            (Kind::Materials, Some(name)) => add_named(&mut materials, name, table, tagged),
            (Kind::Lights, None) => add(&mut lights, table, tagged),
            (Kind::Shapes, None) => add(&mut shapes, table, tagged),
            (Kind::Meshes, Some(name)) => add_named(&mut meshes, name, table, read),
            (Kind::Instances, None) => add(&mut instances, table, read),
            _ => return Ok(None),
        }
    }
    let has = |kind: Kind| parts.parts.iter().any(|part| part.kind == kind);
    let mut rest = rest?;
    let is_in_parts = |key: &str| Kind::ALL.into_iter().any(|kind| kind.name() == key && has(kind));
    if let Err(problem) = defines.put(&[], &mut rest, is_in_parts) {
        return Ok(Some(Err(problem)));
    }
    if defines.left().is_some() {
        return Ok(None); // a whole list, or a name or index that does not exist
    }
    let others = read_file(rest);
    let together = |mut all: Description| {
        // The parts and the rest have no kind in common.
        if has(Kind::Textures) {
            all.textures = textures.at("textures")?;
        }
        if has(Kind::Materials) {
            all.materials = materials.at("materials")?;
        }
        if has(Kind::Lights) {
            all.lights = lights.at("lights")?;
        }
        if has(Kind::Shapes) {
            all.shapes = shapes.at("shapes")?;
        }
        if has(Kind::Meshes) {
            all.meshes = meshes.at("meshes")?;
        }
        if has(Kind::Instances) {
            all.instances = instances.at("instances")?;
        }
        Ok(all)
    };
    Ok(Some(others.and_then(together)))
}

/// Adds a named part, unless there was a problem before.
fn add_named<T>(all: &mut Read<BTreeMap<String, T>>, name: String, table: Table, read: fn(Table) -> Read<T>) {
    let Ok(map) = all else { return };
    match read(table).at(name.as_str()) {
        Ok(value) => {
            map.insert(name, value);
        }
        Err(problem) => *all = Err(problem),
    }
}

fn add<T>(all: &mut Read<Vec<T>>, table: Table, read: fn(Table) -> Read<T>) {
    let Ok(list) = all else { return };
    match read(table).at(list.len()) {
        Ok(value) => list.push(value),
        Err(problem) => *all = Err(problem),
    }
}

fn read_map<T>(tables: BTreeMap<String, Table>, read: fn(Table) -> Read<T>) -> Read<BTreeMap<String, T>> {
    let read = |(name, table): (String, Table)| {
        let value = read(table).at(name.as_str());
        value.map(|value| (name, value))
    };
    tables.into_iter().map(read).collect()
}

fn read_list<T>(tables: Vec<Table>, read: fn(Table) -> Read<T>) -> Read<Vec<T>> {
    let tables = tables.into_iter().enumerate();
    tables.map(|(i, table)| read(table).at(i)).collect()
}

/// Parses a table with the key `type`.
fn tagged<T: Tagged>(table: Table) -> Read<T> {
    read_tagged(table, None)
}

fn read<T: DeserializeOwned>(table: Table) -> Result<T, Problem> {
    let is_said = |integrator: &Integrator| table.get("integrator").and_then(Value::as_str) == Some(integrator.name());
    let said = Integrator::ALL.into_iter().find(is_said);
    read_for(table, said.unwrap_or(Integrator::Phong))
}

/// Parses a table. The ranges in messages depend on the integrator.
pub(super) fn read_for<T: DeserializeOwned>(table: Table, integrator: Integrator) -> Result<T, Problem> {
    // The copy is for the message, because parsing consumes the values.
    tables::read(table.clone()).map_err(|error| {
        let error = with_names(error, &table, |table| tables::read::<T>(table).err());
        explain(error, table, false, integrator)
    })
}

fn read_tagged<T: Tagged>(mut table: Table, default: Option<&str>) -> Result<T, Problem> {
    let tag = match (table.remove("type"), default) {
        (Some(tag), _) => tag,
        (None, Some(default)) => Value::from(default),
        (None, None) => {
            let message = format!("is missing; it must be one of {}", list(T::TYPES));
            return Err(Problem::predicate(message).at("type"));
        }
    };
    let body = table.clone();
    match tag.as_str().and_then(|tag| T::read(tag, body)) {
        Some(result) => result.map_err(|error| {
            let read = |body| tag.as_str().and_then(|tag| T::read(tag, body)?.err());
            let error = with_names(error, &table, read);
            explain(error, table, true, Integrator::Phong)
        }),
        None => {
            let hint = tag.as_str().map(|tag| suggest::hint(tag, T::TYPES.iter().copied()));
            let hint = hint.unwrap_or_default();
            let message = format!("{} must be one of {}{hint}", show(&tag), list(T::TYPES));
            Err(Problem::new(message).at("type"))
        }
    }
}

/// Maximum number of keys in a message, which no table exceeds.
const MAX_KEYS: usize = 64;

/// Formats names as `"a", "b", "c"`, up to a limit.
pub(super) fn list<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    listed(names, 24)
}

/// Formats up to `most` names.
fn listed<S: AsRef<str>>(names: impl IntoIterator<Item = S>, most: usize) -> String {
    let mut text = String::new();
    let mut names = names.into_iter();
    for name in names.by_ref().take(most) {
        let comma = if text.is_empty() { "" } else { ", " };
        // Writing to a String cannot fail.
        let _ = write!(text, "{comma}{:?}", cut(name.as_ref()));
    }
    match names.count() {
        0 => text,
        more => format!("{text} and {more} more"),
    }
}

/// Formats a value as TOML on one line, truncated if it is long.
fn show(value: &Value) -> String {
    cut(&value.to_string().replace('\n', " ")).into_owned()
}

/// Returns an error that lists the allowed names. For values other than strings serde does not list them, so the value is replaced by a
/// string and parsed again.
fn with_names(error: ReadError, table: &Table, read: impl Fn(Table) -> Option<ReadError>) -> ReadError {
    if !error.inner().message().ends_with(NAMES_EXPECTED) {
        return error;
    }
    let mut with_text = Value::Table(table.clone());
    let mut value = Some(&mut with_text);
    for segment in segments(error.path()) {
        value = match segment {
            Segment::Key(key) => value.and_then(|value| value.get_mut(key)),
            Segment::Index(index) => value.and_then(|value| value.get_mut(index)),
        };
    }
    if let Some(value) = value {
        *value = Value::from("?");
    }
    let told = match with_text {
        Value::Table(table) => read(table),
        _ => None,
    };
    let is_same = |told: &ReadError| told.path().to_string() == error.path().to_string();
    told.filter(is_same).unwrap_or(error)
}

/// End of serde's message about a value that must be a string of an enum.
const NAMES_EXPECTED: &str = ", expected string only";

/// Converts serde's error about `table`, whose key `type` was removed if it is `tagged`.
fn explain(error: ReadError, table: Table, tagged: bool, integrator: Integrator) -> Problem {
    let mut path = segments(error.path());
    let mut value = Some(&Value::Table(table));
    for segment in &path {
        value = match segment {
            Segment::Key(key) => value.and_then(|value| value.get(key)),
            Segment::Index(index) => value.and_then(|value| value.get(*index)),
        };
    }
    let message = error.inner().message();
    // serde has the name and the rule only as text.
    let quoted = |text: &str| {
        text.split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let message = if message.starts_with("unknown field") {
        // The first name is the key, which is in the path already.
        let names = quoted(message).into_iter().skip(1);
        let tag = (tagged && path.len() == 1).then(|| "type".to_owned());
        let names: Vec<String> = tag.into_iter().chain(names).collect();
        let hint = match path.last() {
            Some(Segment::Key(wrong)) => suggest::hint(wrong, names.iter().map(String::as_str)),
            _ => String::new(),
        };
        match hint.is_empty() {
            true => format!("unknown key; expected one of {}", listed(names, MAX_KEYS)),
            false => format!("unknown key{hint}"),
        }
    } else if message.starts_with("missing field") {
        let name = quoted(message).into_iter().next().unwrap_or_default();
        if path.is_empty() && ["image", "camera"].contains(&name.as_str()) {
            return Problem::new(format!("the scene has no [{name}] table"));
        }
        path.push(Segment::Key(name));
        let mut problem = Problem::predicate("is missing");
        problem.key = KeyPath(path);
        return problem;
    } else if let (Some((_, expected)), Some(value)) = (message.rsplit_once(", expected "), value) {
        let rule = match expected {
            "f64" => "a number",
            "a boolean" => "true or false",
            "u32" => &whole(path.last(), integrator),
            "a sequence of 3 f64 values" => "a list of 3 numbers",
            "an array of length 2" => "a list of 2 numbers",
            "an array of length 3" => "a list of 3 points",
            "an array of length 4"
                if ["matrix", "factor"]
                    .iter()
                    .any(|key| path.contains(&Segment::from(*key))) =>
            {
                "a list of 4 numbers"
            }
            "an array of length 4" => "a list of 4 points",
            "fewer elements in array" => "a shorter list",
            "a map" => "a table",
            table if table.starts_with("struct ") => "a table",
            "a sequence" => "a list of tables, each under its own [[header]]",
            other => &other.replace('`', "\""),
        };
        format!("{} must be {rule}", show(value))
    } else if let (true, Some(value)) = (message.starts_with("must be"), value) {
        format!("{} {message}", show(value))
    } else {
        message.to_owned()
    };
    Problem {
        key: KeyPath(path),
        ..Problem::new(message)
    }
}

/// Converts the segments of serde's path.
pub(super) fn segments(path: &serde_path_to_error::Path) -> Vec<Segment> {
    use serde_path_to_error::Segment as Step;
    let steps = path.iter().filter_map(|segment| match segment {
        Step::Map { key } => Some(Segment::Key(key.clone())),
        Step::Seq { index } => Some(Segment::Index(*index)),
        Step::Enum { .. } | Step::Unknown => None,
    });
    steps.collect()
}

/// Returns the rule of an integer key. Limits that depend on other keys are checked later.
fn whole(key: Option<&Segment>, integrator: Integrator) -> String {
    if key == Some(&Segment::from("blades")) {
        return format!("0 or a whole number from {} to {}", BLADES.0, BLADES.1);
    }
    let (low, high) = match key {
        Some(Segment::Key(key)) if key == "seed" => (0, u32::MAX),
        Some(Segment::Key(key)) if key == "uv_set" => (0, UV_SETS - 1),
        Some(Segment::Key(key)) if key == "max_depth" => depths(integrator),
        Some(Segment::Key(key)) if key == "rr_depth" => (0, DEEPEST),
        _ => (1, MOST),
    };
    format!("a whole number from {low} to {high}")
}

#[cfg(test)]
mod tests;
