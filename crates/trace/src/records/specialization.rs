//! The override constants of a kernel: features and settings of the scene.

/// Declares [`Specialization`] and the shaders' overrides.
macro_rules! specialization {
    ($($(#[$doc:meta])* $field:ident = $name:literal),* $(,)?) => {
        /// The override constants of a kernel. Each distinct set of values needs its own compilation.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        pub struct Specialization { $($(#[$doc])* pub $field: u32,)* }

        impl Specialization {
            /// Returns the overrides' names and values.
            pub fn constants(&self) -> Vec<(&'static str, u32)> {
                vec![$(($name, self.$field)),*]
            }

            /// Returns true if the scene has an environment map.
            pub fn has_environment_map(&self) -> bool {
                self.environment_flags & super::ENVIRONMENT_MAP != 0
            }

            /// Returns the overrides' declarations in WGSL.
            pub fn declarations() -> String {
                concat!($("override ", $name, ": u32;\n"),*).to_string()
            }
        }
    };
}

specialization! {
    /// Bit i: primitives of kind i exist outside of the BVH.
    primitives = "PRIMITIVES",
    /// Bit i: primitives of kind i outside of the BVH can cast shadows.
    shadow_casters = "SHADOW_CASTERS",
    /// Bit i: the scene's BVH contains primitives of kind i. Meshes have the kind [`INSTANCE`](super::INSTANCE).
    tlas_kinds = "TLAS_KINDS",
    /// Bit 0: area lights exist; bit 1: other lights exist; bit 2: spot lights exist.
    lights = "LIGHTS",
    /// 1 if the camera has a lens, else 0.
    lens = "LENS",
    /// 1 for a panorama, else 0.
    panoramic = "PANORAMIC",
    /// 1 if camera-invisible surfaces exist, else 0.
    camera_invisible = "CAMERA_INVISIBLE",
    /// Pattern of pixel samples.
    pixel_pattern = "PIXEL_PATTERN",
    /// Side of the pattern's grid of cells; number of samples if the pattern has no grid.
    pixel_side = "PIXEL_SIDE",
    /// Samples per pixel; with adaptive sampling, samples per round.
    pixel_samples = "PIXEL_SAMPLES",
    /// Pattern of area light samples.
    light_pattern = "LIGHT_PATTERN",
    /// Side of the pattern's grid of cells; number of samples if the pattern has no grid.
    light_side = "LIGHT_SIDE",
    /// Samples per area light.
    light_samples = "LIGHT_SAMPLES",
    /// Number of bins of the filter table; 0 for a box filter of one pixel.
    filter_bins = "FILTER_BINS",
    /// Pilot samples per pixel; all samples if sampling is not adaptive.
    pilot_samples = "PILOT_SAMPLES",
    /// Adaptive sampling: 1 if neighboring pixels have similar noise, as with path tracing; 0 if the noise is at edges.
    smooth_noise = "SMOOTH_NOISE",
    /// Bits of the `f32` squared target error of adaptive sampling.
    squared_error = "SQUARED_ERROR",
    /// Bit length of the largest shininess if all values are integers up to 4096, else 0.
    exponent_bits = "EXPONENT_BITS",
    /// Maximum number of bounces; with `phong`, 0 if no material is specular.
    bounces = "BOUNCES",
    /// 1 if ray differentials are needed, else 0.
    differentials = "DIFFERENTIALS",
    /// Maximum number of texture lookups of a material that is neither mirror nor glass.
    lookups = "LOOKUPS",
    /// Maximum number of texture lookups of a mirror or glass.
    specular_lookups = "SPECULAR_LOOKUPS",
    /// 1 if normal maps exist, else 0.
    normal_maps = "NORMAL_MAPS",
    /// Bit i: textures of kind i exist.
    texture_kinds = "TEXTURE_KINDS",
    /// Bit i: texels of format i exist.
    texel_formats = "TEXEL_FORMATS",
    /// 1 if textures use further sets of texture coordinates, else 0.
    uv_sets = "UV_SETS",
    /// 1 if vertex colors exist and are used, else 0.
    vertex_colors = "VERTEX_COLORS",
    /// Bit i: materials of kind i exist. This field and all following fields are for `path`.
    materials = "MATERIALS",
    /// 1 if rough diffuse materials exist, else 0.
    rough = "ROUGH",
    /// Bit i: BSDFs of kind i may be pure deltas.
    delta_kinds = "DELTA_KINDS",
    /// 1 if anisotropic microfacets exist, else 0.
    anisotropic = "ANISOTROPIC",
    /// Bits of the lobes of [`PRINCIPLED`](super::PRINCIPLED) materials, such as [`LOBE_COAT`](super::LOBE_COAT).
    lobes = "LOBES",
    /// 1 if rays may pass through surfaces because of their alpha, else 0.
    alpha_surfaces = "ALPHA_SURFACES",
    /// 1 if absorbing media exist, else 0.
    absorption = "ABSORPTION",
    /// 1 if emissive surfaces exist, else 0.
    emissive = "EMISSIVE",
    /// 0 if no lights are sampled, 1 if exactly one emitter exists, else 2.
    emitters = "EMITTERS",
    /// 1 if a light tree exists, else 0.
    light_tree = "LIGHT_TREE",
    /// Bit i: lights of kind i exist; [`INSTANCE`](super::INSTANCE) for emissive meshes.
    emitter_kinds = "EMITTER_KINDS",
    /// 1 if emission is textured, else 0.
    emission_textures = "EMISSION_TEXTURES",
    /// Flags [`ENVIRONMENT_MAP`](super::ENVIRONMENT_MAP), [`ENVIRONMENT_INVISIBLE`](super::ENVIRONMENT_INVISIBLE) and
    /// [`BACKGROUND`](super::BACKGROUND).
    environment_flags = "ENVIRONMENT_FLAGS",
    /// First bounce of Russian roulette.
    rr_depth = "RR_DEPTH",
    /// Bits of the `f32` limit of the largest component of an indirect sample; 0 for no limit.
    max_indirect = "MAX_INDIRECT",
    /// 1 for a transparent background, else 0.
    alpha = "ALPHA",
    /// 1 for a film with layers, else 0.
    layers = "LAYERS",
    /// 1 for a film with noise estimates, else 0.
    noise = "NOISE",
}
