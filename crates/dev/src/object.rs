//! The object at a pixel, and its part of the scene file: source lines, values, and allowed values.

use std::sync::Arc;

use glam::UVec2;
use serde::Serialize;
use toml::{Table, Value};

use super::edit::{Layout, line_end, line_start};
use super::source::{Loaded, Sources};
use wgray_render::cpu::geometry::pixel_first_hit;
use wgray_render::records::{Camera, NO_INDEX, Packed};
use wgray_scene::{Description, Field, KeyPath, Names, Pieces, Segment, ShapeDescription, fields};

/// Maximum number of displayed lines per table.
const MAX_LINES: usize = 40;
const MAX_LISTED: usize = 50;
/// Maximum number of tables that are shown with an object: materials, textures, a mesh.
const MAX_GROUPS: usize = 12;

/// The scene and the camera, for queries about objects.
#[derive(Clone, Debug)]
pub struct SceneView {
    pub(super) loaded: Arc<Loaded>,
    pub(super) camera: Camera,
    pub(super) sources: Sources,
}

/// An object of the scene file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Object {
    /// The name, as in messages: `shapes[3]`.
    pub name: String,
    /// The scene file.
    pub file: String,
    /// The pixel of the query.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<[u32; 2]>,
    /// The material at the pixel, or the material named in the query.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// The object and the tables it refers to: its material, and the textures of the material.
    pub groups: Vec<Group>,
    /// A note.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Why the selection has no object.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gone: Option<String>,
}

/// A table of the scene file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// The path of the table.
    pub name: String,
    /// The `type` of the table; empty if it has none.
    pub kind: String,
    /// The first line of the table in the file, counted from 1; 0 if the table is not in the file.
    pub line: usize,
    /// The first lines of its source text; `more` counts the rest.
    pub text: String,
    /// Number of further lines.
    pub more: usize,
    /// The values of the table.
    pub fields: Vec<Field>,
}

/// The objects whose names contain a text.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ObjectList {
    /// The text.
    pub part: String,
    /// Names, each with its type or material.
    pub objects: Vec<(String, String)>,
    /// Number of further objects.
    pub more: usize,
}

impl Object {
    /// Returns the answer to queries while no scene is loaded.
    pub(super) fn none(name: &str, at: Option<[u32; 2]>) -> Object {
        Object {
            name: name.to_owned(),
            file: String::new(),
            at,
            material: None,
            groups: Vec::new(),
            note: None,
            gone: Some("No scene has been loaded yet".to_owned()),
        }
    }
}

impl SceneView {
    /// Returns the object at a pixel of the full-size image.
    pub fn at(&self, [x, y]: [u32; 2]) -> Object {
        let mut object = match x < self.camera.width && y < self.camera.height {
            true => self.hit(UVec2::new(x, y)),
            false => self.gone("", format!("pixel {x}, {y} is outside the image")),
        };
        object.at = Some([x, y]);
        object
    }

    fn hit(&self, pixel: UVec2) -> Object {
        let loaded = &*self.loaded;
        let packed = Packed {
            camera: self.camera,
            ..loaded.packed.clone()
        };
        let hit = pixel_first_hit(&packed, pixel);
        if hit.shape == NO_INDEX {
            let around = if loaded.description.environment.is_some() {
                "environment"
            } else {
                "render"
            };
            let mut object = self.object(around, None);
            object.note = Some("Nothing here but the background".to_owned());
            return object;
        }
        let (name, note) = place_of(loaded, hit.shape as usize);
        let material = loaded.scene.material_names.get(hit.material as usize);
        let mut object = self.object(&name, material.map(String::as_str));
        object.note = note.or(object.note);
        object
    }

