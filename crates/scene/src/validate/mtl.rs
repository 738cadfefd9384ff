//! Materials of the MTL files of meshes, for groups to which the scene does not assign a material.

mod principled;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::super::assets::AssetKey;
use super::super::image_file::Part;
use super::super::key_path::{cut, cut_to};
use super::super::limits::{MAX_COLOR, SHININESS};
use super::super::{Color, ImageTextureDescription, Integrator, Material, Reflection, Texture};
use super::default_material::default_materials;
use super::images::Images;
use super::texture::image_texture;
use super::{Checked, Problem, number, show};
use crate::mesh::{Mesh, MtlMaterial};
use crate::write::relative_path;

/// Default values of `Kd` (Ramey, Rose and Tyerman, "MTL material format", 1995) and `Ns` (the default exponent of
/// materials of scene files).
const DIFFUSE: f64 = 0.8;
const NS: f64 = 16.0;

/// Maximum length in characters of the reason why a map is not used.
const MAX_MAP_MESSAGE: usize = 300;

/// The materials of the scene file, then the materials of meshes.
pub(super) struct SceneMaterials<'a> {
    pub names: Vec<String>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub files: &'a mut BTreeSet<PathBuf>,
    images: Images<'a>,
    /// Canonical path of the folder to which paths in messages are relative.
    folder: PathBuf,
    /// The materials of each mesh, by the address of the [`Mesh`] in memory.
    group_materials: HashMap<usize, GroupMaterials>,
    integrator: Integrator,
    /// Indices into `materials`, by MTL file, line, and traits of the mesh.
    indices: HashMap<(PathBuf, usize, Traits), usize>,
    /// Indices into `textures`, by image and part of the image.
    maps: BTreeMap<(AssetKey, Part), usize>,
    /// For each keyword of a file, the first warning, and the number of materials with such a warning.
    warnings: BTreeMap<(PathBuf, String), (String, usize)>,
    /// The default materials of meshes without and with vertex colors. The index of a default material in `materials`
    /// is set when the material is first used.
    defaults: [(Material, Option<usize>); 2],
    /// Notes about materials that mesh files refer to, but no file defines.
    pub unmatched: BTreeSet<String>,
    /// In strict mode, the problem of the first damaged image.
    damage: Option<Problem>,
}

/// The attributes of a mesh on which its materials depend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Traits {
    has_uvs: bool,
    has_colors: bool,
}

struct GroupMaterials {
    /// For each group, the index of the MTL file and of the material in this file, if any.
    mtl_indices: Vec<Option<(usize, usize)>>,
    /// For each group, the index of the material in the scene, set when the material is first requested.
    materials: Vec<Option<usize>>,
}

impl<'a> SceneMaterials<'a> {
    /// Starts with the materials, textures and images of the scene file.
    pub fn new(
        (names, materials): (Vec<String>, Vec<Material>),
        textures: Vec<Texture>,
        images: Images<'a>,
        files: &'a mut BTreeSet<PathBuf>,
        integrator: Integrator,
    ) -> Self {
        let folder = &images.assets.folder;
        SceneMaterials {
            folder: (images.assets.file_system.canonical_folder(folder)).unwrap_or_else(|_| folder.clone()),
            names,
            materials,
            textures,
            files,
            images,
            group_materials: HashMap::new(),
            indices: HashMap::new(),
            maps: BTreeMap::new(),
            warnings: BTreeMap::new(),
            defaults: default_materials(integrator).map(|material| (material, None)),
            integrator,
            unmatched: BTreeSet::new(),
            damage: None,
        }
    }

    pub fn default_material(&mut self, has_colors: bool) -> usize {
        let (material, index) = &mut self.defaults[usize::from(has_colors)];
        *index.get_or_insert_with(|| {
            self.names.push("default".to_owned());
            self.materials.push(material.clone());
            self.materials.len() - 1
        })
    }

    /// Registers a mesh and the files that it refers to, whether or not these files are used.
    pub fn register(&mut self, mesh: &Arc<Mesh>) {
        let address = Arc::as_ptr(mesh).addr();
        if self.group_materials.contains_key(&address) {
            return;
        }
        self.group_materials.insert(address, GroupMaterials::of(mesh));
        for library in &mesh.libraries {
            let maps = library.materials.iter().flat_map(MtlMaterial::maps);
            let maps: BTreeSet<&String> = maps.collect();
            let maps = maps.into_iter().map(|map| self.referenced_path(&library.file, map));
            let paths = maps.chain([library.file.clone()]);
            let paths: Vec<PathBuf> = paths
                .map(|path| self.images.assets.folder.join(self.display_path(&path)))
                .collect();
            self.files.extend(paths);
        }
    }

