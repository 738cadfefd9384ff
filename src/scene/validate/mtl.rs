//! Materials that meshes bring: what a group's MTL file says of it, as a Phong material, where the scene says nothing.

mod principled;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::super::error::{cut, cut_to};
use super::super::image_file::{Part, Place};
use super::super::limits::{BRIGHTEST, SHININESS};
use super::super::{Color, ImageTextureDescription, Integrator, Material, Reflection, Texture};
use super::appearance::{Images, image_texture};
use super::default_material::default_materials;
use super::{Checked, Problem, number, show};
use crate::mesh::{Mesh, MtlMaterial, file_beside};

/// What a material is like of which its file does not say it: `Kd` by Ramey, Rose and Tyerman, "MTL material format", 1995;
/// the exponent as of a scene's own materials.
const DIFFUSE: f64 = 0.8;
const NS: f64 = 16.0;

/// The most characters that are told of why there is no image.
const MAX_MAP_MESSAGE: usize = 300;

/// All materials of a scene, those of meshes behind its own.
pub(super) struct Looks<'a> {
    pub names: Vec<String>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    /// The files that the scene is made of.
    pub files: &'a mut BTreeSet<PathBuf>,
    images: Images<'a>,
    /// The folder that files are named from in messages, without links.
    folder: PathBuf,
    /// What is known of each mesh, by its address.
    meshes: HashMap<usize, Described>,
    integrator: Integrator,
    /// The materials by their file and line, and by what their mesh has.
    known: HashMap<(PathBuf, usize, Traits), usize>,
    /// The textures of maps.
    maps: BTreeMap<(Place, Part), usize>,
    oddities: BTreeMap<(PathBuf, Oddity), (String, usize)>,
    /// The material of groups that have none, for meshes without and with colors; and its index once it is used.
    defaults: [(Material, Option<usize>); 2],
    /// Notes about materials that mesh files name and no file describes.
    pub unmatched: BTreeSet<String>,
    /// The first damaged image, if damage is refused.
    damage: Option<Problem>,
}

/// What a mesh has that its materials depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Traits {
    has_uvs: bool,
    has_colors: bool,
}

/// Where the materials of a mesh's groups are.
struct Described {
    /// For each group a file of materials and a material in it, if there is one.
    places: Vec<Option<(usize, usize)>>,
    /// For each group the scene's material, once requested.
    materials: Vec<Option<usize>>,
}

/// What is told once for each file, however many of its materials it is true of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Oddity {
    Diffuse,
    Bright,
    Specular,
    Shininess,
    Map,
    Other(&'static str),
}

impl<'a> Looks<'a> {
    /// The scene's own materials and textures, with the images that they have.
    pub fn new(
        (names, materials): (Vec<String>, Vec<Material>),
        textures: Vec<Texture>,
        images: Images<'a>,
        files: &'a mut BTreeSet<PathBuf>,
        integrator: Integrator,
    ) -> Self {
        let folder = &images.assets.folder;
        Looks {
            folder: folder.canonicalize().unwrap_or_else(|_| folder.clone()),
            names,
            materials,
            textures,
            files,
            images,
            meshes: HashMap::new(),
            known: HashMap::new(),
            maps: BTreeMap::new(),
            oddities: BTreeMap::new(),
            defaults: default_materials(integrator).map(|material| (material, None)),
            integrator,
            unmatched: BTreeSet::new(),
            damage: None,
        }
    }

    /// Returns the material of a group that has none.
    pub fn default_material(&mut self, has_colors: bool) -> usize {
        let (material, index) = &mut self.defaults[usize::from(has_colors)];
        *index.get_or_insert_with(|| {
            self.names.push("default".to_owned());
            self.materials.push(material.clone());
            self.materials.len() - 1
        })
    }

    /// Takes note of a mesh, and of the files that it names, whether or not anything is taken from there.
    pub fn know(&mut self, mesh: &Arc<Mesh>) {
        let address = Arc::as_ptr(mesh).addr();
        if self.meshes.contains_key(&address) {
            return;
        }
        self.meshes.insert(address, Described::of(mesh));
        for library in &mesh.libraries {
            let maps = library.materials.iter().flat_map(MtlMaterial::maps);
            let maps: BTreeSet<&String> = maps.collect();
            let maps = maps.into_iter().map(|map| beside(&library.file, map));
            for path in maps.chain([library.file.clone()]) {
                let path = self.images.assets.folder.join(self.shown(&path));
                self.files.insert(path);
            }
        }
    }

