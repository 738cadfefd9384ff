//! Validated textures.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A color of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Color {
    /// A constant, in linear RGB.
    Plain(DVec3),
    /// A texture: index into [`Scene::textures`](super::Scene::textures).
    Texture(usize),
}

impl Color {
    /// Black.
    pub const BLACK: Color = Color::Plain(DVec3::ZERO);
}

/// A scalar value of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A constant.
    Plain(f64),
    /// A channel of a texture: index into [`Scene::textures`](super::Scene::textures). For [`Channel::A`], the texture
    /// contains the alpha of the file in its red channel.
    Texture(usize, Channel),
}

/// A channel of a texture. In a file, the names are in lower case: `"g"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Red.
    #[default]
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// The alpha channel of the image file; always linear.
    A,
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// Index into [`Scene::textures`](super::Scene::textures) of a [`TextureKind::Image`] with linear texels.
    pub texture: usize,
    /// Factor of the slopes.
    pub strength: f64,
}

/// A texture: a color for each point of the uv plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Content of the texture.
    pub kind: TextureKind,
    /// Rows of the invertible transform from a surface's (u, v, 1) to the texture's (u, v).
    pub transform: [DVec3; 2],
    /// Index of a mesh's set of texture coordinates, 0 to 7; 0 for other shapes.
    pub uv_set: u32,
}

/// Content of a texture. Colors are linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum TextureKind {
    /// One color.
    Constant(DVec3),
    /// A checkerboard of squares with side 1. The square from (0, 0) to (1, 1) has the color `even`.
    Checker {
        /// Color where floor(u) + floor(v) is even.
        even: DVec3,
        /// Color where floor(u) + floor(v) is odd.
        odd: DVec3,
    },
    /// Lines around integer coordinates.
    Lines {
        /// Color between the lines.
        cell: DVec3,
        /// Color of the lines.
        line: DVec3,
        /// Width of the lines, in (0, 1).
        line_width: f64,
    },
    /// An image in the unit square; (0, 0) is the lower left corner.
    Image {
        /// The texels.
        image: Arc<Image>,
        /// Addressing outside of the square, along u and v.
        wrap: [Wrap; 2],
        /// Filter of texture lookups.
        filter: TextureFilter,
        /// Maximum ratio of the axes of a footprint for [`TextureFilter::Ewa`], at least 1.
        max_anisotropy: f64,
        /// Factor of the colors; its components are equal for an alpha texture.
        factor: DVec3,
    },
}

/// Texture addressing outside of the image. In a file, the names are in snake case: `"repeat"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Extends the edge texels.
    Clamp,
    /// Repeats the image, and mirrors every other copy.
    Mirror,
}

/// Texture filter. In a file, the names are in snake case: `"ewa"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum TextureFilter {
    /// Nearest texel.
    Nearest,
    /// Bilinear interpolation of four texels.
    Bilinear,
    /// Bilinear on the two nearest mip levels, interpolated linearly.
    Trilinear,
    /// Elliptical weighted average over the footprint, on the two nearest mip levels.
    #[default]
    Ewa,
}

impl TextureFilter {
    /// Returns true if the filter uses coarser mip levels.
    pub const fn needs_levels(self) -> bool {
        matches!(self, TextureFilter::Trilinear | TextureFilter::Ewa)
    }
}

/// Encoding of 8-bit and 16-bit values. In a file, the names are in snake case: `"srgb"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// The sRGB transfer function of IEC 61966-2-1.
    Srgb,
    /// Linear values.
    Linear,
}

/// An image in row-major order, top row first.
#[derive(Clone, Debug)]
pub struct Image {
    /// Texels per row, at least 1.
    pub width: u32,
    /// Number of rows, at least 1.
    pub height: u32,
    /// Red, green and blue.
    pub texels: Texels,
}

/// An image equals itself without a comparison of its texels, of which scenes can have hundreds of megabytes.
impl PartialEq for Image {
    fn eq(&self, other: &Image) -> bool {
        let Image { width, height, texels } = self;
        let is_equal = || (*width, *height) == (other.width, other.height) && *texels == other.texels;
        std::ptr::eq(self, other) || is_equal()
    }
}

/// Texels, stored as bytes or as floats.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// 8-bit values.
    Bytes(Encoding, Vec<[u8; 3]>),
    /// Linear 32-bit floats.
    Floats(Vec<[f32; 3]>),
}

impl Image {
    /// Returns the number of mip levels, down to one texel.
    pub fn levels(&self) -> u32 {
        levels(self.width, self.height)
    }
}

/// Returns the number of mip levels of an image of this size.
pub(super) fn levels(width: u32, height: u32) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// Returns the size of the mip levels and of the table of their offsets, in 32-bit words. A texel has one word, or
/// three words if its components are floats.
pub fn words(width: u32, height: u32, levels: u32, is_float: bool) -> u64 {
    let words_per_texel = if is_float { 3 } else { 1 };
    let sizes = (0..levels).map(|i| u64::from((width >> i).max(1)) * u64::from((height >> i).max(1)));
    u64::from(levels) + words_per_texel * sizes.sum::<u64>()
}

/// Returns the maximum size of an environment map in 32-bit words: three words per texel (including two additional
/// rows), two words per cell (a square between four texels), and the tables of blocks of cells.
pub(crate) fn environment_words(width: u32, height: u32) -> u64 {
    // The reciprocal of the power of each of at most 32 x 32 blocks, and 33 cumulative distributions of 33 words for
    // each bin of normals (17 x 17 bins, and one bin for all normals).
    const MAX_BLOCK_TABLE_WORDS: u64 = 32 * 32 + (17 * 17 + 1) * 33 * 33;
    let (width, height) = (u64::from(width), u64::from(height));
    3 * width * (height + 2) + 2 * width * (height + 1) + MAX_BLOCK_TABLE_WORDS
}