    /// Returns the object with this name; `material` comes first among its materials.
    pub fn object(&self, name: &str, material: Option<&str>) -> Object {
        let (own, brought) = match material {
            Some(name) if self.loaded.description.materials.contains_key(name) => (material, None),
            _ => (None, material),
        };
        let brought = brought.map(|name| format!("the material here, {name}, is in another file"));
        Object {
            material: material.map(str::to_owned),
            note: brought,
            ..self.described(name, own)
        }
    }

    pub(super) fn names(&self) -> Names {
        let all = &self.loaded.description;
        Names {
            materials: all.materials.keys().cloned().collect(),
            textures: all.textures.keys().cloned().collect(),
            meshes: all.meshes.keys().cloned().collect(),
        }
    }

    /// Returns the field at a path, if the path leads to a value.
    pub(super) fn field(&self, path: &KeyPath) -> Option<Field> {
        let object = object_of(path)?;
        let pieces = self.loaded.pieces();
        let group = self.group(&pieces, &object, &self.names())?;
        let exact = path.exact();
        group.fields.into_iter().find(|field| field.path == exact)
    }

    fn gone(&self, name: &str, why: String) -> Object {
        Object {
            file: self.sources.scene.display().to_string(),
            gone: Some(why),
            ..Object::none(name, None)
        }
    }

    fn described(&self, name: &str, material: Option<&str>) -> Object {
        let not_there = || self.gone(name, format!("{name} is not in the scene"));
        let Some(path) = name
            .parse()
            .ok()
            .filter(|path| is_there(&self.loaded.description, path))
        else {
            return not_there();
        };
        let reason = match self.sources.read_only() {
            Some(reason) => reason,
            None => {
                let pieces = self.loaded.pieces();
                let names = self.names();
                let mut groups: Vec<Group> = self.group(&pieces, &path, &names).into_iter().collect();
                let mut wanted: Vec<KeyPath> = material.map(|name| named("materials", name)).into_iter().collect();
                wanted.extend(groups.iter().flat_map(named_by));
                let mut i = 0;
                while let Some(next) = wanted.get(i).cloned() {
                    i += 1;
                    let is_known = wanted[..i - 1].contains(&next) || !is_there(&self.loaded.description, &next);
                    if is_known || groups.len() >= MAX_GROUPS {
                        continue;
                    }
                    if let Some(group) = self.group(&pieces, &next, &names) {
                        wanted.extend(named_by(&group));
                        groups.push(group);
                    }
                }
                let gone = None;
                return Object {
                    groups,
                    gone,
                    ..self.gone(name, String::new())
                };
            }
        };
        self.gone(name, reason)
    }

    fn group(&self, pieces: &Pieces, path: &KeyPath, names: &Names) -> Option<Group> {
        let piece = pieces.find(path);
        let whole: Table = toml::from_str(piece.text.trim_start_matches('\u{feff}')).ok()?;
        let table = piece
            .path
            .0
            .iter()
            .try_fold(Value::Table(whole), |value, segment| match (value, segment) {
                (Value::Table(mut table), Segment::Key(key)) => table.remove(key),
                (Value::Array(mut list), Segment::Index(i)) if *i < list.len() => Some(list.swap_remove(*i)),
                _ => None,
            });
        let table = table.unwrap_or(Value::Table(Table::new())); // a section that the file does not have
        let layout = Layout::of(&piece.text)?;
        let lines = layout.extent(&piece.path).map(|range| {
            let start = piece.place(range.start);
            lines(&self.loaded.text, start, start + range.len())
        });
        let (line, text, more) = lines.unwrap_or_default();
        let mut fields = fields(path, &table, names);
        let integrator = self.loaded.description.integrator();
        let render = &self.loaded.description.render;
        let counts = [
            ("render.pixel_samples", &render.pixel_samples),
            ("render.light_samples", &render.light_samples),
        ];
        for field in &mut fields {
            let path = field.path.strip_suffix(".count").unwrap_or(&field.path);
            let samples = counts.iter().find(|(own, _)| *own == path);
            field.squares = samples.is_some_and(|(_, samples)| samples.pattern(integrator).needs_square());
            let of_field = field.path.parse().ok();
            if let Some(option) = of_field.and_then(|path| self.sources.overrides.in_place_of(&path)) {
                field.fixed = Some(format!("{option} overrides the value of the file"));
            }
        }
        // Keys of the file come first, in the order of the file.
        let place = |field: &Field| {
            let path: KeyPath = field.path.parse().ok()?;
            let below = path.0.get(path_len(path.0.len(), field)..)?.to_vec();
            let inner = KeyPath(piece.path.0.iter().cloned().chain(below).collect());
            layout.extent(&inner).map(|range| range.start)
        };
        fields.sort_by_cached_key(|field| (field.value.is_none(), place(field)));
        let kind = table.get("type").and_then(Value::as_str).unwrap_or_default().to_owned();
        Some(Group {
            name: path.exact(),
            kind,
            line,
            text,
            more,
            fields,
        })
    }

