// Constants of the shared records. `src/pack.rs` has the same; a test compares them.

const PERSPECTIVE: u32 = 0u;
const ORTHOGRAPHIC: u32 = 1u;

const RECTANGLE: u32 = 0u;
const TRIANGLE: u32 = 1u;
const ELLIPSOID: u32 = 2u;
const PLANE: u32 = 3u;

const PHONG: u32 = 0u;
const EMITTER: u32 = 1u;

const GRID: u32 = 0u;
const RANDOM: u32 = 1u;
const ROTATED_GRID: u32 = 2u;
const JITTERED: u32 = 3u;
const HALTON: u32 = 4u;
const SOBOL: u32 = 5u;

// No distance of a hit is larger.
const FAR: f32 = 3.4028234663852886e38;
// The number of a primitive that is none.
const NOTHING: u32 = 0xffffffffu;
// Shadow rays are traced in blocks of so many, a bit of a word for each.
const BLOCK: u32 = 32u;
