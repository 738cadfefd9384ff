//! A ray tracer written as WGSL compute shaders on wgpu, with a CPU twin that computes the same bits.
// These end the program where a stream is closed or full.
#![warn(clippy::print_stderr, clippy::print_stdout)]

pub mod cpu;
#[cfg(feature = "dev")]
pub mod dev;
pub mod device;
pub mod error;
pub mod film;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod image;
pub mod job;
pub mod pack;
mod picture;
pub mod render;
pub mod scene;

pub use device::{Device, DeviceInfo};
pub use error::Error;
pub use film::Region;
pub use image::{Aov, Pixels};
pub use picture::{Channel, Picture};
pub use render::{Options, render};
pub use scene::{Description, Overrides, Scene};
