//! A ray tracer written as WGSL compute shaders on wgpu, with a CPU twin that computes the same bits.
//!
//! Scenes are read from files (`docs/scene-format.md` documents the format), and rendered on a GPU, on software Vulkan
//! or on the CPU, whichever is available:
//!
//! ```
//! use wgray::{Error, Options, Scene};
//!
//! fn main() -> Result<(), Error> {
//!     let scene = Scene::load("scenes/orthographic.toml")?;
//! #   let smaller = wgray::Overrides { size: Some((48, 48)), ..Default::default() }; // a quick test
//! #   let scene = Scene::load_with("scenes/orthographic.toml", &smaller)?;
//!     let image = wgray::render(&scene, &Options::default())?;
//! #   let folder = tempfile::tempdir().expect("a temporary folder");
//! #   std::env::set_current_dir(&folder).expect("the folder exists");
//!     image.save("spheres.png")
//! }
//! ```
//!
//! - [`Options`] selects the device, a region of the image, and layers such as depth and normals. [`Overrides`] with
//!   [`Scene::load_with`] replaces the size, number of samples or seed of the file.
//! - [`render_progressive`] shows the image while it renders, and can be cancelled.
//! - [`Picture`] provides the linear pixels and layers, and writes PNG, OpenEXR, JPEG and WebP files.
//! - [`Session`] renders a scene several times, from other cameras for example, with one device and without packing the
//!   scene again.
//! - [`Description::new`] builds a scene in code, without a file:
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
//!     let image = wgray::render(&scene, &options)?;
//!     assert!(image.pixels().colors.iter().any(|[red, ..]| *red > 0.5));
//!     Ok(())
//! }
//! ```
//!
//! # Features
//!
//! All are enabled by default; libraries may prefer `default-features = false`.
//!
//! - `gpu`: rendering on GPUs and software Vulkan. Without it, [`Device::Auto`] is the CPU, and wgpu is not linked.
//! - `cli`: the program `wgray`.
//! - `dev`: the program's development mode, a page that updates when a shader or scene is saved. Enables `gpu`.
//!
//! # Stability
//!
//! The public API consists of the items at the root of the crate and the modules listed on this page. Other public
//! modules are internal, and may change at any time.
// These macros panic if the stream is closed or full.
#![warn(clippy::print_stderr, clippy::print_stdout)]

// Compiles the program in the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod cancel;
#[cfg(feature = "cli")]
pub mod cli;
mod context;
mod device;
#[cfg(feature = "cli")]
mod device_plan;
pub mod error;
pub mod image;
mod open;
mod options;
mod picture;
mod progressive;
mod render;
mod renderer;
mod session;
mod task;

pub use cancel::CancelToken;
pub use context::Context;
pub use device::{Device, DeviceInfo};
pub use error::Error;
pub use glam::DVec3;
pub use image::{Aov, AovSource, Pixels};
pub use options::Options;
pub use picture::{Channel, Picture};
pub use progressive::{ProgressiveRender, Status};
pub use render::{Progressive, render, render_progressive};
pub use scene::{Camera, Description, Overrides, Scene};
pub use session::Session;
pub use wgray_image::Region;
pub use wgray_render::film;
#[cfg(feature = "gpu")]
pub use wgray_render::gpu::{GpuInfo, adapters};
pub use wgray_scene as scene;
pub use wgray_scene::mesh;

/// Earlier name of [`Progressive`].
#[deprecated(since = "0.2.0", note = "use `Progressive`")]
pub type Growing<'a> = Progressive<'a>;

/// Earlier name of [`GpuInfo`].
#[cfg(feature = "gpu")]
#[deprecated(since = "0.2.0", note = "use `GpuInfo`")]
pub type Info = GpuInfo;

/// Earlier name of [`render_progressive`].
///
/// # Errors
///
/// The errors of [`render_progressive`].
#[deprecated(since = "0.2.0", note = "use `render_progressive`")]
pub fn render_growing(
    scene: &Scene,
    options: &Options,
    watch: &mut dyn FnMut(&mut Progressive) -> Result<std::ops::ControlFlow<()>, Error>,
) -> Result<Picture, Error> {
    render_progressive(scene, options, watch)
}