    /// The material that a mesh's file gives to a group of it.
    pub fn of_group(&mut self, mesh: &Arc<Mesh>, group: usize) -> Option<usize> {
        let address = Arc::as_ptr(mesh).addr();
        let described = self.meshes.get(&address)?;
        if let Some(material) = described.materials[group] {
            return Some(material);
        }
        let (library, i) = described.places[group]?;
        let library = &mesh.libraries[library];
        let own = &library.materials[i];
        let traits = Traits {
            has_uvs: !mesh.uvs.is_empty(),
            has_colors: !mesh.colors.is_empty(),
        };
        let key = (library.file.clone(), own.line, traits);
        let material = match self.known.get(&key) {
            Some(material) => *material,
            None => {
                let material = match self.integrator {
                    Integrator::Phong => self.phong(own, &library.file, traits.has_uvs),
                    Integrator::Path => self.principled(own, &library.file, traits),
                };
                self.names.push(own.name.clone());
                self.materials.push(material);
                self.known.insert(key, self.materials.len() - 1);
                self.materials.len() - 1
            }
        };
        if let Some(described) = self.meshes.get_mut(&address) {
            described.materials[group] = Some(material);
        }
        Some(material)
    }

    /// Warns of a group without a material, or returns it as an error ([`Assets::tolerate`](super::super::Assets::tolerate)).
    pub fn without_material(&mut self, damage: Problem) -> Checked<()> {
        let note = self.images.assets.tolerate(damage, "a grey material stands in")?;
        self.unmatched.insert(note);
        Ok(())
    }

    /// What is odd about the materials that are used.
    pub fn notes(self) -> impl Iterator<Item = String> {
        let oddities = self.oddities.into_values().map(|(first, count)| match count {
            1 => first,
            2 => format!("{first} (and 1 more material)"),
            _ => format!("{first} (and {} more materials)", count - 1),
        });
        self.images.notes.into_iter().chain(self.unmatched).chain(oddities)
    }

    /// `Ka` is not looked at: exporters write what they like there, and one ambient light wants the colour of the surface.
    fn phong(&mut self, own: &MtlMaterial, file: &Path, has_uvs: bool) -> Material {
        let mut odd = Vec::new();
        let mut color = |name: &str, color: Option<[f64; 3]>, default: f64, oddity: Oddity| {
            let color = color.map_or(DVec3::splat(default), DVec3::from);
            let inside = color.clamp(DVec3::ZERO, DVec3::splat(BRIGHTEST));
            if inside != color {
                let (color, limit, inside) = (show(color), number(BRIGHTEST), show(inside));
                let rule = format!("each of {color} must be from 0 to {limit}; {inside} stands for it");
                odd.push((oddity, format!("{name}: {rule}")));
            }
            inside
        };
        let diffuse = color("Kd", own.diffuse, DIFFUSE, Oddity::Diffuse);
        // Models 0 and 1 have no highlights.
        let specular = match own.illumination {
            Some(0 | 1) => DVec3::ZERO,
            _ => color("Ks", own.specular, 0.0, Oddity::Specular),
        };
        if diffuse.max_element() > 1.0 {
            let rule = "is rendered so, but colours of MTL files are from 0 to 1";
            odd.push((Oddity::Bright, format!("Kd: {} {rule}", show(diffuse))));
        }
        let exponent = own.shininess.unwrap_or(NS);
        let shininess = exponent.clamp(SHININESS.0, SHININESS.1);
        if shininess != exponent && specular != DVec3::ZERO {
            let [exponent, low, high, inside] = [exponent, SHININESS.0, SHININESS.1, shininess].map(number);
            let rule = format!("Ns: {exponent} must be from {low} to {high}; {inside} stands for it");
            odd.push((Oddity::Shininess, rule));
        }
        let needs_path = [
            (own.emission.is_some_and(|emission| emission != [0.0; 3]), "Ke"),
            (own.opacity.is_some_and(|opacity| opacity < 1.0), "d or Tr"),
            (own.emission_map.is_some(), "map_Ke"),
            (own.opacity_map.is_some(), "map_d"),
            (own.bump_map.is_some(), "map_Bump"),
            (own.normal_map.is_some(), "norm"),
            (own.metallic_map.is_some(), "map_Pm"),
            (own.roughness_map.is_some(), "map_Pr"),
        ];
        for (_, name) in needs_path.into_iter().filter(|(is_given, _)| *is_given) {
            odd.push((
                Oddity::Other(name),
                format!("{name} is ignored: it needs integrator = \"path\""),
            ));
        }
        for other in &own.others {
            let verb = if other.starts_with("the ") { "are" } else { "is" };
            odd.push((Oddity::Other(other), format!("{other} {verb} ignored")));
        }
        let texture = own.diffuse_map.as_ref().map(|map| match has_uvs {
            true => self.map(&beside(file, map), Part::Colors(None)),
            false => Err("the mesh has no texture coordinates".to_owned()),
        });
        let diffuse = match texture {
            None => Color::Plain(diffuse),
            Some(Ok(texture)) => Color::Texture(texture),
            Some(Err(why)) => {
                let why = cut_to(MAX_MAP_MESSAGE, &why);
                odd.push((Oddity::Map, format!("map_Kd: {why}; Kd stands for it")));
                Color::Plain(diffuse)
            }
        };
        self.tell(own, file, odd);
        Material {
            reflection: Reflection::Phong {
                ambient: diffuse,
                diffuse,
                specular: Color::Plain(specular),
                shininess,
            },
            emission: Color::BLACK,
            visible: true,
            normal_map: None,
        }
    }

