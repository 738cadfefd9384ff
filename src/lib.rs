//! A ray tracer written as WGSL compute shaders on wgpu, with a CPU twin that computes the same bits.
// These end the program where a stream is closed or full.
#![warn(clippy::print_stderr, clippy::print_stdout)]

pub mod cpu;
#[cfg(feature = "dev")]
pub mod dev;
pub mod error;
pub mod film;
pub mod gpu;
pub mod image;
pub mod job;
pub mod pack;
pub mod scene;