    /// Returns the index of the material that the mesh's file assigns to a group, if an MTL file defines the material.
    pub fn group_material(&mut self, mesh: &Arc<Mesh>, group: usize) -> Option<usize> {
        let address = Arc::as_ptr(mesh).addr();
        let group_materials = self.group_materials.get(&address)?;
        if let Some(material) = group_materials.materials[group] {
            return Some(material);
        }
        let (library, i) = group_materials.mtl_indices[group]?;
        let library = &mesh.libraries[library];
        let mtl = &library.materials[i];
        let traits = Traits {
            has_uvs: !mesh.uvs.is_empty(),
            has_colors: !mesh.colors.is_empty(),
        };
        let key = (library.file.clone(), mtl.line, traits);
        let material = match self.indices.get(&key) {
            Some(material) => *material,
            None => {
                let material = match self.integrator.follows_paths() {
                    false => self.phong(mtl, &library.file, traits.has_uvs),
                    true => self.principled(mtl, &library.file, traits),
                };
                self.names.push(mtl.name.clone());
                self.materials.push(material);
                self.indices.insert(key, self.materials.len() - 1);
                self.materials.len() - 1
            }
        };
        if let Some(group_materials) = self.group_materials.get_mut(&address) {
            group_materials.materials[group] = Some(material);
        }
        Some(material)
    }

    /// Adds a note about undefined materials of groups, or returns an error in strict mode
    /// ([`Assets::tolerate`](super::super::Assets::tolerate)).
    pub fn report_missing(&mut self, damage: Problem) -> Checked<()> {
        let note = self.images.assets.tolerate(damage, "a gray material is used instead")?;
        self.unmatched.insert(note);
        Ok(())
    }

    pub fn notes(self) -> impl Iterator<Item = String> {
        let warnings = self.warnings.into_values().map(|(first, count)| match count {
            1 => first,
            2 => format!("{first} (and 1 more material)"),
            _ => format!("{first} (and {} more materials)", count - 1),
        });
        self.images.notes.into_iter().chain(self.unmatched).chain(warnings)
    }

    /// Returns a Phong material. Ambient light uses `Kd`, because exporters write arbitrary values for `Ka`.
    fn phong(&mut self, mtl: &MtlMaterial, file: &Path, has_uvs: bool) -> Material {
        let mut warnings = Warnings::default();
        let mut color = |name: &'static str, color: Option<[f64; 3]>, default: f64| {
            let color = color.map_or(DVec3::splat(default), DVec3::from);
            let clamped = color.clamp(DVec3::ZERO, DVec3::splat(MAX_COLOR));
            if clamped != color {
                let (color, limit, clamped) = (show(color), number(MAX_COLOR), show(clamped));
                let rule = format!("each of {color} must be from 0 to {limit}; {clamped} is used instead");
                warnings.add(name, rule);
            } else if name == "Kd" && color.max_element() > 1.0 {
                let rule = format!("{} is used, but colors of MTL files are from 0 to 1", show(color));
                warnings.add(name, rule);
            }
            clamped
        };
        let diffuse = color("Kd", mtl.diffuse, DIFFUSE);
        // The illumination models 0 and 1 have no highlights.
        let specular = match mtl.illumination {
            Some(0 | 1) => DVec3::ZERO,
            _ => color("Ks", mtl.specular, 0.0),
        };
        let exponent = mtl.shininess.unwrap_or(NS);
        let shininess = exponent.clamp(SHININESS.0, SHININESS.1);
        if shininess != exponent && specular != DVec3::ZERO {
            let [exponent, low, high, clamped] = [exponent, SHININESS.0, SHININESS.1, shininess].map(number);
            warnings.add(
                "Ns",
                format!("{exponent} must be from {low} to {high}; {clamped} is used instead"),
            );
        }
        let needs_path = [
            (mtl.emission.is_some_and(|emission| emission != [0.0; 3]), "Ke"),
            (mtl.opacity.is_some_and(|opacity| opacity < 1.0), "d"),
            (mtl.emission_map.is_some(), "map_Ke"),
            (mtl.opacity_map.is_some(), "map_d"),
            (mtl.bump_map.is_some(), "map_Bump"),
            (mtl.normal_map.is_some(), "norm"),
            (mtl.metallic_map.is_some(), "map_Pm"),
            (mtl.roughness_map.is_some(), "map_Pr"),
        ];
        for (_, name) in needs_path.into_iter().filter(|(is_set, _)| *is_set) {
            warnings.add(name, "ignored: it needs integrator = \"path\"");
        }
        warnings.ignored(mtl);
        let map = mtl.diffuse_map.as_ref();
        let texture = map.and_then(|map| {
            let found = self.map_texture(&self.referenced_path(file, map), Part::Colors(None), has_uvs);
            warnings.texture_or_warning("map_Kd", found, "Kd is used instead")
        });
        let diffuse = texture.map_or(Color::Plain(diffuse), Color::Texture);
        self.warn(mtl, file, warnings);
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

    pub fn damage(&mut self) -> Option<Problem> {
        self.damage.take()
    }

