//! Textures that have been checked.

use std::sync::Arc;

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A colour of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Color {
    /// One colour for all of the surface; linear RGB.
    Plain(DVec3),
    /// From a texture: index into [`Scene::textures`](super::Scene::textures).
    Texture(usize),
}

impl Color {
    /// No light.
    pub const BLACK: Color = Color::Plain(DVec3::ZERO);
}

/// A number of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// One number for all of the surface.
    Plain(f64),
    /// One of the values of a texture: index into [`Scene::textures`](super::Scene::textures). [`Channel::A`] is the red of a
    /// texture of its own, which has the file's alpha as its colour.
    Texture(usize, Channel),
}

/// One of the values of a texture. In a file the names are in lower case: `"g"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Red.
    #[default]
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// The alpha channel of the image's file: how opaque it is, never by a curve.
    A,
}

/// A texture in tangent space that gives normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// Index into [`Scene::textures`](super::Scene::textures) of a [`TextureKind::Image`] with linear texels.
    pub texture: usize,
    /// Factor of the slopes.
    pub strength: f64,
}

/// A colour for each point of a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// What is on it.
    pub kind: TextureKind,
    /// Rows of the map from a surface's (u, v, 1) to the plane's (u, v); invertible.
    pub transform: [DVec3; 2],
    /// Which of a mesh's sets of texture coordinates these u and v are of: 0 to 7, and 0 on what is no mesh.
    pub uv_set: u32,
}

/// What is on a texture. Colours are linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum TextureKind {
    /// One colour.
    Constant(DVec3),
    /// Squares of side 1, the one from (0, 0) to (1, 1) being even.
    Checker {
        /// Where the floors of u and v have an even sum.
        even: DVec3,
        /// Elsewhere.
        odd: DVec3,
    },
    /// Lines around all whole numbers.
    Lines {
        /// Between the lines.
        cell: DVec3,
        /// On the lines.
        line: DVec3,
        /// The lines' width, in (0, 1).
        line_width: f64,
    },
    /// An image on the square from (0, 0), its lower left corner, to (1, 1).
    Image {
        /// The texels.
        image: Arc<Image>,
        /// Beyond the square, along u and along v.
        wrap: [Wrap; 2],
        /// How its colours are found.
        filter: TextureFilter,
        /// The largest ratio of a footprint's axes that [`TextureFilter::Ewa`] follows, at least 1.
        max_anisotropy: f64,
        /// Factor of its colours: of a texture of alpha the same for all parts.
        factor: DVec3,
    },
}

/// An image beyond its edges. In a file the names are in snake case: `"repeat"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// Again and again.
    #[default]
    Repeat,
    /// The colour of the nearest edge.
    Clamp,
    /// Again and again, every other one mirrored.
    Mirror,
}

/// How an image's colours are found. In a file the names are in snake case: `"ewa"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TextureFilter {
    /// The texel that the point lies in.
    Nearest,
    /// Between the four nearest texels.
    Bilinear,
    /// Bilinear on the two nearest levels of a mip pyramid.
    Trilinear,
    /// The elliptical weighted average over the footprint, on the two nearest levels.
    #[default]
    Ewa,
}

impl TextureFilter {
    /// Whether it reads the coarser levels of a mip pyramid.
    pub const fn needs_levels(self) -> bool {
        matches!(self, TextureFilter::Trilinear | TextureFilter::Ewa)
    }
}

/// What an image's 8-bit and 16-bit values mean. In a file the names are in snake case: `"srgb"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// Colours by the curve of IEC 61966-2-1.
    Srgb,
    /// Numbers.
    Linear,
}

/// The texels of an image, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Red, green and blue of each.
    pub texels: Texels,
}

/// Texels by their type.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// 8 bits.
    Bytes(Encoding, Vec<[u8; 3]>),
    /// Linear floats.
    Floats(Vec<[f32; 3]>),
}

impl Image {
    /// Levels of its pyramid: each half the size of the one before, down to one texel.
    pub fn levels(&self) -> u32 {
        levels(self.width, self.height)
    }
}

/// Levels of an image of this size.
pub(super) fn levels(width: u32, height: u32) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// 32-bit words that so many levels of an image take, with the table of their places: a texel takes one, or three if its
/// values are floats.
pub fn words(width: u32, height: u32, levels: u32, is_float: bool) -> u64 {
    let texel = if is_float { 3 } else { 1 };
    let sizes = (0..levels).map(|i| u64::from((width >> i).max(1)) * u64::from((height >> i).max(1)));
    u64::from(levels) + texel * sizes.sum::<u64>()
}

/// 32-bit words that an environment map takes: three a texel, in two rows more than it has, two for each cell between texels, and the tables of
/// its blocks, at most.
pub(crate) fn words_around(width: u32, height: u32) -> u64 {
    const BLOCKS: u64 = 32 * 32 + 290 * 33 * 33;
    let (width, height) = (u64::from(width), u64::from(height));
    3 * width * (height + 2) + 2 * width * (height + 1) + BLOCKS
}
