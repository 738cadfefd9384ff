//! Conversion of glTF materials (section 3.9, KHR_materials_*) to `principled`, whose parameters have the same names.

use std::collections::BTreeMap;
use std::sync::Arc;

use gltf_json::material::AlphaMode as JsonAlphaMode;
use gltf_json::validation::Checked;
use serde_json::{Map, Value};

use super::document::Document;
use super::error::GltfError;
use super::light::note;
use super::texture::{Slot, has_alpha};
use crate::{
    AlphaMode, Channel, ColorDescription, Encoding, NormalMapDescription, PrincipledDescription, TextureDescription,
    TextureReference, ValueDescription, VertexColors,
};

/// The images of all materials, by name.
#[derive(Default)]
pub struct Images {
    pub read: BTreeMap<String, Arc<[u8]>>,
    /// Reasons for missing images.
    pub absent: BTreeMap<String, String>,
}

pub(super) type Textures = BTreeMap<String, TextureDescription>;

/// Maximum emitted radiance.
const BRIGHTEST: f64 = 1e6;
const IORS: (f64, f64) = (1.0, 100.0);

pub(super) struct Converter<'a> {
    pub document: &'a Document,
    pub place: String,
    pub name: String,
    pub textures: Textures,
    pub images: &'a mut Images,
    pub notes: &'a mut Vec<String>,
}

const R: Channel = Channel::R;
const G: Channel = Channel::G;
const B: Channel = Channel::B;
const A: Channel = Channel::A;

