//! Pictures as files: PNG, JPEG and WebP as a screen shows them, OpenEXR with the linear values. Rows of PNG and OpenEXR are
//! written as they come, so that a picture need not fit memory, and all under another name until they are whole, so that no
//! half file is ever seen.

mod aov;
mod exr;
mod flat;
mod metadata;
mod png;
mod save_options;
mod target;

use crate::error::RenderError;
use crate::film::Film;
use crate::records::FirstHit;
use wgray_image::{Pending, Pixels, Region, to_8_bits, to_16_bits};
use wgray_scene::ViewSettings;

pub use aov::Channel;
pub use aov::{Aov, AovSource};
pub use exr::read_exr;
pub use metadata::read_metadata;
pub use png::in_memory;
pub use save_options::{BitDepth, ExrCompression, ExrType, Metadata, SaveOptions};
pub use target::{Format, Layers, Saved, Target, files, save};

/// What a picture file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Width and height of the whole picture in pixels.
    pub picture: (u32, u32),
    /// The pixels that are written.
    pub region: Region,
    /// What is written besides the radiance.
    pub aovs: Vec<Aov>,
    /// Whether the picture has alpha, by which its colours are weighted. The film has layers then.
    pub alpha: bool,
    /// The distance that is half bright in a PNG of the depth.
    pub middle_depth: f32,
    /// The number of samples that is bright in a PNG of their counts.
    pub max_samples: u32,
    /// How it is shown, but in an EXR.
    pub view: ViewSettings,
}

/// Some whole rows of a region, in full width.
#[derive(Clone, Copy, Debug)]
pub struct Band<'a> {
    /// The radiance.
    pub film: &'a Film,
    /// The first hits of the same pixels; empty where the layout has no [`Aov`] of them ([`AovSource::FirstHit`]).
    pub hits: &'a [FirstHit],
}

/// Takes the bands of a region one after the other, from the top.
pub type Sink<'a> = dyn FnMut(Band) -> Result<(), RenderError> + 'a;
