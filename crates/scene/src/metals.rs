//! Measured complex indices of refraction of metals, by name.

use glam::DVec3;

/// The complex index of refraction of a metal for red, green and blue light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetalIndex {
    /// Real parts.
    pub eta: DVec3,
    /// Imaginary parts: extinction coefficients.
    pub k: DVec3,
}

/// Name of a metal, and its eta and k for linear sRGB.
type Entry = (&'static str, [f64; 3], [f64; 3]);

/// The spectra in the tables of luxpop.com and of E. D. Palik, "Handbook of Optical Constants of Solids", 1985,
/// weighted by the color matching functions (CIE 1931, primaries of sRGB) and normalized such that a constant spectrum
/// keeps its value. For example, gold reflects (0.97, 0.80, 0.32) at normal incidence. `benches/peers/metals.py` prints
/// this table.
const METALS: &[Entry] = &[
    ("aluminium", [1.6575, 0.8804, 0.5212], [9.2238, 6.2695, 4.837]),
    ("beryllium", [4.185, 3.185, 2.7841], [3.8355, 3.0101, 2.869]),
    ("chromium", [4.3697, 2.9165, 1.6549], [5.2065, 4.2313, 3.7547]),
    ("copper", [0.201, 0.9237, 1.1022], [3.9133, 2.453, 2.1421]),
    ("gold", [0.143, 0.3753, 1.442], [3.983, 2.3856, 1.6034]),
    ("iridium", [3.0863, 2.0822, 1.6179], [5.5921, 4.0671, 3.2673]),
    ("mercury", [2.3989, 1.44, 0.9096], [6.3276, 4.3719, 3.4218]),
    ("molybdenum", [4.484, 3.5251, 2.7763], [4.1114, 3.4208, 3.1506]),
    ("nickel", [2.3673, 1.6634, 1.4671], [4.4988, 3.0501, 2.3454]),
    ("niobium", [3.4201, 2.7901, 2.3956], [3.4414, 2.7377, 2.5797]),
    ("rhodium", [2.5858, 1.8602, 1.5543], [6.7822, 4.703, 3.9761]),
    ("silver", [0.1553, 0.1167, 0.1384], [4.8283, 3.1222, 2.1469]),
    ("titanium_nitride", [1.6484, 1.1505, 1.3798], [3.3683, 1.9435, 1.1021]),
    ("tungsten", [4.3708, 3.3002, 2.9984], [3.5006, 2.6049, 2.2732]),
];

impl MetalIndex {
    /// Returns the index of refraction of the metal with this name.
    pub fn named(name: &str) -> Option<MetalIndex> {
        let (_, eta, k) = METALS.iter().find(|(entry_name, ..)| *entry_name == name)?;
        Some(MetalIndex {
            eta: DVec3::from_array(*eta),
            k: DVec3::from_array(*k),
        })
    }

    /// Returns the names of all metals.
    pub fn names() -> impl Iterator<Item = &'static str> {
        METALS.iter().map(|(name, ..)| *name)
    }
}
