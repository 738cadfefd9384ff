//! What a scene file says of materials.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::tagged::{ReadError, Tagged, tagged};
use super::{ColorDescription, NormalMapDescription, ValueDescription};

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
        /// Polished metal, for `integrator = "path"`.
        "conductor" => Conductor(ConductorDescription),
        /// Clear glass or liquid, for `integrator = "path"`.
        "dielectric" => Dielectric(DielectricDescription),
    }
}

/// Phong's reflection model. A factor that is absent is `color`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PhongDescription {
    /// Short for the three factors.
    pub color: Option<ColorDescription>,
    /// Factor of the ambient light.
    pub ambient: Option<ColorDescription>,
    /// Factor of the diffuse term.
    pub diffuse: Option<ColorDescription>,
    /// Factor of the specular term.
    pub specular: Option<ColorDescription>,
    /// Exponent of the specular term.
    #[serde(default = "sixteen")]
    pub shininess: f64,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out, for `integrator = "path"`; black if absent.
    pub emission: Option<ColorDescription>,
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
        }
    }
}

/// A mirror.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MirrorDescription {
    /// Factor of the reflected light.
    #[serde(default)]
    pub tint: ColorDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out, for `integrator = "path"`; black if absent.
    pub emission: Option<ColorDescription>,
}

/// Clear glass.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GlassDescription {
    /// Index of refraction.
    pub ior: f64,
    /// Factor of the light that passes the surface.
    #[serde(default)]
    pub tint: ColorDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out, for `integrator = "path"`; black if absent.
    pub emission: Option<ColorDescription>,
}

impl GlassDescription {
    /// Glass that colours no light.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            tint: ColorDescription::default(),
            normal_map: None,
            emission: None,
        }
    }
}

/// A matt surface.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DiffuseDescription {
    /// The share of the light that it reflects.
    pub color: ColorDescription,
    /// How rough it is, 0 to 1.
    #[serde(default)]
    pub roughness: ValueDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out; black if absent.
    pub emission: Option<ColorDescription>,
}

impl DiffuseDescription {
    /// A smooth one that reflects this share of the light.
    pub fn new(color: impl Into<ColorDescription>) -> Self {
        Self {
            color: color.into(),
            roughness: ValueDescription::default(),
            normal_map: None,
            emission: None,
        }
    }
}

/// Polished metal.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ConductorDescription {
    /// The share of the light that it reflects.
    #[serde(default)]
    pub color: ColorDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out; black if absent.
    pub emission: Option<ColorDescription>,
}

impl ConductorDescription {
    /// Metal that reflects this share of the light.
    pub fn new(color: impl Into<ColorDescription>) -> Self {
        Self {
            color: color.into(),
            normal_map: None,
            emission: None,
        }
    }
}

/// Clear glass or liquid.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DielectricDescription {
    /// Index of refraction.
    pub ior: f64,
    /// Factor of the light that passes the surface.
    #[serde(default)]
    pub color: ColorDescription,
    /// How much light it swallows, for each unit of length.
    #[serde(default)]
    pub absorption: DVec3,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
    /// Radiance that it sends out; black if absent.
    pub emission: Option<ColorDescription>,
}

impl DielectricDescription {
    /// One that colours no light.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            color: ColorDescription::default(),
            absorption: DVec3::ZERO,
            normal_map: None,
            emission: None,
        }
    }
}

fn sixteen() -> f64 {
    16.0
}
