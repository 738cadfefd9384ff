//! The materials that the primitives of a glTF file use in the selected variant, with their textures.

use std::collections::{BTreeMap, BTreeSet};

use gltf_json::mesh::Primitive;
use serde_json::Value;

use super::ImportedMaterial;
use super::document::Document;
use super::error::GltfError;
use super::material::{Converter, Images, Textures};
use super::texture::Slot;
use crate::{PrincipledDescription, VertexColors};

/// Maximum length of a name in characters. The length is limited because every instance stores the name.
const MAX_NAME_LEN: usize = 200;

pub struct Materials<'a> {
    document: &'a Document,
    variant: Option<usize>,
    /// Maps the index of a material in the file to its index in `used`; the key `None` is the default material.
    use_indices: BTreeMap<Option<usize>, usize>,
    used: Vec<MaterialUse>,
}

pub struct MaterialUse {
    /// Index of the material in the file; `None` is the default material.
    index: Option<usize>,
    /// True if a primitive with vertex colors uses the material.
    is_colored: bool,
    /// Required texture coordinate sets.
    pub sets: BTreeSet<u32>,
    /// The texture whose coordinates define the tangents; `None` if the material needs no tangents.
    pub tangents: Option<Slot>,
}

impl<'a> Materials<'a> {
    pub fn of(document: &'a Document, variant: Option<usize>) -> Materials<'a> {
        Materials {
            document,
            variant,
            use_indices: BTreeMap::new(),
            used: Vec::new(),
        }
    }

    /// Returns the index of a primitive's material in `used`, and adds the material if it is new.
    pub fn mark_used(&mut self, primitive: &Primitive, location: &str, is_colored: bool) -> Result<usize, GltfError> {
        let index = self.material_index(primitive);
        let count = self.document.json.materials.len();
        if let Some(index) = index
            && index >= count
        {
            let rule = format!("{index} is out of range; number of materials: {count}");
            return Err(self.document.fault(format!("{location}.material"), rule));
        }
        let use_index = match self.use_indices.get(&index) {
            Some(use_index) => *use_index,
            None => {
                self.used.push(MaterialUse::of(self.document, index)?);
                self.use_indices.insert(index, self.used.len() - 1);
                self.used.len() - 1
            }
        };
        self.used[use_index].is_colored |= is_colored;
        Ok(use_index)
    }

    pub fn get(&self, index: usize) -> &MaterialUse {
        &self.used[index]
    }

    fn material_index(&self, primitive: &Primitive) -> Option<usize> {
        let extension = || primitive.extensions.as_ref()?.others.get("KHR_materials_variants");
        let mappings = || extension()?.get("mappings")?.as_array();
        let has_variant = |mapping: &&Value, variant: usize| {
            let variants = mapping.get("variants").and_then(Value::as_array);
            variants.is_some_and(|all| all.iter().any(|entry| entry.as_u64() == Some(variant as u64)))
        };
        let variant_material = self.variant.and_then(|variant| {
            let mapping = mappings()?.iter().find(|mapping| has_variant(mapping, variant))?;
            usize::try_from(mapping.get("material")?.as_u64()?).ok()
        });
        variant_material.or(primitive.material.map(|material| material.value()))
    }

    pub fn finish(self, notes: &mut Vec<String>) -> Result<(Vec<ImportedMaterial>, Images), GltfError> {
        let mut images = Images::default();
        let mut names = BTreeSet::new();
        // The next suffix of each repeated name.
        let mut next_suffixes: BTreeMap<String, usize> = BTreeMap::new();
        let mut materials = Vec::with_capacity(self.used.len());
        for used in &self.used {
            let mut name = match used.index {
                None => "default".to_owned(),
                Some(i) => (self.document.json.materials[i].name.clone()).unwrap_or_else(|| format!("material {i}")),
            };
            if let Some((end, _)) = name.char_indices().nth(MAX_NAME_LEN) {
                name.truncate(end);
            }
            let base_name = name.clone();
            while !names.insert(name.clone()) {
                let suffix = next_suffixes.entry(base_name.clone()).or_insert(2);
                name = format!("{base_name} ({suffix})");
                *suffix += 1;
            }
            let mut converter = Converter {
                document: self.document,
                location: String::new(),
                name: name.clone(),
                textures: Textures::new(),
                images: &mut images,
                notes,
            };
            let description = match used.index {
                None => PrincipledDescription::default(),
                Some(index) => converter.material(index, used.is_colored)?,
            };
            let description = match (used.index, used.is_colored) {
                (None, true) => PrincipledDescription {
                    vertex_colors: VertexColors::BaseColor,
                    ..description
                },
                _ => description,
            };
            let textures = converter.textures;
            materials.push(ImportedMaterial {
                name,
                description: description.into(),
                textures,
            });
        }
        Ok((materials, images))
    }
}

const EXTENSION_TEXTURES: [(&str, &str); 14] = [
    ("KHR_materials_transmission", "transmissionTexture"),
    ("KHR_materials_specular", "specularTexture"),
    ("KHR_materials_specular", "specularColorTexture"),
    ("KHR_materials_clearcoat", "clearcoatTexture"),
    ("KHR_materials_clearcoat", "clearcoatRoughnessTexture"),
    ("KHR_materials_clearcoat", "clearcoatNormalTexture"),
    ("KHR_materials_sheen", "sheenColorTexture"),
    ("KHR_materials_sheen", "sheenRoughnessTexture"),
    ("KHR_materials_anisotropy", "anisotropyTexture"),
    ("KHR_materials_iridescence", "iridescenceTexture"),
    ("KHR_materials_iridescence", "iridescenceThicknessTexture"),
    ("KHR_materials_pbrSpecularGlossiness", "diffuseTexture"),
    ("KHR_materials_pbrSpecularGlossiness", "specularGlossinessTexture"),
    ("KHR_materials_volume", "thicknessTexture"),
];

impl MaterialUse {
    fn of(document: &Document, index: Option<usize>) -> Result<MaterialUse, GltfError> {
        let mut used = MaterialUse {
            index,
            is_colored: false,
            sets: BTreeSet::new(),
            tangents: None,
        };
        let Some(index) = index else {
            return Ok(used);
        };
        let material = &document.json.materials[index];
        let location = format!("materials[{index}]");
        let pbr = &material.pbr_metallic_roughness;
        let infos = [
            pbr.base_color_texture.as_ref(),
            pbr.metallic_roughness_texture.as_ref(),
            material.emissive_texture.as_ref(),
        ];
        for info in infos.into_iter().flatten() {
            let extensions = info.extensions.as_ref().map(|all| &all.others);
            let slot = Slot::new(document, &location, (info.index.value(), info.tex_coord), extensions)?;
            used.sets.insert(slot.set);
        }
        let extensions = material.extensions.as_ref().map(|all| &all.others);
        let extension = |name: &str| extensions.and_then(|all| all.get(name));
        for (extension, texture) in EXTENSION_TEXTURES.map(|(name, texture)| (extension(name), texture)) {
            if let Some(value) = extension.and_then(|extension| extension.get(texture)) {
                let (slot, _) = Slot::of_value(document, &format!("{location}.{texture}"), value)?;
                used.sets.insert(slot.set);
                if ["clearcoatNormalTexture", "anisotropyTexture"].contains(&texture) {
                    used.tangents = Some(slot);
                }
            }
        }
        let anisotropy =
            extension("KHR_materials_anisotropy").and_then(|values| values.get("anisotropyStrength")?.as_f64());
        if used.tangents.is_none() && anisotropy.is_some_and(|strength| strength != 0.0) {
            used.sets.insert(0);
            used.tangents = Some(Slot {
                texture: 0,
                set: 0,
                transform: Default::default(),
            });
        }
        if let Some(normal) = &material.normal_texture {
            let extensions = normal.extensions.as_ref().map(|all| &all.others);
            let slot = Slot::new(
                document,
                &location,
                (normal.index.value(), normal.tex_coord),
                extensions,
            )?;
            used.sets.insert(slot.set);
            used.tangents = Some(slot);
        }
        Ok(used)
    }
}
