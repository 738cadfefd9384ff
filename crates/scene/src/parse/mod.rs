//! Parses scene files to a [`Description`], and finds the line of a key path.

mod change;
mod parts;
mod syntax;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use self::parts::{Broken, Kind, LARGEST, Parts};
use super::Integrator;
use super::define::Defines;
use super::description::tables::{self, ReadError};
use super::description::tagged::Tagged;
use super::description::{
    CameraDescription, CameraKeyDescription, CameraPathDescription, Description, ImageDescription, InstanceDescription,
    LightDescription, MaterialDescription, MeshFileDescription, PerspectiveDescription, RenderDescription,
    ShapeDescription, TextureDescription,
};
use super::error::SceneError;
use super::key_path::{KeyPath, Segment, cut, list, listed};
use super::limits::{BLADES, DEEPEST, MOST, UV_SETS};
use super::problem::{At, Collector, Problem, Problems, both};
use super::suggest;

pub use change::{Pieces, Places};
pub use syntax::{NOT_UTF8, encoding, syntax_error};

impl Description {
    /// Returns the description with the defined values.
    pub(crate) fn defined(&self, defines: &mut Defines) -> Result<Description, Problem> {
        let mut file = Table::try_from(self).map_err(|error| Problem::new(error.to_string()))?;
        defines.put(&[], &mut file, |_| false).at("define")?;
        read_file(file).map_err(|problems| problems.first.at("define"))
    }

    /// Parses a scene file in TOML with the defined values.
    pub(crate) fn parse_toml(text: &str, origin: &str, defines: &mut Defines) -> Result<Self, SceneError> {
        let broken = |broken: Broken| broken.into_error(text, origin);
        let parts = Parts::of(text);
        if let Some(large) = parts.too_large() {
            return Err(broken(large));
        }
        let read = match read_parts(&parts, defines).map_err(broken)? {
            Some(read) => read,
            None if text.len() > LARGEST => match defines.left() {
                Some(key) => Err(defines.not_there(key).into()),
                None => return Err(broken(Broken::whole(text))),
            },
            None => {
                let mut file = toml::from_str(text).map_err(|error| broken(Broken::of(0, &error)))?;
                defines.restart();
                let put = defines.put(&[], &mut file, |_| false);
                put.map_err(Problems::from).and_then(|()| read_file(file))
            }
        };
        read.map_err(|problems| invalid(text, origin, problems, defines))
    }
}

/// Returns true if a scene of this name is in JSON.
pub fn is_course(name: &Path) -> bool {
    let extension = name.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}

/// Returns the error of invalid values, of the text or of a define.
pub fn invalid(text: &str, origin: &str, problems: Problems, defines: &Defines) -> SceneError {
    if let Some(error) = problems.of_define(defines) {
        return error;
    }
    let keys = Keys::of(text);
    let invalid = |at: usize, problem: Problem| SceneError::Invalid {
        origin: origin.to_owned(),
        line: line_number(text, at),
        problem,
    };
    problems.into_error(|problem| keys.place(&problem.key), invalid)
}

/// Returns the line, from 1, of the path of the camera.
pub fn line_of_path(text: &str) -> usize {
    let path = KeyPath(["camera", "path"].map(Segment::from).to_vec());
    line_number(text, Keys::of(text).place(&path))
}

