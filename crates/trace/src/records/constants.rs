//! Constants that the host and the shaders share.

#[cfg(doc)]
use super::{BvhItem, Camera, Instance, Lookup, Material, Texture};
#[cfg(doc)]
use wgray_scene::Pattern;

use glam::UVec2;

use super::KINDS;
use super::record::constants;

constants! {
    /// [`Camera::projection`]: perspective.
    pub const PERSPECTIVE: u32 = 0;
    /// [`Camera::projection`]: orthographic.
    pub const ORTHOGRAPHIC: u32 = 1;
    /// [`Camera::projection`]: equirectangular panorama.
    pub const PANORAMA: u32 = 2;

    /// [`BvhItem::kind`]: a mesh instance.
    pub const INSTANCE: u32 = KINDS;
    /// Flag in [`BvhItem::kind`]: casts shadows.
    pub const CASTS_SHADOW: u32 = 0x100;
    /// Flag in a mesh group's word, in addition to the material index: casts no shadow.
    pub const NO_SHADOW: u32 = 0x8000_0000;
    /// [`Instance::shadows`]: some groups cast no shadow.
    pub const SOME_SHADOWS: u32 = 1;
    /// Maximum number of levels of a BVH.
    pub const BVH_MAX_DEPTH: u32 = 32;
    /// Padding of mesh boxes, relative to coordinates: 32 unit roundoffs, more than the error of a triangle test.
    pub const BOX_PAD: f32 = 32.0 / 16_777_216.0;

    /// [`Material::kind`]: Phong's reflection model.
    pub const PHONG: u32 = 0;
    /// [`Material::kind`]: an area light, with a single color.
    pub const EMITTER: u32 = 1;
    /// [`Material::kind`]: a perfect mirror.
    pub const MIRROR: u32 = 2;
    /// [`Material::kind`]: smooth glass.
    pub const GLASS: u32 = 3;
    /// [`Material::kind`]: diffuse reflection.
    pub const DIFFUSE: u32 = 4;
    /// [`Material::kind`]: rough metal, or metal with a complex index of refraction.
    pub const METAL: u32 = 5;
    /// [`Material::kind`]: rough glass.
    pub const ROUGH_GLASS: u32 = 6;
    /// [`Material::kind`]: a thin sheet of glass, smooth or rough.
    pub const THIN: u32 = 7;
    /// Bits of microfacet kinds.
    pub const MICROFACET_KINDS: u32 = 1 << METAL | 1 << ROUGH_GLASS | 1 << THIN;
    /// Bits of transmissive microfacet kinds.
    pub const TRANSMISSIVE_KINDS: u32 = 1 << ROUGH_GLASS | 1 << THIN;
    /// Number of rows and of columns of the table at [`Material::energy`]; each side of the surface has a table.
    pub const ENERGY_SIZE: u32 = 32;
    /// Number of rows of the table at [`Material::aniso_table`]; rows correspond to the azimuth.
    pub const ANISO_LINES: u32 = 49;
    /// Number of columns of the table at [`Material::aniso_table`]; columns correspond to the cosine.
    pub const ANISO_COLUMNS: u32 = 48;
    /// Minimum alpha of a microfacet lobe. If alpha is smaller along both axes, the lobe is a delta.
    pub const SMALLEST_ALPHA: f32 = 1e-3;
    /// [`Material::kind`]: glTF's metallic-roughness material.
    pub const PRINCIPLED: u32 = 8;
    /// Clear coat reflectance at normal incidence, for index 1.5.
    pub const COAT_F0: f32 = 0.04;
    /// Minimum sheen roughness.
    pub const MIN_SHEEN_ROUGHNESS: f32 = 0.15;
    /// [`Material::alpha_mode`]: the surface is opaque.
    pub const OPAQUE: u32 = 0;
    /// [`Material::alpha_mode`]: the surface exists where the opacity is at least the cutoff.
    pub const MASK: u32 = 1;
    /// [`Material::alpha_mode`]: the opacity is the probability of a hit.
    pub const BLEND: u32 = 2;
    /// Maximum number of surfaces that a ray passes through because of their alpha.
    pub const MAX_ALPHA_SKIPS: u32 = 64;
    /// Bits of pure-delta kinds.
    pub const SPECULAR_KINDS: u32 = 1 << MIRROR | 1 << GLASS;

    /// [`Light::kind`](super::Light::kind): a point light. The kinds of lights without primitives follow [`INSTANCE`].
    pub const POINT: u32 = KINDS + 1;
    /// [`Light::kind`](super::Light::kind): directional.
    pub const DIRECTIONAL: u32 = KINDS + 2;
    /// [`Light::kind`](super::Light::kind): the environment map.
    pub const ENVIRONMENT: u32 = KINDS + 3;

    /// Flag in [`Specialization::environment_flags`](super::Specialization::environment_flags): the scene has an
    /// environment map.
    pub const ENVIRONMENT_MAP: u32 = 1;
    /// Flag in [`Specialization::environment_flags`](super::Specialization::environment_flags): the environment is
    /// invisible to the camera.
    pub const ENVIRONMENT_INVISIBLE: u32 = 2;
    /// Flag in [`Specialization::environment_flags`](super::Specialization::environment_flags): camera rays that leave
    /// the scene have a single color.
    pub const BACKGROUND: u32 = 4;
    /// Maximum number of blocks of the environment map per row or column, a power of two.
    pub const ENVIRONMENT_BLOCKS: u32 = 32;
    /// Number of bins of normals along each side of the octahedral map; odd, to center the axes.
    pub const NORMAL_BINS: u32 = 17;
    /// [`Light::kind`](super::Light::kind): a spot light.
    pub const SPOT: u32 = KINDS + 4;
    /// [`Material::camera_culling`]: camera rays skip both faces.
    pub const CULL_BOTH_FACES: u32 = 1;
    /// [`Material::camera_culling`]: camera rays skip back faces.
    pub const CULL_BACKFACE: u32 = 2;
    /// [`Material::vertex_colors`]: ignored.
    pub const NO_COLORS: u32 = 0;
    /// [`Material::vertex_colors`]: multiply base color and opacity.
    pub const COLORS_OF_BASE: u32 = 1;
    /// [`Material::vertex_colors`]: multiply emission and opacity.
    pub const COLORS_OF_EMISSION: u32 = 2;
    /// Maximum number of camera-invisible surfaces that a ray skips; the next such surface is visible.
    pub const MAX_CAMERA_SKIPS: u32 = 64;

    /// Number of first bounces at which glass splits a path.
    pub const MAX_SPLIT_DEPTH: u32 = 2;
    /// Maximum number of leaves of a split path.
    pub const MAX_PATH_LEAVES: u32 = 4;

    /// [`Texture::kind`]: a checkerboard.
    pub const CHECKER: u32 = 0;
    /// [`Texture::kind`]: grid lines.
    pub const LINES: u32 = 1;
    /// [`Texture::kind`]: nearest texel.
    pub const NEAREST: u32 = 2;
    /// [`Texture::kind`]: bilinear.
    pub const BILINEAR: u32 = 3;
    /// [`Texture::kind`]: trilinear.
    pub const TRILINEAR: u32 = 4;
    /// [`Texture::kind`]: elliptical weighted average (EWA).
    pub const EWA: u32 = 5;

    /// [`Texture::format`]: 8 bits, sRGB-encoded.
    pub const SRGB8: u32 = 0;
    /// [`Texture::format`]: 8 bits, linear.
    pub const LINEAR8: u32 = 1;
    /// [`Texture::format`]: 32-bit floats.
    pub const FLOAT: u32 = 2;

    /// [`Texture::wrap`]: repeat.
    pub const REPEAT: u32 = 0;
    /// [`Texture::wrap`]: clamp to the edge.
    pub const CLAMP: u32 = 1;
    /// [`Texture::wrap`]: repeat, mirroring every other copy.
    pub const MIRRORED: u32 = 2;

    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::ambient`].
    pub const FOR_AMBIENT: u32 = 0x1;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::diffuse`].
    pub const FOR_DIFFUSE: u32 = 0x2;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::specular`].
    pub const FOR_SPECULAR: u32 = 0x4;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::tint`].
    pub const FOR_TINT: u32 = 0x8;
    /// Flag in [`Lookup::purposes`]: the lookup sets the normal.
    pub const FOR_NORMAL: u32 = 0x10;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::emission`].
    pub const FOR_EMISSION: u32 = 0x20;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::roughness`].
    pub const FOR_ROUGHNESS: u32 = 0x40;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::sheen`].
    pub const FOR_SHEEN: u32 = 0x80;
    /// Flag in [`Lookup::purposes`]: the lookup sets the clear coat's normal.
    pub const FOR_CLEARCOAT_NORMAL: u32 = 0x100;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::metallic`].
    pub const FOR_METALLIC: u32 = 0x200;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::anisotropy`].
    pub const FOR_ANISOTROPY: u32 = 0x400;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::specular_weight`].
    pub const FOR_SPECULAR_WEIGHT: u32 = 0x800;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::transmission`].
    pub const FOR_TRANSMISSION: u32 = 0x1000;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::clearcoat`].
    pub const FOR_CLEARCOAT: u32 = 0x2000;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::clearcoat_roughness`].
    pub const FOR_CLEARCOAT_ROUGHNESS: u32 = 0x4000;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::sheen_roughness`].
    pub const FOR_SHEEN_ROUGHNESS: u32 = 0x8000;
    /// Flag in [`Lookup::purposes`]: the lookup sets [`Material::opacity`].
    pub const FOR_OPACITY: u32 = 0x10000;
    /// Flag in [`Lookup::purposes`]: the lookup adds a direction to [`Material::rotation`].
    pub const FOR_DIRECTION: u32 = 0x20000;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::roughness`].
    pub const ROUGHNESS_CHANNEL: u32 = 0;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::metallic`].
    pub const METALLIC_CHANNEL: u32 = 1;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::anisotropy`].
    pub const ANISOTROPY_CHANNEL: u32 = 2;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::specular_weight`].
    pub const SPECULAR_WEIGHT_CHANNEL: u32 = 3;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::transmission`].
    pub const TRANSMISSION_CHANNEL: u32 = 4;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::clearcoat`].
    pub const CLEARCOAT_CHANNEL: u32 = 5;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::clearcoat_roughness`].
    pub const CLEARCOAT_ROUGHNESS_CHANNEL: u32 = 6;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::sheen_roughness`].
    pub const SHEEN_ROUGHNESS_CHANNEL: u32 = 7;
    /// Index of a pair of bits in [`Lookup::channels`]: channel of [`Material::opacity`].
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

    /// Number of bins of a tabulated pixel filter, from its center to its radius.
    pub const FILTER_TABLE_SIZE: u32 = 128;

    /// Maximum hit distance; also the distance stored for a miss.
    pub const INFINITE_T: f32 = f32::MAX;
    /// Index that refers to nothing.
    pub const NO_INDEX: u32 = u32::MAX;
    /// The primitive of a ray that does not start on a surface.
    pub const NO_PRIMITIVE: UVec2 = UVec2::new(0, NO_INDEX);
    /// Number of shadow rays per block; each ray has one bit of a mask.
    pub const SAMPLE_BLOCK: u32 = 32;

    /// Minimum effective sample size of the variance estimate for each multiple of the pilot samples after the first.
    pub const EFFECTIVE_SAMPLES_PER_MULTIPLE: f32 = 2.0;
    /// For noise at edges: maximum distance of the neighbors whose pilot samples determine a pixel's sample count.
    pub const EDGE_NEIGHBOR_RADIUS: u32 = 1;
    /// The same, if neighboring pixels have similar noise.
    pub const SMOOTH_NEIGHBOR_RADIUS: u32 = 2;
    /// If neighboring pixels have similar noise: each effective sample of the variance estimate permits this many times the
    /// pilot samples in addition.
    pub const MULTIPLES_PER_EFFECTIVE_SAMPLE: f32 = 2.0;

    /// Radius of the denoiser's window in pixels: a pixel is averaged with the pixels of a square of 2 * radius + 1.
    pub const DENOISE_RADIUS: u32 = 7;
    /// Radius of the patches that the denoiser compares.
    pub const DENOISE_PATCH_RADIUS: u32 = 2;
    /// Squared difference of colors at which the denoiser's weight falls to about 1/e, in units of their variance.
    pub const DENOISE_COLOR_SCALE: f32 = 1.1;
    /// Smallest variance, against division by zero.
    pub const DENOISE_MIN_VARIANCE: f32 = 1e-20;

    /// First plane of the denoiser's color, in three planes.
    pub const GUIDE_COLOR: u32 = 0;
    /// Plane of the summed variances of the color's components.
    pub const GUIDE_COLOR_VARIANCE: u32 = 3;
    /// Plane of the largest variance that is attributed to other pixels.
    pub const GUIDE_VARIANCE_LIMIT: u32 = 4;
    /// First plane of the denoiser's normal: three planes, the summed variances, and the scale, which is 1 / (tolerated
    /// squared difference).
    pub const GUIDE_NORMAL: u32 = 5;
    /// First plane of the denoiser's albedo, like [`GUIDE_NORMAL`].
    pub const GUIDE_ALBEDO: u32 = 10;
    /// First plane of the denoiser's depth: depth, variance and scale.
    pub const GUIDE_DEPTH: u32 = 15;
    /// Number of planes.
    pub const GUIDE_PLANES: u32 = 18;
}
