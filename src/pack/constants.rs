//! Constants of both sides.

#[cfg(doc)]
use super::{Camera, Instance, Item, Material, Primitive, Texture};
#[cfg(doc)]
use crate::scene::Pattern;

use glam::UVec2;

use super::record::constants;

constants! {
    /// [`Camera::projection`] of a camera whose rays start at one point.
    pub const PERSPECTIVE: u32 = 0;
    /// [`Camera::projection`] of a camera whose rays are parallel.
    pub const ORTHOGRAPHIC: u32 = 1;

    /// [`Primitive::kind`]: |x| <= 1, |y| <= 1, z = 0 in local space.
    pub const RECTANGLE: u32 = 0;
    /// [`Primitive::kind`]: x >= 0, y >= 0, x + y <= 1, z = 0 in local space.
    pub const TRIANGLE: u32 = 1;
    /// [`Primitive::kind`]: the unit sphere of local space.
    pub const ELLIPSOID: u32 = 2;
    /// [`Primitive::kind`]: z = 0 in local space.
    pub const PLANE: u32 = 3;

    /// [`Primitive::kind`]: x² + y² <= 1, z = 0 in local space.
    pub const DISK: u32 = 4;
    /// How many kinds of primitives there are.
    pub const KINDS: u32 = 5;
    /// [`Item::kind`]: an instance of a mesh.
    pub const INSTANCE: u32 = KINDS;
    /// In [`Item::kind`]: casts a shadow.
    pub const CASTS_SHADOW: u32 = 0x100;
    /// In the word of a mesh's group: casts no shadow. The other bits are its material.
    pub const NO_SHADOW: u32 = 0x8000_0000;
    /// [`Instance::shadows`]: some groups cast none.
    pub const SOME_SHADOWS: u32 = 1;
    /// Levels of nodes that a tree has at most.
    pub const LEVELS: u32 = 32;
    /// How much larger a mesh's boxes count, relative to the coordinates: 32 units of rounding, more than all that is
    /// computed of a ray and a triangle loses.
    pub const PAD: f32 = 32.0 / 16_777_216.0;

    /// [`Material::kind`]: Phong's reflection model.
    pub const PHONG: u32 = 0;
    /// [`Material::kind`]: a light's surface, of one colour.
    pub const EMITTER: u32 = 1;
    /// [`Material::kind`]: a mirror.
    pub const MIRROR: u32 = 2;
    /// [`Material::kind`]: clear glass.
    pub const GLASS: u32 = 3;
    /// [`Material::kind`]: a diffuse surface.
    pub const DIFFUSE: u32 = 4;
    /// The bits of the kinds of materials that mirror or refract, and do nothing else.
    pub const SPECULAR_KINDS: u32 = 1 << MIRROR | 1 << GLASS;

    /// [`Light::kind`](super::Light::kind), behind the kinds of primitives and instances: light from one point.
    pub const POINT: u32 = 6;
    /// [`Light::kind`](super::Light::kind): light from infinitely far away.
    pub const DIRECTIONAL: u32 = 7;

    /// Glass splits a path at the first so many bounces.
    pub const SPLITS: u32 = 2;
    /// A path so has at most so many ends.
    pub const LEAVES: u32 = 4;

    /// [`Texture::kind`]: two colours that alternate.
    pub const CHECKER: u32 = 0;
    /// [`Texture::kind`]: lines.
    pub const LINES: u32 = 1;
    /// [`Texture::kind`]: an image, by its nearest texel.
    pub const NEAREST: u32 = 2;
    /// [`Texture::kind`]: an image, between its texels.
    pub const BILINEAR: u32 = 3;
    /// [`Texture::kind`]: an image, between its texels and levels.
    pub const TRILINEAR: u32 = 4;
    /// [`Texture::kind`]: an image, by the elliptical weighted average.
    pub const EWA: u32 = 5;

    /// [`Texture::format`]: 8 bits by the sRGB curve.
    pub const SRGB8: u32 = 0;
    /// [`Texture::format`]: 8 bits.
    pub const LINEAR8: u32 = 1;
    /// [`Texture::format`]: 32-bit floats.
    pub const FLOAT: u32 = 2;

    /// [`Texture::wrap`]: the image again and again.
    pub const REPEAT: u32 = 0;
    /// [`Texture::wrap`]: the colour of the nearest edge.
    pub const CLAMP: u32 = 1;
    /// [`Texture::wrap`]: the image again and again, every other one mirrored.
    pub const MIRRORED: u32 = 2;

    /// The bits of [`Material::lookups`] that are the texture's number.
    pub const TEXTURE_NUMBER: u32 = 0xff_ffff;
    /// In [`Material::lookups`]: gives [`Material::ambient`].
    pub const FOR_AMBIENT: u32 = 0x100_0000;
    /// In [`Material::lookups`]: gives [`Material::diffuse`].
    pub const FOR_DIFFUSE: u32 = 0x200_0000;
    /// In [`Material::lookups`]: gives [`Material::specular`].
    pub const FOR_SPECULAR: u32 = 0x400_0000;
    /// In [`Material::lookups`]: gives [`Material::tint`].
    pub const FOR_TINT: u32 = 0x800_0000;
    /// In [`Material::lookups`]: gives the normal.
    pub const FOR_NORMAL: u32 = 0x1000_0000;
    /// In [`Material::lookups`]: gives [`Material::emission`].
    pub const FOR_EMISSION: u32 = 0x2000_0000;
    /// In [`Material::lookups`]: its red gives [`Material::roughness`].
    pub const FOR_ROUGHNESS: u32 = 0x4000_0000;

    /// [`Pattern::Grid`].
    pub const GRID: u32 = 0;
    /// [`Pattern::Random`].
    pub const RANDOM: u32 = 1;
    /// [`Pattern::RotatedGrid`].
    pub const ROTATED_GRID: u32 = 2;
    /// [`Pattern::Jittered`].
    pub const JITTERED: u32 = 3;
    /// [`Pattern::Halton`].
    pub const HALTON: u32 = 4;
    /// [`Pattern::Sobol`].
    pub const SOBOL: u32 = 5;

    /// Bins between the centre and the radius of a reconstruction filter.
    pub const BINS: u32 = 128;

    /// No distance of a hit is larger.
    pub const FAR: f32 = f32::MAX;
    /// The number of a primitive that is none.
    pub const NOTHING: u32 = u32::MAX;
    /// The instance and primitive of a ray's start that is on none.
    pub const NOWHERE: UVec2 = UVec2::new(0, NOTHING);
    /// Shadow rays are traced in blocks of so many, a bit of a word for each.
    pub const BLOCK: u32 = 32;

    /// How many samples an estimate must rest on to allow a pixel as many samples again as its first look has, under adaptive
    /// sampling.
    pub const EVIDENCE: f32 = 2.0;
}
