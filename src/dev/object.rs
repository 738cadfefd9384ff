//! What is at a pixel, and what the scene file says of it: its lines, and its values with what they may be.

use std::sync::Arc;

use glam::UVec2;
use serde::Serialize;
use toml::{Table, Value};

use super::edit::{Layout, line_end, line_start};
use super::source::{Loaded, Sources};
use crate::cpu::geometry::pixel_first_hit;
use crate::pack::{Camera, NOTHING, Packed};
use crate::scene::{Description, Field, KeyPath, Names, Pieces, Segment, ShapeDescription, fields};

/// So many lines of a table are told.
const MOST_LINES: usize = 40;
/// So many objects are listed.
const MOST_LISTED: usize = 50;
/// So many tables are told of that belong to an object: materials, textures, a mesh.
const MOST_GROUPS: usize = 12;

/// The scene as it is looked at: what questions about its objects are answered from.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The scene.
    pub(super) loaded: Arc<Loaded>,
    /// The camera that is looked through.
    pub(super) camera: Camera,
    /// Its file.
    pub(super) sources: Sources,
}

/// An object of the scene file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Object {
    /// As messages name it: `shapes[3]`.
    pub name: String,
    /// The scene file.
    pub file: String,
    /// The pixel that was asked about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<[u32; 2]>,
    /// The material at that pixel, or that which was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// It, and what it names: its material, the textures of that.
    pub groups: Vec<Group>,
    /// What else is to be known of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Why there is nothing to be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gone: Option<String>,
}

/// A table of the scene file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// Its path.
    pub name: String,
    /// Its type, if it has one.
    pub kind: String,
    /// The first of its lines in the file, from 1; 0 if it is not there.
    pub line: usize,
    /// The lines, the first of them where they are many.
    pub text: String,
    /// How many more there are.
    pub more: usize,
    /// Its values.
    pub fields: Vec<Field>,
}

/// Objects whose names have a text in them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Listed {
    /// That text.
    pub part: String,
    /// Their names, and of what type or material they are.
    pub objects: Vec<(String, String)>,
    /// How many more there are.
    pub more: usize,
}

impl Object {
    /// Of a scene that there is not yet.
    pub(super) fn none(name: &str, at: Option<[u32; 2]>) -> Object {
        Object {
            name: name.to_owned(),
            file: String::new(),
            at,
            material: None,
            groups: Vec::new(),
            note: None,
            gone: Some("there is no scene yet".to_owned()),
        }
    }
}