/// The locations of the keys of a text.
enum Keys<'a> {
    Whole(DeValue<'a>),
    /// The parts of a text that is too large to parse at once.
    Parts(Parts<'a>),
}

impl<'a> Keys<'a> {
    fn of(text: &'a str) -> Keys<'a> {
        match text.len() > LARGEST {
            true => Keys::Parts(Parts::of(text)),
            false => Keys::Whole(document(text)),
        }
    }

    /// Returns the byte offset of the key at a path, or of the innermost table that exists.
    fn place(&self, path: &KeyPath) -> usize {
        let parts = match self {
            Keys::Whole(document) => return place_in(document, path),
            Keys::Parts(parts) => parts,
        };
        match parts.find(path) {
            Some((part, path)) => part.place.start + place_in(&document(parts.text(part)), &path),
            None => {
                let rest = parts.rest();
                rest.place(place_in(&document(&rest.text), path))
            }
        }
    }
}

/// Returns a text with the locations of its keys; an empty table if it cannot be parsed.
fn document(text: &str) -> DeValue<'_> {
    DeValue::Table(
        DeTable::parse(text)
            .map(|document| document.into_inner())
            .unwrap_or_default(),
    )
}

/// Returns the byte offset of the key at a path.
fn place_in(document: &DeValue, path: &KeyPath) -> usize {
    let mut at = 0;
    let mut value = document;
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

fn read_file(file: Table) -> Result<Description, Problems> {
    let (sections, outside) = read_sections(file)?;
    let view = both(
        read(sections.image).at("image"),
        read_camera(sections.camera).at("camera"),
    );
    let settings = both(
        read(sections.render).at("render"),
        sections.environment.map(read).transpose().at("environment"),
    );
    let appearance = both(
        read_map(sections.textures, tagged).at("textures"),
        read_map(sections.materials, tagged).at("materials"),
    );
    let objects = both(
        read_list(sections.lights, tagged).at("lights"),
        read_list(sections.shapes, tagged).at("shapes"),
    );
    let meshes = both(
        read_map(sections.meshes, read).at("meshes"),
        read_list(sections.instances, read).at("instances"),
    );
    let sections = both(both(view, settings), both(appearance, both(objects, meshes)));
    let (((view, settings), (appearance, (objects, meshes))), ()) = both(sections, outside)?;
    let ((image, camera), (render, environment)) = (view, settings);
    let ((textures, materials), (lights, shapes), (meshes, instances)) = (appearance, objects, meshes);
    Ok(Description {
        image,
        camera,
        render,
        environment,
        textures,
        materials,
        lights,
        shapes,
        meshes,
        instances,
    })
}

/// Returns the sections of a file, and the problems of its other keys.
fn read_sections(file: Table) -> Result<(Sections, Result<(), Problems>), Problems> {
    let problems = match read(file.clone()) {
        Ok(sections) => return Ok((sections, Ok(()))),
        Err(problems) => problems.map(with_section),
    };
    let mut rest = file;
    for problem in problems.iter() {
        remove(&mut rest, &problem.key.0[..problem.key.0.len().min(1)]);
    }
    match read(rest) {
        Ok(sections) => Ok((sections, Err(problems))),
        Err(_) => Err(problems),
    }
}

/// Adds the name of the section to the problem of a key outside of sections.
fn with_section(problem: Problem) -> Problem {
    let [Segment::Key(key)] = problem.key.0.as_slice() else {
        return problem;
    };
    // Names of options, and of other renderers.
    let name = match key.as_str() {
        "spp" | "samples" => "pixel_samples",
        "bounces" | "depth" => "max_depth",
        name => name,
    };
    let sections = [
        ("render", has_key::<RenderDescription>(name)),
        ("camera", has_key::<PerspectiveDescription>(name)),
        ("image", has_key::<ImageDescription>(name)),
    ];
    let section = sections.iter().find(|(_, has_key)| *has_key);
    match section.filter(|_| problem.is_unknown_key) {
        Some((section, _)) => Problem {
            message: format!("unknown key; did you mean {section}.{name}?"),
            ..problem
        },
        None => problem,
    }
}

fn has_key<T: DeserializeOwned>(name: &str) -> bool {
    let table = Table::from_iter([(name.to_owned(), Value::from(0))]);
    // An unknown key is reported before a missing one and a wrong type.
    let error = tables::read::<T>(table).err();
    !error.is_some_and(|error| error.inner().message().starts_with("unknown field"))
}

/// Parses a camera. A missing value is taken from the first key of its path that has one.
fn read_camera(mut camera: Table) -> Read<CameraDescription> {
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

type Read<T> = Result<T, Problems>;

/// Parses a file part by part. Returns `None` if the parts depend on each other, so that the file must be parsed at once.
fn read_parts(parts: &Parts, defines: &mut Defines) -> Result<Option<Result<Description, Problems>>, Broken> {
    let rest = parts.read_rest();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut names = BTreeSet::new();
    let mut found = Collector::default();
    let mut textures: BTreeMap<String, TextureDescription> = BTreeMap::new();
    let mut materials: BTreeMap<String, MaterialDescription> = BTreeMap::new();
    let mut lights: Vec<LightDescription> = Vec::new();
    let mut shapes: Vec<ShapeDescription> = Vec::new();
    let mut meshes: BTreeMap<String, MeshFileDescription> = BTreeMap::new();
    let mut instances: Vec<InstanceDescription> = Vec::new();
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
        let path = [Segment::from(part.kind.name()), step];
        if let Err(problem) = defines.put(&path, &mut table, |_| false) {
            return Ok(Some(Err(problem.into())));
        }
        if let Some(name) = &name
            && !names.insert((part.kind.name(), name.clone()))
        {
            return parts.twice(name, part).map_or(Ok(None), Err);
        }
        let read = match (part.kind, name) {
            (Kind::Textures, Some(name)) => tagged(table).map(|value| drop(textures.insert(name, value))),
            (Kind::Materials, Some(name)) => tagged(table).map(|value| drop(materials.insert(name, value))),
            (Kind::Lights, None) => tagged(table).map(|value| lights.push(value)),
            (Kind::Shapes, None) => tagged(table).map(|value| shapes.push(value)),
            (Kind::Meshes, Some(name)) => read(table).map(|value| drop(meshes.insert(name, value))),
            (Kind::Instances, None) => read(table).map(|value| instances.push(value)),
            _ => return Ok(None),
        };
        let [kind, step] = path;
        found.values(read.at(step).at(kind));
    }
    let has = |kind: Kind| parts.parts.iter().any(|part| part.kind == kind);
    let mut rest = rest?;
    let is_in_parts = |key: &str| Kind::ALL.into_iter().any(|kind| kind.name() == key && has(kind));
    if let Err(problem) = defines.put(&[], &mut rest, is_in_parts) {
        return Ok(Some(Err(problem.into())));
    }
    if defines.left().is_some() {
        return Ok(None); // a whole list, or a name or index that does not exist
    }
    let read = both(found.end(()), read_file(rest)).map(|((), mut all)| {
        // The parts and the rest have no kind in common.
        if has(Kind::Textures) {
            all.textures = textures;
        }
        if has(Kind::Materials) {
            all.materials = materials;
        }
        if has(Kind::Lights) {
            all.lights = lights;
        }
        if has(Kind::Shapes) {
            all.shapes = shapes;
        }
        if has(Kind::Meshes) {
            all.meshes = meshes;
        }
        if has(Kind::Instances) {
            all.instances = instances;
        }
        all
    });
    Ok(Some(read))
}

fn read_map<T>(tables: BTreeMap<String, Table>, read: fn(Table) -> Read<T>) -> Result<BTreeMap<String, T>, Problems> {
    let mut found = Collector::default();
    let read = |(name, table): (String, Table)| {
        let value = found.values(read(table).at(name.as_str()))?;
        Some((name, value))
    };
    let all = tables.into_iter().filter_map(read).collect();
    found.end(all)
}

fn read_list<T>(tables: Vec<Table>, read: fn(Table) -> Read<T>) -> Result<Vec<T>, Problems> {
    let mut found = Collector::default();
    let tables = tables.into_iter().enumerate();
    let all = tables
        .filter_map(|(i, table)| found.values(read(table).at(i)))
        .collect();
    found.end(all)
}

fn tagged<T: Tagged>(table: Table) -> Read<T> {
    read_tagged(table, None)
}

fn read<T: DeserializeOwned>(table: Table) -> Read<T> {
    let is_said = |integrator: &Integrator| table.get("integrator").and_then(Value::as_str) == Some(integrator.name());
    let said = Integrator::ALL.into_iter().find(is_said);
    read_for(table, said.unwrap_or(Integrator::Phong))
}

/// Parses a table. The ranges in messages depend on the integrator.
pub fn read_for<T: DeserializeOwned>(table: Table, integrator: Integrator) -> Read<T> {
    read_keys(table, false, integrator, tables::read)
}

fn read_tagged<T: Tagged>(mut table: Table, default: Option<&str>) -> Read<T> {
    let tag = match (table.remove("type"), default) {
        (Some(tag), _) => tag,
        (None, Some(default)) => Value::from(default),
        (None, None) => {
            let message = format!("is missing; it must be one of {}", list(T::TYPES));
            return Err(Problem::predicate(message).at("type").into());
        }
    };
    match tag.as_str().filter(|tag| T::TYPES.contains(tag)) {
        Some(tag) => read_keys(table, true, Integrator::Phong, |body| {
            T::read(tag, body).expect("a type of the list can be read")
        }),
        None => {
            let hint = tag.as_str().map(|tag| suggest::hint(tag, T::TYPES.iter().copied()));
            let hint = hint.unwrap_or_default();
            let message = format!("{} must be one of {}{hint}", show(&tag), list(T::TYPES));
            Err(Problem::new(message).at("type").into())
        }
    }
}

/// Parses a table, whose key `type` was removed if it is `tagged`. serde stops at the first error, so the value there is removed and the
/// table parsed again, for the errors of the other keys.
fn read_keys<T>(
    mut table: Table,
    tagged: bool,
    integrator: Integrator,
    read: impl Fn(Table) -> Result<T, ReadError>,
) -> Read<T> {
    let mut problems: Option<Problems> = None;
    loop {
        let error = match (read(table.clone()), problems) {
            (Ok(value), None) => return Ok(value),
            (Ok(_), Some(found)) => return Err(found),
            (Err(error), found) => {
                problems = found;
                error
            }
        };
        let error = with_names(error, &table, |table| read(table).err());
        let problem = explain(error, &table, tagged, integrator);
        let path = problem.key.0.clone();
        let is_missing = find(&table, &path).is_none();
        let is_removed = !is_missing && remove(&mut table, &path) || remove(&mut table, &path[..path.len().min(1)]);
        let found = match problems {
            Some(found) if is_missing && found.iter().any(|other| explains(&other.key.0, &path)) => found,
            Some(mut found) => {
                found.add(problem);
                found
            }
            None => problem.into(),
        };
        if !is_removed || found.is_full() {
            return Err(found);
        }
        problems = Some(found);
    }
}

/// Returns true if a key is missing because of an error at another one: that was removed, or may be the misspelled key.
fn explains(other: &[Segment], missing: &[Segment]) -> bool {
    let table = &missing[..missing.len().saturating_sub(1)];
    other.starts_with(missing) || other.split_last().is_some_and(|(_, others)| others == table)
}

fn find<'a>(table: &'a Table, path: &[Segment]) -> Option<&'a Value> {
    let (Segment::Key(key), path) = path.split_first()? else {
        return None;
    };
    path.iter().try_fold(table.get(key)?, |value, segment| match segment {
        Segment::Key(key) => value.get(key),
        Segment::Index(index) => value.get(*index),
    })
}

