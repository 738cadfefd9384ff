//! Conversion of MTL materials to `principled` for the integrator `path`, with the extensions of Exocortex, "Extending
//! the Wavefront MTL format for physically based rendering", which Blender also writes.

use std::path::Path;

use glam::DVec3;

use super::super::super::image_file::Part;
use super::super::super::limits::MAX_COLOR;
use super::super::super::{
    AlphaMode, Channel, Color, Encoding, Material, NormalMap, Principled, Reflection, Texels, TextureKind, Value,
    VertexColors,
};
use super::super::principled::dielectric;
use super::super::{number, show};
use super::{DIFFUSE, SceneMaterials, Traits, Warnings};
use crate::mesh::MtlMaterial;

/// Factor from `Ks` to `specular`: exporters write 0.5 for common dielectrics, whose `specular` is 1.
const SPECULAR: f64 = 2.0;

impl SceneMaterials<'_> {
    /// Returns a principled material. Ignores `Ka`, because exporters write arbitrary values for `Ka`.
    pub(super) fn principled(&mut self, mtl: &MtlMaterial, file: &Path, traits: Traits) -> Material {
        let mut warnings = Warnings::default();
        let clamp_color = |warnings: &mut Warnings, name: &'static str, color: [f64; 3], limit: f64| {
            let color = DVec3::from(color);
            let clamped = color.clamp(DVec3::ZERO, DVec3::splat(limit));
            if clamped != color {
                let (color, limit, clamped) = (show(color), number(limit), show(clamped));
                let rule = format!("each of {color} must be from 0 to {limit}; {clamped} is used instead");
                warnings.add(name, rule);
            }
            clamped
        };
        let clamp_fraction = |warnings: &mut Warnings, name: &'static str, value: f64| {
            let clamped = value.clamp(0.0, 1.0);
            if clamped != value {
                let rule = format!("{} must be from 0 to 1; {clamped} is used instead", number(value));
                warnings.add(name, rule);
            }
            clamped
        };
        let diffuse = clamp_color(&mut warnings, "Kd", mtl.diffuse.unwrap_or([DIFFUSE; 3]), 1.0);
        let emission = clamp_color(&mut warnings, "Ke", mtl.emission.unwrap_or_default(), MAX_COLOR);
        let has_factors = mtl.metallic.is_some() || mtl.roughness.is_some();
        let has_maps = mtl.metallic_map.is_some() || mtl.roughness_map.is_some();
        let specular = match (mtl.illumination, mtl.specular) {
            (Some(0 | 1), _) => 0.0,
            (_, Some(color)) => {
                let mean = clamp_color(&mut warnings, "Ks", color, MAX_COLOR).element_sum() / 3.0;
                (SPECULAR * mean).min(1.0)
            }
            (_, None) => f64::from(has_factors || has_maps),
        };
        let roughness = match (mtl.roughness, mtl.shininess) {
            (Some(roughness), _) => clamp_fraction(&mut warnings, "Pr", roughness),
            // The highlight is as wide as the Blinn-Phong highlight with this exponent.
            (None, Some(exponent)) => (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25),
            (None, None) => 1.0,
        };
        let opacity = clamp_fraction(&mut warnings, "d", mtl.opacity.unwrap_or(1.0));
        let metallic = clamp_fraction(&mut warnings, "Pm", mtl.metallic.unwrap_or(0.0));
        if opacity == 0.0 && mtl.opacity_map.is_none() {
            warnings.add("d", "0 makes the material invisible; 1 is opaque");
        }
        warnings.ignored(mtl);
        let mut map = |name: &'static str, map: &Option<String>, part: Part| {
            let found = self.map_texture(&self.referenced_path(file, map.as_ref()?), part, traits.has_uvs);
            warnings.texture_or_warning(name, found, "it is ignored")
        };
        let colors = Part::Colors(None);
        let linear = Part::Colors(Some(Encoding::Linear));
        let texture_or_value = |texture: Option<usize>, plain: f64| match texture {
            Some(texture) => Value::Texture(texture, Channel::R),
            None => Value::Plain(plain),
        };
        let texture_or_color =
            |texture: Option<usize>, plain: DVec3| texture.map_or(Color::Plain(plain), Color::Texture);
        let base_color = texture_or_color(map("map_Kd", &mtl.diffuse_map, colors), diffuse);
        let emission = texture_or_color(map("map_Ke", &mtl.emission_map, colors), emission);
        let metallic = texture_or_value(map("map_Pm", &mtl.metallic_map, linear), metallic);
        let roughness_map = map("map_Pr", &mtl.roughness_map, linear);
        let normal = map("norm", &mtl.normal_map, linear);
        let bump = normal.or_else(|| map("map_Bump", &mtl.bump_map, linear));
        let alpha = self.opacity(mtl, file, traits, &mut warnings);
        let normal_map = bump.filter(|texture| normal.is_some() || self.has_directions(*texture, &mut warnings));
        self.warn(mtl, file, warnings);
        let is_opaque = alpha.is_none() && opacity == 1.0;
        Material {
            reflection: Reflection::Principled(Box::new(Principled {
                metallic,
                roughness: texture_or_value(roughness_map, roughness),
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
    fn opacity(&mut self, mtl: &MtlMaterial, file: &Path, traits: Traits, warnings: &mut Warnings) -> Option<Value> {
        let path = self.referenced_path(file, mtl.opacity_map.as_ref()?);
        if let Ok(texture) = self.map_texture(&path, Part::Alpha, traits.has_uvs) {
            return Some(Value::Texture(texture, Channel::A));
        }
        let red = self.map_texture(&path, Part::Colors(Some(Encoding::Linear)), traits.has_uvs);
        let texture = warnings.texture_or_warning("map_d", red, "it is ignored")?;
        Some(Value::Texture(texture, Channel::R))
    }

    /// Returns true if the texture of `map_Bump` is a normal map. Adds a warning about a gray image, which is a height
    /// map and not supported.
    fn has_directions(&self, texture: usize, warnings: &mut Warnings) -> bool {
        let has_colors = match &self.textures[texture].kind {
            TextureKind::Image { image, .. } => match &image.texels {
                Texels::Bytes(_, texels) => texels.iter().any(|[r, g, b]| r != g || g != b),
                Texels::Floats(texels) => texels.iter().any(|[r, g, b]| r != g || g != b),
            },
            _ => false,
        };
        if !has_colors {
            let rule = "a height map is ignored; bake a normal map and reference it with norm";
            warnings.add("map_Bump", rule);
        }
        has_colors
    }
}
