//! Scene files in JSON, in the format of a path tracing course (keys: `docs/scene-format.md`), converted from +Y up to
//! a [`Description`] with +Z up.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;
use serde_json::value::RawValue;
use toml::Value;

use super::defines::Defines;
use super::error::SceneError;
use super::key_path::{KeyPath, Segment, cut};
use super::problem::{At, Collector, Problem, Problems};
use super::validate::{light, point};
use super::{
    ColorDescription, ConductorDescription, Description, DiffuseDescription, Integrator, LightDescription,
    MaterialDescription, MeshDescription, PerspectiveDescription, RectangleLightDescription, RenderDescription,
    SamplesDescription, Scale, Up, parse,
};

/// Maximum size of a file in bytes. The limit is small, because the parsed values need many times the memory of the
/// text.
const MAX_FILE_BYTES: usize = 4 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Course {
    spp: u32,
    max_depth: u32,
    image_resolution: [u32; 2],
    cam_config: Camera,
    light_config: Light,
    materials: Vec<Material>,
    objects: Vec<Object>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Camera {
    position: DVec3,
    look_at: DVec3,
    ref_up: DVec3,
    vertical_fov: f64,
    #[serde(default = "one")]
    focal_length: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Light {
    position: DVec3,
    size: [f64; 2],
    radiance: DVec3,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Material {
    name: String,
    #[serde(rename = "type")]
    kind: Kind,
    color: DVec3,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Diffuse,
    Specular,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Object {
    obj_file_path: String,
    material_name: String,
    #[serde(default)]
    translate: DVec3,
    #[serde(default = "one")]
    scale: f64,
    /// Ignored: all meshes have a BVH.
    #[serde(default, rename = "has_bvh")]
    _has_bvh: bool,
}

fn one() -> f64 {
    1.0
}

/// Returns the default folder that must contain all files: the parent of the scene's folder, because files are named
/// `../assets/...`.
pub fn asset_root(folder: &Path) -> PathBuf {
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let canonical = folder.canonicalize().ok();
    let parent = canonical.as_deref().and_then(Path::parent);
    parent.map_or_else(|| folder.join(".."), Path::to_owned)
}

/// Parses a JSON scene, and converts it to +Z up.
pub fn read(text: &str, origin: &str, defines: &mut Defines) -> Result<Description, SceneError> {
    let course = read_json(text, defines).map_err(|fault| match fault {
        ReadFault::Values(problems) => {
            let error =
                |offset, problem: Problem| syntax_error(origin, line_and_column(text, offset), problem.to_string());
            match problems.define_error(defines) {
                Some(error) => error,
                None => problems.into_error(|problem| value_offset(text, &problem.key), error),
            }
        }
        ReadFault::Text(error, key) => text_error(text, origin, error, key),
        ReadFault::Large => {
            let rule = format!("a JSON scene must not be larger than {} MiB", MAX_FILE_BYTES >> 20);
            syntax_error(origin, (1, 1), rule)
        }
    })?;
    let checked = check(&course);
    checked.map_err(|problems| invalid(text, origin, problems, defines))?;
    Ok(description(&course))
}

/// Converts problems of a description to an error with the keys and lines of the JSON file.
pub fn invalid(text: &str, origin: &str, problems: Problems, defines: &Defines) -> SceneError {
    let problems = problems.map(|problem| Problem {
        key: key_in_file(text, &problem.key, defines),
        // The JSON file names this type "specular".
        message: problem.message.replace("\"conductor\"", "\"specular\""),
        ..problem
    });
    if let Some(error) = problems.define_error(defines) {
        return error;
    }
    let error = |offset: usize, problem: Problem| SceneError::Invalid {
        origin: origin.to_owned(),
        line: line_and_column(text, offset).0,
        problem,
    };
    problems.into_error(|problem| value_offset(text, &problem.key), error)
}

enum ReadFault {
    Text(serde_json::Error, KeyPath),
    /// Valid JSON with invalid types or keys, or an invalid override.
    Values(Problems),
    Large,
}

fn text_error(text: &str, origin: &str, error: serde_json::Error, key: KeyPath) -> SceneError {
    // serde_json counts columns in bytes.
    let (line, byte_column) = (error.line().max(1), error.column());
    let line_bytes = text.lines().nth(line - 1).unwrap_or_default().as_bytes();
    let bytes_before = &line_bytes[..byte_column.saturating_sub(1).min(line_bytes.len())];
    let column = String::from_utf8_lossy(bytes_before).chars().count() + 1;
    let full_message = error.to_string();
    let message = full_message
        .rsplit_once(" at line ")
        .map_or(&*full_message, |(message, _)| message);
    let message = message
        .replace(", expected any valid TOML value", "")
        .replace('`', "\"")
        .replace(
            "recursion limit exceeded",
            "lists and objects must be nested at most 127 levels deep",
        );
    let problem = Problem {
        key,
        ..Problem::new(message)
    };
    syntax_error(origin, (line, column), problem.to_string())
}

fn syntax_error(origin: &str, (line, column): (usize, usize), message: String) -> SceneError {
    SceneError::Syntax {
        origin: origin.to_owned(),
        line,
        column,
        message,
    }
}

fn read_json(text: &str, defines: &mut Defines) -> Result<Course, ReadFault> {
    if text.len() > MAX_FILE_BYTES {
        return Err(ReadFault::Large);
    }
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let value: Value = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let key = KeyPath(segments(error.path()));
        ReadFault::Text(error.into_inner(), key)
    })?;
    let end = deserializer.end();
    end.map_err(|error| ReadFault::Text(error, KeyPath::default()))?;
    let Value::Table(mut table) = value else {
        let message = format!("{} must be an object: {{ \"spp\": ... }}", cut(&one_line(text)));
        return Err(ReadFault::Values(Problem::new(message).into()));
    };
    defines
        .apply(&[], &mut table, |_| false)
        .map_err(|problem| ReadFault::Values(problem.into()))?;
    let in_json_terms = |problem: Problem| {
        // The messages of `parse` use the terms of TOML.
        let object = find(text, &problem.key).filter(|value| value.starts_with('{'));
        let message = match (problem.message.rsplit_once(" must be "), object) {
            (Some((_, rule)), Some(object)) => format!("{} must be {rule}", cut(&one_line(object))),
            _ => problem.message,
        };
        let message = message.replace(
            "must be a list of tables, each under its own [[header]]",
            "must be a list",
        );
        let message = message.replace("must be a table", "must be an object");
        Problem { message, ..problem }
    };
    parse::read_for(table, Integrator::Path).map_err(|problems| ReadFault::Values(problems.map(in_json_terms)))
}

fn segments(path: &serde_path_to_error::Path) -> Vec<Segment> {
    use serde_path_to_error::Segment as PathSegment;
    let segments = path.iter().filter_map(|segment| match segment {
        PathSegment::Map { key } => Some(Segment::Key(key.clone())),
        PathSegment::Seq { index } => Some(Segment::Index(*index)),
        PathSegment::Enum { .. } | PathSegment::Unknown => None,
    });
    segments.collect()
}

/// Validates the values that the conversion to +Z up changes, so that errors show the numbers of the file.
fn check(course: &Course) -> Result<(), Problems> {
    let Course {
        cam_config,
        light_config,
        materials,
        objects,
        ..
    } = course;
    // Not `validate`, which replaces an `up` of +Z in vertical views: +Z is not the default `up` of JSON scenes.
    let mut problems = Collector::default();
    problems.values(camera(cam_config).validate_frame().map_err(Problems::from).at("camera"));
    problems.value(light(&self::rectangle(light_config).into()).at(0).at("lights"));
    for (i, object) in objects.iter().enumerate() {
        problems.value(point(object.translate).at("translate").at(i).at("shapes"));
    }
    let mut names = BTreeMap::new();
    for (i, material) in materials.iter().enumerate() {
        if let Some(first) = names.insert(material.name.as_str(), i) {
            let message = format!(
                "{:?} is defined twice, first in materials[{first}]",
                cut(&material.name)
            );
            problems.value(Err::<(), _>(Problem::new(message).at("name").at(i).at("materials")));
        }
    }
    problems.end(())
}

/// Returns the camera in the coordinates of the file.
fn camera(camera: &Camera) -> super::CameraDescription {
    let mut perspective = PerspectiveDescription::new(camera.position, camera.look_at, camera.vertical_fov);
    perspective.up = camera.ref_up;
    perspective.focal_length = camera.focal_length;
    perspective.into()
}

/// Returns the light in the coordinates of the file.
fn rectangle(light: &Light) -> RectangleLightDescription {
    RectangleLightDescription::new(light.position, light.size, DVec3::NEG_Y, DVec3::X, light.radiance)
}

/// Converts a vector from +Y up to +Z up, like [`Up::Y`] for meshes.
fn to_z_up(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

fn description(course: &Course) -> Description {
    let Course {
        spp,
        max_depth,
        image_resolution: [width, height],
        cam_config,
        light_config,
        materials,
        objects,
    } = course;
    let mut scene = Description::new(
        *width,
        *height,
        camera(&Camera {
            position: to_z_up(cam_config.position),
            look_at: to_z_up(cam_config.look_at),
            ref_up: to_z_up(cam_config.ref_up),
            ..*cam_config
        }),
    )
    .with_render(RenderDescription {
        integrator: Some(Integrator::Path),
        max_depth: *max_depth,
        pixel_samples: SamplesDescription::new(*spp),
        ..RenderDescription::default()
    })
    .with_light(LightDescription::from(RectangleLightDescription {
        center: to_z_up(light_config.position),
        normal: to_z_up(DVec3::NEG_Y),
        ..rectangle(light_config)
    }));
    for Material { name, kind, color } in materials {
        let color = ColorDescription::Plain(*color);
        let material = match kind {
            Kind::Diffuse => MaterialDescription::from(DiffuseDescription::new(color)),
            Kind::Specular => MaterialDescription::from(ConductorDescription::new(color)),
        };
        scene = scene.with_material(name, material);
    }
    for object in objects {
        scene = scene.with_shape(MeshDescription {
            up: Up::Y,
            translate: Some(to_z_up(object.translate)),
            scale: Some(Scale::All(object.scale)),
            ..MeshDescription::new(&object.material_name, &object.obj_file_path)
        });
    }
    scene
}

/// Converts a key path of the description to the key path in the file.
fn key_in_file(text: &str, key: &KeyPath, defines: &Defines) -> KeyPath {
    let in_file = |segment: &Segment| match segment {
        Segment::Key(key) => Segment::from(match key.as_str() {
            "up" => "ref_up",
            "fov" => "vertical_fov",
            "center" => "position",
            "file" => "obj_file_path",
            "material" => "material_name",
            other => other,
        }),
        Segment::Index(index) => Segment::Index(*index),
    };
    let first = match key.0.first() {
        Some(Segment::Key(first)) => first.as_str(),
        _ => return key.clone(),
    };
    let rest = &key.0[1..];
    KeyPath(match (first, rest) {
        ("image", [Segment::Key(side), ..]) => {
            vec!["image_resolution".into(), usize::from(side == "height").into()]
        }
        ("render", [Segment::Key(key), ..]) if key == "pixel_samples" => vec!["spp".into()],
        ("render", [Segment::Key(key), ..]) => vec![key.as_str().into()],
        ("camera", rest) => [Segment::from("cam_config")]
            .into_iter()
            .chain(rest.iter().map(in_file))
            .collect(),
        ("lights", [_, rest @ ..]) => {
            let in_light = |segment| match in_file(segment) {
                Segment::Key(key) if key == "color" => "radiance".into(),
                other => other,
            };
            [Segment::from("light_config")]
                .into_iter()
                .chain(rest.iter().map(in_light))
                .collect()
        }
        ("materials", [Segment::Key(name), rest @ ..]) => {
            let course = read_json(text, &mut defines.restarted()).ok();
            let index = course.and_then(|course| course.materials.iter().position(|material| material.name == *name));
            let key = match rest {
                [Segment::Key(key)] if key == "type" => "type",
                _ => "color",
            };
            vec!["materials".into(), index.unwrap_or_default().into(), key.into()]
        }
        ("shapes", rest) => [Segment::from("objects")]
            .into_iter()
            .chain(rest.iter().map(in_file))
            .collect(),
        _ => return key.clone(),
    })
}

/// Returns the text of the value at a path, or of the innermost existing ancestor.
fn find<'a>(text: &'a str, path: &KeyPath) -> Option<&'a str> {
    let root: &RawValue = serde_json::from_str(text).ok()?;
    let mut value = root.get();
    for segment in &path.0 {
        let inner: Option<&RawValue> = match segment {
            Segment::Key(key) => {
                let table: Option<BTreeMap<String, &RawValue>> = serde_json::from_str(value).ok();
                table.and_then(|table| table.get(key).copied())
            }
            Segment::Index(index) => {
                let list: Option<Vec<&RawValue>> = serde_json::from_str(value).ok();
                list.and_then(|list| list.get(*index).copied())
            }
        };
        match inner {
            Some(inner) => value = inner.get(),
            None => break,
        }
    }
    Some(value)
}

/// Returns the byte offset of the value that [`find`] returns.
fn value_offset(text: &str, path: &KeyPath) -> usize {
    find(text, path).map_or(0, |value| value.as_ptr() as usize - text.as_ptr() as usize)
}

/// Returns the line and column, both counted from 1, of a byte offset.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
