//! Sequences, reconstruction filters and adaptive sampling.

mod adaptive;
mod adaptive_paths;
mod filters;
mod sequences;
mod unbiased;

use wgray::scene::{Description, Pattern};
use wgray_trace::records::Packed;

use crate::{patterns, scenes};

/// Returns a small `cornell.toml` with one pattern for pixel and light samples, modified by `change`.
fn cornell(pattern: Pattern, count: u32, change: impl FnOnce(&mut Description)) -> Packed {
    let mut description = scenes::scene("cornell.toml");
    (description.image.width, description.image.height) = (41, 33);
    description.render.pixel_samples = patterns::samples(pattern, count);
    description.render.light_samples = patterns::samples(pattern, 9);
    change(&mut description);
    scenes::packed(&description)
}
