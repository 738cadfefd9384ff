//! Materials of scene files.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::tagged::{Tagged, tagged};
use super::{ColorDescription, NormalMapDescription, PrincipledDescription, ValueDescription};
use crate::description::kinds::*;

tagged! {
    /// A material. The key `type` selects the variant.
    #[non_exhaustive]
    MaterialDescription {
        /// Phong reflection model.
        "phong" => Phong(PhongDescription),
        /// A perfect mirror.
        "mirror" => Mirror(MirrorDescription),
        /// Clear glass.
        "glass" => Glass(GlassDescription),
        /// Diffuse surface, for `integrator = "path"`.
        "diffuse" => Diffuse(DiffuseDescription),
        /// Metal, for `integrator = "path"`.
        "conductor" => Conductor(ConductorDescription),
        /// Glass or liquid, for `integrator = "path"`.
        "dielectric" => Dielectric(DielectricDescription),
        /// glTF's metallic-roughness material, for `integrator = "path"`.
        "principled" => Principled(PrincipledDescription),
    }
}

impl MaterialDescription {
    /// Returns the scalar values that may be textures.
    pub(crate) fn values(&self) -> Vec<&ValueDescription> {
        match self {
            Self::Diffuse(diffuse) => vec![&diffuse.roughness],
            Self::Conductor(conductor) => vec![&conductor.roughness],
            Self::Dielectric(dielectric) => vec![&dielectric.roughness],
            Self::Principled(principled) => vec![
                &principled.metallic,
                &principled.roughness,
                &principled.anisotropy,
                &principled.specular,
                &principled.transmission,
                &principled.clearcoat,
                &principled.clearcoat_roughness,
                &principled.sheen_roughness,
                &principled.alpha,
            ],
            Self::Phong(_) | Self::Mirror(_) | Self::Glass(_) => Vec::new(),
        }
    }
}

/// Phong reflection model.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhongDescription {
    /// Default of `ambient`, `diffuse` and `specular`.
    pub color: Option<ColorDescription>,
    /// Factor ka of the ambient light. If absent, `color`.
    pub ambient: Option<ColorDescription>,
    /// Factor kd of the diffuse term. If absent, `color`.
    pub diffuse: Option<ColorDescription>,
    /// Factor ks of the specular term. If absent, `color`.
    pub specular: Option<ColorDescription>,
    /// Exponent of the specular term.
    #[serde(default = "default_shininess")]
    #[schemars(with = "Shininess")]
    pub shininess: f64,
    /// Normal map, which tilts the shading normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance emitted on both sides, for `"path"`. If absent, black.
    pub emission: Option<ColorDescription>,
    /// Visible to the camera. If absent, true.
    pub visible: Option<bool>,
}

