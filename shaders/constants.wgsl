// Constants of the shared records. `src/pack/constants.rs` has the same; a test compares them.

const PERSPECTIVE: u32 = 0u;
const ORTHOGRAPHIC: u32 = 1u;

const RECTANGLE: u32 = 0u;
const TRIANGLE: u32 = 1u;
const ELLIPSOID: u32 = 2u;
const PLANE: u32 = 3u;

const PHONG: u32 = 0u;
const EMITTER: u32 = 1u;
const MIRROR: u32 = 2u;
const GLASS: u32 = 3u;

// Glass splits a path at the first so many bounces, and a path so has at most so many ends.
const SPLITS: u32 = 2u;
const LEAVES: u32 = 4u;

// How a texture's colours are found: two that alternate, lines, or an image by one of four filters.
const CHECKER: u32 = 0u;
const LINES: u32 = 1u;
const NEAREST: u32 = 2u;
const BILINEAR: u32 = 3u;
const TRILINEAR: u32 = 4u;
const EWA: u32 = 5u;

// Texels: 8 bits by the sRGB curve, 8 bits, 32-bit floats.
const SRGB8: u32 = 0u;
const LINEAR8: u32 = 1u;
const FLOAT: u32 = 2u;

// Images beyond their edges.
const REPEAT: u32 = 0u;
const CLAMP: u32 = 1u;
const MIRRORED: u32 = 2u;

// What a lookup in a texture is for, bits above the texture's number.
const TEXTURE_NUMBER: u32 = 0xffffffu;
const FOR_AMBIENT: u32 = 0x1000000u;
const FOR_DIFFUSE: u32 = 0x2000000u;
const FOR_SPECULAR: u32 = 0x4000000u;
const FOR_NORMAL: u32 = 0x8000000u;

const GRID: u32 = 0u;
const RANDOM: u32 = 1u;
const ROTATED_GRID: u32 = 2u;
const JITTERED: u32 = 3u;
const HALTON: u32 = 4u;
const SOBOL: u32 = 5u;

// Bins of a reconstruction filter's table.
const BINS: u32 = 128u;

// No distance of a hit is larger.
const FAR: f32 = 3.4028234663852886e38;
// The number of a primitive that is none.
const NOTHING: u32 = 0xffffffffu;
// Shadow rays are traced in blocks of so many, a bit of a word for each.
const BLOCK: u32 = 32u;
// How many samples an estimate must rest on to allow a pixel as many samples again as its first look has, under adaptive
// sampling.
const EVIDENCE: f32 = 2.0;
