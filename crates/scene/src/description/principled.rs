//! The material `principled` of scene files.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{ColorDescription, NormalMapDescription, TextureReference, ValueDescription};
use crate::description::kinds::*;

/// glTF's metallic-roughness material with extensions and glTF's defaults, for `integrator = "path"`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PrincipledDescription {
    /// Diffuse albedo, reflectance of metal at normal incidence, factor of transmitted light.
    #[schemars(with = "FractionColor")]
    pub base_color: ColorDescription,
    /// Fraction of metal, 0 to 1; the rest is a dielectric.
    pub metallic: ValueDescription,
    /// Roughness, 0 to 1; GGX's alpha is its square.
    pub roughness: ValueDescription,
    /// Additional roughness along the tangent, 0 to 1.
    pub anisotropy: ValueDescription,
    /// Rotation of the tangent, counter-clockwise in degrees.
    #[schemars(with = "Degrees")]
    pub anisotropy_rotation: f64,
    /// Linear image of the unrotated tangent: red and green, mapped to -1 to 1, are its components along u and v. If
    /// absent, u.
    pub anisotropy_direction: Option<TextureReference>,
    /// Index of refraction of the dielectric.
    #[schemars(with = "PrincipledIor")]
    pub ior: f64,
    /// Factor of the dielectric's reflection, 0 to 1.
    pub specular: ValueDescription,
    /// Color factor of the dielectric's reflection at normal incidence; the product is clamped to 1.
    pub specular_color: ColorDescription,
    /// Fraction of the dielectric that transmits light instead of reflecting it diffusely, 0 to 1.
    pub transmission: ValueDescription,
    /// 0 for a thin sheet, which does not refract; otherwise the surface encloses a volume.
    #[schemars(with = "Thickness")]
    pub thickness: f64,
    /// Fraction of light that remains in the volume after `attenuation_distance`.
    #[schemars(with = "FractionRgb")]
    pub attenuation_color: DVec3,
    /// Distance for `attenuation_color`; required if that color is not white.
    #[schemars(with = "Option<AttenuationDistance>")]
    pub attenuation_distance: Option<f64>,
    /// Weight of a clear coat with an index of refraction of 1.5, 0 to 1.
    pub clearcoat: ValueDescription,
    /// Roughness of the clear coat, 0 to 1.
    pub clearcoat_roughness: ValueDescription,
    /// Normal map of the clear coat. If absent, the normals of the shape.
    pub clearcoat_normal_map: Option<NormalMapDescription>,
    /// Color of the sheen of cloth.
    #[schemars(with = "FractionColor")]
    pub sheen_color: ColorDescription,
    /// Roughness of the sheen, 0 to 1; values below 0.15 count as 0.15.
    pub sheen_roughness: ValueDescription,
    /// Opacity, 0 to 1; without effect if `alpha_mode` is `"opaque"`.
    pub alpha: ValueDescription,
    /// Effect of `alpha`.
    pub alpha_mode: AlphaMode,
    /// Alpha from which the surface exists, with `alpha_mode = "mask"`.
    #[schemars(with = "Fraction")]
    pub alpha_cutoff: f64,
    /// Key that is multiplied by a mesh's vertex colors, in addition to `alpha`.
    pub vertex_colors: VertexColors,
    /// The camera sees the back of the surface.
    pub double_sided: bool,
    /// Normal map, which tilts the shading normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance emitted on both sides, for `"path"`. If absent, black.
    pub emission: Option<ColorDescription>,
    /// Visible to the camera. If absent, true.
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
