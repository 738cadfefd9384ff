//! What a scene file says of materials.

use serde::{Deserialize, Serialize};
use toml::Table;

use super::tagged::{ReadError, Tagged, tagged};
use super::{ColorDescription, NormalMapDescription};

tagged! {
    /// `[materials.NAME]`
    MaterialDescription {
        /// Phong's reflection model.
        "phong" => Phong(PhongDescription),
        /// A mirror.
        "mirror" => Mirror(MirrorDescription),
        /// Clear glass.
        "glass" => Glass(GlassDescription),
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
}

impl GlassDescription {
    /// Glass that colours no light.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            tint: ColorDescription::default(),
            normal_map: None,
        }
    }
}

fn sixteen() -> f64 {
    16.0
}
