//! Render settings of scene files.

use std::fmt;

use glam::DVec3;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize};

use super::integrator::Integrator;
use crate::description::kinds::*;
use crate::limits::MAX_COUNT;

/// Shadows of glass. In a file, the names are in snake case: `"opaque"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Shadows {
    /// Glass casts shadows.
    #[default]
    Opaque,
    /// Glass casts no shadows: light passes straight through glass without attenuation.
    Transparent,
}

/// Render settings.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RenderDescription {
    /// Light transport algorithm. If absent, `"path"` if a key needs it, else `"phong"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integrator: Option<Integrator>,
    /// Ambient light; ignored under `"path"`.
    #[schemars(with = "Rgb")]
    pub ambient: DVec3,
    /// Radiance of rays that leave the scene; lights the scene under `"path"`.
    #[schemars(with = "Rgb")]
    pub background: DVec3,
    /// Minimum offset of ray origins above a surface, relative to the largest coordinate.
    #[schemars(with = "ShadowEpsilon")]
    pub shadow_epsilon: f64,
    /// Shadows of glass; ignored under `"path"`.
    pub shadows: Shadows,
    /// Maximum number of bounces of a path. `"phong"` counts only bounces at mirrors and glass, and accepts 1 to 64.
    #[schemars(with = "Depth")]
    pub max_depth: u32,
    /// First bounce with Russian roulette, for `"path"`. If absent, 5.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Depth>")]
    pub rr_depth: Option<u32>,
    /// Maximum contribution of a sample of indirect light, for `"path"`. If absent, unlimited.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Clamp>")]
    pub clamp: Option<f64>,
    /// Transparent background, for `"path"`. If absent, false.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<bool>,
    /// Filter textures over the footprint of each ray.
    pub ray_differentials: bool,
    /// Seed of all random patterns.
    #[schemars(with = "Seed")]
    pub seed: u32,
    /// Samples per pixel; under `"path"` one path for each.
    pub pixel_samples: SamplesDescription,
    /// Samples per area light and hit; ignored under `"path"`.
    pub light_samples: SamplesDescription,
    /// Reconstruction filter.
    pub filter: PixelFilterDescription,
    /// Adaptive sampling: further samples for pixels with a large error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveDescription>,
    /// Denoise the image. If absent, false.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoise: Option<bool>,
}

impl Default for RenderDescription {
    fn default() -> Self {
        let samples = SamplesDescription {
            pattern: None,
            count: 16,
        };
        Self {
            integrator: None,
            ambient: DVec3::ZERO,
            background: DVec3::ZERO,
            shadow_epsilon: 0.0,
            shadows: Shadows::Opaque,
            max_depth: 8,
            rr_depth: None,
            clamp: None,
            alpha: None,
            ray_differentials: true,
            seed: 0,
            pixel_samples: samples.clone(),
            light_samples: samples,
            filter: PixelFilterDescription {
                kind: PixelFilterKind::Box,
                radius: None,
            },
            adaptive: None,
            denoise: None,
        }
    }
}

/// A number of samples and their pattern; in a scene file, a table or only the number.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SamplesDescription {
    /// Pattern. If absent, `"sobol"` under `"path"`, else `"grid"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<Pattern>,
    /// Number of samples; a square number for patterns of n x n cells.
    pub count: u32,
}

/// A [`SamplesDescription`] that is a table in the scene file.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SamplesTable {
    /// Pattern. If absent, `"sobol"` under `"path"`, else `"grid"`.
    #[serde(default)]
    pattern: Option<Pattern>,
    /// Number of samples; a square number for patterns of n x n cells.
    #[schemars(with = "Count")]
    count: u32,
}

// Not derived: serde's untagged enums lose the location and the reason of an error.
impl<'de> Deserialize<'de> for SamplesDescription {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SamplesVisitor;

        impl<'de> Visitor<'de> for SamplesVisitor {
            type Value = SamplesDescription;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(
                    f,
                    "a whole number from 1 to {MAX_COUNT}, or a table such as {{ pattern = \"grid\", count = 16 }}"
                )
            }

            fn visit_i64<E: Error>(self, count: i64) -> Result<Self::Value, E> {
                let count = count
                    .try_into()
                    .map_err(|_| E::invalid_value(Unexpected::Signed(count), &self))?;
                Ok(SamplesDescription::new(count))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                let SamplesTable { pattern, count } = SamplesTable::deserialize(MapAccessDeserializer::new(map))?;
                Ok(SamplesDescription { pattern, count })
            }
        }

        deserializer.deserialize_any(SamplesVisitor)
    }
}

