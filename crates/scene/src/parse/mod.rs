//! Parses scene files to a [`Description`].

mod change;
mod location;
mod parts;
mod syntax;
mod table;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use self::parts::{Kind, MAX_PART_BYTES, Parts, SyntaxFault};
use self::table::{Read, read, read_tagged, remove, tagged};
use super::defines::Defines;
use super::description::{
    CameraDescription, CameraKeyDescription, CameraPathDescription, Description, ImageDescription, InstanceDescription,
    LightDescription, MaterialDescription, MeshFileDescription, PerspectiveDescription, RenderDescription,
    ShapeDescription, TextureDescription,
};
use super::error::SceneError;
use super::key_path::Segment;
use super::problem::{At, Collector, Problem, Problems, both};
use super::tree::{self, Fault};

pub use change::{Pieces, Places};
pub use location::{invalid, line_of_path};
pub use syntax::{NOT_UTF8, encoding, syntax_error};
pub use table::read_for;

impl Description {
    /// Returns the description with the defines applied.
    pub(crate) fn with_defines(&self, defines: &mut Defines) -> Result<Description, Problem> {
        let mut file = Table::try_from(self).map_err(|error| Problem::new(error.to_string()))?;
        defines.apply(&[], &mut file, |_| false).at("define")?;
        read_file(file).map_err(|problems| problems.first.at("define"))
    }

    pub(crate) fn parse_toml(text: &str, origin: &str, defines: &mut Defines) -> Result<Self, SceneError> {
        let to_error = |fault: SyntaxFault| fault.into_error(text, origin);
        let parts = Parts::of(text);
        if let Some(fault) = parts.too_large() {
            return Err(to_error(fault));
        }
        let read = match read_parts(&parts, defines).map_err(to_error)? {
            Some(read) => read,
            None if text.len() > MAX_PART_BYTES => match defines.unapplied() {
                Some(key) => Err(defines.missing_key(key).into()),
                None => return Err(to_error(SyntaxFault::file_too_large(text))),
            },
            None => {
                let mut file = toml::from_str(text).map_err(|error| to_error(SyntaxFault::of(0, &error)))?;
                defines.restart();
                let applied = defines.apply(&[], &mut file, |_| false);
                applied.map_err(Problems::from).and_then(|()| read_file(file))
            }
        };
        read.map_err(|problems| invalid(text, origin, problems, defines))
    }
}

/// Returns true if a scene file with this name is in JSON.
pub fn is_json_scene(name: &Path) -> bool {
    let extension = name.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}

/// The sections of a scene file, whose keys are not yet parsed.
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
    let (sections, other_keys) = read_sections(file)?;
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
    let (((view, settings), (appearance, (objects, meshes))), ()) = both(sections, other_keys)?;
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

/// Returns the sections of a file, and the problems of keys outside of sections.
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

/// Suggests a section in the problem of an unknown key outside of sections.
fn with_section(problem: Problem) -> Problem {
    let [Segment::Key(key)] = problem.key.0.as_slice() else {
        return problem;
    };
    // Translates names of command-line options, and names in other renderers, to keys of scene files.
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
    // Unknown keys are reported before missing keys and wrong types.
    let error = tree::read::<T>(Value::Table(table)).err();
    !error.is_some_and(|error| matches!(error.fault, Fault::UnknownKey(_)))
}

