//! Expansion of `gltf` shapes into ordinary meshes, instances, textures, materials and lights.

mod fitting;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use self::fitting::longest_side;
use super::assets::AssetKey;
use super::key_path::Segment;
use super::key_path::list;
use super::problem::{At, Problem};
use super::suggest;
use super::validate::placement;
use super::{
    Assets, ColorDescription, Description, GltfDescription, InstanceDescription, LightDescription, MaterialDescription,
    MeshFileDescription, NormalMapDescription, ShapeDescription, TextureDescription, ValueDescription,
};
use crate::gltf::{ImportOptions, Imported, load};
use crate::note::Note;

/// A description without `gltf` shapes, and its assets.
pub struct ExpandedScene {
    pub description: Description,
    pub assets: Assets,
    pub notes: Vec<Note>,
    /// The imported files. The scene keeps the imports alive, so that later loads of the files can reuse them.
    pub imported: Vec<Arc<Imported>>,
    origins: Vec<Origin>,
    /// For each file name, the number of its last prefix.
    prefix_numbers: BTreeMap<String, usize>,
    prefixes: BTreeSet<String>,
    /// Number of imported objects, plus [`SHAPE_COST`] per shape: for all shapes, and for shapes that repeat a file.
    object_counts: [usize; 2],
}

/// Maximum number of imported objects: the instances, meshes, materials and lights of all `gltf` shapes.
const MAX_OBJECTS: usize = 1 << 21;
/// Maximum number of objects of shapes that repeat a file. An object takes at least 1 KiB of memory.
const MAX_REPEATED_OBJECTS: usize = 1 << 18;
/// Amount that a shape adds to the number of objects.
const SHAPE_COST: usize = 16;

/// The `gltf` shape that expanded objects come from.
struct Origin {
    shape: usize,
    /// Prefix of the names of meshes, materials and textures.
    prefix: String,
    instances: Range<usize>,
    lights: Range<usize>,
}

