//! Constants of both sides.

#[cfg(doc)]
use super::{Camera, Instance, Item, Lookup, Material, Texture};
#[cfg(doc)]
use wgray_scene::Pattern;

use glam::UVec2;

use super::KINDS;
use super::record::constants;

constants! {
    /// [`Camera::projection`] of a camera whose rays start at one point.
    pub const PERSPECTIVE: u32 = 0;
    /// [`Camera::projection`] of a camera whose rays are parallel.
    pub const ORTHOGRAPHIC: u32 = 1;
    /// [`Camera::projection`] of a camera that sees in all directions.
    pub const PANORAMA: u32 = 2;

    /// [`Item::kind`]: an instance of a mesh.
    pub const INSTANCE: u32 = KINDS;
    /// In [`Item::kind`]: casts a shadow.
    pub const CASTS_SHADOW: u32 = 0x100;
    /// In the word of a mesh's group: casts no shadow. The other bits are its material.
    pub const NO_SHADOW: u32 = 0x8000_0000;
    /// [`Instance::shadows`]: some groups cast none.
    pub const SOME_SHADOWS: u32 = 1;
    /// Levels of nodes that a tree has at most.
    pub const BVH_MAX_DEPTH: u32 = 32;
    /// How much larger a mesh's boxes count, relative to the coordinates: 32 units of rounding, more than all that is
    /// computed of a ray and a triangle loses.
    pub const BOX_PAD: f32 = 32.0 / 16_777_216.0;

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
    /// [`Material::kind`]: metal that is rough, or has an index of refraction.
    pub const METAL: u32 = 5;
    /// [`Material::kind`]: clear glass that is rough.
    pub const ROUGH_GLASS: u32 = 6;
    /// [`Material::kind`]: a sheet of clear glass, rough or not.
    pub const THIN: u32 = 7;
    /// The bits of the kinds of materials that have facets.
    pub const FACET_KINDS: u32 = 1 << METAL | 1 << ROUGH_GLASS | 1 << THIN;
    /// The bits of those of them that let light through.
    pub const PASSING_KINDS: u32 = 1 << ROUGH_GLASS | 1 << THIN;
    /// Rows and columns of a table of [`Material::energy`], for each side.
    pub const ENERGY_SIZE: u32 = 32;
    /// Lines of a table of [`Material::aniso_table`], by the direction along the surface.
    pub const STREAK_LINES: u32 = 49;
    /// Its columns, by the cosine.
    pub const STREAK_COLUMNS: u32 = 48;
    /// A microfacet lobe whose alpha are all below this is a delta; each of any other is at least this.
    pub const SMALLEST_ALPHA: f32 = 1e-3;
    /// [`Material::kind`]: glTF's material.
    pub const PRINCIPLED: u32 = 8;
    /// What a clear coat reflects head-on: its index of refraction is 1.5.
    pub const COAT_F0: f32 = 0.04;
    /// The smallest roughness of sheen: a smoother one stands for it.
    pub const LEAST_SHEEN: f32 = 0.15;
    /// [`Material::alpha_mode`]: all of the surface is there.
    pub const OPAQUE: u32 = 0;
    /// [`Material::alpha_mode`]: it is there where its alpha is not below the cutoff.
    pub const MASK: u32 = 1;
    /// [`Material::alpha_mode`]: it is there for that share of the rays.
    pub const BLEND: u32 = 2;
    /// The most surfaces that a ray passes by their alpha.
    pub const MAX_ALPHA_SKIPS: u32 = 64;
    /// The bits of the kinds of materials that mirror or refract, and do nothing else.
    pub const SPECULAR_KINDS: u32 = 1 << MIRROR | 1 << GLASS;

    /// [`Light::kind`](super::Light::kind), behind the kinds of primitives and instances: light from one point.
    pub const POINT: u32 = KINDS + 1;
    /// [`Light::kind`](super::Light::kind): light from infinitely far away.
    pub const DIRECTIONAL: u32 = KINDS + 2;
    /// [`Light::kind`](super::Light::kind): the image that surrounds the scene.
    pub const ENVIRONMENT: u32 = KINDS + 3;

    /// In [`Specialization::surroundings`](super::Specialization::surroundings): an image surrounds the scene.
    pub const ENVIRONMENT_MAP: u32 = 1;
    /// In [`Specialization::surroundings`](super::Specialization::surroundings): the camera does not see what surrounds the scene.
    pub const ENVIRONMENT_INVISIBLE: u32 = 2;
    /// In [`Specialization::surroundings`](super::Specialization::surroundings): the camera sees one colour in place of them.
    pub const BACKGROUND: u32 = 4;
    /// Blocks of an environment map's cells along a row or a column, at most; a power of two.
    pub const ENVIRONMENT_BLOCKS: u32 = 32;
    /// Bins of normals along a side of the octahedral map, for each of which blocks have probabilities of their own; an odd number, so that
    /// the axes are in the middle of theirs.
    pub const NORMAL_BINS: u32 = 17;
    /// [`Light::kind`](super::Light::kind): a cone of light from one point.
    pub const SPOT: u32 = KINDS + 4;
    /// [`Material::hidden`]: the camera's rays go through its back.
    pub const CULL_BACKFACE: u32 = 2;
    /// [`Material::vertex_colors`]: colours of vertices do nothing.
    pub const NO_COLORS: u32 = 0;
    /// [`Material::vertex_colors`]: they are factors of the base colour, and of what there is of the surface.
    pub const COLORS_OF_BASE: u32 = 1;
    /// [`Material::vertex_colors`]: they are factors of the emission, and of what there is of the surface.
    pub const COLORS_OF_EMISSION: u32 = 2;
    /// The camera's rays go through so many surfaces that are hidden from it, at most; they see the next one.
    pub const MAX_CAMERA_SKIPS: u32 = 64;

    /// Glass splits a path at the first so many bounces.
    pub const MAX_SPLIT_DEPTH: u32 = 2;
    /// A path so has at most so many ends.
    pub const MAX_PATH_LEAVES: u32 = 4;

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

    /// In [`Lookup::purposes`]: gives [`Material::ambient`].
    pub const FOR_AMBIENT: u32 = 0x1;
    /// In [`Lookup::purposes`]: gives [`Material::diffuse`].
    pub const FOR_DIFFUSE: u32 = 0x2;
    /// In [`Lookup::purposes`]: gives [`Material::specular`].
    pub const FOR_SPECULAR: u32 = 0x4;
    /// In [`Lookup::purposes`]: gives [`Material::tint`].
    pub const FOR_TINT: u32 = 0x8;
    /// In [`Lookup::purposes`]: gives the normal.
    pub const FOR_NORMAL: u32 = 0x10;
    /// In [`Lookup::purposes`]: gives [`Material::emission`].
    pub const FOR_EMISSION: u32 = 0x20;
    /// In [`Lookup::purposes`]: gives [`Material::roughness`].
    pub const FOR_ROUGHNESS: u32 = 0x40;
    /// In [`Lookup::purposes`]: gives [`Material::sheen`].
    pub const FOR_SHEEN: u32 = 0x80;
    /// In [`Lookup::purposes`]: gives the normal of the coat.
    pub const FOR_COAT_NORMAL: u32 = 0x100;
    /// In [`Lookup::purposes`]: gives [`Material::metallic`].
    pub const FOR_METALLIC: u32 = 0x200;
    /// In [`Lookup::purposes`]: gives [`Material::anisotropy`].
    pub const FOR_ANISOTROPY: u32 = 0x400;
    /// In [`Lookup::purposes`]: gives [`Material::specular_weight`].
    pub const FOR_WEIGHT: u32 = 0x800;
    /// In [`Lookup::purposes`]: gives [`Material::transmission`].
    pub const FOR_TRANSMISSION: u32 = 0x1000;
    /// In [`Lookup::purposes`]: gives [`Material::clearcoat`].
    pub const FOR_COAT: u32 = 0x2000;
    /// In [`Lookup::purposes`]: gives [`Material::clearcoat_roughness`].
    pub const FOR_COAT_ROUGHNESS: u32 = 0x4000;
    /// In [`Lookup::purposes`]: gives [`Material::sheen_roughness`].
    pub const FOR_SHEEN_ROUGHNESS: u32 = 0x8000;
    /// In [`Lookup::purposes`]: gives [`Material::opacity`].
    pub const FOR_OPACITY: u32 = 0x10000;
    /// In [`Lookup::purposes`]: turns [`Material::rotation`].
    pub const FOR_DIRECTION: u32 = 0x20000;
    /// Where the two bits of [`Lookup::channels`] are that say which value gives [`Material::roughness`].
    pub const ROUGHNESS_CHANNEL: u32 = 0;
    /// Those of [`Material::metallic`], and so on.
    pub const METALLIC_CHANNEL: u32 = 1;
    /// Of [`Material::anisotropy`].
    pub const ANISOTROPY_CHANNEL: u32 = 2;
    /// Of [`Material::specular_weight`].
    pub const WEIGHT_CHANNEL: u32 = 3;
    /// Of [`Material::transmission`].
    pub const TRANSMISSION_CHANNEL: u32 = 4;
    /// Of [`Material::clearcoat`].
    pub const COAT_CHANNEL: u32 = 5;
    /// Of [`Material::clearcoat_roughness`].
    pub const COAT_ROUGHNESS_CHANNEL: u32 = 6;
    /// Of [`Material::sheen_roughness`].
    pub const SHEEN_ROUGHNESS_CHANNEL: u32 = 7;
    /// Of [`Material::opacity`].
    pub const OPACITY_CHANNEL: u32 = 8;

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
    pub const FILTER_BINS_MAX: u32 = 128;

    /// No distance of a hit is larger.
    pub const INFINITE_T: f32 = f32::MAX;
    /// The number of a primitive that is none.
    pub const NO_INDEX: u32 = u32::MAX;
    /// The instance and primitive of a ray's start that is on none.
    pub const NO_PRIMITIVE: UVec2 = UVec2::new(0, NO_INDEX);
    /// Shadow rays are traced in blocks of so many, a bit of a word for each.
    pub const SAMPLE_BLOCK: u32 = 32;

    /// How many samples an estimate must rest on to allow a pixel as many samples again as its first look has, under adaptive
    /// sampling.
    pub const EFFECTIVE_SAMPLES_PER_DOUBLING: f32 = 2.0;
}