impl PhongDescription {
    /// Creates a material with one color for all factors, and the exponent 16.
    pub fn new(color: impl Into<ColorDescription>) -> Self {
        Self {
            color: Some(color.into()),
            ambient: None,
            diffuse: None,
            specular: None,
            shininess: default_shininess(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

/// A perfect mirror.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorDescription {
    /// Factor of the reflected light.
    #[serde(default)]
    #[schemars(with = "FractionColor")]
    pub tint: ColorDescription,
    /// Normal map, which tilts the shading normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance emitted on both sides, for `"path"`. If absent, black.
    pub emission: Option<ColorDescription>,
    /// Visible to the camera. If absent, true.
    pub visible: Option<bool>,
}

/// Clear glass.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GlassDescription {
    /// Index of refraction behind the surface, relative to that in front.
    #[schemars(with = "Ior")]
    pub ior: f64,
    /// Factor of transmitted light, in either direction.
    #[serde(default)]
    #[schemars(with = "FractionColor")]
    pub tint: ColorDescription,
    /// Normal map, which tilts the shading normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance emitted on both sides, for `"path"`. If absent, black.
    pub emission: Option<ColorDescription>,
    /// Visible to the camera. If absent, true.
    pub visible: Option<bool>,
}

impl GlassDescription {
    /// Creates glass without a tint.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            tint: ColorDescription::default(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

/// A diffuse surface.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiffuseDescription {
    /// Albedo: the reflected fraction of the light.
    #[schemars(with = "FractionColor")]
    pub color: ColorDescription,
    /// Roughness, 0 to 1; 0 is a Lambertian surface.
    #[serde(default)]
    pub roughness: ValueDescription,
    /// Normal map, which tilts the shading normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance emitted on both sides, for `"path"`. If absent, black.
    pub emission: Option<ColorDescription>,
    /// Visible to the camera. If absent, true.
    pub visible: Option<bool>,
}

impl DiffuseDescription {
    /// Creates a smooth surface with this albedo.
    pub fn new(color: impl Into<ColorDescription>) -> Self {
        Self {
            color: color.into(),
            roughness: ValueDescription::default(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

/// Defines the description of a microfacet material.
macro_rules! microfacet_material {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ty,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $ty,)*
            /// Roughness, 0 to 1; GGX's alpha is its square.
            #[serde(default)]
            pub roughness: ValueDescription,
            /// Additional roughness along the first axis.
            #[serde(default)]
            #[schemars(with = "Fraction")]
            pub anisotropy: f64,
            /// Rotation of the first axis from u towards v, in degrees.
            #[serde(default)]
            #[schemars(with = "Degrees")]
            pub anisotropy_rotation: f64,
            /// Restore the energy of multiple scattering between microfacets.
            #[serde(default = "default_true")]
            pub energy_compensation: bool,
            /// Normal map, which tilts the shading normals.
            pub normal_map: Option<NormalMapDescription>,
            /// Radiance emitted on both sides, for `"path"`. If absent, black.
            pub emission: Option<ColorDescription>,
            /// Visible to the camera. If absent, true.
            pub visible: Option<bool>,
        }
    };
}

microfacet_material! {
    /// Smooth or rough metal, whose reflectance is given by `color`, by `metal`, or by `eta` and `k`.
    ConductorDescription {
        /// Reflectance, equal at all angles. If absent, `[1, 1, 1]`.
        #[schemars(with = "Option<FractionColor>")]
        color: Option<ColorDescription>,
        /// A metal's name, such as `"gold"`; replaces `color`.
        #[schemars(with = "Option<Metal>")]
        metal: Option<String>,
        /// Real part of the index of refraction for red, green and blue; replaces `color`.
        #[schemars(with = "Option<Etas>")]
        eta: Option<DVec3>,
        /// Imaginary part of the index of refraction for red, green and blue; required with `eta`.
        #[schemars(with = "Option<Ks>")]
        k: Option<DVec3>,
    }
}

impl ConductorDescription {
    /// Creates smooth metal with this reflectance.
    pub fn new(color: impl Into<ColorDescription>) -> Self {
        Self {
            color: Some(color.into()),
            ..Self::default()
        }
    }
}

impl Default for ConductorDescription {
    /// Returns smooth metal with a reflectance of 1.
    fn default() -> Self {
        Self {
            color: None,
            metal: None,
            eta: None,
            k: None,
            roughness: ValueDescription::default(),
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            energy_compensation: default_true(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

microfacet_material! {
    /// Smooth or rough glass or liquid, or a thin sheet.
    DielectricDescription {
        /// Index of refraction behind the surface, relative to that in front.
        #[schemars(with = "Ior")]
        ior: f64,
        /// Factor of transmitted light, in either direction.
        #[serde(default)]
        #[schemars(with = "FractionColor")]
        color: ColorDescription,
        /// Absorption coefficients behind the surface, per scene unit.
        #[serde(default)]
        #[schemars(with = "Absorption")]
        absorption: DVec3,
        /// Thin sheet, with the same medium on both sides; `absorption` must be 0.
        #[serde(default)]
        thin: bool,
    }
}

impl DielectricDescription {
    /// Creates a smooth dielectric without a tint.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            color: ColorDescription::default(),
            absorption: DVec3::ZERO,
            thin: false,
            roughness: ValueDescription::default(),
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            energy_compensation: default_true(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

fn default_true() -> bool {
    true
}

fn default_shininess() -> f64 {
    16.0
}
