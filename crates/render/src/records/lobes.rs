//! The lobes of `principled` materials besides the diffuse one, as a table.

#[cfg(doc)]
use super::PRINCIPLED;
use super::record::constants;
use super::{FOR_ANISOTROPY, FOR_COAT, FOR_METALLIC, FOR_SHEEN, FOR_TRANSMISSION, FOR_WEIGHT, Material};
use glam::Vec3;

/// A lobe of `principled` materials.
pub struct Lobe {
    /// Its bit in [`Specialization::lobes`](super::Specialization::lobes).
    pub bit: u32,
    /// Its name in `wgray info`.
    pub name: &'static str,
    /// Purposes of the texture lookups that may give a material this lobe.
    pub purposes: u32,
    /// Returns true if a material has it without textures.
    pub is_in: fn(&Material) -> bool,
}

constants! {
    /// A lobe of [`PRINCIPLED`] materials: the reflection of dielectrics and metals.
    pub const LOBE_SPECULAR: u32 = 1;
    /// A lobe of [`PRINCIPLED`] materials: transmission.
    pub const LOBE_TRANSMISSION: u32 = 2;
    /// A lobe of [`PRINCIPLED`] materials: the clear coat.
    pub const LOBE_COAT: u32 = 4;
    /// A lobe of [`PRINCIPLED`] materials: sheen.
    pub const LOBE_SHEEN: u32 = 8;
    /// A flag beside the lobes of [`PRINCIPLED`] materials: any is anisotropic.
    pub const LOBE_ANISOTROPY: u32 = 16;
}

/// All lobes.
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
        purposes: FOR_METALLIC | FOR_WEIGHT,
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
        purposes: FOR_COAT,
        is_in: |m| m.clearcoat > 0.0,
    },
    Lobe {
        bit: LOBE_SHEEN,
        name: "sheen",
        purposes: FOR_SHEEN,
        is_in: |m| m.sheen != Vec3::ZERO,
    },
];