#[cfg(test)]
impl JsonSchema for SamplesDescription {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SamplesDescription".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let table = generator.subschema_for::<SamplesTable>();
        let number = generator.subschema_for::<Count>();
        serde_json::json!({ "anyOf": [table, number] })
            .try_into()
            .unwrap_or_default()
    }
}

impl SamplesDescription {
    /// Creates settings for `count` samples in the default pattern of the integrator.
    pub fn new(count: u32) -> Self {
        Self { pattern: None, count }
    }

    /// Returns the pattern; if it is absent, `"sobol"` under `"path"` and `"grid"` under `"phong"`.
    pub fn pattern(&self, integrator: Integrator) -> Pattern {
        self.pattern.unwrap_or(integrator.pattern())
    }
}

/// Layout of samples in the unit square. In a file, the names are in snake case: `"grid"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Centers of n x n cells.
    #[default]
    Grid,
    /// The grid, rotated by atan(1/2).
    RotatedGrid,
    /// A uniform random position in each of n x n cells.
    Jittered,
    /// Independent uniform random positions.
    Random,
    /// The Halton sequence in bases 2 and 3, randomly rotated.
    Halton,
    /// The Sobol' sequence, Owen-scrambled.
    Sobol,
}

impl Pattern {
    /// All patterns.
    pub const ALL: [Pattern; 6] = [
        Pattern::Grid,
        Pattern::RotatedGrid,
        Pattern::Jittered,
        Pattern::Random,
        Pattern::Halton,
        Pattern::Sobol,
    ];

    /// Returns the name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Pattern::Grid => "grid",
            Pattern::RotatedGrid => "rotated_grid",
            Pattern::Jittered => "jittered",
            Pattern::Random => "random",
            Pattern::Halton => "halton",
            Pattern::Sobol => "sobol",
        }
    }

    /// Returns true if the count must be a square number, because the pattern consists of n x n cells.
    pub const fn needs_square(self) -> bool {
        matches!(self, Pattern::Grid | Pattern::RotatedGrid | Pattern::Jittered)
    }

    /// Returns true if samples can be added to the pattern, as adaptive sampling requires.
    pub const fn is_extensible(self) -> bool {
        !matches!(self, Pattern::Grid | Pattern::RotatedGrid)
    }
}

/// Adaptive sampling.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, such as { error = 0.01 }")]
pub struct AdaptiveDescription {
    /// Target standard error of a pixel's value in `gamma22`, without exposure: 0 is black, 1 is white.
    #[schemars(with = "Fraction")]
    pub error: f64,
    /// Maximum number of samples per pixel; at least the count of `pixel_samples`. If absent, 16 times the count of
    /// `pixel_samples`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<MaxSamples>")]
    pub max_samples: Option<u32>,
}

/// A reconstruction filter.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, such as { type = \"gaussian\" }")]
pub struct PixelFilterDescription {
    /// Shape of the filter.
    #[serde(rename = "type")]
    pub kind: PixelFilterKind,
    /// Radius in pixels. If absent, 0.5 for `"box"`, 1 for `"triangle"`, 1.5 for `"gaussian"` and `"blackman_harris"`,
    /// 2 for `"mitchell"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<FilterRadius>")]
    pub radius: Option<f64>,
}

/// Shape of a separable reconstruction filter. In a file, the names are in snake case: `"blackman_harris"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PixelFilterKind {
    /// Constant.
    Box,
    /// Linear from the center to the radius.
    Triangle,
    /// Gaussian with a standard deviation of a third of the radius.
    Gaussian,
    /// Mitchell-Netravali cubic with B = C = 1/3, which has negative lobes.
    Mitchell,
    /// Four-term Blackman-Harris window.
    BlackmanHarris,
}

impl PixelFilterKind {
    /// Returns the default radius in pixels.
    pub const fn radius(self) -> f64 {
        match self {
            PixelFilterKind::Box => 0.5,
            PixelFilterKind::Triangle => 1.0,
            PixelFilterKind::Gaussian | PixelFilterKind::BlackmanHarris => 1.5,
            PixelFilterKind::Mitchell => 2.0,
        }
    }
}
