//! The material `principled` of scene files.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ColorDescription, NormalMapDescription, TextureReference, ValueDescription};
use crate::description::kinds::{
    AttenuationDistance, Degrees, Fraction, FractionColor, FractionRgb, PrincipledIor, Thickness,
};

/// glTF's metallic-roughness material with extensions and glTF's defaults, for `integrator = "path"`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PrincipledDescription {
    /// Albedo of the dielectric's diffuse base, or reflectance of the metal at normal incidence.
    #[schemars(with = "FractionColor")]
    pub base_color: ColorDescription,
    /// Metallic weight, 0 to 1.
    pub metallic: ValueDescription,
    /// Roughness, 0 to 1.
    pub roughness: ValueDescription,
    /// Increase of the roughness along the tangent, 0 to 1.
    pub anisotropy: ValueDescription,
    /// Rotation of the tangent, counter-clockwise in degrees.
    #[schemars(with = "Degrees")]
    pub anisotropy_rotation: f64,
    /// Texture of the unrotated tangent: red and green, mapped to -1 to 1, are the components along u and v.
    pub anisotropy_direction: Option<TextureReference>,
    /// Index of refraction of the dielectric.
    #[schemars(with = "PrincipledIor")]
    pub ior: f64,
    /// Factor of the dielectric's reflection, 0 to 1.
    pub specular: ValueDescription,
    /// Color factor of the dielectric's reflection at normal incidence.
    pub specular_color: ColorDescription,
    /// Fraction of the dielectric's light that is transmitted, 0 to 1.
    pub transmission: ValueDescription,
    /// Thickness: 0 for a thin sheet; otherwise the surface encloses a volume.
    #[schemars(with = "Thickness")]
    pub thickness: f64,
    /// Transmittance of the volume over `attenuation_distance`.
    #[schemars(with = "FractionRgb")]
    pub attenuation_color: DVec3,
    /// Distance over which the transmittance is `attenuation_color`; infinite if absent.
    #[schemars(with = "Option<AttenuationDistance>")]
    pub attenuation_distance: Option<f64>,
    /// Weight of the clear coat, 0 to 1.
    pub clearcoat: ValueDescription,
    /// Roughness of the clear coat, 0 to 1.
    pub clearcoat_roughness: ValueDescription,
    /// Normal map of the clear coat.
    pub clearcoat_normal_map: Option<NormalMapDescription>,
    /// Color of the sheen.
    #[schemars(with = "FractionColor")]
    pub sheen_color: ColorDescription,
    /// Roughness of the sheen, 0 to 1.
    pub sheen_roughness: ValueDescription,
    /// Opacity, 0 to 1.
    pub alpha: ValueDescription,
    /// Effect of `alpha`.
    pub alpha_mode: AlphaMode,
    /// Minimum alpha of opaque points, with `alpha_mode = "mask"`.
    #[schemars(with = "Fraction")]
    pub alpha_cutoff: f64,
    /// Use of a mesh's vertex colors.
    pub vertex_colors: VertexColors,
    /// True if back faces are visible to the camera.
    pub double_sided: bool,
    /// Normal map.
    pub normal_map: Option<NormalMapDescription>,
    /// Emitted radiance; black if absent.
    pub emission: Option<ColorDescription>,
    /// Visible to the camera; true if absent.
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

/// Effect of a material's alpha. In a file, the names are in snake case: `"mask"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AlphaMode {
    /// Alpha is ignored: the surface is opaque.
    #[default]
    Opaque,
    /// Opaque where alpha is at least the cutoff, else fully transparent.
    Mask,
    /// Alpha is the opacity: the remaining light passes straight through.
    Blend,
}

/// Use of a mesh's vertex colors. In a file, the names are in snake case: `"base_color"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VertexColors {
    /// Vertex colors are ignored.
    #[default]
    None,
    /// Factors of the base color and of alpha.
    BaseColor,
    /// Factors of the emission and of alpha.
    Emission,
}
