// What a kernel may take as constant: it is compiled for its scene. `src/pack/specialization.rs` has the same names; a
// test compares them.

// Primitives are sorted by kind, in this order; in each kind those that can cast a shadow come first.
override RECTANGLES: u32;
override BLOCKING_RECTANGLES: u32;
override TRIANGLES: u32;
override BLOCKING_TRIANGLES: u32;
override ELLIPSOIDS: u32;
override BLOCKING_ELLIPSOIDS: u32;
override PLANES: u32;
override BLOCKING_PLANES: u32;

// Lights are sorted: rectangles first, then points and directions.
override AREA_LIGHTS: u32;
override DELTA_LIGHTS: u32;

// The samples of a pixel and of an area light. A side is that of a grid of cells, or the number of samples.
override PIXEL_PATTERN: u32;
override PIXEL_SIDE: u32;
override PIXEL_SAMPLES: u32;
override LIGHT_PATTERN: u32;
override LIGHT_SIDE: u32;
override LIGHT_SAMPLES: u32;

// Bins of the filter's table; 0 if it is the box of the pixel.
override FILTER_BINS: u32;

// The samples that every pixel gets, and the bits of the square of the error that adaptive sampling aims at.
override FIRST_LOOK: u32;
override SQUARED_ERROR: u32;

// Bits of the largest shininess if all are whole numbers, else 0.
override EXPONENT_BITS: u32;

// Most bounces of a path, 0 where nothing mirrors or refracts.
override BOUNCES: u32;
// 1 where rays carry differentials, else 0.
override DIFFERENTIALS: u32;
// Most lookups in textures of a material, and of one of mirrors or glass; 1 if any texture gives a normal, else 0.
override LOOKUPS: u32;
override SPECULAR_LOOKUPS: u32;
override NORMAL_MAPS: u32;
// Bit i is set if a texture is of kind or format i.
override TEXTURE_KINDS: u32;
override TEXEL_FORMATS: u32;
