//! Expansion of `gltf` shapes into ordinary meshes, instances, textures, materials and lights.

mod fitting;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use self::fitting::longest_side;
use super::image_file::AssetKey;
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
    /// The imported files, which must outlive the scene.
    pub imported: Vec<Arc<Imported>>,
    origins: Vec<Origin>,
    /// Number of shapes per file.
    numbers: BTreeMap<String, usize>,
    prefixes: BTreeSet<String>,
    /// Number of imported parts, plus [`SHAPE`] per shape: for all files, and for repeated files only.
    brought: [usize; 2],
}

/// Maximum total number of instances, meshes, materials and lights of all shapes.
const MAX_IMPORTED_INSTANCES: usize = 1 << 21;
/// Maximum total number of these parts that come from repeated files. Each part takes at least 1 KiB.
const MAX_REPEATED_IMPORTS: usize = 1 << 18;
/// Amount that a shape adds to these counts.
const SHAPE: usize = 16;

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
            numbers: BTreeMap::new(),
            prefixes: BTreeSet::new(),
            brought: [0; 2],
        };
        for (i, shape) in description.shapes.iter().enumerate() {
            if let ShapeDescription::Gltf(gltf) = shape {
                expanded.add(i, gltf, files).at(i).at("shapes")?;
            }
        }
        let fitting = longest_side(&expanded.description, &expanded.assets).map_err(|rule| {
            let first = expanded.origins.first().map_or(0, |origin| origin.shape);
            Problem::of("file", rule).at(first).at("shapes")
        })?;
        if let Some((longest, bytes)) = fitting {
            expanded.assets.longest_side = Some(longest);
            let gib = bytes as f64 / f64::from(1 << 30);
            let note = format!(
                "images of glTF files take {gib:.1} GiB: those with more than {longest} texels along a side are halved until they have no more, so that all fit 1 GiB"
            );
            expanded.notes.push(note.into());
        }
        let is_gltf = |shape: &ShapeDescription| matches!(shape, ShapeDescription::Gltf(_));
        expanded.description.shapes.retain(|shape| !is_gltf(shape));
        Ok(expanded)
    }

    /// Maps a problem from the expanded to the original description.
    pub fn place(&self, description: &Description, problem: Problem) -> Problem {
        let brought = self.origins.iter().find(|origin| match problem.key.0.as_slice() {
            [Segment::Key(list), Segment::Index(i), ..] if list == "instances" => origin.instances.contains(i),
            [Segment::Key(list), Segment::Index(i), ..] if list == "lights" => origin.lights.contains(i),
            [Segment::Key(_), Segment::Key(name), ..] => name.starts_with(&origin.prefix),
            _ => false,
        });
        match (brought, problem.key.0.as_slice()) {
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
                let plain = |(_, shape): &(usize, &ShapeDescription)| !matches!(shape, ShapeDescription::Gltf(_));
                let number = description.shapes.iter().enumerate().filter(plain).nth(*i);
                let mut moved = problem.clone();
                moved.key.0 = [Segment::from("shapes"), number.map_or(*i, |(number, _)| number).into()]
                    .into_iter()
                    .chain(rest.iter().cloned())
                    .collect();
                moved
            }
            _ => problem,
        }
    }

    fn add(&mut self, shape: usize, gltf: &GltfDescription, files: &mut BTreeSet<PathBuf>) -> Result<(), Problem> {
        let transform = placement(gltf.translate, gltf.rotate, gltf.scale, gltf.matrix.as_ref())?;
        let AssetKey::File(path) = self.assets.find(&gltf.file).at("file")? else {
            return Err(Problem::of(
                "file",
                format!("{:?} is in memory, and no glTF file", gltf.file),
            ));
        };
        let choice = ImportOptions::of(gltf)?;
        let read = load(&path, &self.assets.root, &choice, files);
        let imported = read.map_err(|error| Problem::new(error.to_string())).at("file")?;
        let counts = [
            imported.instances.len(),
            imported.meshes.len(),
            imported.materials.len(),
            imported.lights.len(),
        ];
        let brought = SHAPE + counts.iter().sum::<usize>();
        let is_again = self.numbers.contains_key(&gltf.file);
        let what = "instances, meshes, materials and lights";
        self.brought[0] += brought;
        self.brought[1] += if is_again { brought } else { 0 };
        if self.brought[0] > MAX_IMPORTED_INSTANCES {
            let rule =
                format!("all shapes of type \"gltf\" together must bring at most {MAX_IMPORTED_INSTANCES} {what}");
            return Err(Problem::of("file", rule));
        }
        if self.brought[1] > MAX_REPEATED_IMPORTS {
            let rule =
                format!("shapes that name a glTF file again together must bring at most {MAX_REPEATED_IMPORTS} {what}");
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
        for (name, why) in &imported.absent {
            let why = format!("{}: {why}", gltf.file);
            self.assets.absent.insert(format!("{prefix}{name}"), why);
        }
        let first = self.description.instances.len();
        for placed in &imported.instances {
            let materials = placed.materials.iter().enumerate();
            let materials = materials.map(|(group, material)| (group.to_string(), names[*material].clone()));
            self.description.instances.push(InstanceDescription {
                mesh: mesh_name(placed.mesh),
                material: None,
                materials: materials.collect(),
                translate: None,
                rotate: None,
                scale: None,
                matrix: Some(rows(&(transform * placed.to_world))),
            });
        }
        let first_light = self.description.lights.len();
        let lights = imported.lights.iter().filter(|_| gltf.lights);
        (self.description.lights).extend(lights.map(|light| moved(light, &transform)));
        let notes = imported
            .notes
            .iter()
            .map(|note| Note::from(note.as_str()).in_file(&gltf.file));
        self.notes.extend(notes);
        for damage in &imported.damage {
            if self.assets.strict {
                let what = Problem::damage(format!("{}: {}", gltf.file, damage.what));
                return Err(what.at("file"));
            }
            let note = Note::from(format!("{}; {}", damage.what, damage.stand_in));
            self.notes.push(note.in_file(&gltf.file));
        }
        self.origins.push(Origin {
            shape,
            prefix,
            instances: first..self.description.instances.len(),
            lights: first_light..self.description.lights.len(),
        });
        self.imported.push(imported);
        Ok(())
    }

    /// Returns a unique prefix for a file's names.
    fn prefix(&mut self, file: &str) -> String {
        let number = self.numbers.entry(file.to_owned()).or_default();
        loop {
            *number += 1;
            let prefix = match *number {
                1 => format!("{file}/"),
                i => format!("{file} ({i})/"),
            };
            // A different file may have the same name.
            if self.prefixes.insert(prefix.clone()) {
                return prefix;
            }
        }
    }

    /// Returns the names of a file's materials after the shape's overrides.
    fn materials(&mut self, gltf: &GltfDescription, imported: &Imported, prefix: &str) -> Result<Vec<String>, Problem> {
        let known: BTreeSet<&str> = imported.materials.iter().map(|material| &*material.name).collect();
        for (name, own) in &gltf.materials {
            if !known.contains(name.as_str()) {
                let rule = format!("the file has no such material; there are {}", list(&known));
                return Err(Problem::of(name, rule)).at("materials");
            }
            if !self.description.materials.contains_key(own) {
                let names = self.description.materials.keys().map(String::as_str);
                let rule = suggest::unknown("material", own, names);
                return Err(Problem::of(name, rule)).at("materials");
            }
        }
        let mut names = Vec::with_capacity(imported.materials.len());
        for material in &imported.materials {
            if let Some(own) = gltf.materials.get(&material.name) {
                names.push(own.clone());
                continue;
            }
            let name = format!("{prefix}{}", material.name);
            let described = renamed(&material.description, prefix);
            self.description.materials.insert(name.clone(), described);
            for (texture, described) in &material.textures {
                let mut described = described.clone();
                if let TextureDescription::Image(image) = &mut described {
                    image.file = format!("{prefix}{}", image.file);
                }
                self.description
                    .textures
                    .insert(format!("{prefix}{texture}"), described);
            }
            names.push(name);
        }
        Ok(names)
    }
}

