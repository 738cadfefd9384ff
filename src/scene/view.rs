//! How linear light is shown on a display; what the transforms compute is in `image::view`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// From linear light to what a display is sent. In a file the names are those of [`ViewTransform::name`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[non_exhaustive]
pub enum ViewTransform {
    /// Clamped to 0 ... 1, to the power 1/2.2.
    #[default]
    #[serde(rename = "gamma22")]
    Gamma22,
    /// Clamped to 0 ... 1, then the curve of sRGB.
    #[serde(rename = "srgb")]
    Srgb,
    /// AgX: bright colours go to white gradually, as on film. Without a look.
    #[serde(rename = "agx")]
    Agx,
    /// Khronos' PBR Neutral: colours stay as they are up to a brightness, those above it are compressed.
    #[serde(rename = "khronos-pbr-neutral")]
    KhronosPbrNeutral,
}

impl ViewTransform {
    /// All of them.
    pub const ALL: [ViewTransform; 4] = [
        ViewTransform::Gamma22,
        ViewTransform::Srgb,
        ViewTransform::Agx,
        ViewTransform::KhronosPbrNeutral,
    ];

    /// The name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            ViewTransform::Gamma22 => "gamma22",
            ViewTransform::Srgb => "srgb",
            ViewTransform::Agx => "agx",
            ViewTransform::KhronosPbrNeutral => "khronos-pbr-neutral",
        }
    }
}

/// How a picture is shown. What is kept as numbers, such as OpenEXR, takes neither.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewSettings {
    /// From linear light to what a display is sent.
    pub transform: ViewTransform,
    /// Stops, -100 to 100: light is multiplied by 2 to this power before the transform.
    pub exposure: f64,
}

impl ViewSettings {
    /// The most stops, up or down: light stays far inside of what 64-bit floats hold.
    pub const MOST_STOPS: f64 = 100.0;

    /// The rule of an exposure that breaks it.
    pub fn check_exposure(stops: f64) -> Result<f64, String> {
        match stops.abs() <= ViewSettings::MOST_STOPS {
            true => Ok(stops),
            false => Err("must be from -100 to 100 stops".to_owned()),
        }
    }
}
