//! Image comparison metrics behind `wgray diff`. `docs/golden-pictures.md` defines each metric.

mod color_map;
mod colors;
mod flip;
mod picture;
mod plain;
mod show;
mod ssim;

pub use color_map::color;
pub use flip::{Flip, Map, PIXELS_PER_DEGREE, flip};
pub use picture::{Channel, Kind, Picture, Plane, Unreadable};
pub use plain::{COLOR, Difference, LargestDifference, Layer, NonFiniteCounts, PixelCoord, layer_of, layers};
pub use show::{ErrorImage, show, step};
pub use ssim::ssim;
