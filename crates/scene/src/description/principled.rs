//! What a scene file says of the material `principled`.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ColorDescription, NormalMapDescription, TextureReference, ValueDescription};
use crate::description::kinds::{AttenuationDistance, Degrees, PrincipledIor, Share, ShareColor, ShareRgb, Thickness};

/// glTF's metallic-roughness material with its extensions, for `integrator = "path"`; glTF's defaults.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PrincipledDescription {
    /// The share of light that a dielectric's ground spreads, or a metal reflects head-on.
    #[schemars(with = "ShareColor")]
    pub base_color: ColorDescription,
    /// How much of it is metal, 0 to 1.
    pub metallic: ValueDescription,
    /// How rough it is, 0 to 1.
    pub roughness: ValueDescription,
    /// How much rougher it is along the tangent, 0 to 1.
    pub anisotropy: ValueDescription,
    /// The tangent's angle, counter-clockwise in degrees.
    #[schemars(with = "Degrees")]
    pub anisotropy_rotation: f64,
    /// An image whose red and green, as numbers from -1 to 1, are the direction along u and v that is turned so.
    pub anisotropy_direction: Option<TextureReference>,
    /// Index of refraction of the dielectric.
    #[schemars(with = "PrincipledIor")]
    pub ior: f64,
    /// Factor of what the dielectric reflects, 0 to 1.
    pub specular: ValueDescription,
    /// Factor of what it reflects head-on.
    pub specular_color: ColorDescription,
    /// How much of the dielectric's light passes the surface, 0 to 1.
    pub transmission: ValueDescription,
    /// 0 where the surface is a thin sheet; else what is behind it is a volume.
    #[schemars(with = "Thickness")]
    pub thickness: f64,
    /// What is left of light after `attenuation_distance` in the volume.
    #[schemars(with = "ShareRgb")]
    pub attenuation_color: DVec3,
    /// That distance; infinite if absent.
    #[schemars(with = "Option<AttenuationDistance>")]
    pub attenuation_distance: Option<f64>,
    /// How much there is of a clear coat, 0 to 1.
    pub clearcoat: ValueDescription,
    /// How rough that is, 0 to 1.
    pub clearcoat_roughness: ValueDescription,
    /// What bends the coat's normals.
    pub clearcoat_normal_map: Option<NormalMapDescription>,
    /// The colour of the sheen of cloth.
    #[schemars(with = "ShareColor")]
    pub sheen_color: ColorDescription,
    /// How rough the sheen is, 0 to 1.
    pub sheen_roughness: ValueDescription,
    /// How much of the surface there is, 0 to 1.
    pub alpha: ValueDescription,
    /// What `alpha` does.
    pub alpha_mode: AlphaMode,
    /// The least alpha of what is there, under `"mask"`.
    #[schemars(with = "Share")]
    pub alpha_cutoff: f64,
    /// What the colours of a mesh's vertices are factors of.
    pub vertex_colors: VertexColors,
    /// Whether the camera sees its back.
    pub double_sided: bool,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out; black if absent.
    pub emission: Option<ColorDescription>,
    /// Whether the camera sees it; yes if absent.
    pub visible: Option<bool>,
}

impl Default for PrincipledDescription {
    fn default() -> Self {
        Self {
            base_color: ColorDescription::default(),
            metallic: 1.0.into(),
            roughness: 1.0.into(),
            anisotropy: 0.0.into(),
            anisotropy_rotation: 0.0,
            anisotropy_direction: None,
            ior: 1.5,
            specular: 1.0.into(),
            specular_color: ColorDescription::default(),
            transmission: 0.0.into(),
            thickness: 0.0,
            attenuation_color: DVec3::ONE,
            attenuation_distance: None,
            clearcoat: 0.0.into(),
            clearcoat_roughness: 0.0.into(),
            clearcoat_normal_map: None,
            sheen_color: [0.0; 3].into(),
            sheen_roughness: 0.0.into(),
            alpha: 1.0.into(),
            alpha_mode: AlphaMode::Opaque,
            alpha_cutoff: 0.5,
            vertex_colors: VertexColors::None,
            double_sided: true,
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

/// What a material's alpha does. In a file the names are in snake case: `"mask"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AlphaMode {
    /// Nothing: all of the surface is there.
    #[default]
    Opaque,
    /// The surface is there where its alpha is the cutoff or more.
    Mask,
    /// That share of the light meets it; the rest passes straight on.
    Blend,
}

/// What the colours of a mesh's vertices do. In a file the names are in snake case: `"base_color"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VertexColors {
    /// Nothing.
    #[default]
    None,
    /// They are factors of the base colour and of alpha.
    BaseColor,
    /// They are factors of the emission and of alpha.
    Emission,
}