impl Converter<'_> {
    pub fn material(&mut self, index: usize, is_colored: bool) -> Result<PrincipledDescription, GltfError> {
        self.place = format!("materials[{index}]");
        let json = &self.document.json.materials[index];
        let others = json.extensions.as_ref().map(|all| &all.others);
        let extension = |name: &str| others.and_then(|all| all.get(name)).and_then(Value::as_object);
        let pbr = &json.pbr_metallic_roughness;
        let mut of = PrincipledDescription {
            double_sided: json.double_sided,
            vertex_colors: if is_colored {
                VertexColors::BaseColor
            } else {
                VertexColors::None
            },
            ..PrincipledDescription::default()
        };
        let [r, g, b, a] = pbr.base_color_factor.0.map(f64::from);
        let mut base = (
            self.shares("baseColorFactor", [r, g, b])?,
            self.share("baseColorFactor", a)?,
        );
        let mut base_texture = (pbr.base_color_texture.as_ref())
            .map(|info| {
                let others = info.extensions.as_ref().map(|all| &all.others);
                Slot::new(self.document, &self.place, (info.index.value(), info.tex_coord), others)
            })
            .transpose()?;
        let metal = self.share("metallicFactor", pbr.metallic_factor.0.into())?;
        let rough = self.share("roughnessFactor", pbr.roughness_factor.0.into())?;
        match &pbr.metallic_roughness_texture {
            None => (of.metallic, of.roughness) = (metal.into(), rough.into()),
            Some(info) => {
                let others = info.extensions.as_ref().map(|all| &all.others);
                let slot = Slot::new(self.document, &self.place, (info.index.value(), info.tex_coord), others)?;
                let name = self.texture(&slot, Encoding::Linear, [1.0, rough, metal, 1.0])?;
                of.metallic = ValueDescription::channel(&name, B);
                of.roughness = ValueDescription::channel(&name, G);
            }
        }
        if let Some(normal) = &json.normal_texture {
            let others = normal.extensions.as_ref().map(|all| &all.others);
            let slot = Slot::new(
                self.document,
                &self.place,
                (normal.index.value(), normal.tex_coord),
                others,
            )?;
            of.normal_map = Some(self.normal_map(&slot, normal.scale.into())?);
        }
        if json.occlusion_texture.is_some() {
            let rule = "occlusion textures are ignored: the path tracer computes occlusion";
            note(self.notes, rule.to_owned());
        }
        let strength = extension("KHR_materials_emissive_strength").and_then(|of| of.get("emissiveStrength")?.as_f64());
        let emission = json.emissive_factor.0.map(|x| f64::from(x) * strength.unwrap_or(1.0));
        if emission != [0.0; 3] {
            let slot = (json.emissive_texture.as_ref())
                .map(|info| {
                    let others = info.extensions.as_ref().map(|all| &all.others);
                    Slot::new(self.document, &self.place, (info.index.value(), info.tex_coord), others)
                })
                .transpose()?;
            let emission = self.colors("emissiveFactor times emissiveStrength", emission, BRIGHTEST)?;
            of.emission = Some(self.color(slot.as_ref(), emission)?);
        }
        if let Some(ior) = extension("KHR_materials_ior") {
            self.ior(self.number(ior, "ior", 1.5)?, &mut of)?;
        }
        if let Some(all) = extension("KHR_materials_transmission") {
            of.transmission = self.value(all, "transmissionFactor", 0.0, "transmissionTexture", R)?;
        }
        if let Some(all) = extension("KHR_materials_volume") {
            self.volume(all, &mut of)?;
        }
        if let Some(all) = extension("KHR_materials_specular") {
            of.specular = self.value(all, "specularFactor", 1.0, "specularTexture", A)?;
            let factor = self.triple(all, "specularColorFactor", [1.0; 3])?;
            let factor = self.colors("specularColorFactor", factor, BRIGHTEST)?;
            of.specular_color = self.extension_color(all, factor, "specularColorTexture")?;
        }
        if let Some(all) = extension("KHR_materials_clearcoat") {
            of.clearcoat = self.value(all, "clearcoatFactor", 0.0, "clearcoatTexture", R)?;
            of.clearcoat_roughness =
                self.value(all, "clearcoatRoughnessFactor", 0.0, "clearcoatRoughnessTexture", G)?;
            if let Some(map) = all.get("clearcoatNormalTexture") {
                let (slot, scale) = Slot::of_value(self.document, &self.place, map)?;
                of.clearcoat_normal_map = Some(self.normal_map(&slot, scale)?);
            }
        }
        if let Some(all) = extension("KHR_materials_sheen") {
            let factor = self.triple(all, "sheenColorFactor", [0.0; 3])?;
            let factor = self.shares("sheenColorFactor", factor)?;
            of.sheen_color = self.extension_color(all, factor, "sheenColorTexture")?;
            of.sheen_roughness = self.value(all, "sheenRoughnessFactor", 0.0, "sheenRoughnessTexture", A)?;
        }
        if let Some(all) = extension("KHR_materials_anisotropy") {
            self.anisotropy(all, &mut of)?;
        }
        if let Some(all) = extension("KHR_materials_pbrSpecularGlossiness") {
            (base, base_texture) = self.specular_glossiness(all, &mut of)?;
        }
        let ([r, g, b], a) = base;
        let name = (base_texture.as_ref())
            .map(|slot| self.texture(slot, Encoding::Srgb, [r, g, b, a]))
            .transpose()?;
        of.base_color = match &name {
            None => ColorDescription::Plain([r, g, b].into()),
            Some(name) => ColorDescription::texture(name),
        };
        let has_alpha = match &base_texture {
            None => false,
            Some(slot) => self.has_alpha(slot)?,
        };
        of.alpha_mode = match json.alpha_mode {
            Checked::Valid(JsonAlphaMode::Mask) => AlphaMode::Mask,
            Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        if of.alpha_mode == AlphaMode::Blend && a == 1.0 && !has_alpha && !is_colored {
            of.alpha_mode = AlphaMode::Opaque; // exporters write opaque materials as BLEND
        }
        if of.alpha_mode != AlphaMode::Opaque {
            of.alpha = match name {
                Some(name) if has_alpha => ValueDescription::channel(name, A),
                _ => a.into(),
            };
            let cutoff = json.alpha_cutoff.as_ref().map_or(0.5, |cutoff| cutoff.0.into());
            if cutoff > 1.0 {
                // The cutoff exceeds every alpha value, so the material is invisible.
                of.alpha = 0.0.into();
            }
            of.alpha_cutoff = f64::clamp(cutoff, 0.0, 1.0);
        }
        if extension("KHR_materials_unlit").is_some() {
            return Ok(self.unlit(of));
        }
        Ok(of)
    }

    /// Converts KHR_materials_unlit to emission.
    fn unlit(&mut self, of: PrincipledDescription) -> PrincipledDescription {
        PrincipledDescription {
            emission: Some(of.base_color),
            base_color: [0.0; 3].into(),
            metallic: 0.0.into(),
            roughness: 1.0.into(),
            specular: 0.0.into(),
            alpha: of.alpha,
            alpha_mode: of.alpha_mode,
            alpha_cutoff: of.alpha_cutoff,
            double_sided: of.double_sided,
            vertex_colors: match of.vertex_colors {
                VertexColors::None => VertexColors::None,
                _ => VertexColors::Emission,
            },
            ..PrincipledDescription::default()
        }
    }

    fn ior(&mut self, ior: f64, of: &mut PrincipledDescription) -> Result<(), GltfError> {
        if ior == 0.0 {
            // In the extension, 0 means total reflection.
            of.ior = IORS.1;
            of.specular_color = [(101.0_f64 / 99.0).powi(2); 3].into();
            return Ok(());
        }
        of.ior = ior.clamp(IORS.0, IORS.1);
        if of.ior != ior {
            let rule = format!(
                "ior: {ior} must be 0 or from {} to {}; {} stands for it",
                IORS.0, IORS.1, of.ior
            );
            note(self.notes, format!("{}: {rule}", self.display_name()));
        }
        Ok(())
    }

    /// Applies KHR_materials_volume. The thickness factor only enables the volume; rays trace the actual thickness.
    fn volume(&mut self, all: &Map<String, Value>, of: &mut PrincipledDescription) -> Result<(), GltfError> {
        let thickness = self.number(all, "thicknessFactor", 0.0)?;
        let color = self.triple(all, "attenuationColor", [1.0; 3])?;
        let color = self.shares("attenuationColor", color)?;
        let distance = self.number(all, "attenuationDistance", f64::INFINITY)?;
        if thickness <= 0.0 {
            return Ok(()); // thin-walled
        }
        of.thickness = thickness.min(1e9);
        of.double_sided = true; // by the extension, as the interior is visible
        if color != [1.0; 3] && distance.is_finite() && distance > 0.0 {
            of.attenuation_color = color.into();
            of.attenuation_distance = Some(distance.clamp(1e-6, 1e9));
        }
        Ok(())
    }

    fn anisotropy(&mut self, all: &Map<String, Value>, of: &mut PrincipledDescription) -> Result<(), GltfError> {
        let strength = self.share("anisotropyStrength", self.number(all, "anisotropyStrength", 0.0)?)?;
        of.anisotropy = strength.into();
        of.anisotropy_rotation = self.number(all, "anisotropyRotation", 0.0)?.to_degrees() % 360.0;
        if let Some(texture) = all.get("anisotropyTexture") {
            let (slot, _) = Slot::of_value(self.document, &self.place, texture)?;
            let name = self.texture(&slot, Encoding::Linear, [1.0, 1.0, strength, 1.0])?;
            of.anisotropy = ValueDescription::channel(&name, B);
            of.anisotropy_direction = Some(TextureReference { texture: name });
        }
        Ok(())
    }

    /// Applies KHR_materials_pbrSpecularGlossiness. Returns the diffuse colour, alpha and texture.
    #[allow(clippy::type_complexity, reason = "the two are taken apart at once")]
    fn specular_glossiness(
        &mut self,
        all: &Map<String, Value>,
        of: &mut PrincipledDescription,
    ) -> Result<(([f64; 3], f64), Option<Slot>), GltfError> {
        let factor: [f64; 4] = self.numbers(all, "diffuseFactor", [1.0; 4])?;
        let [r, g, b, a] = factor;
        let base = (
            self.shares("diffuseFactor", [r, g, b])?,
            self.share("diffuseFactor", a)?,
        );
        let specular = self.triple(all, "specularFactor", [1.0; 3])?;
        let specular = self.shares("specularFactor", specular)?;
        let gloss = self.share("glossinessFactor", self.number(all, "glossinessFactor", 1.0)?)?;
        of.metallic = 0.0.into();
        of.roughness = (1.0 - gloss).into();
        // An ior of 1.5 has a reflectance of 0.04.
        of.specular_color = specular.map(|x| x / 0.04).into();
        if let Some(texture) = all.get("specularGlossinessTexture") {
            let (slot, _) = Slot::of_value(self.document, &self.place, texture)?;
            let [r, g, b] = specular.map(|x| x / 0.04);
            let name = self.texture(&slot, Encoding::Srgb, [r, g, b, 1.0])?;
            of.specular_color = ColorDescription::texture(name);
            let rule = "KHR_materials_pbrSpecularGlossiness: the glossiness of its textures is ignored";
            note(self.notes, rule.to_owned());
        }
        let slot = (all.get("diffuseTexture"))
            .map(|texture| Slot::of_value(self.document, &self.place, texture))
            .transpose()?;
        Ok((base, slot.map(|(slot, _)| slot)))
    }

    /// Returns a parameter from 0 to 1, which may have a texture.
    fn value(
        &mut self,
        all: &Map<String, Value>,
        factor: &str,
        default: f64,
        texture: &str,
        channel: Channel,
    ) -> Result<ValueDescription, GltfError> {
        let plain = self.share(factor, self.number(all, factor, default)?)?;
        let Some(texture) = all.get(texture) else {
            return Ok(plain.into());
        };
        let (slot, _) = Slot::of_value(self.document, &self.place, texture)?;
        if plain == 0.0 || channel == A && !self.has_alpha(&slot)? {
            return Ok(plain.into());
        }
        let name = self.texture(&slot, Encoding::Linear, [plain; 4])?;
        Ok(ValueDescription::channel(name, channel))
    }

    fn extension_color(
        &mut self,
        all: &Map<String, Value>,
        factor: [f64; 3],
        texture: &str,
    ) -> Result<ColorDescription, GltfError> {
        let slot = (all.get(texture))
            .map(|texture| Slot::of_value(self.document, &self.place, texture))
            .transpose()?;
        self.color(slot.map(|(slot, _)| slot).as_ref(), factor)
    }

    fn color(&mut self, slot: Option<&Slot>, [r, g, b]: [f64; 3]) -> Result<ColorDescription, GltfError> {
        Ok(match slot {
            None => ColorDescription::Plain([r, g, b].into()),
            Some(slot) => ColorDescription::texture(self.texture(slot, Encoding::Srgb, [r, g, b, 1.0])?),
        })
    }

    fn normal_map(&mut self, slot: &Slot, scale: f64) -> Result<NormalMapDescription, GltfError> {
        let strength = scale.clamp(-100.0, 100.0);
        Ok(NormalMapDescription {
            texture: self.texture(slot, Encoding::Linear, [1.0; 4])?,
            strength: if strength.is_nan() { 1.0 } else { strength },
        })
    }

    /// Returns the name of a texture, and adds the texture if it is new.
    fn texture(&mut self, slot: &Slot, encoding: Encoding, factor: [f64; 4]) -> Result<String, GltfError> {
        let file = self.image(slot)?;
        let mut lookup = self.document.lookup(slot, &self.place, &file, encoding)?;
        lookup.factor = factor;
        let description = TextureDescription::Image(lookup);
        let known = self.textures.iter().find(|(_, known)| **known == description);
        if let Some((name, _)) = known {
            return Ok(name.clone());
        }
        let name = format!("{}/{}", self.name, self.textures.len());
        self.textures.insert(name.clone(), description);
        Ok(name)
    }

    /// Returns the name of an image, and reads the image if it is new.
    fn image(&mut self, slot: &Slot) -> Result<String, GltfError> {
        let image = self.document.image_of(slot.texture)?;
        let name = format!("images[{image}]");
        if self.images.read.contains_key(&name) || self.images.absent.contains_key(&name) {
            return Ok(name);
        }
        match self.document.image_bytes(image)? {
            Ok(bytes) => _ = self.images.read.insert(name.clone(), bytes),
            Err(why) => _ = self.images.absent.insert(name.clone(), why),
        }
        Ok(name)
    }

    fn has_alpha(&mut self, slot: &Slot) -> Result<bool, GltfError> {
        let name = self.image(slot)?;
        Ok(self.images.read.get(&name).is_some_and(|bytes| has_alpha(bytes)))
    }

    fn numbers<const N: usize>(
        &self,
        all: &Map<String, Value>,
        key: &str,
        default: [f64; N],
    ) -> Result<[f64; N], GltfError> {
        let Some(value) = all.get(key) else {
            return Ok(default);
        };
        let list = value
            .as_array()
            .map(|list| list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>());
        let numbers = list.flatten().and_then(|list| <[f64; N]>::try_from(list).ok());
        let rule = || {
            self.document
                .fault(&self.place, format!("{key}: {value} must be a list of {N} numbers"))
        };
        numbers.filter(|all| all.iter().all(|x| x.is_finite())).ok_or_else(rule)
    }

    fn triple(&self, all: &Map<String, Value>, key: &str, default: [f64; 3]) -> Result<[f64; 3], GltfError> {
        self.numbers(all, key, default)
    }

    fn number(&self, all: &Map<String, Value>, key: &str, default: f64) -> Result<f64, GltfError> {
        let Some(value) = all.get(key) else {
            return Ok(default);
        };
        let number = value.as_f64().filter(|x| x.is_finite());
        number.ok_or_else(|| {
            self.document
                .fault(&self.place, format!("{key}: {value} must be a number"))
        })
    }

    /// Clamps a value to 0 ... 1; adds a note if this changes the value.
    fn share(&mut self, key: &str, x: f64) -> Result<f64, GltfError> {
        let [x, _, _] = self.colors(key, [x, 0.0, 0.0], 1.0)?;
        Ok(x)
    }

    fn shares(&mut self, key: &str, color: [f64; 3]) -> Result<[f64; 3], GltfError> {
        self.colors(key, color, 1.0)
    }

    /// Clamps color components to 0 ... `most`; adds a note if this changes a component.
    fn colors(&mut self, key: &str, color: [f64; 3], most: f64) -> Result<[f64; 3], GltfError> {
        if color.iter().any(|x| x.is_nan()) {
            return Err(self.document.fault(&self.place, format!("{key}: must be finite")));
        }
        let inside = color.map(|x| x.clamp(0.0, most));
        if inside != color {
            let rule = format!("{key} must be from 0 to {most}; it is clamped");
            note(self.notes, format!("{}: {rule}", self.display_name()));
        }
        Ok(inside)
    }

    fn display_name(&self) -> String {
        format!("{} ({:?})", self.place, self.name)
    }
}
