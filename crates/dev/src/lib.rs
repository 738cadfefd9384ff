//! The development mode: watches a scene and its shaders, renders again whenever a file is saved, and shows the image
//! on a web page.
//!
//! ```text
//! files ── watch ──> Snapshot ──> painter ──> builder (compiles)
//!                                    │  ^─────────┘
//!                   Canvas (renders, one dispatch at a time, on an Engine)
//!                                    └──> State, Frame, SceneView ──> server ──> page
//! ```

// The checks that the types of the server are `Send` reach the default limit in naga's types.
#![recursion_limit = "256"]

mod bad_pixels;
mod build;
mod camera;
mod canvas;
mod diagnostic;
mod display_settings;
mod download;
mod edit;
mod engine;
mod film_layer;
mod guard;
mod histogram;
mod history;
mod messages;
mod object;
mod painter;
mod picture;
mod pixel_values;
mod reference;
mod save;
mod server;
mod session;
mod shared;
mod sliders;
mod source;
mod times;
mod viewer;
mod watch;

pub use bad_pixels::BadPixels;
pub use camera::{Move, Viewpoint};
pub use diagnostic::Diagnostic;
pub use display_settings::{DisplayOverrides, DisplaySettings, Legend};
pub use film_layer::FilmLayer;
pub use histogram::Histogram;
pub use messages::{Command, Notice, Preview, Report, Set, State};
pub use object::{Group, Object, ObjectList, SceneView};
pub use picture::{Against, Content, Frame, Header, View};
pub use reference::{ErrorMeasures, Reference};
pub use server::Listener;
pub use session::{Session, Settings, StartError, Viewer, Viewers};
pub use sliders::SliderState;
pub use source::Sources;
pub use times::{Time, Times};
pub use wgray_render::gpu::sliders::{Kind, Slider, Value};
