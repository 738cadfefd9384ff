//! A ray tracer written as WGSL compute shaders on wgpu, with a CPU twin that computes the same bits.
//!
//! Images are rendered on a GPU, on software Vulkan or on the CPU. `docs/scene-format.md` documents the scene format.
//! The library has four main uses:
//!
//! # Render a file
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
//! # Render from and to memory
//!
//! ```
//! use wgray::image::{Format, SaveOptions};
//! use wgray::scene::{LoadOptions, MemoryFiles, SceneFormat};
//! use wgray::{Error, Options, Overrides, Scene};
//!
//! fn png(model: &[u8], texture: &[u8]) -> Result<Vec<u8>, Error> {
//!     let files = MemoryFiles::new().with("wood.png", texture); // the files that the model refers to
//!     let smaller = Overrides { size: Some((320, 240)), pixel_samples: Some(16), ..Overrides::default() };
//!     let options = LoadOptions::new().with_source(files).with_overrides(smaller);
//!     let scene = Scene::from_slice(model, SceneFormat::Gltf, &options)?;
//!     let mut png = std::io::Cursor::new(Vec::new());
//!     wgray::render(&scene, &Options::default())?.write_to(&mut png, Format::Png, &SaveOptions::default())?;
//!     Ok(png.into_inner())
//! }
//! # assert!(png(b"{}", b"").is_err());
//! ```
//!
//! # Build a scene in code
//!
//! ```
//! use wgray::scene::{DiffuseDescription, EnvironmentDescription, PerspectiveDescription, SceneBuilder, SphereDescription};
//! use wgray::{Error, Options};
//!
//! fn main() -> Result<(), Error> {
//!     let camera = PerspectiveDescription::new([0.0, -5.0, 2.0], [0.0, 0.0, 0.5], 40.0);
//!     let mut builder = SceneBuilder::new(32, 24, camera);
//!     builder.environment(EnvironmentDescription::new([1.0, 1.0, 1.0]));
//!     let red = builder.material(DiffuseDescription::new([0.8, 0.1, 0.1]));
//!     builder.shape(SphereDescription::new(&red, [0.0, 0.0, 0.5], 0.5));
//!     let image = wgray::render(&builder.build()?, &Options::default())?;
//!     assert!(image.pixels().colors.iter().any(|[red, green, _]| red > green));
//!     Ok(())
//! }
//! ```
//!
//! # Render a scene several times
//!
//! ```
//! use wgray::{Context, Error, Options, Scene, Session};
//!
//! fn main() -> Result<(), Error> {
//!     let scene = Scene::load("scenes/turntable.toml")?;
//! #   let smaller = wgray::Overrides { size: Some((16, 16)), ..Default::default() };
//! #   let scene = Scene::load_with("scenes/turntable.toml", &smaller)?;
//!     let mut session = Session::new(&Context::new(), scene); // keeps the device and the packed scene
//!     for frame in 1..=3 {
//!         let camera = session.scene().camera_at(frame.into())?;
//!         session.set_camera(camera)?;
//!         let image = session.render(&Options::default())?;
//! #       assert_eq!(image.width(), 16);
//!     }
//!     Ok(())
//! }
//! ```
//!
//! The frames are those of an animated camera, or of an orbit around a model ([`Overrides::turntable`]).
//!
//! # More
//!
//! - The folder `examples` has programs: views of a model in memory (`from_memory.rs`) and of a file (`views.rs`), scenes
//!   in code, steps with cancellation, a server.
//! - [`Options`] selects the device, a region of the image, and layers such as depth and normals. [`Overrides`] changes
//!   the size, number of samples or seed of a scene.
//! - [`Session::start`] renders step by step, with the image so far at any time; [`CancelToken`] cancels from another
//!   thread. [`Session::render_async`] returns a future. [`render_progressive`] calls a function with the image so far.
//! - [`Picture`] provides the linear pixels and layers, and writes PNG, OpenEXR, JPEG and WebP.
//! - [`Description`] is a scene file as a value.
//!
//! # Features
//!
//! All are enabled by default, so that `cargo install wgray` installs the program. Libraries usually need less:
//!
//! ```toml
//! wgray = { version = "0.2", default-features = false, features = ["gpu", "formats"] }
//! ```
//!
//! - `gpu`: rendering on GPUs and software Vulkan. Without it, [`Device::Auto`] is the CPU, and wgpu is not linked.
//! - `formats`: OpenEXR, WebP and KTX 2 files, and metadata of JPEG files. Without it, such files are errors, JPEG files
//!   have no metadata, and textures of glTF files use the PNG or JPEG image if there is one.
//! - `cli`: the program `wgray`. Enables `formats`.
//! - `dev`: the program's development mode, a page that updates when a shader or scene is saved. Enables `cli` and `gpu`.
//!
//! Without optimization, the CPU renders far more slowly. To optimize the renderer in your debug builds:
//!
//! ```toml
//! [profile.dev.package."*"]
//! opt-level = 3
//! ```
//!
//! # Stability
//!
//! The public API consists of the items at the root of the crate and the modules listed on this page. Other public
//! modules are internal, and may change at any time.
// `print!` and `eprint!` panic if the stream is closed or full.
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
mod device_cost;
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
#[cfg(not(target_family = "wasm"))]
mod task;

pub use cancel::CancelToken;
pub use context::Context;
pub use device::{Device, DeviceInfo};
pub use error::Error;
pub use glam;
pub use glam::DVec3;
pub use image::{Aov, AovSource, Pixels};
pub use options::Options;
pub use picture::{ChannelValues, Picture};
pub use progressive::{ProgressiveRender, Status};
pub use render::{Progressive, render, render_progressive};
pub use scene::{Camera, Description, Overrides, Scene};
pub use session::Session;
pub use wgray_image::Region;
#[cfg(feature = "gpu")]
pub use wgray_render::gpu::{GpuInfo, adapters};
pub use wgray_render::noise::Noise;
pub use wgray_scene as scene;
pub use wgray_scene::mesh;
pub use wgray_trace::film;

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
