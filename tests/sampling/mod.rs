//! Where samples lie, how they are weighted, and where more of them are taken.

mod adaptive;
mod filters;
mod sequences;
mod unbiased;

use wgray::scene::{Description, Pattern};
use wgray_render::records::Packed;

use crate::{patterns, scenes};

/// The assignment scene, small, with a pattern for the pixel's and the light's samples; `change` sets what else.
fn cornell(pattern: Pattern, count: u32, change: impl FnOnce(&mut Description)) -> Packed {
    let mut description = scenes::scene("cornell.toml");
    (description.image.width, description.image.height) = (41, 33);
    description.render.pixel_samples = patterns::samples(pattern, count);
    description.render.light_samples = patterns::samples(pattern, 9);
    change(&mut description);
    scenes::packed(&description)
}
