//! The records and constants that the CPU path and the kernels share: each is stated once, as a Rust struct and as WGSL.

mod constants;
mod layout;
mod mesh;
mod packed;
mod record;
mod specialization;

pub use constants::*;
pub use layout::*;
pub use mesh::PackedMesh;
pub use packed::Packed;
pub use record::{Field, Record};
pub use specialization::Specialization;