impl Seen {
    /// What is seen at a pixel of the whole picture.
    pub fn at(&self, [x, y]: [u32; 2]) -> Object {
        let mut object = match x < self.camera.width && y < self.camera.height {
            true => self.hit(UVec2::new(x, y)),
            false => self.gone("", format!("pixel {x}, {y} is not in the picture")),
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
        if hit.shape == NOTHING {
            let around = if loaded.description.environment.is_some() {
                "environment"
            } else {
                "render"
            };
            let mut object = self.object(around, None);
            object.note = Some("nothing is here but what is behind everything".to_owned());
            return object;
        }
        let (name, note) = place_of(loaded, hit.shape as usize);
        let material = loaded.scene.material_names.get(hit.material as usize);
        let mut object = self.object(&name, material.map(String::as_str));
        object.note = note.or(object.note);
        object
    }

    /// The object of a name, if there is one; of its materials this one is told first.
    pub fn object(&self, name: &str, material: Option<&str>) -> Object {
        let (own, brought) = match material {
            Some(name) if self.loaded.description.materials.contains_key(name) => (material, None),
            _ => (None, material),
        };
        let brought = brought.map(|name| format!("its material here, {name}, comes from another file"));
        Object {
            material: material.map(str::to_owned),
            note: brought,
            ..self.described(name, own)
        }
    }

    /// The names that objects have for each other.
    pub(super) fn names(&self) -> Names {
        let all = &self.loaded.description;
        Names {
            materials: all.materials.keys().cloned().collect(),
            textures: all.textures.keys().cloned().collect(),
            meshes: all.meshes.keys().cloned().collect(),
        }
    }

    /// The values of the table that a path leads into, if it leads to a value that can be told.
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
                    if is_known || groups.len() >= MOST_GROUPS {
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

    /// The table of the scene file at a path.
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
        let render = &self.loaded.description.render;
        let counts = [
            ("render.pixel_samples.count", &render.pixel_samples),
            ("render.light_samples.count", &render.light_samples),
        ];
        for field in &mut fields {
            let samples = counts.iter().find(|(path, _)| *path == field.path);
            field.squares = samples.is_some_and(|(_, samples)| samples.pattern(render.integrator).needs_square());
            let of_field = field.path.parse().ok();
            if let Some(option) = of_field.and_then(|path| self.sources.overrides.in_place_of(&path)) {
                field.fixed = Some(format!("{option} stands in for what the file says"));
            }
        }
        // Those that are there first, as they stand in the file.
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

    /// The objects whose names have a text in them, in the order of the file's sections.
    pub fn objects(&self, part: &str) -> Listed {
        let all = &self.loaded.description;
        let wanted = part.to_lowercase();
        let mut listed = Listed {
            part: part.to_owned(),
            objects: Vec::new(),
            more: 0,
        };
        let mut add = |name: &dyn Fn() -> String, about: String| {
            let name = name();
            if format!("{name} {about}").to_lowercase().contains(&wanted) {
                match listed.objects.len() < MOST_LISTED {
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
            add(&|| format!("shapes[{i}]"), about(shape));
        }
        for (i, instance) in all.instances.iter().enumerate() {
            add(&|| format!("instances[{i}]"), instance.mesh.clone());
        }
        listed
    }
}

/// How much of a field's path is its object's.
fn path_len(whole: usize, field: &Field) -> usize {
    let below = field.name.parse::<KeyPath>().map_or(0, |name| name.0.len());
    whole.saturating_sub(below)
}

/// A name of one of the sections that have names.
fn named(section: &str, name: &str) -> KeyPath {
    KeyPath([section, name].map(Segment::from).to_vec())
}

/// The object that a path leads into: `shapes[3]` of `shapes[3].radius`.
pub(super) fn object_of(path: &KeyPath) -> Option<KeyPath> {
    let length = match path.0.first()? {
        Segment::Key(section) if ["image", "camera", "render", "environment"].contains(&section.as_str()) => 1,
        _ => 2,
    };
    path.0.get(..length).map(|object| KeyPath(object.to_vec()))
}

/// Whether a scene has an object.
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

/// What a table names: materials, textures, a mesh.
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

/// The lines of a range, with the comments right above: the first one's number, the text, and how many more there are.
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
    let shown: Vec<&str> = whole.lines().take(MOST_LINES).collect();
    (number, shown.join("\n"), whole.lines().count() - shown.len())
}

/// The object of the file that a shape of the scene is, by its number, and what is to be said of it.
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
        "render".to_owned() // every one is of a file
    };
    let imported = |file: usize| loaded.scene.imported.get(file);
    let plain = all.shapes.len() - gltf.len();
    let of_gltf = "it is of this glTF file, whose materials wgray convert writes into a scene";
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

/// Of what type and material a shape is.
fn about(shape: &ShapeDescription) -> String {
    let (kind, name) = match shape {
        ShapeDescription::Rectangle(shape) => ("rectangle", &shape.material),
        ShapeDescription::Disk(shape) => ("disk", &shape.material),
        ShapeDescription::Ellipsoid(shape) => ("ellipsoid", &shape.material),
        ShapeDescription::Sphere(shape) => ("sphere", &shape.material),
        ShapeDescription::Triangle(shape) => ("triangle", &shape.material),
        ShapeDescription::Tetrahedron(shape) => ("tetrahedron", &shape.material),
        ShapeDescription::Plane(shape) => ("plane", &shape.material),
        ShapeDescription::Mesh(shape) => ("mesh", &shape.file),
        ShapeDescription::Gltf(shape) => ("gltf", &shape.file),
    };
    format!("{kind}, {name}")
}

#[cfg(test)]
mod tests;