/// Removes the key at a path from its table, if it has one.
fn remove(table: &mut Table, path: &[Segment]) -> bool {
    let Some((Segment::Key(key), path)) = path.split_last() else {
        return false;
    };
    let Some((Segment::Key(first), path)) = path.split_first() else {
        return table.remove(key).is_some();
    };
    let inner = path.iter().fold(table.get_mut(first), |value, segment| match segment {
        Segment::Key(key) => value?.get_mut(key),
        Segment::Index(index) => value?.get_mut(*index),
    });
    let inner = inner.and_then(Value::as_table_mut);
    inner.is_some_and(|inner| inner.remove(key).is_some())
}

/// Maximum number of keys in a message, which no table exceeds.
const MAX_KEYS: usize = 64;

/// Formats a value as TOML on one line, truncated if it is long.
fn show(value: &Value) -> String {
    cut(&value.to_string().replace('\n', " ")).into_owned()
}

/// Returns an error that lists the allowed names. serde only lists them for strings, so the value is replaced by one and parsed again.
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
fn explain(error: ReadError, table: &Table, tagged: bool, integrator: Integrator) -> Problem {
    let mut path = segments(error.path());
    let value = find(table, &path);
    let message = error.inner().message();
    // serde has the name and the rule only as text.
    let quoted = |text: &str| {
        text.split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let is_unknown_key = message.starts_with("unknown field");
    let message = if is_unknown_key {
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
        is_unknown_key,
        ..Problem::new(message)
    }
}

pub fn segments(path: &serde_path_to_error::Path) -> Vec<Segment> {
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
        Some(Segment::Key(key)) if key == "max_depth" => integrator.depths(),
        Some(Segment::Key(key)) if key == "rr_depth" => (0, DEEPEST),
        _ => (1, MOST),
    };
    format!("a whole number from {low} to {high}")
}

#[cfg(test)]
mod tests;