fn rows(map: &DAffine3) -> Vec<[f64; 4]> {
    let rows = map.matrix3.transpose();
    let row = |i: usize| rows.col(i).extend(map.translation[i]).to_array();
    vec![row(0), row(1), row(2)]
}

/// Transforms a light without changing the emission.
fn moved(light: &LightDescription, map: &DAffine3) -> LightDescription {
    let turned = |direction: DVec3| map.transform_vector3(direction);
    let mut light = light.clone();
    match &mut light {
        LightDescription::Point(point) => point.position = map.transform_point3(point.position),
        LightDescription::Directional(sun) => sun.direction = turned(sun.direction),
        LightDescription::Spot(spot) => {
            spot.position = map.transform_point3(spot.position);
            spot.direction = spot.direction.map(turned);
        }
        LightDescription::Rectangle(_) => {} // not in glTF
    }
    light
}

/// Prefixes the textures of a material.
fn renamed(material: &MaterialDescription, prefix: &str) -> MaterialDescription {
    let mut material = material.clone();
    let MaterialDescription::Principled(of) = &mut material else {
        return material;
    };
    let rename = |name: &mut String| *name = format!("{prefix}{name}");
    let colors = [&mut of.base_color, &mut of.specular_color, &mut of.sheen_color];
    for color in colors.into_iter().chain(&mut of.emission) {
        if let ColorDescription::Texture(reference) = color {
            rename(&mut reference.texture);
        }
    }
    let values = [
        &mut of.metallic,
        &mut of.roughness,
        &mut of.anisotropy,
        &mut of.specular,
        &mut of.transmission,
        &mut of.clearcoat,
        &mut of.clearcoat_roughness,
        &mut of.sheen_roughness,
        &mut of.alpha,
    ];
    for value in values {
        if let ValueDescription::Texture(reference) = value {
            rename(&mut reference.texture);
        }
    }
    let directions = of.anisotropy_direction.iter_mut();
    directions.for_each(|direction| rename(&mut direction.texture));
    let maps = [&mut of.normal_map, &mut of.clearcoat_normal_map];
    for NormalMapDescription { texture, .. } in maps.into_iter().flatten() {
        rename(texture);
    }
    material
}
