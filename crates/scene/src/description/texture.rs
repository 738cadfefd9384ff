//! Textures of scene files, and colors and numbers that may come from textures.

use std::fmt;

use glam::DVec3;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer, StrDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::tagged::{Tagged, tagged};
use crate::description::kinds::*;
use crate::{Channel, Encoding, TextureFilter, Wrap};

/// A color of a material: `[r, g, b]` or `{ texture = "NAME" }`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(transform = copy_plain_title)]
pub enum ColorDescription {
    /// Linear RGB.
    Plain(#[schemars(with = "Rgb")] DVec3),
    /// A texture.
    Texture(TextureReference),
}

impl Default for ColorDescription {
    fn default() -> Self {
        Self::Plain(DVec3::ONE)
    }
}

impl From<[f64; 3]> for ColorDescription {
    /// Converts linear RGB.
    fn from(color: [f64; 3]) -> Self {
        Self::Plain(color.into())
    }
}

impl ColorDescription {
    /// Returns a reference to the texture of this name.
    pub fn texture(name: impl Into<String>) -> Self {
        Self::Texture(TextureReference { texture: name.into() })
    }
}

// Not derived: serde's untagged enums lose the location and the reason of an error.
impl<'de> Deserialize<'de> for ColorDescription {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ColorVisitor;

        impl<'de> Visitor<'de> for ColorVisitor {
            type Value = ColorDescription;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list of 3 numbers or { texture = NAME }")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                DVec3::deserialize(SeqAccessDeserializer::new(seq)).map(ColorDescription::Plain)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                TextureReference::deserialize(MapAccessDeserializer::new(map)).map(ColorDescription::Texture)
            }
        }

        deserializer.deserialize_any(ColorVisitor)
    }
}

/// A number of a material: `0.5` or `{ texture = "NAME", channel = "g" }`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ValueDescription {
    /// A constant.
    Plain(#[schemars(with = "Fraction")] f64),
    /// One channel of a texture.
    Texture(ChannelReference),
}

impl Default for ValueDescription {
    /// Returns the constant 0.
    fn default() -> Self {
        Self::Plain(0.0)
    }
}

impl From<f64> for ValueDescription {
    fn from(value: f64) -> Self {
        Self::Plain(value)
    }
}

impl ValueDescription {
    /// Returns a reference to the red channel of the texture of this name.
    pub fn texture(name: impl Into<String>) -> Self {
        Self::channel(name, Channel::default())
    }

    /// Returns a reference to a channel of the texture of this name.
    pub fn channel(name: impl Into<String>, channel: Channel) -> Self {
        Self::Texture(ChannelReference {
            texture: name.into(),
            channel,
        })
    }
}

// Not derived, for the same reason as `ColorDescription`.
impl<'de> Deserialize<'de> for ValueDescription {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ValueVisitor;

        impl<'de> Visitor<'de> for ValueVisitor {
            type Value = ValueDescription;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or { texture = NAME }")
            }

            fn visit_f64<E>(self, value: f64) -> Result<Self::Value, E> {
                Ok(ValueDescription::Plain(value))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Self::Value, E> {
                Ok(ValueDescription::Plain(value as f64))
            }

            fn visit_u64<E>(self, value: u64) -> Result<Self::Value, E> {
                Ok(ValueDescription::Plain(value as f64))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                ChannelReference::deserialize(MapAccessDeserializer::new(map)).map(ValueDescription::Texture)
            }
        }

        deserializer.deserialize_any(ValueVisitor)
    }
}

/// A reference to a texture: `{ texture = "NAME" }`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, such as { texture = \"NAME\" }")]
pub struct TextureReference {
    /// Name of the texture.
    pub texture: String,
}

/// A reference to a channel of a texture: `{ texture = "NAME", channel = "r" }`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(
    deny_unknown_fields,
    expecting = "a table, such as { texture = \"NAME\", channel = \"g\" }"
)]
pub struct ChannelReference {
    /// Name of the texture.
    pub texture: String,
    /// Channel of the texture.
    #[serde(default)]
    pub channel: Channel,
}

/// A tangent-space normal map: `{ texture = "NAME", strength = 1 }`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, such as { texture = \"NAME\" }")]
pub struct NormalMapDescription {
    /// Name of the texture.
    pub texture: String,
    /// Factor of the slopes.
    #[serde(default = "one")]
    #[schemars(with = "Strength")]
    pub strength: f64,
}

tagged! {
    /// A texture. The key `type` selects the variant.
    #[non_exhaustive]
    TextureDescription {
        /// One color.
        "constant" => Constant(ConstantDescription),
        /// Squares of two colors.
        "checker" => Checker(CheckerDescription),
        /// Grid lines.
        "grid" => Lines(LinesDescription),
        /// An image file.
        "image" => Image(ImageTextureDescription),
    }
}

/// One color.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstantDescription {
    /// Color at every point.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
}

impl ConstantDescription {
    /// Creates a texture of this color, in linear RGB.
    pub fn new(color: impl Into<DVec3>) -> Self {
        Self { color: color.into() }
    }
}

/// A checkerboard of squares of side 1.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CheckerDescription {
    /// Color of the square from (0, 0) to (1, 1), and of every second square.
    #[schemars(with = "Rgb")]
    pub even: DVec3,
    /// Color of the other squares.
    #[schemars(with = "Rgb")]
    pub odd: DVec3,
    /// Factors of u and v.
    #[serde(default = "ones")]
    #[schemars(with = "UvScale")]
    pub scale: [f64; 2],
    /// Rotation counter-clockwise, in degrees.
    #[serde(default)]
    #[schemars(with = "Degrees")]
    pub rotate: f64,
    /// Offset of u and v.
    #[serde(default)]
    #[schemars(with = "UvOffset")]
    pub offset: [f64; 2],
}

