//! What the values of a scene file may be: the smallest and the largest, as they are checked (`validate`) and as editors are told
//! (`schema`).

/// Coordinates.
pub(super) const COORDINATES: (f64, f64) = (-FARTHEST, FARTHEST);
/// Largest absolute coordinate.
pub(super) const FARTHEST: f64 = 1e9;
/// Smallest and largest length.
pub(super) const LENGTHS: (f64, f64) = (1e-9, 1e9);
/// Components of colours.
pub(super) const COLORS: (f64, f64) = (0.0, BRIGHTEST);
/// Largest component of a colour.
pub(super) const BRIGHTEST: f64 = 1e6;
/// Parts of a whole.
pub(super) const SHARES: (f64, f64) = (0.0, 1.0);
/// Angles that something is turned by, in degrees.
pub(super) const TURNS: (f64, f64) = (-360.0, 360.0);

/// Most pixels along a side of the picture, and most samples.
pub(super) const MOST: u32 = 65_536;
/// Fewest samples that adaptive sampling can tell anything from.
pub(super) const LEAST_ADAPTIVE: u32 = 2;
/// Most bounces of a path of light from surface to surface.
pub(super) const DEEPEST: u32 = 1024;
/// What the light of a sample may be limited to.
pub(super) const CLAMPS: (f64, f64) = (1e-6, 1e6);
/// How far above a surface rays start at least, relative to the largest coordinate there.
pub(super) const SHADOW_EPSILONS: (f64, f64) = (0.0, 0.1);
/// How far a filter reaches, in pixels.
pub(super) const FILTER_RADII: (f64, f64) = (0.01, 16.0);

/// The first and the last frame that a key may be at.
pub(super) const FRAMES: (f64, f64) = (-1e9, 1e9);
/// Vertical fields of view, in degrees.
pub(super) const FOVS: (f64, f64) = (0.001, 179.999);
/// Diameters of lenses.
pub(super) const APERTURES: (f64, f64) = (0.0, 1e9);
/// Focal lengths over diameters.
pub(super) const F_NUMBERS: (f64, f64) = (0.1, 1e9);
/// Corners of lenses that are not round.
pub(super) const BLADES: (u32, u32) = (3, 16);

/// The exponents of highlights.
pub(super) const SHININESS: (f64, f64) = (1e-6, 1e6);
/// Indices of refraction, relative to what is before a surface.
pub(super) const IORS: (f64, f64) = (0.01, DENSEST);
/// Those of a principled material: from that of empty space on.
pub(super) const PRINCIPLED_IORS: (f64, f64) = (1.0, DENSEST);
/// Real and imaginary parts of metals' indices.
pub(super) const ETAS: (f64, f64) = (0.001, DENSEST);
pub(super) const KS: (f64, f64) = (0.0, DENSEST);
/// Largest index of refraction.
const DENSEST: f64 = 100.0;
/// The light that is swallowed for each unit of length.
pub(super) const ABSORPTIONS: (f64, f64) = (0.0, 1e6);
/// Thicknesses of volumes; 0 is a sheet.
pub(super) const THICKNESSES: (f64, f64) = (0.0, 1e9);
/// Distances after which light is attenuated.
pub(super) const ATTENUATION_DISTANCES: (f64, f64) = (1e-6, 1e9);

/// Factors of coordinates, or their opposites.
pub(super) const SCALES: (f64, f64) = (1e-6, 1e6);
/// What is added to a texture coordinate.
pub(super) const OFFSETS: (f64, f64) = (-1e6, 1e6);
/// Widths of lines, both ends left out.
pub(super) const LINE_WIDTHS: (f64, f64) = (0.0, 1.0);
/// Ratios of a footprint's axes.
pub(super) const ANISOTROPIES: (f64, f64) = (1.0, 64.0);
/// Factors of an image's values.
pub(super) const FACTORS: (f64, f64) = (0.0, 1e6);
/// How many sets of texture coordinates a mesh may have.
pub(super) const UV_SETS: u32 = 8;
/// Factors of a normal map's slopes.
pub(super) const STRENGTHS: (f64, f64) = (-100.0, 100.0);

/// Angles between a cone's middle and its edge, in degrees.
pub(super) const CONES: (f64, f64) = (0.01, 180.0);
/// Factors of the surroundings' radiance.
pub(super) const ENVIRONMENT_SCALES: (f64, f64) = (0.0, 1e6);
/// How high the sun may stand, in degrees.
pub(super) const ELEVATIONS: (f64, f64) = (0.0, 90.0);
/// How hazy a sky may be.
pub(super) const TURBIDITIES: (f64, f64) = (1.0, 10.0);
/// Seconds of animations.
pub(crate) const TIMES: (f64, f64) = (0.0, 1e9);
