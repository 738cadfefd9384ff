//! The constants that a kernel is compiled for: what its scene uses, and its settings.

/// Declares [`Specialization`] and the shaders' overrides, a field and its override side by side.
macro_rules! specialization {
    ($($(#[$doc:meta])* $field:ident = $name:literal),* $(,)?) => {
        /// Everything that a kernel may take as constant; a kernel is compiled for one of these.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        pub struct Specialization { $($(#[$doc])* pub $field: u32,)* }

        impl Specialization {
            /// The values by the names of the shaders' overrides.
            pub fn constants(&self) -> Vec<(&'static str, u32)> {
                vec![$(($name, self.$field)),*]
            }

            /// Returns whether the scene has an environment map.
            pub fn has_environment_map(&self) -> bool {
                self.surroundings & super::ENVIRONMENT_MAP != 0
            }

            /// The overrides in WGSL.
            pub fn declarations() -> String {
                concat!($("override ", $name, ": u32;\n"),*).to_string()
            }
        }
    };
}

specialization! {
    /// Bit i is set if there are primitives of kind i.
    primitives = "PRIMITIVES",
    /// Bit i is set if any of them can cast a shadow.
    shadow_casters = "SHADOW_CASTERS",
    /// Bit i is set if primitives of kind i are in the scene's tree, the bit of [`INSTANCE`](super::INSTANCE) if instances of
    /// meshes are.
    in_tree = "TLAS_KINDS",
    /// Bit 0 is set if there are lights with an area, bit 1 if there are others, bit 2 if there are spots among these.
    lights = "LIGHTS",
    /// 1 if the camera has a lens, else 0.
    lens = "LENS",
    /// 1 if the camera sees in all directions, else 0.
    panoramic = "PANORAMIC",
    /// 1 if anything is hidden from the camera, else 0.
    hidden = "CAMERA_INVISIBLE",
    /// How the samples of a pixel are laid out.
    pixel_pattern = "PIXEL_PATTERN",
    /// Side of their grid of cells; how many there are in patterns without cells.
    pixel_side = "PIXEL_SIDE",
    /// How many samples a pixel has; under adaptive sampling in every round.
    pixel_samples = "PIXEL_SAMPLES",
    /// How the samples of an area light are laid out.
    light_pattern = "LIGHT_PATTERN",
    /// Side of their grid of cells; how many there are in patterns without cells.
    light_side = "LIGHT_SIDE",
    /// How many there are.
    light_samples = "LIGHT_SAMPLES",
    /// Bins of the filter's table; 0 if it is the box of the pixel.
    filter_bins = "FILTER_BINS",
    /// How many samples every pixel gets.
    first_look = "PILOT_SAMPLES",
    /// The bits, as an f32, of the square of the error that adaptive sampling aims at.
    squared_error = "SQUARED_ERROR",
    /// Bits of the largest shininess if all are whole numbers, else 0.
    exponent_bits = "EXPONENT_BITS",
    /// Most bounces of a path; under the integrator `phong` 0 where nothing mirrors or refracts.
    bounces = "BOUNCES",
    /// 1 where rays carry differentials, else 0.
    differentials = "DIFFERENTIALS",
    /// Most lookups in textures of a material that neither mirrors nor refracts.
    lookups = "LOOKUPS",
    /// Most lookups of one that does.
    specular_lookups = "SPECULAR_LOOKUPS",
    /// 1 if any texture gives a normal, else 0.
    normal_maps = "NORMAL_MAPS",
    /// Bit i is set if a texture is of kind i.
    texture_kinds = "TEXTURE_KINDS",
    /// Bit i is set if texels are of format i.
    texel_formats = "TEXEL_FORMATS",
    /// 1 if any texture lies by another set of texture coordinates than the first, else 0.
    uv_sets = "UV_SETS",
    /// 1 if any material asks for the colours of vertices, and any mesh has them, else 0.
    vertex_colors = "VERTEX_COLORS",
    /// Under the integrator `path`, as all below: bit i is set if there are materials of kind i.
    materials = "MATERIALS",
    /// 1 if any diffuse material is rough, else 0.
    rough = "ROUGH",
    /// Bit i is set if a material of kind i may mirror or refract alone.
    delta_kinds = "DELTA_KINDS",
    /// 1 if any material with facets is rougher along one axis, else 0.
    anisotropic = "ANISOTROPIC",
    /// The lobes that [`PRINCIPLED`](super::PRINCIPLED) materials have, such as [`LOBE_COAT`](super::LOBE_COAT).
    lobes = "LOBES",
    /// 1 if rays pass any surface by its alpha, else 0.
    sees_through = "ALPHA_SURFACES",
    /// 1 if anything absorbs light that passes through it, else 0.
    absorption = "ABSORPTION",
    /// 1 if any surface shines, else 0.
    shines = "EMISSIVE",
    /// 0 where no light can be sampled, 1 where there is one emitter, else 2.
    emitters = "EMITTERS",
    /// 1 where a tree is over what shines, else 0.
    light_tree = "LIGHT_TREE",
    /// Bit i is set if there are lights of kind i, that of [`INSTANCE`](super::INSTANCE) if meshes shine.
    emitter_kinds = "EMITTER_KINDS",
    /// 1 if a texture says how anything shines, else 0.
    emission_textures = "EMISSION_TEXTURES",
    /// Any of [`ENVIRONMENT_MAP`](super::IMAGE_AROUND), [`ENVIRONMENT_INVISIBLE`](super::UNSEEN_AROUND) and [`BACKGROUND`](super::BACKGROUND).
    surroundings = "ENVIRONMENT_FLAGS",
    /// From which bounce on paths end at random.
    rr_depth = "RR_DEPTH",
    /// The bits, as an f32, of the largest component of a sample of indirect light; 0 for no such limit.
    most_indirect = "MAX_INDIRECT",
    /// 1 where the background is transparent, else 0.
    alpha = "ALPHA",
    /// 1 where the film has layers, else 0.
    layers = "LAYERS",
}