impl CheckerDescription {
    /// Creates a checkerboard of squares of side 1. The colors are linear RGB.
    pub fn new(even: impl Into<DVec3>, odd: impl Into<DVec3>) -> Self {
        Self {
            even: even.into(),
            odd: odd.into(),
            scale: ones(),
            rotate: 0.0,
            offset: [0.0; 2],
        }
    }
}

/// Lines around integer coordinates.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinesDescription {
    /// Color between the lines.
    #[schemars(with = "Rgb")]
    pub cell: DVec3,
    /// Color of the lines.
    #[schemars(with = "Rgb")]
    pub line: DVec3,
    /// Width of the lines, relative to their distance.
    #[schemars(with = "LineWidth")]
    pub line_width: f64,
    /// Factors of u and v.
    #[serde(default = "ones")]
    #[schemars(with = "UvScale")]
    pub scale: [f64; 2],
    /// Rotation counter-clockwise, in degrees.
    #[serde(default)]
    #[schemars(with = "Degrees")]
    pub rotate: f64,
    /// Offset of u and v.
    #[serde(default)]
    #[schemars(with = "UvOffset")]
    pub offset: [f64; 2],
}

impl LinesDescription {
    /// Creates grid lines. The colors are linear RGB.
    pub fn new(cell: impl Into<DVec3>, line: impl Into<DVec3>, line_width: f64) -> Self {
        Self {
            cell: cell.into(),
            line: line.into(),
            line_width,
            scale: ones(),
            rotate: 0.0,
            offset: [0.0; 2],
        }
    }
}

/// An image file, or an image of [`Assets::images`](crate::Assets::images).
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageTextureDescription {
    /// A PNG, JPEG, WebP, KTX2, EXR or HDR file, relative to the scene file.
    #[schemars(length(min = 1))]
    pub file: String,
    /// Encoding of the values; EXR and HDR files are always linear. If absent, `"linear"` for EXR and HDR files, else
    /// `"srgb"`.
    pub encoding: Option<Encoding>,
    /// Addressing beyond the edges of the image, along u and v.
    #[serde(default)]
    pub wrap: WrapDescription,
    /// Texture filter.
    #[serde(default)]
    pub filter: TextureFilter,
    /// Maximum ratio of the axes of a footprint, for `"ewa"`.
    #[serde(default = "default_max_anisotropy")]
    #[schemars(with = "Anisotropy")]
    pub max_anisotropy: f64,
    /// Factors of u and v.
    #[serde(default = "ones")]
    #[schemars(with = "UvScale")]
    pub scale: [f64; 2],
    /// Rotation counter-clockwise, in degrees.
    #[serde(default)]
    #[schemars(with = "Degrees")]
    pub rotate: f64,
    /// Offset of u and v.
    #[serde(default)]
    #[schemars(with = "UvOffset")]
    pub offset: [f64; 2],
    /// Factors of red, green, blue and alpha.
    #[serde(default = "four_ones")]
    #[schemars(with = "Factors")]
    pub factor: [f64; 4],
    /// Index of the set of texture coordinates of the mesh.
    #[serde(default)]
    #[schemars(with = "UvSet")]
    pub uv_set: u32,
}

impl ImageTextureDescription {
    /// Creates a repeated texture with the default filter, the elliptical weighted average.
    pub fn new(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            encoding: None,
            wrap: WrapDescription::default(),
            filter: TextureFilter::default(),
            max_anisotropy: default_max_anisotropy(),
            scale: ones(),
            rotate: 0.0,
            offset: [0.0; 2],
            factor: four_ones(),
            uv_set: 0,
        }
    }
}

/// Texture addressing beyond the edges of the image: `"repeat"`, or `["repeat", "clamp"]` along u and v.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
#[non_exhaustive]
pub enum WrapDescription {
    /// The same addressing along u and v.
    Both(Wrap),
    /// The addressing along u, and the addressing along v.
    Each([Wrap; 2]),
}

impl Default for WrapDescription {
    fn default() -> Self {
        Self::Both(Wrap::default())
    }
}

impl From<[Wrap; 2]> for WrapDescription {
    fn from([u, v]: [Wrap; 2]) -> Self {
        if u == v { Self::Both(u) } else { Self::Each([u, v]) }
    }
}

impl WrapDescription {
    /// Returns the addressing along u and along v.
    pub fn each(self) -> [Wrap; 2] {
        match self {
            Self::Both(wrap) => [wrap; 2],
            Self::Each(wraps) => wraps,
        }
    }
}

// Not derived, for the same reason as `ColorDescription`.
impl<'de> Deserialize<'de> for WrapDescription {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WrapVisitor;

        impl<'de> Visitor<'de> for WrapVisitor {
            type Value = WrapDescription;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a name, or a list of 2 names")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Self::Value, E> {
                Wrap::deserialize(StrDeserializer::new(name)).map(WrapDescription::Both)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                <[Wrap; 2]>::deserialize(SeqAccessDeserializer::new(seq)).map(WrapDescription::Each)
            }
        }

        deserializer.deserialize_any(WrapVisitor)
    }
}

fn one() -> f64 {
    1.0
}

fn default_max_anisotropy() -> f64 {
    16.0
}

fn ones() -> [f64; 2] {
    [1.0, 1.0]
}

fn four_ones() -> [f64; 4] {
    [1.0; 4]
}
