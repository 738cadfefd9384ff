//! The development mode: a scene and its shaders are watched, rendered anew as they are saved, and shown on a page.
//!
//! ```text
//! files ── watch ──> Snapshot ──> painter ──> builder (compiles)
//!                                    │  ^─────────┘
//!                       Canvas (renders, call by call)
//!                                    └──> State, Frame ──> server ──> page
//! ```

mod build;
mod camera;
mod canvas;
mod diagnostic;
mod faults;
mod guard;
mod measure;
mod messages;
mod painter;
mod picture;
mod save;
mod server;
mod session;
mod sliders;
mod source;
mod times;
mod watch;

pub use crate::gpu::marks::{Kind, Value};
pub use camera::Move;
pub use diagnostic::Diagnostic;
pub use faults::Faults;
pub use measure::{Measured, measure};
pub use messages::{Command, Notice, Report, State};
pub use picture::{Content, Frame, Header, LayerName, View};
pub use server::Listener;
pub use session::{Session, Settings, StartError, Viewer, Viewers};
pub use sliders::SliderState;
pub use source::Sources;
pub use times::{Time, Times};
