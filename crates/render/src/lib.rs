//! The renderer of wgray: scenes are packed into plain records, which a CPU path and WGSL kernels on a GPU turn into
//! the same bits.

pub mod backend;
pub mod bvh;
pub mod cpu;
pub mod error;
pub mod excerpt;
pub mod film;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod job;
pub mod output;
pub mod pack;
pub mod records;
