//! What a scene file says of materials.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::tables::ReadError;
use super::tagged::{Tagged, tagged};
use super::{ColorDescription, NormalMapDescription, PrincipledDescription, ValueDescription};
use crate::description::kinds::{Absorption, Degrees, Etas, Ior, Ks, Metal, Share, ShareColor, Shininess};

tagged! {
    /// `[materials.NAME]`
    MaterialDescription {
        /// Phong's reflection model.
        "phong" => Phong(PhongDescription),
        /// A mirror.
        "mirror" => Mirror(MirrorDescription),
        /// Clear glass.
        "glass" => Glass(GlassDescription),
        /// Matt, for `integrator = "path"`.
        "diffuse" => Diffuse(DiffuseDescription),
        /// Metal, for `integrator = "path"`.
        "conductor" => Conductor(ConductorDescription),
        /// Clear glass or liquid, for `integrator = "path"`.
        "dielectric" => Dielectric(DielectricDescription),
        /// glTF's material, for `integrator = "path"`.
        "principled" => Principled(PrincipledDescription),
    }
}

impl MaterialDescription {
    /// The numbers that may come from textures.
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

/// Phong's reflection model. A factor that is absent is `color`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhongDescription {
    /// Short for the three factors.
    pub color: Option<ColorDescription>,
    /// Factor of the ambient light: linear red, green and blue, or a texture. If absent, `color`.
    pub ambient: Option<ColorDescription>,
    /// Factor of the diffuse term: linear red, green and blue, or a texture. If absent, `color`.
    pub diffuse: Option<ColorDescription>,
    /// Factor of the specular term: linear red, green and blue, or a texture. If absent, `color`.
    pub specular: Option<ColorDescription>,
    /// Exponent of the specular term.
    #[serde(default = "sixteen")]
    #[schemars(with = "Shininess")]
    pub shininess: f64,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out, for `integrator = "path"`; black if absent.
    pub emission: Option<ColorDescription>,
    /// Whether the camera sees it; yes if absent.
    pub visible: Option<bool>,
}

impl PhongDescription {
    /// A material with one colour for all three factors, and the exponent 16.
    pub fn new(color: impl Into<ColorDescription>) -> Self {
        Self {
            color: Some(color.into()),
            ambient: None,
            diffuse: None,
            specular: None,
            shininess: sixteen(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

/// A mirror.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorDescription {
    /// Factor of the reflected light.
    #[serde(default)]
    #[schemars(with = "ShareColor")]
    pub tint: ColorDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out, for `integrator = "path"`; black if absent.
    pub emission: Option<ColorDescription>,
    /// Whether the camera sees it; yes if absent.
    pub visible: Option<bool>,
}

/// Clear glass.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GlassDescription {
    /// Index of refraction.
    #[schemars(with = "Ior")]
    pub ior: f64,
    /// Factor of the light that passes the surface.
    #[serde(default)]
    #[schemars(with = "ShareColor")]
    pub tint: ColorDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out, for `integrator = "path"`; black if absent.
    pub emission: Option<ColorDescription>,
    /// Whether the camera sees it; yes if absent.
    pub visible: Option<bool>,
}

impl GlassDescription {
    /// Glass that colours no light.
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

/// A matt surface.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiffuseDescription {
    /// The share of the light that it reflects.
    #[schemars(with = "ShareColor")]
    pub color: ColorDescription,
    /// How rough it is, 0 to 1.
    #[serde(default)]
    pub roughness: ValueDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out; black if absent.
    pub emission: Option<ColorDescription>,
    /// Whether the camera sees it; yes if absent.
    pub visible: Option<bool>,
}

impl DiffuseDescription {
    /// A smooth one that reflects this share of the light.
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

/// How rough a surface of facets is.
macro_rules! faceted {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ty,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $ty,)*
            /// How rough it is, 0 to 1.
            #[serde(default)]
            pub roughness: ValueDescription,
            /// How much rougher it is along its first axis, 0 to 1.
            #[serde(default)]
            #[schemars(with = "Share")]
            pub anisotropy: f64,
            /// How far that axis is turned from the direction of the texture's u towards that of its v, in degrees.
            #[serde(default)]
            #[schemars(with = "Degrees")]
            pub anisotropy_rotation: f64,
            /// Whether light that bounces between facets is given back.
            #[serde(default = "yes")]
            pub energy_compensation: bool,
            /// What bends its normals.
            pub normal_map: Option<NormalMapDescription>,
            /// Radiance that it sends out; black if absent.
            pub emission: Option<ColorDescription>,
            /// Whether the camera sees it; yes if absent.
            pub visible: Option<bool>,
        }
    };
}

faceted! {
    /// Metal, polished or rough. One of `color`, `metal`, and `eta` with `k` says what it reflects.
    ConductorDescription {
        /// The share of the light that it reflects; all if nothing else is said.
        #[schemars(with = "Option<ShareColor>")]
        color: Option<ColorDescription>,
        /// The name of a metal.
        #[schemars(with = "Option<Metal>")]
        metal: Option<String>,
        /// The real part of its index of refraction.
        #[schemars(with = "Option<Etas>")]
        eta: Option<DVec3>,
        /// The imaginary part.
        #[schemars(with = "Option<Ks>")]
        k: Option<DVec3>,
    }
}

impl ConductorDescription {
    /// Polished metal that reflects this share of the light.
    pub fn new(color: impl Into<ColorDescription>) -> Self {
        Self {
            color: Some(color.into()),
            ..Self::default()
        }
    }
}

impl Default for ConductorDescription {
    /// Polished metal that reflects all light.
    fn default() -> Self {
        Self {
            color: None,
            metal: None,
            eta: None,
            k: None,
            roughness: ValueDescription::default(),
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            energy_compensation: yes(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

faceted! {
    /// Clear glass or liquid, or a sheet of it, polished or rough.
    DielectricDescription {
        /// Index of refraction.
        #[schemars(with = "Ior")]
        ior: f64,
        /// Factor of the light that passes the surface.
        #[serde(default)]
        #[schemars(with = "ShareColor")]
        color: ColorDescription,
        /// How much light it swallows, for each unit of length.
        #[serde(default)]
        #[schemars(with = "Absorption")]
        absorption: DVec3,
        /// Whether it is a thin sheet, behind which all is as before it.
        #[serde(default)]
        thin: bool,
    }
}

impl DielectricDescription {
    /// Polished, and one that colours no light.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            color: ColorDescription::default(),
            absorption: DVec3::ZERO,
            thin: false,
            roughness: ValueDescription::default(),
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            energy_compensation: yes(),
            normal_map: None,
            emission: None,
            visible: None,
        }
    }
}

fn yes() -> bool {
    true
}

fn sixteen() -> f64 {
    16.0
}
