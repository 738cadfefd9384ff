//! The constants for which a kernel is compiled: features of its scene, and its settings.

/// Declares [`Specialization`] and the overrides of the shaders from one list of fields.
macro_rules! specialization {
    ($($(#[$doc:meta])* $field:ident = $name:literal),* $(,)?) => {
        /// The override constants of a kernel. Each distinct value needs its own compilation.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        pub struct Specialization { $($(#[$doc])* pub $field: u32,)* }

        impl Specialization {
            /// Returns the values with the names of the overrides.
            pub fn constants(&self) -> Vec<(&'static str, u32)> {
                vec![$(($name, self.$field)),*]
            }

            /// Returns true if the scene has an environment map.
            pub fn has_environment_map(&self) -> bool {
                self.environment_flags & super::ENVIRONMENT_MAP != 0
            }

            /// Returns the declarations of the overrides in WGSL.
            pub fn declarations() -> String {
                concat!($("override ", $name, ": u32;\n"),*).to_string()
            }
        }
    };
}

specialization! {
    /// Bit i is set if primitives of kind i exist outside of the BVH.
    primitives = "PRIMITIVES",
    /// Bit i is set if any of these can cast a shadow.
    shadow_casters = "SHADOW_CASTERS",
    /// Bit i is set if the scene's BVH has primitives of kind i; [`INSTANCE`](super::INSTANCE) for meshes.
    tlas_kinds = "TLAS_KINDS",
    /// Bit 0 is set if area lights exist, bit 1 if other lights do, bit 2 if these include spot lights.
    lights = "LIGHTS",
    /// 1 if the camera has a lens, else 0.
    lens = "LENS",
    /// 1 if the camera is a panorama, else 0.
    panoramic = "PANORAMIC",
    /// 1 if any surface is invisible to the camera, else 0.
    camera_invisible = "CAMERA_INVISIBLE",
    /// Pattern of the samples of a pixel.
    pixel_pattern = "PIXEL_PATTERN",
    /// Side of its grid of cells; number of samples for patterns without cells.
    pixel_side = "PIXEL_SIDE",
    /// Number of samples per pixel; per round under adaptive sampling.
    pixel_samples = "PIXEL_SAMPLES",
    /// Pattern of the samples of an area light.
    light_pattern = "LIGHT_PATTERN",
    /// Side of its grid of cells; number of samples for patterns without cells.
    light_side = "LIGHT_SIDE",
    /// Number of samples per area light.
    light_samples = "LIGHT_SAMPLES",
    /// Number of bins of the filter table; 0 for a box filter of one pixel.
    filter_bins = "FILTER_BINS",
    /// Number of pilot samples per pixel; all samples without adaptive sampling.
    pilot_samples = "PILOT_SAMPLES",
    /// Bits of the `f32` that is the square of adaptive sampling's target error.
    squared_error = "SQUARED_ERROR",
    /// Bit length of the largest shininess if all are integers up to 4096, else 0.
    exponent_bits = "EXPONENT_BITS",
    /// Maximum number of bounces of a path; under the integrator `phong` 0 without specular materials.
    bounces = "BOUNCES",
    /// 1 if rays carry differentials, else 0.
    differentials = "DIFFERENTIALS",
    /// Maximum number of texture lookups of a material that is neither a mirror nor glass.
    lookups = "LOOKUPS",
    /// Maximum number of texture lookups of a mirror or glass.
    specular_lookups = "SPECULAR_LOOKUPS",
    /// 1 if any texture is a normal map, else 0.
    normal_maps = "NORMAL_MAPS",
    /// Bit i is set if textures of kind i exist.
    texture_kinds = "TEXTURE_KINDS",
    /// Bit i is set if texels of format i exist.
    texel_formats = "TEXEL_FORMATS",
    /// 1 if any texture uses a set of texture coordinates other than the first, else 0.
    uv_sets = "UV_SETS",
    /// 1 if any material uses vertex colors and any mesh has them, else 0.
    vertex_colors = "VERTEX_COLORS",
    /// Under the integrator `path`, like all fields below: bit i is set if materials of kind i exist.
    materials = "MATERIALS",
    /// 1 if any diffuse material is rough, else 0.
    rough = "ROUGH",
    /// Bit i is set if the BSDF of a material of kind i may be a pure delta.
    delta_kinds = "DELTA_KINDS",
    /// 1 if any microfacet material is anisotropic, else 0.
    anisotropic = "ANISOTROPIC",
    /// Bits of the lobes of [`PRINCIPLED`](super::PRINCIPLED) materials, such as [`LOBE_COAT`](super::LOBE_COAT).
    lobes = "LOBES",
    /// 1 if rays may skip any surface by its alpha, else 0.
    alpha_surfaces = "ALPHA_SURFACES",
    /// 1 if any medium absorbs light, else 0.
    absorption = "ABSORPTION",
    /// 1 if any surface is emissive, else 0.
    emissive = "EMISSIVE",
    /// 0 if no light can be sampled, 1 for a single emitter, else 2.
    emitters = "EMITTERS",
    /// 1 if a light tree selects emitters, else 0.
    light_tree = "LIGHT_TREE",
    /// Bit i is set if lights of kind i exist, that of [`INSTANCE`](super::INSTANCE) if meshes are emissive.
    emitter_kinds = "EMITTER_KINDS",
    /// 1 if any emission is textured, else 0.
    emission_textures = "EMISSION_TEXTURES",
    /// Flags [`ENVIRONMENT_MAP`](super::ENVIRONMENT_MAP), [`ENVIRONMENT_INVISIBLE`](super::ENVIRONMENT_INVISIBLE) and
    /// [`BACKGROUND`](super::BACKGROUND).
    environment_flags = "ENVIRONMENT_FLAGS",
    /// First bounce at which Russian roulette may end a path.
    rr_depth = "RR_DEPTH",
    /// Bits of the `f32` that limits the largest component of an indirect sample; 0 for no limit.
    max_indirect = "MAX_INDIRECT",
    /// 1 if the background is transparent, else 0.
    alpha = "ALPHA",
    /// 1 if the film has layers, else 0.
    layers = "LAYERS",
}