/// Parses a camera. A missing value is taken from the first key of the path that sets the value.
fn read_camera(mut camera: Table) -> Read<CameraDescription> {
    if let Some(Value::Table(path)) = camera.get("path") {
        // The path is parsed first, so that errors in keys are reported at the keys.
        let path: CameraPathDescription = read(path.clone()).at("path")?;
        let to_value = |point: DVec3| Value::from(point.to_array().to_vec());
        let first_point =
            |value_of: fn(&CameraKeyDescription) -> Option<DVec3>| path.keys.iter().find_map(value_of).map(to_value);
        let points = [
            ("position", first_point(|key| key.position)),
            ("look_at", first_point(|key| key.look_at)),
            ("up", first_point(|key| key.up)),
        ];
        let first_number =
            |value_of: fn(&CameraKeyDescription) -> Option<f64>| path.keys.iter().find_map(value_of).map(Value::from);
        let mut numbers = match camera.get("type").and_then(Value::as_str) {
            Some("orthographic") => vec![("height", first_number(|key| key.height))],
            Some("panorama") => vec![],
            _ => vec![
                ("fov", first_number(|key| key.fov)),
                ("focus_distance", first_number(|key| key.focus_distance)),
                ("aperture", first_number(|key| key.aperture)),
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

/// Parses a file part by part; `None` if the parts depend on each other.
fn read_parts(parts: &Parts, defines: &mut Defines) -> Result<Option<Result<Description, Problems>>, SyntaxFault> {
    let rest = parts.read_rest();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut names = BTreeSet::new();
    let mut problems = Collector::default();
    let mut textures: BTreeMap<String, TextureDescription> = BTreeMap::new();
    let mut materials: BTreeMap<String, MaterialDescription> = BTreeMap::new();
    let mut lights: Vec<LightDescription> = Vec::new();
    let mut shapes: Vec<ShapeDescription> = Vec::new();
    let mut meshes: BTreeMap<String, MeshFileDescription> = BTreeMap::new();
    let mut instances: Vec<InstanceDescription> = Vec::new();
    for part in parts.parts.iter() {
        match &rest {
            // Errors are reported in the order of the text.
            Err(fault) if fault.offset < part.range.start => break,
            Ok(rest) if rest.contains_key(part.kind.name()) => return Ok(None),
            _ => {}
        }
        let Some((name, mut table)) = parts.read(part)? else {
            return Ok(None);
        };
        let count = counts.entry(part.kind.name()).or_default();
        let name_or_index = name.as_deref().map_or(Segment::Index(*count), Segment::from);
        *count += 1;
        let path = [Segment::from(part.kind.name()), name_or_index];
        if let Err(problem) = defines.apply(&path, &mut table, |_| false) {
            return Ok(Some(Err(problem.into())));
        }
        if let Some(name) = &name
            && !names.insert((part.kind.name(), name.clone()))
        {
            return parts.duplicate_name(name, part).map_or(Ok(None), Err);
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
        let [kind, name_or_index] = path;
        problems.values(read.at(name_or_index).at(kind));
    }
    let has_parts = |kind: Kind| parts.parts.iter().any(|part| part.kind == kind);
    let mut rest = rest?;
    let is_in_parts = |key: &str| Kind::ALL.into_iter().any(|kind| kind.name() == key && has_parts(kind));
    if let Err(problem) = defines.apply(&[], &mut rest, is_in_parts) {
        return Ok(Some(Err(problem.into())));
    }
    if defines.unapplied().is_some() {
        return Ok(None); // an override of an entire list, or of a name or index that does not exist
    }
    let part_problems = problems.end(());
    let read = both(part_problems, read_file(rest)).map(|((), mut description)| {
        // The elements of a section are either all in the parts or all in the rest.
        if has_parts(Kind::Textures) {
            description.textures = textures;
        }
        if has_parts(Kind::Materials) {
            description.materials = materials;
        }
        if has_parts(Kind::Lights) {
            description.lights = lights;
        }
        if has_parts(Kind::Shapes) {
            description.shapes = shapes;
        }
        if has_parts(Kind::Meshes) {
            description.meshes = meshes;
        }
        if has_parts(Kind::Instances) {
            description.instances = instances;
        }
        description
    });
    Ok(Some(read))
}

fn read_map<T>(tables: BTreeMap<String, Table>, read: fn(Table) -> Read<T>) -> Result<BTreeMap<String, T>, Problems> {
    let mut problems = Collector::default();
    let read = |(name, table): (String, Table)| {
        let value = problems.values(read(table).at(name.as_str()))?;
        Some((name, value))
    };
    let values = tables.into_iter().filter_map(read).collect();
    problems.end(values)
}

fn read_list<T>(tables: Vec<Table>, read: fn(Table) -> Read<T>) -> Result<Vec<T>, Problems> {
    let mut problems = Collector::default();
    let tables = tables.into_iter().enumerate();
    let values = tables
        .filter_map(|(i, table)| problems.values(read(table).at(i)))
        .collect();
    problems.end(values)
}

#[cfg(test)]
mod tests;