    /// Returns the objects whose names contain a text, in the order of the file's sections.
    pub fn objects(&self, part: &str) -> ObjectList {
        let all = &self.loaded.description;
        let wanted = part.to_lowercase();
        let mut listed = ObjectList {
            part: part.to_owned(),
            objects: Vec::new(),
            more: 0,
        };
        let mut add = |name: &dyn Fn() -> String, about: String| {
            let name = name();
            if format!("{name} {about}").to_lowercase().contains(&wanted) {
                match listed.objects.len() < MAX_LISTED {
                    true => listed.objects.push((name, about)),
                    false => listed.more += 1,
                }
            }
        };
        for section in ["image", "camera", "render", "environment"] {
            if section != "environment" || all.environment.is_some() {
                add(&|| section.to_owned(), String::new());
            }
        }
        let maps = [
            ("materials", all.materials.keys().collect::<Vec<_>>()),
            ("textures", all.textures.keys().collect()),
            ("meshes", all.meshes.keys().collect()),
        ];
        for (section, keys) in maps {
            keys.into_iter()
                .for_each(|key| add(&|| named(section, key).exact(), String::new()));
        }
        for i in 0..all.lights.len() {
            add(&|| format!("lights[{i}]"), String::new());
        }
        for (i, shape) in all.shapes.iter().enumerate() {
            add(&|| format!("shapes[{i}]"), description_of(shape));
        }
        for (i, instance) in all.instances.iter().enumerate() {
            add(&|| format!("instances[{i}]"), instance.mesh.clone());
        }
        listed
    }
}

/// Returns the number of path segments of a field's object.
fn path_len(whole: usize, field: &Field) -> usize {
    let below = field.name.parse::<KeyPath>().map_or(0, |name| name.0.len());
    whole.saturating_sub(below)
}

fn named(section: &str, name: &str) -> KeyPath {
    KeyPath([section, name].map(Segment::from).to_vec())
}

/// Returns the object that contains a path: `shapes[3]` for `shapes[3].radius`.
pub(super) fn object_of(path: &KeyPath) -> Option<KeyPath> {
    let length = match path.0.first()? {
        Segment::Key(section) if ["image", "camera", "render", "environment"].contains(&section.as_str()) => 1,
        _ => 2,
    };
    path.0.get(..length).map(|object| KeyPath(object.to_vec()))
}

fn is_there(all: &Description, path: &KeyPath) -> bool {
    match path.0.as_slice() {
        [Segment::Key(section)] => match section.as_str() {
            "image" | "camera" | "render" => true,
            "environment" => all.environment.is_some(),
            _ => false,
        },
        [Segment::Key(section), Segment::Key(name)] => match section.as_str() {
            "materials" => all.materials.contains_key(name),
            "textures" => all.textures.contains_key(name),
            "meshes" => all.meshes.contains_key(name),
            _ => false,
        },
        [Segment::Key(section), Segment::Index(i)] => match section.as_str() {
            "shapes" => *i < all.shapes.len(),
            "lights" => *i < all.lights.len(),
            "instances" => *i < all.instances.len(),
            _ => false,
        },
        _ => false,
    }
}

