//! What a scene file says of how it is rendered.

use std::borrow::Cow;
use std::fmt;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::integrator::Integrator;
use crate::description::kinds::{Clamp, Count, Depth, FilterRadius, MostSamples, Rgb, Seed, ShadowEpsilon, Share};
use crate::limits::MOST;

/// Whether glass casts shadows. In a file the names are in snake case: `"opaque"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shadows {
    /// Like everything else.
    #[default]
    Opaque,
    /// Not at all: light passes it straight on, with its full strength.
    Transparent,
}

/// The settings of a render.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RenderDescription {
    /// The light transport that is simulated. Absent, `"path"` if the scene uses a key that needs it, else `"phong"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integrator: Option<Integrator>,
    /// The ambient light.
    #[schemars(with = "Rgb")]
    pub ambient: DVec3,
    /// Radiance of rays that leave the scene.
    #[schemars(with = "Rgb")]
    pub background: DVec3,
    /// How far above a surface rays start at least, relative to the largest coordinate there.
    #[schemars(with = "ShadowEpsilon")]
    pub shadow_epsilon: f64,
    /// Whether glass casts shadows.
    pub shadows: Shadows,
    /// Most bounces of a path; under `"phong"` by mirrors and glass.
    #[schemars(with = "Depth")]
    pub max_depth: u32,
    /// From which bounce on a path may end at random, for `integrator = "path"`; absent, 5.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Depth>")]
    pub rr_depth: Option<u32>,
    /// Most of what a sample of indirect light may add, for `integrator = "path"`; absent, all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Clamp>")]
    pub clamp: Option<f64>,
    /// Whether the background is transparent, for `integrator = "path"`; absent, it is not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<bool>,
    /// Whether textures are filtered over the footprint of each ray.
    pub ray_differentials: bool,
    /// Seed of all random patterns.
    #[schemars(with = "Seed")]
    pub seed: u32,
    /// Samples of every pixel.
    pub pixel_samples: SamplesDescription,
    /// Samples of every area light at every hit.
    pub light_samples: SamplesDescription,
    /// What a pixel's samples are weighted by.
    pub filter: PixelFilterDescription,
    /// Further samples where they are needed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveDescription>,
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
        }
    }
}

/// A number of samples and their pattern. A scene file has a table, or the number alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SamplesDescription {
    /// Pattern; absent, `"sobol"` under `integrator = "path"`, else `"grid"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<Pattern>,
    /// Number of samples.
    pub count: u32,
}

/// The table form of [`SamplesDescription`].
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SamplesTable {
    /// Pattern; absent, `"sobol"` under `integrator = "path"`, else `"grid"`.
    #[serde(default)]
    pattern: Option<Pattern>,
    /// Number of samples.
    #[schemars(with = "Count")]
    count: u32,
}

// By hand: serde's untagged enums lose the location and the reason of an error.
impl<'de> Deserialize<'de> for SamplesDescription {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SamplesVisitor;

        impl<'de> Visitor<'de> for SamplesVisitor {
            type Value = SamplesDescription;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(
                    f,
                    "a whole number from 1 to {MOST}, or a table such as {{ pattern = \"grid\", count = 16 }}"
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

impl JsonSchema for SamplesDescription {
    fn schema_name() -> Cow<'static, str> {
        "SamplesDescription".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<SamplesTable>();
        let number = generator.subschema_for::<Count>();
        json!({ "anyOf": [table, number] }).try_into().unwrap_or_default()
    }
}

impl SamplesDescription {
    /// Returns this number of samples in the default pattern of the integrator.
    pub fn new(count: u32) -> Self {
        Self { pattern: None, count }
    }

    /// Returns the pattern: its own, else `"sobol"` under `"path"` and `"grid"` under `"phong"`.
    pub fn pattern(&self, integrator: Integrator) -> Pattern {
        self.pattern.unwrap_or(integrator.pattern())
    }
}

/// How samples are laid out on the unit square. In a file the names are in snake case: `"grid"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// The centres of n x n cells.
    #[default]
    Grid,
    /// The grid, turned by atan(1/2).
    RotatedGrid,
    /// A uniform position in each of n x n cells.
    Jittered,
    /// Independent and uniform.
    Random,
    /// Halton's sequence in bases 2 and 3, randomly rotated.
    Halton,
    /// Sobol's sequence, Owen-scrambled.
    Sobol,
}

impl Pattern {
    /// All of them.
    pub const ALL: [Pattern; 6] = [
        Pattern::Grid,
        Pattern::RotatedGrid,
        Pattern::Jittered,
        Pattern::Random,
        Pattern::Halton,
        Pattern::Sobol,
    ];

    /// The name in files and options.
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

    /// Whether the pattern is made of n x n cells, so that its count must be a square number.
    pub const fn needs_square(self) -> bool {
        matches!(self, Pattern::Grid | Pattern::RotatedGrid | Pattern::Jittered)
    }

    /// Whether the pattern has further positions when all of a set are used, so that sampling can be adaptive.
    pub const fn goes_on(self) -> bool {
        !matches!(self, Pattern::Grid | Pattern::RotatedGrid)
    }
}

/// Adaptive sampling.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, such as { error = 0.01 }")]
pub struct AdaptiveDescription {
    /// The standard error of a pixel's displayed value that is aimed at.
    #[schemars(with = "Share")]
    pub error: f64,
    /// The most samples of a pixel; absent, 16 times their count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<MostSamples>")]
    pub max_samples: Option<u32>,
}

/// A reconstruction filter.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, such as { type = \"gaussian\" }")]
pub struct PixelFilterDescription {
    /// Its form.
    #[serde(rename = "type")]
    pub kind: PixelFilterKind,
    /// How far it reaches, in pixels. If absent, what is usual for its form: 0.5 for `"box"`, 1 for `"triangle"`, 1.5 for `"gaussian"` and
    /// `"blackman_harris"`, 2 for `"mitchell"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<FilterRadius>")]
    pub radius: Option<f64>,
}

/// The form of a reconstruction filter, a product of the same function of x and of y. In a file the names are in snake
/// case: `"blackman_harris"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PixelFilterKind {
    /// Constant.
    Box,
    /// Linear from the middle to the radius.
    Triangle,
    /// The bell, with a standard deviation of a third of the radius.
    Gaussian,
    /// The cubic of Mitchell and Netravali with B = C = 1/3, with negative lobes.
    Mitchell,
    /// The window of Blackman and Harris, of four terms.
    BlackmanHarris,
}

impl PixelFilterKind {
    /// The usual radius in pixels.
    pub const fn radius(self) -> f64 {
        match self {
            PixelFilterKind::Box => 0.5,
            PixelFilterKind::Triangle => 1.0,
            PixelFilterKind::Gaussian | PixelFilterKind::BlackmanHarris => 1.5,
            PixelFilterKind::Mitchell => 2.0,
        }
    }
}