    /// Records warnings about a material, and in strict mode the first damage.
    fn warn(&mut self, mtl: &MtlMaterial, file: &Path, warnings: Warnings) {
        let is_strict = self.images.assets.strict;
        for Warning {
            keyword,
            message,
            placeholder,
            is_damage,
        } in warnings.0
        {
            let line = mtl.lines.get(&keyword).unwrap_or(&mtl.line);
            let location = format!(
                "{}:{line}: material {:?}",
                self.display_path(file).display(),
                cut(&mtl.name)
            );
            let mut message = format!("{location}: {keyword}: {message}");
            if is_damage && is_strict {
                self.damage.get_or_insert_with(|| Problem::damage(&*message));
            }
            if let Some(placeholder) = placeholder {
                message = format!("{message}; {placeholder}");
            }
            let warning = self.warnings.entry((file.to_owned(), keyword));
            warning.or_insert((message, 0)).1 += 1;
        }
    }

    /// Returns the index of the texture for an MTL map such as `map_Kd`; adds the texture on first use.
    fn map_texture(&mut self, path: &Path, part: Part, has_uvs: bool) -> Checked<usize> {
        if !has_uvs {
            return Err(Problem::new("the mesh has no texture coordinates"));
        }
        let file = self.display_path(path).to_string_lossy().into_owned();
        let as_damage = |problem: Problem| Problem {
            is_damage: true,
            ..problem
        };
        let asset = self.images.assets.find(&file).map_err(as_damage)?;
        if let Some(texture) = self.maps.get(&(asset.clone(), part)) {
            return Ok(*texture);
        }
        let image = ImageTextureDescription::new(file);
        let texture = image_texture(&image, part, &mut self.images).map_err(as_damage)?;
        self.textures.push(texture);
        self.maps.insert((asset, part), self.textures.len() - 1);
        Ok(self.textures.len() - 1)
    }

    /// Returns the path of a file that an MTL file refers to.
    fn referenced_path(&self, library: &Path, name: &str) -> PathBuf {
        let folder = library.parent().unwrap_or(Path::new(""));
        self.images.assets.file_system.resolve(folder, name)
    }

    /// Returns a path for messages and textures. The path is relative to the scene's folder if the file is in this
    /// folder or in a source.
    fn display_path<'p>(&self, path: &'p Path) -> Cow<'p, Path> {
        if let Ok(relative) = path.strip_prefix(&self.folder) {
            return Cow::Borrowed(relative);
        }
        let relative = match self.images.assets.file_system.is_disk() {
            true => None,
            false => relative_path(&self.folder, path),
        };
        relative.map_or(Cow::Borrowed(path), |relative| Cow::Owned(relative.into()))
    }
}

struct Warning {
    keyword: String,
    message: String,
    /// The replacement of the map, if the warning is about a map that cannot be used.
    placeholder: Option<&'static str>,
    /// True for a damaged or missing file, which is an error in strict mode.
    is_damage: bool,
}

/// Warnings about a material: at most one per keyword.
#[derive(Default)]
struct Warnings(Vec<Warning>);

impl Warnings {
    fn add(&mut self, keyword: impl Into<String>, message: impl Into<String>) {
        self.push(Warning {
            keyword: keyword.into(),
            message: message.into(),
            placeholder: None,
            is_damage: false,
        });
    }

    fn push(&mut self, warning: Warning) {
        if !self.0.iter().any(|added| added.keyword == warning.keyword) {
            self.0.push(warning);
        }
    }

    /// Adds a warning for each statement that has no effect.
    fn ignored(&mut self, mtl: &MtlMaterial) {
        for keyword in &mtl.others {
            self.add(keyword.as_str(), "ignored");
        }
    }

    /// Returns the texture of a map. A map that cannot be used causes a warning.
    fn texture_or_warning(&mut self, keyword: &str, found: Checked<usize>, placeholder: &'static str) -> Option<usize> {
        found
            .map_err(|problem| {
                self.push(Warning {
                    keyword: keyword.to_owned(),
                    message: cut_to(MAX_MAP_MESSAGE, &problem.message).into_owned(),
                    placeholder: Some(placeholder),
                    is_damage: problem.is_damage,
                });
            })
            .ok()
    }
}

impl GroupMaterials {
    fn of(mesh: &Mesh) -> GroupMaterials {
        let mut by_name = HashMap::new();
        for (i, library) in mesh.libraries.iter().enumerate() {
            for (j, material) in library.materials.iter().enumerate() {
                by_name.entry(material.name.as_str()).or_insert((i, j)); // the first material with this name
            }
        }
        let mtl_index = |name: &String| by_name.get(name.as_str()).copied();
        GroupMaterials {
            mtl_indices: mesh
                .groups
                .iter()
                .map(|group| group.material.as_ref().and_then(mtl_index))
                .collect(),
            materials: vec![None; mesh.groups.len()],
        }
    }
}

#[cfg(test)]
mod tests;
