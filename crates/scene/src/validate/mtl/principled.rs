//! Conversion of MTL materials to `principled` for the integrator `path`, with the extensions of Exocortex, "Extending
//! the Wavefront MTL format for physically based rendering", which Blender also writes.

use std::path::Path;

use glam::DVec3;

use super::super::super::image_file::Part;
use super::super::super::limits::BRIGHTEST;
use super::super::super::{
    AlphaMode, Channel, Color, Encoding, Material, NormalMap, Principled, Reflection, Texels, TextureKind, Value,
    VertexColors,
};
use super::super::principled::dielectric;
use super::super::{number, show};
use super::{DIFFUSE, SceneMaterials, Traits, Warnings, beside};
use crate::mesh::MtlMaterial;

/// Factor from `Ks` to `specular`: exporters write 0.5 for common dielectrics, whose `specular` is 1.
const SPECULAR: f64 = 2.0;

impl SceneMaterials<'_> {
    /// Returns a principled material. Ignores `Ka`, because exporters write arbitrary values for it.
    pub(super) fn principled(&mut self, own: &MtlMaterial, file: &Path, traits: Traits) -> Material {
        let mut warnings = Warnings::default();
        let clamped = |warnings: &mut Warnings, name: &'static str, color: [f64; 3], limit: f64| {
            let color = DVec3::from(color);
            let inside = color.clamp(DVec3::ZERO, DVec3::splat(limit));
            if inside != color {
                let (color, limit, inside) = (show(color), number(limit), show(inside));
                let rule = format!("each of {color} must be from 0 to {limit}; {inside} stands in");
                warnings.add(name, rule);
            }
            inside
        };
        let share = |warnings: &mut Warnings, name: &'static str, value: f64| {
            let inside = value.clamp(0.0, 1.0);
            if inside != value {
                let rule = format!("{} must be from 0 to 1; {inside} stands in", number(value));
                warnings.add(name, rule);
            }
            inside
        };
        let diffuse = clamped(&mut warnings, "Kd", own.diffuse.unwrap_or([DIFFUSE; 3]), 1.0);
        let emission = clamped(&mut warnings, "Ke", own.emission.unwrap_or_default(), BRIGHTEST);
        let has_factors = own.metallic.is_some() || own.roughness.is_some();
        let has_maps = own.metallic_map.is_some() || own.roughness_map.is_some();
        let specular = match (own.illumination, own.specular) {
            (Some(0 | 1), _) => 0.0,
            (_, Some(color)) => {
                let mean = clamped(&mut warnings, "Ks", color, BRIGHTEST).element_sum() / 3.0;
                (SPECULAR * mean).min(1.0)
            }
            (_, None) => f64::from(has_factors || has_maps),
        };
        let roughness = match (own.roughness, own.shininess) {
            (Some(roughness), _) => share(&mut warnings, "Pr", roughness),
            // The highlight is as wide as with the Blinn-Phong exponent.
            (None, Some(exponent)) => (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25),
            (None, None) => 1.0,
        };
        let opacity = share(&mut warnings, "d", own.opacity.unwrap_or(1.0));
        let metallic = share(&mut warnings, "Pm", own.metallic.unwrap_or(0.0));
        if opacity == 0.0 && own.opacity_map.is_none() {
            warnings.add("d", "0 makes the material invisible; it is opaque at 1");
        }
        warnings.ignored(own);
        let mut map = |name: &'static str, map: &Option<String>, part: Part| {
            let found = self.map(&beside(file, map.as_ref()?), part, traits.has_uvs);
            warnings.of_map(name, found, "it is ignored")
        };
        let colors = Part::Colors(None);
        let linear = Part::Colors(Some(Encoding::Linear));
        let or_plain = |texture: Option<usize>, plain: f64| match texture {
            Some(texture) => Value::Texture(texture, Channel::R),
            None => Value::Plain(plain),
        };
        let of_color = |texture: Option<usize>, plain: DVec3| texture.map_or(Color::Plain(plain), Color::Texture);
        let base_color = of_color(map("map_Kd", &own.diffuse_map, colors), diffuse);
        let emission = of_color(map("map_Ke", &own.emission_map, colors), emission);
        let metallic = or_plain(map("map_Pm", &own.metallic_map, linear), metallic);
        let roughness_map = map("map_Pr", &own.roughness_map, linear);
        let normal = map("norm", &own.normal_map, linear);
        let bump = normal.or_else(|| map("map_Bump", &own.bump_map, linear));
        let alpha = self.opacity(own, file, traits, &mut warnings);
        let normal_map = bump.filter(|texture| normal.is_some() || self.has_directions(*texture, &mut warnings));
        self.warn(own, file, warnings);
        let is_opaque = alpha.is_none() && opacity == 1.0;
        Material {
            reflection: Reflection::Principled(Box::new(Principled {
                metallic,
                roughness: or_plain(roughness_map, roughness),
                specular: Value::Plain(specular),
                alpha: alpha.unwrap_or(Value::Plain(opacity)),
                alpha_mode: if is_opaque { AlphaMode::Opaque } else { AlphaMode::Blend },
                vertex_colors: match traits.has_colors {
                    true => VertexColors::BaseColor,
                    false => VertexColors::None,
                },
                ..dielectric(base_color, roughness)
            })),
            emission,
            normal_map: normal_map.map(|texture| NormalMap { texture, strength: 1.0 }),
            visible: true,
        }
    }

    /// Returns the opacity of `map_d`: the alpha channel of the image, or the red channel if there is no alpha channel.
    fn opacity(&mut self, own: &MtlMaterial, file: &Path, traits: Traits, warnings: &mut Warnings) -> Option<Value> {
        let path = beside(file, own.opacity_map.as_ref()?);
        if let Ok(texture) = self.map(&path, Part::Alpha, traits.has_uvs) {
            return Some(Value::Texture(texture, Channel::A));
        }
        let red = self.map(&path, Part::Colors(Some(Encoding::Linear)), traits.has_uvs);
        let texture = warnings.of_map("map_d", red, "it is ignored")?;
        Some(Value::Texture(texture, Channel::R))
    }

    /// Returns true if an image contains normals. Gray images contain heights, which are not supported.
    fn has_directions(&self, texture: usize, warnings: &mut Warnings) -> bool {
        let has_colors = match &self.textures[texture].kind {
            TextureKind::Image { image, .. } => match &image.texels {
                Texels::Bytes(_, texels) => texels.iter().any(|[r, g, b]| r != g || g != b),
                Texels::Floats(texels) => texels.iter().any(|[r, g, b]| r != g || g != b),
            },
            _ => false,
        };
        if !has_colors {
            let rule = "a map of heights is ignored; bake a normal map, and name it by norm";
            warnings.add("map_Bump", rule);
        }
        has_colors
    }
}
