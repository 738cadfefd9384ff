//! Image files: PNG, JPEG and WebP with display values, OpenEXR with linear values. PNG and OpenEXR files are written
//! row by row, so that an image need not fit into memory. Files have temporary names until they are complete.

mod aov;
mod flat;
#[cfg_attr(not(feature = "formats"), path = "no_formats.rs")]
mod formats;
mod metadata;
mod png;
mod save_options;
mod target;

use crate::error::RenderError;
use wgray_image::{Pending, Pixels, Region, to_8_bits, to_16_bits};
use wgray_scene::ViewSettings;
use wgray_trace::film::Film;
use wgray_trace::records::FirstHit;

pub use aov::{Aov, AovSource, Channel, channels_of};
pub use formats::exr::read_exr;
pub use metadata::read_metadata;
pub use png::in_memory;
pub use save_options::{BitDepth, ExrCompression, ExrType, Metadata, SaveOptions};
pub use target::{Format, Layers, SaveReport, Target, files, save, write_to};

/// Contents of an image file.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Width and height of the full image in pixels.
    pub picture: (u32, u32),
    /// Pixels to write.
    pub region: Region,
    /// Layers besides the radiance.
    pub aovs: Vec<Aov>,
    /// True if the image has alpha, which requires film layers. Colors are premultiplied.
    pub alpha: bool,
    /// Distance that a PNG of the depth maps to half brightness.
    pub middle_depth: f32,
    /// Sample count that a PNG maps to full brightness.
    pub max_samples: u32,
    /// View transform and exposure, which are not applied to OpenEXR files.
    pub view: ViewSettings,
}

/// Complete rows of a region.
#[derive(Clone, Copy, Debug)]
pub struct Band<'a> {
    /// Film of these rows.
    pub film: &'a Film,
    /// First hits of the pixels; empty if no [`Aov`] of the layout needs them ([`AovSource::FirstHit`]).
    pub hits: &'a [FirstHit],
}

/// Function that receives a region's bands, from top to bottom.
pub type Sink<'a> = dyn FnMut(Band) -> Result<(), RenderError> + 'a;
