//! Conversion of glTF materials (section 3.9, KHR_materials_*) to `principled`, whose parameters have the same names.

use std::collections::BTreeMap;
use std::sync::Arc;

use gltf_json::material::AlphaMode as JsonAlphaMode;
use gltf_json::validation::Checked;
use serde_json::{Map, Value};

use super::document::Document;
use super::error::GltfError;
use super::light::note;
use super::texture::Slot;
use crate::decode::has_alpha;
use crate::{
    AlphaMode, Channel, ColorDescription, Encoding, NormalMapDescription, PrincipledDescription, TextureDescription,
    TextureReference, ValueDescription, VertexColors,
};

/// The images of all materials, by name.
#[derive(Default)]
pub struct Images {
    pub read: BTreeMap<String, Arc<[u8]>>,
    /// Reasons why images are missing, by the name of the image.
    pub absent: BTreeMap<String, String>,
}

pub(super) type Textures = BTreeMap<String, TextureDescription>;

/// Maximum component of an emitted radiance, and of a color factor that may exceed 1.
const MAX_COLOR: f64 = 1e6;
const IORS: (f64, f64) = (1.0, 100.0);

pub(super) struct Converter<'a> {
    pub document: &'a Document,
    pub location: String,
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
        self.location = format!("materials[{index}]");
        let json = &self.document.json.materials[index];
        let extensions = json.extensions.as_ref().map(|all| &all.others);
        let extension = |name: &str| extensions.and_then(|all| all.get(name)).and_then(Value::as_object);
        let pbr = &json.pbr_metallic_roughness;
        let mut principled = PrincipledDescription {
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
            self.fractions("baseColorFactor", [r, g, b])?,
            self.fraction("baseColorFactor", a)?,
        );
        let mut base_texture = (pbr.base_color_texture.as_ref())
            .map(|info| {
                let extensions = info.extensions.as_ref().map(|all| &all.others);
                Slot::new(
                    self.document,
                    &self.location,
                    (info.index.value(), info.tex_coord),
                    extensions,
                )
            })
            .transpose()?;
        let metallic = self.fraction("metallicFactor", pbr.metallic_factor.0.into())?;
        let roughness = self.fraction("roughnessFactor", pbr.roughness_factor.0.into())?;
        match &pbr.metallic_roughness_texture {
            None => (principled.metallic, principled.roughness) = (metallic.into(), roughness.into()),
            Some(info) => {
                let extensions = info.extensions.as_ref().map(|all| &all.others);
                let slot = Slot::new(
                    self.document,
                    &self.location,
                    (info.index.value(), info.tex_coord),
                    extensions,
                )?;
                let name = self.texture(&slot, Encoding::Linear, [1.0, roughness, metallic, 1.0])?;
                principled.metallic = ValueDescription::channel(&name, B);
                principled.roughness = ValueDescription::channel(&name, G);
            }
        }
        if let Some(normal) = &json.normal_texture {
            let extensions = normal.extensions.as_ref().map(|all| &all.others);
            let slot = Slot::new(
                self.document,
                &self.location,
                (normal.index.value(), normal.tex_coord),
                extensions,
            )?;
            principled.normal_map = Some(self.normal_map(&slot, normal.scale.into())?);
        }
        if json.occlusion_texture.is_some() {
            let message = "occlusion textures are ignored: the path tracer computes occlusion";
            note(self.notes, message.to_owned());
        }
        let emissive_strength =
            extension("KHR_materials_emissive_strength").and_then(|values| values.get("emissiveStrength")?.as_f64());
        let emission = (json.emissive_factor.0).map(|x| f64::from(x) * emissive_strength.unwrap_or(1.0));
        if emission != [0.0; 3] {
            let slot = (json.emissive_texture.as_ref())
                .map(|info| {
                    let extensions = info.extensions.as_ref().map(|all| &all.others);
                    Slot::new(
                        self.document,
                        &self.location,
                        (info.index.value(), info.tex_coord),
                        extensions,
                    )
                })
                .transpose()?;
            let emission = self.clamp_color("emissiveFactor times emissiveStrength", emission, MAX_COLOR)?;
            principled.emission = Some(self.color(slot.as_ref(), emission)?);
        }
        if let Some(ior) = extension("KHR_materials_ior") {
            self.ior(self.number(ior, "ior", 1.5)?, &mut principled)?;
        }
        if let Some(values) = extension("KHR_materials_transmission") {
            principled.transmission = self.value(values, "transmissionFactor", 0.0, "transmissionTexture", R)?;
        }
        if let Some(values) = extension("KHR_materials_volume") {
            self.volume(values, &mut principled)?;
        }
        if let Some(values) = extension("KHR_materials_specular") {
            principled.specular = self.value(values, "specularFactor", 1.0, "specularTexture", A)?;
            let factor = self.triple(values, "specularColorFactor", [1.0; 3])?;
            let factor = self.clamp_color("specularColorFactor", factor, MAX_COLOR)?;
            principled.specular_color = self.extension_color(values, factor, "specularColorTexture")?;
        }
        if let Some(values) = extension("KHR_materials_clearcoat") {
            principled.clearcoat = self.value(values, "clearcoatFactor", 0.0, "clearcoatTexture", R)?;
            principled.clearcoat_roughness =
                self.value(values, "clearcoatRoughnessFactor", 0.0, "clearcoatRoughnessTexture", G)?;
            if let Some(texture) = values.get("clearcoatNormalTexture") {
                let (slot, scale) = Slot::of_value(self.document, &self.location, texture)?;
                principled.clearcoat_normal_map = Some(self.normal_map(&slot, scale)?);
            }
        }
        if let Some(values) = extension("KHR_materials_sheen") {
            let factor = self.triple(values, "sheenColorFactor", [0.0; 3])?;
            let factor = self.fractions("sheenColorFactor", factor)?;
            principled.sheen_color = self.extension_color(values, factor, "sheenColorTexture")?;
            principled.sheen_roughness = self.value(values, "sheenRoughnessFactor", 0.0, "sheenRoughnessTexture", A)?;
        }
        if let Some(values) = extension("KHR_materials_anisotropy") {
            self.anisotropy(values, &mut principled)?;
        }
        if let Some(values) = extension("KHR_materials_pbrSpecularGlossiness") {
            (base, base_texture) = self.specular_glossiness(values, &mut principled)?;
        }
        let ([r, g, b], a) = base;
        let name = (base_texture.as_ref())
            .map(|slot| self.texture(slot, Encoding::Srgb, [r, g, b, a]))
            .transpose()?;
        principled.base_color = match &name {
            None => ColorDescription::Plain([r, g, b].into()),
            Some(name) => ColorDescription::texture(name),
        };
        let has_alpha = match &base_texture {
            None => false,
            Some(slot) => self.has_alpha(slot)?,
        };
        principled.alpha_mode = match json.alpha_mode {
            Checked::Valid(JsonAlphaMode::Mask) => AlphaMode::Mask,
            Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        if principled.alpha_mode == AlphaMode::Blend && a == 1.0 && !has_alpha && !is_colored {
            principled.alpha_mode = AlphaMode::Opaque; // some exporters write opaque materials as BLEND
        }
        if principled.alpha_mode != AlphaMode::Opaque {
            principled.alpha = match name {
                Some(name) if has_alpha => ValueDescription::channel(name, A),
                _ => a.into(),
            };
            let cutoff = json.alpha_cutoff.as_ref().map_or(0.5, |cutoff| cutoff.0.into());
            if cutoff > 1.0 {
                // The cutoff exceeds every alpha value, so the material is invisible.
                principled.alpha = 0.0.into();
            }
            principled.alpha_cutoff = f64::clamp(cutoff, 0.0, 1.0);
        }
        if extension("KHR_materials_unlit").is_some() {
            return Ok(self.unlit(principled));
        }
        Ok(principled)
    }

    /// Converts KHR_materials_unlit to emission.
    fn unlit(&mut self, principled: PrincipledDescription) -> PrincipledDescription {
        PrincipledDescription {
            emission: Some(principled.base_color),
            base_color: [0.0; 3].into(),
            metallic: 0.0.into(),
            roughness: 1.0.into(),
            specular: 0.0.into(),
            alpha: principled.alpha,
            alpha_mode: principled.alpha_mode,
            alpha_cutoff: principled.alpha_cutoff,
            double_sided: principled.double_sided,
            vertex_colors: match principled.vertex_colors {
                VertexColors::None => VertexColors::None,
                _ => VertexColors::Emission,
            },
            ..PrincipledDescription::default()
        }
    }

    fn ior(&mut self, ior: f64, principled: &mut PrincipledDescription) -> Result<(), GltfError> {
        if ior == 0.0 {
            // In KHR_materials_ior, 0 means total reflection. With the maximum IOR of 100, this `specular_color` makes
            // the reflectance at normal incidence 1.
            principled.ior = IORS.1;
            principled.specular_color = [(101.0_f64 / 99.0).powi(2); 3].into();
            return Ok(());
        }
        principled.ior = ior.clamp(IORS.0, IORS.1);
        if principled.ior != ior {
            let rule = format!(
                "ior: {ior} must be 0 or from {} to {}; {} is used instead",
                IORS.0, IORS.1, principled.ior
            );
            note(self.notes, format!("{}: {rule}", self.display_name()));
        }
        Ok(())
    }

    /// Applies KHR_materials_volume. The thickness factor only enables the volume; absorption uses the length of the
    /// ray.
    fn volume(&mut self, values: &Map<String, Value>, principled: &mut PrincipledDescription) -> Result<(), GltfError> {
        let thickness = self.number(values, "thicknessFactor", 0.0)?;
        let color = self.triple(values, "attenuationColor", [1.0; 3])?;
        let color = self.fractions("attenuationColor", color)?;
        let distance = self.number(values, "attenuationDistance", f64::INFINITY)?;
        if thickness <= 0.0 {
            return Ok(()); // thin-walled
        }
        principled.thickness = thickness.min(1e9);
        principled.double_sided = true; // as in KHR_materials_volume: the interior is visible
        if color != [1.0; 3] && distance.is_finite() && distance > 0.0 {
            principled.attenuation_color = color.into();
            principled.attenuation_distance = Some(distance.clamp(1e-6, 1e9));
        }
        Ok(())
    }

    fn anisotropy(
        &mut self,
        values: &Map<String, Value>,
        principled: &mut PrincipledDescription,
    ) -> Result<(), GltfError> {
        let strength = self.fraction("anisotropyStrength", self.number(values, "anisotropyStrength", 0.0)?)?;
        principled.anisotropy = strength.into();
        principled.anisotropy_rotation = self.number(values, "anisotropyRotation", 0.0)?.to_degrees() % 360.0;
        if let Some(texture) = values.get("anisotropyTexture") {
            let (slot, _) = Slot::of_value(self.document, &self.location, texture)?;
            let name = self.texture(&slot, Encoding::Linear, [1.0, 1.0, strength, 1.0])?;
            principled.anisotropy = ValueDescription::channel(&name, B);
            principled.anisotropy_direction = Some(TextureReference { texture: name });
        }
        Ok(())
    }

    /// Applies KHR_materials_pbrSpecularGlossiness. Returns the diffuse color, the alpha and the texture of the base
    /// color.
    #[allow(clippy::type_complexity, reason = "the caller destructures the tuple")]
    fn specular_glossiness(
        &mut self,
        values: &Map<String, Value>,
        principled: &mut PrincipledDescription,
    ) -> Result<(([f64; 3], f64), Option<Slot>), GltfError> {
        let factor: [f64; 4] = self.numbers(values, "diffuseFactor", [1.0; 4])?;
        let [r, g, b, a] = factor;
        let base = (
            self.fractions("diffuseFactor", [r, g, b])?,
            self.fraction("diffuseFactor", a)?,
        );
        let specular = self.triple(values, "specularFactor", [1.0; 3])?;
        let specular = self.fractions("specularFactor", specular)?;
        let gloss = self.fraction("glossinessFactor", self.number(values, "glossinessFactor", 1.0)?)?;
        principled.metallic = 0.0.into();
        principled.roughness = (1.0 - gloss).into();
        // `specular_color` scales the reflectance at normal incidence, which is 0.04 for the default IOR of 1.5.
        principled.specular_color = specular.map(|x| x / 0.04).into();
        if let Some(texture) = values.get("specularGlossinessTexture") {
            let (slot, _) = Slot::of_value(self.document, &self.location, texture)?;
            let [r, g, b] = specular.map(|x| x / 0.04);
            let name = self.texture(&slot, Encoding::Srgb, [r, g, b, 1.0])?;
            principled.specular_color = ColorDescription::texture(name);
            let message = "KHR_materials_pbrSpecularGlossiness: the glossiness of textures is ignored";
            note(self.notes, message.to_owned());
        }
        let slot = (values.get("diffuseTexture"))
            .map(|texture| Slot::of_value(self.document, &self.location, texture))
            .transpose()?;
        Ok((base, slot.map(|(slot, _)| slot)))
    }

    /// Returns a parameter from 0 to 1, which may have a texture.
    fn value(
        &mut self,
        values: &Map<String, Value>,
        factor: &str,
        default: f64,
        texture: &str,
        channel: Channel,
    ) -> Result<ValueDescription, GltfError> {
        let constant = self.fraction(factor, self.number(values, factor, default)?)?;
        let Some(texture) = values.get(texture) else {
            return Ok(constant.into());
        };
        let (slot, _) = Slot::of_value(self.document, &self.location, texture)?;
        if constant == 0.0 || channel == A && !self.has_alpha(&slot)? {
            return Ok(constant.into());
        }
        let name = self.texture(&slot, Encoding::Linear, [constant; 4])?;
        Ok(ValueDescription::channel(name, channel))
    }

    fn extension_color(
        &mut self,
        values: &Map<String, Value>,
        factor: [f64; 3],
        texture: &str,
    ) -> Result<ColorDescription, GltfError> {
        let slot = (values.get(texture))
            .map(|texture| Slot::of_value(self.document, &self.location, texture))
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
        let mut lookup = self.document.lookup(slot, &self.location, &file, encoding)?;
        lookup.factor = factor;
        let description = TextureDescription::Image(lookup);
        let existing = self.textures.iter().find(|(_, existing)| **existing == description);
        if let Some((name, _)) = existing {
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
            Err(reason) => _ = self.images.absent.insert(name.clone(), reason),
        }
        Ok(name)
    }

    fn has_alpha(&mut self, slot: &Slot) -> Result<bool, GltfError> {
        let name = self.image(slot)?;
        Ok(self.images.read.get(&name).is_some_and(|bytes| has_alpha(bytes)))
    }

    fn numbers<const N: usize>(
        &self,
        values: &Map<String, Value>,
        key: &str,
        default: [f64; N],
    ) -> Result<[f64; N], GltfError> {
        let Some(value) = values.get(key) else {
            return Ok(default);
        };
        let list = value
            .as_array()
            .map(|list| list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>());
        let numbers = list.flatten().and_then(|list| <[f64; N]>::try_from(list).ok());
        let rule = || {
            self.document
                .fault(&self.location, format!("{key}: {value} must be a list of {N} numbers"))
        };
        numbers
            .filter(|list| list.iter().all(|x| x.is_finite()))
            .ok_or_else(rule)
    }

    fn triple(&self, values: &Map<String, Value>, key: &str, default: [f64; 3]) -> Result<[f64; 3], GltfError> {
        self.numbers(values, key, default)
    }

    fn number(&self, values: &Map<String, Value>, key: &str, default: f64) -> Result<f64, GltfError> {
        let Some(value) = values.get(key) else {
            return Ok(default);
        };
        let number = value.as_f64().filter(|x| x.is_finite());
        number.ok_or_else(|| {
            self.document
                .fault(&self.location, format!("{key}: {value} must be a number"))
        })
    }

    /// Clamps a value to 0 ... 1; adds a note if this changes the value.
    fn fraction(&mut self, key: &str, x: f64) -> Result<f64, GltfError> {
        let [x, _, _] = self.clamp_color(key, [x, 0.0, 0.0], 1.0)?;
        Ok(x)
    }

    fn fractions(&mut self, key: &str, color: [f64; 3]) -> Result<[f64; 3], GltfError> {
        self.clamp_color(key, color, 1.0)
    }

    /// Clamps color components to 0 ... `max`; adds a note if this changes a component.
    fn clamp_color(&mut self, key: &str, color: [f64; 3], max: f64) -> Result<[f64; 3], GltfError> {
        if color.iter().any(|x| x.is_nan()) {
            return Err(self.document.fault(&self.location, format!("{key}: must be finite")));
        }
        let clamped = color.map(|x| x.clamp(0.0, max));
        if clamped != color {
            let rule = format!("{key} must be from 0 to {max}; the value is clamped");
            note(self.notes, format!("{}: {rule}", self.display_name()));
        }
        Ok(clamped)
    }

    fn display_name(&self) -> String {
        format!("{} ({:?})", self.location, self.name)
    }
}
