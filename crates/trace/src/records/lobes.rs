//! The lobes of `principled` materials besides diffuse, as a table.

#[cfg(doc)]
use super::PRINCIPLED;
use super::record::constants;
use super::{FOR_ANISOTROPY, FOR_CLEARCOAT, FOR_METALLIC, FOR_SHEEN, FOR_SPECULAR_WEIGHT, FOR_TRANSMISSION, Material};
use glam::Vec3;

/// A lobe of `principled` materials.
pub struct Lobe {
    /// Bit in [`Specialization::lobes`](super::Specialization::lobes).
    pub bit: u32,
    /// Name in `wgray info`.
    pub name: &'static str,
    /// Purposes of lookups that may give a material this lobe.
    pub purposes: u32,
    /// Returns true if a material has this lobe, even without textures.
    pub is_in: fn(&Material) -> bool,
}

constants! {
    /// Lobe of [`PRINCIPLED`]: reflection of dielectrics and metals.
    pub const LOBE_SPECULAR: u32 = 1;
    /// Lobe of [`PRINCIPLED`]: transmission.
    pub const LOBE_TRANSMISSION: u32 = 2;
    /// Lobe of [`PRINCIPLED`]: clear coat.
    pub const LOBE_COAT: u32 = 4;
    /// Lobe of [`PRINCIPLED`]: sheen.
    pub const LOBE_SHEEN: u32 = 8;
    /// Flag in addition to the lobes of [`PRINCIPLED`]: anisotropy.
    pub const LOBE_ANISOTROPY: u32 = 16;
}

/// All lobes, and the flag for anisotropy.
pub static LOBES: [Lobe; 5] = [
    Lobe {
        bit: LOBE_ANISOTROPY,
        name: "anisotropy",
        purposes: FOR_ANISOTROPY,
        is_in: |m| m.anisotropy > 0.0,
    },
    Lobe {
        bit: LOBE_SPECULAR,
        name: "specular lobe",
        purposes: FOR_METALLIC | FOR_SPECULAR_WEIGHT,
        is_in: |m| m.metallic > 0.0 || m.specular_weight > 0.0,
    },
    Lobe {
        bit: LOBE_TRANSMISSION,
        name: "transmission",
        purposes: FOR_TRANSMISSION,
        is_in: |m| m.transmission > 0.0,
    },
    Lobe {
        bit: LOBE_COAT,
        name: "clearcoat",
        purposes: FOR_CLEARCOAT,
        is_in: |m| m.clearcoat > 0.0,
    },
    Lobe {
        bit: LOBE_SHEEN,
        name: "sheen",
        purposes: FOR_SHEEN,
        is_in: |m| m.sheen != Vec3::ZERO,
    },
];