    /// Returns the message of an image that cannot be used, and records it if damage is refused.
    fn refuse(&mut self, problem: Problem) -> String {
        let message = problem.message.clone();
        if problem.is_damage && self.images.assets.strict {
            self.damage.get_or_insert(Problem::damage(&*message));
        }
        message
    }

    /// Returns the first damaged image, if damage is refused.
    pub fn damage(&mut self) -> Option<Problem> {
        self.damage.take()
    }

    /// Records warnings about a material.
    fn tell(&mut self, own: &MtlMaterial, file: &Path, odd: principled::Odd) {
        let place = format!("{}:{}: {:?}", self.shown(file).display(), own.line, cut(&own.name));
        for (oddity, message) in odd {
            let told = self.oddities.entry((file.to_owned(), oddity));
            told.or_insert_with(|| (format!("{place}: {message}"), 0)).1 += 1;
        }
    }

    /// Returns the texture of a part of an image, or why there is none.
    fn map(&mut self, path: &Path, part: Part) -> Result<usize, String> {
        let file = self.shown(path).to_string_lossy().into_owned();
        let place = self.images.assets.find(&file);
        let place = place.map_err(|problem| self.refuse(problem))?;
        if let Some(texture) = self.maps.get(&(place.clone(), part)) {
            return Ok(*texture);
        }
        let image = ImageTextureDescription::new(file);
        let texture = image_texture(&image, part, &mut self.images);
        let texture = texture.map_err(|problem| self.refuse(problem))?;
        self.textures.push(texture);
        self.maps.insert((place, part), self.textures.len() - 1);
        Ok(self.textures.len() - 1)
    }

    fn shown<'p>(&self, path: &'p Path) -> &'p Path {
        shown(&self.folder, path)
    }
}

impl Described {
    fn of(mesh: &Mesh) -> Described {
        let mut by_name = HashMap::new();
        for (i, library) in mesh.libraries.iter().enumerate() {
            for (j, material) in library.materials.iter().enumerate() {
                by_name.entry(material.name.as_str()).or_insert((i, j)); // the first one of a name
            }
        }
        let place = |name: &String| by_name.get(name.as_str()).copied();
        Described {
            places: mesh
                .groups
                .iter()
                .map(|g| g.material.as_ref().and_then(place))
                .collect(),
            materials: vec![None; mesh.groups.len()],
        }
    }
}

/// A file that an MTL file names.
fn beside(library: &Path, name: &str) -> PathBuf {
    file_beside(library.parent().unwrap_or(Path::new("")), name)
}

/// A path as it is shown: from the scene's folder if it is in there.
fn shown<'p>(folder: &Path, path: &'p Path) -> &'p Path {
    path.strip_prefix(folder).unwrap_or(path)
}

#[cfg(test)]
mod tests;
