// Constants of the shared records. `src/pack.rs` has the same; a test compares them.

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

const GRID: u32 = 0u;
const RANDOM: u32 = 1u;

// No distance of a hit is larger.
const FAR: f32 = 3.4028234663852886e38;
// The number of a primitive that is none.
const NOTHING: u32 = 0xffffffffu;
// Shadow rays are traced in blocks of so many, a bit of a word for each.
const BLOCK: u32 = 32u;
