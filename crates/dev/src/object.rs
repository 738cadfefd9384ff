//! Queries for the object at a pixel or with a name: the tables of the object in the scene file, with their source
//! lines, values and allowed values.

use std::sync::Arc;

use glam::UVec2;
use serde::Serialize;
use toml::{Table, Value};

use super::edit::{Layout, line_end, line_start};
use super::source::{Loaded, Sources};
use wgray_scene::{Description, Field, KeyPath, Names, Pieces, Segment, ShapeDescription, fields};
use wgray_trace::cpu::geometry::pixel_first_hit;
use wgray_trace::records::{Camera, NO_INDEX, Packed};

/// Maximum number of displayed lines per table.
const MAX_LINES: usize = 40;
/// Maximum number of listed objects.
const MAX_LISTED: usize = 50;
/// Maximum number of tables of an object, including its materials, textures and mesh.
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
    /// The table of the object, and the tables that it refers to: its material, and the textures of the material.
    pub groups: Vec<Group>,
    /// A note about the object, for the user.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// The reason if the selection has no object.
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
    /// The first lines of the table's source text.
    pub text: String,
    /// Number of lines that `text` omits.
    pub more: usize,
    /// The values of the table.
    pub fields: Vec<Field>,
}

/// The objects whose name, type, file or material contains a query.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ObjectList {
    /// The query.
    pub query: String,
    /// The name of each object, and its type, file or material.
    pub objects: Vec<(String, String)>,
    /// Number of objects that `objects` omits.
    pub more: usize,
}

