//! Ranges of the values of scene files, for validation (`validate`) and the JSON Schema (`schema`).

/// Maximum absolute coordinate.
pub(super) const MAX_COORDINATE: f64 = 1e9;
pub(super) const LENGTHS: (f64, f64) = (1e-9, 1e9);
/// Range of color components.
pub(super) const COLORS: (f64, f64) = (0.0, MAX_COLOR);
/// Maximum component of a color.
pub(super) const MAX_COLOR: f64 = 1e6;
pub(super) const FRACTIONS: (f64, f64) = (0.0, 1.0);
/// Rotation angles in degrees.
pub(super) const ROTATIONS: (f64, f64) = (-360.0, 360.0);

/// Maximum number of pixels along a side of the image, and of samples.
pub(super) const MAX_COUNT: u32 = 65_536;
/// Minimum number of samples for an error estimate.
pub(super) const MIN_ADAPTIVE_SAMPLES: u32 = 2;
/// Maximum number of bounces of a path.
pub(super) const MAX_DEPTH: u32 = 1024;
/// Values of `clamp`, the maximum contribution of a sample.
pub(super) const CLAMPS: (f64, f64) = (1e-6, 1e6);
/// Offsets of ray origins above a surface, relative to the largest coordinate of the surface point.
pub(super) const SHADOW_EPSILONS: (f64, f64) = (0.0, 0.1);
/// Filter radii in pixels.
pub(super) const FILTER_RADII: (f64, f64) = (0.01, 16.0);

pub(super) const FRAMES: (f64, f64) = (-1e9, 1e9);
/// Vertical fields of view in degrees.
pub(super) const FOVS: (f64, f64) = (0.001, 179.999);
/// Lens diameters.
pub(super) const APERTURES: (f64, f64) = (0.0, 1e9);
/// F-numbers: focal length divided by lens diameter.
pub(super) const F_NUMBERS: (f64, f64) = (0.1, 1e9);
/// Numbers of corners of polygonal lenses.
pub(super) const BLADES: (u32, u32) = (3, 16);

pub(super) const SHININESS: (f64, f64) = (1e-6, 1e6);
/// Indices of refraction, relative to the medium in front of a surface.
pub(super) const IORS: (f64, f64) = (0.01, MAX_IOR);
/// Indices of refraction of principled materials; 1 is the index of a vacuum.
pub(super) const PRINCIPLED_IORS: (f64, f64) = (1.0, MAX_IOR);
/// Real parts and imaginary parts of the indices of refraction of metals.
pub(super) const ETAS: (f64, f64) = (0.001, MAX_IOR);
pub(super) const KS: (f64, f64) = (0.0, MAX_IOR);
/// Maximum index of refraction.
const MAX_IOR: f64 = 100.0;
/// Absorption coefficients per unit of length.
pub(super) const ABSORPTIONS: (f64, f64) = (0.0, 1e6);
/// Thicknesses of volumes; 0 means a thin sheet.
pub(super) const THICKNESSES: (f64, f64) = (0.0, 1e9);
pub(super) const ATTENUATION_DISTANCES: (f64, f64) = (1e-6, 1e9);

/// Absolute values of scale factors.
pub(super) const SCALES: (f64, f64) = (1e-6, 1e6);
pub(super) const OFFSETS: (f64, f64) = (-1e6, 1e6);
/// Line widths, both ends excluded.
pub(super) const LINE_WIDTHS: (f64, f64) = (0.0, 1.0);
/// Ratios of the axes of a footprint.
pub(super) const ANISOTROPIES: (f64, f64) = (1.0, 64.0);
/// Factors of an image's values.
pub(super) const FACTORS: (f64, f64) = (0.0, 1e6);
/// Maximum number of sets of texture coordinates of a mesh.
pub(super) const UV_SETS: u32 = 8;
/// Factors of the slopes of normal maps.
pub(super) const STRENGTHS: (f64, f64) = (-100.0, 100.0);

/// Angles between the axis and the edge of a cone, in degrees.
pub(super) const CONES: (f64, f64) = (0.01, 180.0);
pub(super) const ENVIRONMENT_SCALES: (f64, f64) = (0.0, 1e6);
/// Elevations of the sun in degrees.
pub(super) const ELEVATIONS: (f64, f64) = (0.0, 90.0);
pub(super) const TURBIDITIES: (f64, f64) = (1.0, 10.0);
/// Times of animations in seconds.
pub(crate) const TIMES: (f64, f64) = (0.0, 1e9);