/// Returns the paths of the objects that a table refers to: materials, textures, a mesh.
fn named_by(group: &Group) -> Vec<KeyPath> {
    let mut found = Vec::new();
    for field in &group.fields {
        let (Some(section), Some(text)) = (
            field
                .path
                .parse::<KeyPath>()
                .ok()
                .and_then(|path| Names::section(&path)),
            field.value.as_ref().and_then(|value| value.as_str()),
        ) else {
            continue;
        };
        found.push(named(section, text));
    }
    found
}

/// Returns the lines of a range, including the comments directly above: the first line number, the text, and the number
/// of omitted lines.
fn lines(text: &str, start: usize, end: usize) -> (usize, String, usize) {
    let mut start = line_start(text, start);
    while let Some(above) = text[..start].strip_suffix('\n') {
        let line = line_start(text, above.len());
        if !text[line..start].trim_start().starts_with('#') {
            break;
        }
        start = line;
    }
    let whole = &text[start..line_end(text, end)];
    let number = 1 + text.as_bytes()[..start].iter().filter(|byte| **byte == b'\n').count();
    let shown: Vec<&str> = whole.lines().take(MAX_LINES).collect();
    (number, shown.join("\n"), whole.lines().count() - shown.len())
}

/// Returns the name of the object in the file that contains the scene's shape with this index, and a note.
fn place_of(loaded: &Loaded, number: usize) -> (String, Option<String>) {
    let all = &loaded.description;
    let gltf: Vec<(usize, bool)> = (all.shapes.iter().enumerate())
        .filter_map(|(i, shape)| match shape {
            ShapeDescription::Gltf(gltf) => Some((i, gltf.lights)),
            _ => None,
        })
        .collect();
    let brought = |mut number: usize, count: &dyn Fn(usize, bool) -> usize| {
        for (file, (shape, lights)) in gltf.iter().enumerate() {
            match number.checked_sub(count(file, *lights)) {
                Some(rest) => number = rest,
                None => return format!("shapes[{shape}]"),
            }
        }
        "render".to_owned() // unreachable: every imported part is from a file
    };
    let imported = |file: usize| loaded.scene.imported.get(file);
    let plain = all.shapes.len() - gltf.len();
    let of_gltf = "part of this glTF file, which is read-only here. Run `wgray convert` for an editable scene.";
    if number < plain {
        let mut plain = all
            .shapes
            .iter()
            .enumerate()
            .filter(|(_, shape)| !matches!(shape, ShapeDescription::Gltf(_)));
        let place = plain.nth(number).map_or(number, |(i, _)| i);
        return (format!("shapes[{place}]"), None);
    }
    let Some(light) = number.checked_sub(loaded.scene.shapes.len()) else {
        let instance = number - plain;
        return match instance.checked_sub(all.instances.len()) {
            None => (format!("instances[{instance}]"), None),
            Some(rest) => {
                let count = |file: usize, _| imported(file).map_or(0, |file| file.instances.len());
                (brought(rest, &count), Some(of_gltf.to_owned()))
            }
        };
    };
    match light.checked_sub(all.lights.len()) {
        None => (format!("lights[{light}]"), None),
        Some(rest) => {
            let count =
                |file: usize, lights: bool| imported(file).map_or(0, |file| if lights { file.lights.len() } else { 0 });
            (brought(rest, &count), Some(of_gltf.to_owned()))
        }
    }
}

/// Describes a shape: its type, and its file or material.
fn description_of(shape: &ShapeDescription) -> String {
    let table = serde_json::to_value(shape).unwrap_or_default();
    let text = |key: &str| table[key].as_str();
    let name = text("file").or(text("material")).unwrap_or_default();
    format!("{}, {name}", text("type").unwrap_or_default())
}

#[cfg(test)]
mod tests;