impl ExpandedScene {
    pub fn of(
        description: &Description,
        assets: &Assets,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<ExpandedScene, Problem> {
        let mut expanded = ExpandedScene {
            description: description.clone(),
            assets: assets.clone(),
            notes: Vec::new(),
            imported: Vec::new(),
            origins: Vec::new(),
            prefix_numbers: BTreeMap::new(),
            prefixes: BTreeSet::new(),
            object_counts: [0; 2],
        };
        for (i, shape) in description.shapes.iter().enumerate() {
            if let ShapeDescription::Gltf(gltf) = shape {
                expanded.add(i, gltf, files).at(i).at("shapes")?;
            }
        }
        let limit = longest_side(&expanded.description, &expanded.assets).map_err(|rule| {
            let first = expanded.origins.first().map_or(0, |origin| origin.shape);
            Problem::of("file", rule).at(first).at("shapes")
        })?;
        if let Some((max_side, bytes)) = limit {
            expanded.assets.longest_side = Some(max_side);
            let gib = bytes as f64 / f64::from(1 << 30);
            let note = format!(
                "images of glTF files take {gib:.1} GiB: images with more than {max_side} texels along a side are halved until no side is longer, so that all images fit in 1 GiB"
            );
            expanded.notes.push(note.into());
        }
        let is_gltf = |shape: &ShapeDescription| matches!(shape, ShapeDescription::Gltf(_));
        expanded.description.shapes.retain(|shape| !is_gltf(shape));
        Ok(expanded)
    }

    /// Maps a problem from the expanded to the original description.
    pub fn original_problem(&self, description: &Description, problem: Problem) -> Problem {
        let origin = self.origins.iter().find(|origin| match problem.key.0.as_slice() {
            [Segment::Key(list), Segment::Index(i), ..] if list == "instances" => origin.instances.contains(i),
            [Segment::Key(list), Segment::Index(i), ..] if list == "lights" => origin.lights.contains(i),
            [Segment::Key(_), Segment::Key(name), ..] => name.starts_with(&origin.prefix),
            _ => false,
        });
        match (origin, problem.key.0.as_slice()) {
            (Some(origin), _) => Problem {
                is_damage: problem.is_damage,
                ..match problem.is_damage {
                    true => Problem::new(problem.message),
                    false => Problem::new(problem.to_string()),
                }
            }
            .at("file")
            .at(origin.shape)
            .at("shapes"),
            (None, [Segment::Key(list), Segment::Index(i), rest @ ..]) if list == "shapes" => {
                let is_plain = |(_, shape): &(usize, &ShapeDescription)| !matches!(shape, ShapeDescription::Gltf(_));
                let shape = description.shapes.iter().enumerate().filter(is_plain).nth(*i);
                let mut problem = problem.clone();
                problem.key.0 = [Segment::from("shapes"), shape.map_or(*i, |(index, _)| index).into()]
                    .into_iter()
                    .chain(rest.iter().cloned())
                    .collect();
                problem
            }
            _ => problem,
        }
    }

    fn add(&mut self, shape: usize, gltf: &GltfDescription, files: &mut BTreeSet<PathBuf>) -> Result<(), Problem> {
        let transform = placement(gltf.translate, gltf.rotate, gltf.scale, gltf.matrix.as_ref())?;
        let AssetKey::File(path) = self.assets.find(&gltf.file).at("file")? else {
            return Err(Problem::of(
                "file",
                format!("{:?} is an image in memory, not a glTF file", gltf.file),
            ));
        };
        let options = ImportOptions::of(gltf)?;
        let result = load(&path, &self.assets.root, &self.assets.file_system, &options, files);
        let imported = result.map_err(|error| Problem::new(error.to_string())).at("file")?;
        let counts = [
            imported.instances.len(),
            imported.meshes.len(),
            imported.materials.len(),
            imported.lights.len(),
        ];
        let object_count = SHAPE_COST + counts.iter().sum::<usize>();
        let is_repeated = self.prefix_numbers.contains_key(&gltf.file);
        let objects = "instances, meshes, materials and lights";
        self.object_counts[0] += object_count;
        self.object_counts[1] += if is_repeated { object_count } else { 0 };
        if self.object_counts[0] > MAX_OBJECTS {
            let rule = format!("all shapes of type \"gltf\" together must import at most {MAX_OBJECTS} {objects}");
            return Err(Problem::of("file", rule));
        }
        if self.object_counts[1] > MAX_REPEATED_OBJECTS {
            let rule =
                format!("shapes that repeat a glTF file together must import at most {MAX_REPEATED_OBJECTS} {objects}");
            return Err(Problem::of("file", rule));
        }
        let prefix = self.prefix(&gltf.file);
        let names = self.materials(gltf, &imported, &prefix)?;
        let mesh_name = |i: usize| format!("{prefix}meshes[{i}]");
        for (i, mesh) in imported.meshes.iter().enumerate() {
            let name = mesh_name(i);
            self.assets.meshes.insert(name.clone(), Arc::clone(mesh));
            let file = MeshFileDescription::new(&name);
            self.description.meshes.insert(name, file);
        }
        for (name, bytes) in &imported.images {
            let name = format!("{prefix}{name}");
            self.assets.encoded.insert(name, Arc::clone(bytes));
        }
        for (name, reason) in &imported.absent {
            let reason = format!("{}: {reason}", gltf.file);
            self.assets.absent.insert(format!("{prefix}{name}"), reason);
        }
        let first_instance = self.description.instances.len();
        for instance in &imported.instances {
            let materials = instance.materials.iter().enumerate();
            let materials = materials.map(|(group, material)| (group.to_string(), names[*material].clone()));
            self.description.instances.push(InstanceDescription {
                mesh: mesh_name(instance.mesh),
                material: None,
                materials: materials.collect(),
                translate: None,
                rotate: None,
                scale: None,
                matrix: Some(rows(&(transform * instance.to_world))),
            });
        }
        let first_light = self.description.lights.len();
        let lights = imported.lights.iter().filter(|_| gltf.lights);
        (self.description.lights).extend(lights.map(|light| transformed(light, &transform)));
        let notes = imported
            .notes
            .iter()
            .map(|note| Note::from(note.as_str()).in_file(&gltf.file));
        self.notes.extend(notes);
        for damage in &imported.damage {
            if self.assets.strict {
                let problem = Problem::damage(format!("{}: {}", gltf.file, damage.what));
                return Err(problem.at("file"));
            }
            let note = Note::from(format!("{}; {}", damage.what, damage.stand_in));
            self.notes.push(note.in_file(&gltf.file));
        }
        self.origins.push(Origin {
            shape,
            prefix,
            instances: first_instance..self.description.instances.len(),
            lights: first_light..self.description.lights.len(),
        });
        self.imported.push(imported);
        Ok(())
    }

    /// Returns a unique prefix for the names in a file.
    fn prefix(&mut self, file: &str) -> String {
        let number = self.prefix_numbers.entry(file.to_owned()).or_default();
        loop {
            *number += 1;
            let prefix = match *number {
                1 => format!("{file}/"),
                i => format!("{file} ({i})/"),
            };
            // The prefix may exist already: another file may be named "FILE (2)".
            if self.prefixes.insert(prefix.clone()) {
                return prefix;
            }
        }
    }

    /// Adds the materials of a file that the shape does not override. Returns the material names, in file order.
    fn materials(&mut self, gltf: &GltfDescription, imported: &Imported, prefix: &str) -> Result<Vec<String>, Problem> {
        let names_in_file: BTreeSet<&str> = imported.materials.iter().map(|material| &*material.name).collect();
        for (name, replacement) in &gltf.materials {
            if !names_in_file.contains(name.as_str()) {
                let rule = format!("the file has no such material; available: {}", list(&names_in_file));
                return Err(Problem::of(name, rule)).at("materials");
            }
            if !self.description.materials.contains_key(replacement) {
                let names = self.description.materials.keys().map(String::as_str);
                let rule = suggest::unknown("material", replacement, names);
                return Err(Problem::of(name, rule)).at("materials");
            }
        }
        let mut names = Vec::with_capacity(imported.materials.len());
        for material in &imported.materials {
            if let Some(replacement) = gltf.materials.get(&material.name) {
                names.push(replacement.clone());
                continue;
            }
            let name = format!("{prefix}{}", material.name);
            let description = with_texture_prefix(&material.description, prefix);
            self.description.materials.insert(name.clone(), description);
            for (texture, description) in &material.textures {
                let mut description = description.clone();
                if let TextureDescription::Image(image) = &mut description {
                    image.file = format!("{prefix}{}", image.file);
                }
                self.description
                    .textures
                    .insert(format!("{prefix}{texture}"), description);
            }
            names.push(name);
        }
        Ok(names)
    }
}

/// Returns the first three rows of the 4 x 4 matrix of a transform.
pub fn rows(transform: &DAffine3) -> Vec<[f64; 4]> {
    let rows = transform.matrix3.transpose();
    let row = |i: usize| rows.col(i).extend(transform.translation[i]).to_array();
    vec![row(0), row(1), row(2)]
}

/// Transforms the position and direction of a light; its emission does not change.
fn transformed(light: &LightDescription, transform: &DAffine3) -> LightDescription {
    let rotate = |direction: DVec3| transform.transform_vector3(direction);
    let mut light = light.clone();
    match &mut light {
        LightDescription::Point(point) => point.position = transform.transform_point3(point.position),
        LightDescription::Directional(directional) => directional.direction = rotate(directional.direction),
        LightDescription::Spot(spot) => {
            spot.position = transform.transform_point3(spot.position);
            spot.direction = spot.direction.map(rotate);
        }
        LightDescription::Rectangle(_) => {} // not in glTF
    }
    light
}

/// Returns the material with prefixed names of textures.
fn with_texture_prefix(material: &MaterialDescription, prefix: &str) -> MaterialDescription {
    let mut material = material.clone();
    let MaterialDescription::Principled(principled) = &mut material else {
        return material;
    };
    let add_prefix = |name: &mut String| *name = format!("{prefix}{name}");
    let colors = [
        &mut principled.base_color,
        &mut principled.specular_color,
        &mut principled.sheen_color,
    ];
    for color in colors.into_iter().chain(&mut principled.emission) {
        if let ColorDescription::Texture(reference) = color {
            add_prefix(&mut reference.texture);
        }
    }
    let values = [
        &mut principled.metallic,
        &mut principled.roughness,
        &mut principled.anisotropy,
        &mut principled.specular,
        &mut principled.transmission,
        &mut principled.clearcoat,
        &mut principled.clearcoat_roughness,
        &mut principled.sheen_roughness,
        &mut principled.alpha,
    ];
    for value in values {
        if let ValueDescription::Texture(reference) = value {
            add_prefix(&mut reference.texture);
        }
    }
    let directions = principled.anisotropy_direction.iter_mut();
    directions.for_each(|direction| add_prefix(&mut direction.texture));
    let maps = [&mut principled.normal_map, &mut principled.clearcoat_normal_map];
    for NormalMapDescription { texture, .. } in maps.into_iter().flatten() {
        add_prefix(texture);
    }
    material
}