impl Object {
    /// Returns the answer to queries while no scene is loaded.
    pub(super) fn without_scene(name: &str, at: Option<[u32; 2]>) -> Object {
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
            false => self.without_groups("", format!("pixel {x}, {y} is outside the image")),
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
            let section = if loaded.description.environment.is_some() {
                "environment"
            } else {
                "render"
            };
            let mut object = self.object(section, None);
            object.note = Some("The background is visible at this pixel".to_owned());
            return object;
        }
        let (name, note) = name_of_shape(loaded, hit.shape as usize);
        let material = loaded.scene.material_names.get(hit.material as usize);
        let mut object = self.object(&name, material.map(String::as_str));
        object.note = note.or(object.note);
        object
    }

    /// Returns the object with this name; `material` comes first among its materials.
    pub fn object(&self, name: &str, material: Option<&str>) -> Object {
        let (file_material, imported) = match material {
            Some(name) if self.loaded.description.materials.contains_key(name) => (material, None),
            _ => (None, material),
        };
        let note = imported.map(|name| format!("the material at this pixel, {name}, is in another file"));
        Object {
            material: material.map(str::to_owned),
            note,
            ..self.with_groups(name, file_material)
        }
    }

    pub(super) fn names(&self) -> Names {
        let description = &self.loaded.description;
        Names {
            materials: description.materials.keys().cloned().collect(),
            textures: description.textures.keys().cloned().collect(),
            meshes: description.meshes.keys().cloned().collect(),
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

    fn without_groups(&self, name: &str, reason: String) -> Object {
        Object {
            file: self.sources.scene.display().to_string(),
            gone: Some(reason),
            ..Object::without_scene(name, None)
        }
    }

    fn with_groups(&self, name: &str, material: Option<&str>) -> Object {
        let Some(path) = name.parse().ok().filter(|path| exists(&self.loaded.description, path)) else {
            return self.without_groups(name, format!("{name} is not in the scene"));
        };
        let reason = match self.sources.read_only() {
            Some(reason) => reason,
            None => {
                let pieces = self.loaded.pieces();
                let names = self.names();
                let mut groups: Vec<Group> = self.group(&pieces, &path, &names).into_iter().collect();
                let mut queue: Vec<KeyPath> = material.map(|name| table_path("materials", name)).into_iter().collect();
                queue.extend(groups.iter().flat_map(references));
                let mut i = 0;
                while let Some(next) = queue.get(i).cloned() {
                    i += 1;
                    let is_excluded = queue[..i - 1].contains(&next) || !exists(&self.loaded.description, &next);
                    if is_excluded || groups.len() >= MAX_GROUPS {
                        continue;
                    }
                    if let Some(group) = self.group(&pieces, &next, &names) {
                        queue.extend(references(&group));
                        groups.push(group);
                    }
                }
                let gone = None;
                return Object {
                    groups,
                    gone,
                    ..self.without_groups(name, String::new())
                };
            }
        };
        self.without_groups(name, reason)
    }

    fn group(&self, pieces: &Pieces, path: &KeyPath, names: &Names) -> Option<Group> {
        let piece = pieces.find(path);
        let document: Table = toml::from_str(piece.text.trim_start_matches('\u{feff}')).ok()?;
        let table = piece
            .path
            .0
            .iter()
            .try_fold(Value::Table(document), |value, segment| match (value, segment) {
                (Value::Table(mut table), Segment::Key(key)) => table.remove(key),
                (Value::Array(mut list), Segment::Index(i)) if *i < list.len() => Some(list.swap_remove(*i)),
                _ => None,
            });
        let table = table.unwrap_or(Value::Table(Table::new())); // the section is not in the file
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
            let samples = counts.iter().find(|(key, _)| *key == path);
            field.squares = samples.is_some_and(|(_, samples)| samples.pattern(integrator).needs_square());
            let field_path = field.path.parse().ok();
            if let Some(option) = field_path.and_then(|path| self.sources.overrides.in_place_of(&path)) {
                field.fixed = Some(format!("{option} overrides the value of the file"));
            }
        }
        // Keys of the file come first, in the order of the file.
        let offset = |field: &Field| {
            let path: KeyPath = field.path.parse().ok()?;
            let keys = path.0.get(object_path_len(path.0.len(), field)..)?.to_vec();
            let path_in_piece = KeyPath(piece.path.0.iter().cloned().chain(keys).collect());
            layout.extent(&path_in_piece).map(|range| range.start)
        };
        fields.sort_by_cached_key(|field| (field.value.is_none(), offset(field)));
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

    /// Returns the objects whose name, type, file or material contains the query, section by section.
    pub fn objects(&self, query: &str) -> ObjectList {
        let description = &self.loaded.description;
        let lowercase_query = query.to_lowercase();
        let mut list = ObjectList {
            query: query.to_owned(),
            objects: Vec::new(),
            more: 0,
        };
        let mut add = |name: &dyn Fn() -> String, details: String| {
            let name = name();
            if format!("{name} {details}").to_lowercase().contains(&lowercase_query) {
                match list.objects.len() < MAX_LISTED {
                    true => list.objects.push((name, details)),
                    false => list.more += 1,
                }
            }
        };
        for section in ["image", "camera", "render", "environment"] {
            if section != "environment" || description.environment.is_some() {
                add(&|| section.to_owned(), String::new());
            }
        }
        let maps = [
            ("materials", description.materials.keys().collect::<Vec<_>>()),
            ("textures", description.textures.keys().collect()),
            ("meshes", description.meshes.keys().collect()),
        ];
        for (section, keys) in maps {
            keys.into_iter()
                .for_each(|key| add(&|| table_path(section, key).exact(), String::new()));
        }
        for i in 0..description.lights.len() {
            add(&|| format!("lights[{i}]"), String::new());
        }
        for (i, shape) in description.shapes.iter().enumerate() {
            add(&|| format!("shapes[{i}]"), shape_details(shape));
        }
        for (i, instance) in description.instances.iter().enumerate() {
            add(&|| format!("instances[{i}]"), instance.mesh.clone());
        }
        list
    }
}

/// Returns the length of the path of the object that contains a field. `path_len` is the length of the field's path.
fn object_path_len(path_len: usize, field: &Field) -> usize {
    let name_len = field.name.parse::<KeyPath>().map_or(0, |name| name.0.len());
    path_len.saturating_sub(name_len)
}

fn table_path(section: &str, name: &str) -> KeyPath {
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

fn exists(description: &Description, path: &KeyPath) -> bool {
    match path.0.as_slice() {
        [Segment::Key(section)] => match section.as_str() {
            "image" | "camera" | "render" => true,
            "environment" => description.environment.is_some(),
            _ => false,
        },
        [Segment::Key(section), Segment::Key(name)] => match section.as_str() {
            "materials" => description.materials.contains_key(name),
            "textures" => description.textures.contains_key(name),
            "meshes" => description.meshes.contains_key(name),
            _ => false,
        },
        [Segment::Key(section), Segment::Index(i)] => match section.as_str() {
            "shapes" => *i < description.shapes.len(),
            "lights" => *i < description.lights.len(),
            "instances" => *i < description.instances.len(),
            _ => false,
        },
        _ => false,
    }
}

/// Returns the paths of the tables that a table refers to: materials, textures, a mesh.
fn references(group: &Group) -> Vec<KeyPath> {
    let mut paths = Vec::new();
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
        paths.push(table_path(section, text));
    }
    paths
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
    let range = &text[start..line_end(text, end)];
    let number = 1 + text.as_bytes()[..start].iter().filter(|byte| **byte == b'\n').count();
    let first_lines: Vec<&str> = range.lines().take(MAX_LINES).collect();
    (
        number,
        first_lines.join("\n"),
        range.lines().count() - first_lines.len(),
    )
}

/// Returns the name of the object in the file that contains the scene's shape, instance or light with this index, and
/// a note if the object is a glTF file.
fn name_of_shape(loaded: &Loaded, index: usize) -> (String, Option<String>) {
    let description = &loaded.description;
    let gltf: Vec<(usize, bool)> = (description.shapes.iter().enumerate())
        .filter_map(|(i, shape)| match shape {
            ShapeDescription::Gltf(gltf) => Some((i, gltf.lights)),
            _ => None,
        })
        .collect();
    let gltf_shape = |mut index: usize, count: &dyn Fn(usize, bool) -> usize| {
        for (file, (shape, lights)) in gltf.iter().enumerate() {
            match index.checked_sub(count(file, *lights)) {
                Some(remaining) => index = remaining,
                None => return format!("shapes[{shape}]"),
            }
        }
        "render".to_owned() // unreachable: every imported object is from a file
    };
    let imported = |file: usize| loaded.scene.imported.get(file);
    let file_shapes = description.shapes.len() - gltf.len();
    let note = "The object is part of a glTF file, which is read-only here. Run `wgray convert` for an editable scene.";
    if index < file_shapes {
        let mut shapes = description
            .shapes
            .iter()
            .enumerate()
            .filter(|(_, shape)| !matches!(shape, ShapeDescription::Gltf(_)));
        let file_index = shapes.nth(index).map_or(index, |(i, _)| i);
        return (format!("shapes[{file_index}]"), None);
    }
    let Some(light) = index.checked_sub(loaded.scene.shapes.len()) else {
        let instance = index - file_shapes;
        return match instance.checked_sub(description.instances.len()) {
            None => (format!("instances[{instance}]"), None),
            Some(imported_index) => {
                let count = |file: usize, _| imported(file).map_or(0, |file| file.instances.len());
                (gltf_shape(imported_index, &count), Some(note.to_owned()))
            }
        };
    };
    match light.checked_sub(description.lights.len()) {
        None => (format!("lights[{light}]"), None),
        Some(imported_index) => {
            let count =
                |file: usize, lights: bool| imported(file).map_or(0, |file| if lights { file.lights.len() } else { 0 });
            (gltf_shape(imported_index, &count), Some(note.to_owned()))
        }
    }
}

/// Returns the type of a shape, and its file or material.
fn shape_details(shape: &ShapeDescription) -> String {
    let table = serde_json::to_value(shape).unwrap_or_default();
    let text = |key: &str| table[key].as_str();
    let name = text("file").or(text("material")).unwrap_or_default();
    format!("{}, {name}", text("type").unwrap_or_default())
}

#[cfg(test)]
mod tests;
