//! The records and constants that the CPU path and the kernels share: each is stated once, as a Rust struct and as WGSL.

mod constants;
mod layout;
mod lobes;
mod mesh;
mod packed;
mod primitive_kinds;
mod record;
mod specialization;

pub use constants::*;
pub use layout::*;
pub use lobes::*;
pub use mesh::PackedMesh;
pub use packed::{Lighting, Packed, PackedBvh, PackedTextures, Sampling};
pub use primitive_kinds::*;
pub use record::{Field, Record};
pub use specialization::Specialization;

/// The declarations of all constants in WGSL.
pub fn constant_declarations() -> String {
    [
        primitive_kinds::constant_declarations(),
        lobes::constant_declarations(),
        constants::constant_declarations(),
    ]
    .concat()
}
