//! A ray tracer written as WGSL compute shaders on wgpu, with a CPU twin that computes the same bits.
//!
//! A scene is read from a file, whose format is described in `docs/scene-format.md`, and rendered on a GPU, on software
//! Vulkan or on the CPU, whichever there is:
//!
//! ```
//! use wgray::{Error, Options, Scene};
//!
//! fn main() -> Result<(), Error> {
//!     let scene = Scene::load("scenes/orthographic.toml")?;
//! #   let smaller = wgray::Overrides { size: Some((48, 48)), ..Default::default() }; // a quick test
//! #   let scene = Scene::load_with("scenes/orthographic.toml", &smaller)?;
//!     let picture = wgray::render(&scene, &Options::default())?;
//! #   let folder = tempfile::tempdir().expect("a temporary folder");
//! #   std::env::set_current_dir(&folder).expect("the folder is there");
//!     picture.save("spheres.png")
//! }
//! ```
//!
//! - [`Options`] chooses the device, a part of the picture, and layers such as depth and normals; [`Overrides`] with
//!   [`Scene::load_with`] puts another size, number of samples or seed in place of the file's.
//! - [`render_growing`] shows the picture as it grows, and can be cancelled.
//! - [`Picture`] gives the linear pixels and layers, and writes PNG, OpenEXR, JPEG and WebP files.
//! - A scene can be built in code, without a file, by [`Description::new`]:
//!
//! ```
//! use wgray::scene::{PerspectiveDescription, PhongDescription, PointLightDescription, SphereDescription};
//! use wgray::{Description, Device, Error, Options};
//!
//! fn main() -> Result<(), Error> {
//!     let camera = PerspectiveDescription::new([0.0, -5.0, 2.0], [0.0, 0.0, 0.5], 40.0);
//!     let scene = Description::new(32, 24, camera)
//!         .with_material("red", PhongDescription::new([0.8, 0.1, 0.1]))
//!         .with_light(PointLightDescription::new([3.0, -4.0, 5.0], [1.0, 1.0, 1.0]))
//!         .with_shape(SphereDescription::new("red", [0.0, 0.0, 0.5], 0.5))
//!         .validate()?;
//!     let options = Options { device: Device::Cpu, ..Options::default() };
//!     let picture = wgray::render(&scene, &options)?;
//!     assert!(picture.pixels().colors.iter().any(|[red, ..]| *red > 0.5));
//!     Ok(())
//! }
//! ```
//!
//! # Features
//!
//! All are on by default; a program that links the library may want `default-features = false`.
//!
//! - `gpu`: rendering on GPUs and software Vulkan. Without it [`Device::Auto`] is the CPU, and wgpu is not linked.
//! - `cli`: the program `wgray`.
//! - `dev`: the development mode of the program, a page that follows every save of a shader or scene; with `gpu`.
//!
//! # What is promised
//!
//! What is named at the root of the crate, and the modules that this page lists. Modules that are public but not listed are
//! for the project's own tests and the program; they change as they need to.
// These end the program where a stream is closed or full.
#![warn(clippy::print_stderr, clippy::print_stdout)]

// The program in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(feature = "cli")]
pub mod cli;
mod device;
#[cfg(feature = "cli")]
mod device_plan;
pub mod error;
pub mod image;
mod open;
mod options;
mod picture;
mod render;
mod renderer;

pub use device::{Device, DeviceInfo};
pub use error::Error;
pub use glam::DVec3;
pub use image::{Aov, AovSource, Pixels};
pub use options::Options;
pub use picture::{Channel, Picture};
pub use render::{Growing, render, render_growing};
pub use scene::{Description, Overrides, Scene};
pub use wgray_image::Region;
pub use wgray_render::film;
#[cfg(feature = "gpu")]
pub use wgray_render::gpu::{Info, adapters};
pub use wgray_scene as scene;
pub use wgray_scene::mesh;
