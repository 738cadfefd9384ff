//! Records and constants that the CPU renderer and the kernels share. A single declaration defines each record and
//! constant for both Rust and WGSL.

mod bvh_rows;
mod constants;
mod layout;
mod lobes;
mod mesh;
mod packed;
mod primitive;
mod primitive_kinds;
mod record;
mod specialization;

pub use constants::*;
pub use layout::*;
pub use lobes::*;
pub use mesh::PackedMesh;
pub use packed::{Lighting, Packed, PackedBvh, PackedTextures, Sampling};
pub use primitive::primitive;
pub use primitive_kinds::*;
pub use record::{Field, Record};
pub use specialization::Specialization;

/// Returns the WGSL declarations of all constants.
pub fn constant_declarations() -> String {
    [
        primitive_kinds::constant_declarations(),
        lobes::constant_declarations(),
        constants::constant_declarations(),
    ]
    .concat()
}
