//! Image handling that does not need a renderer: regions, color and view transforms, atomic files, comparison. Also
//! contains the handling of memory and paths that all crates of wgray share.

mod agx;
pub mod blocking_path;
pub mod color;
pub mod compare;
mod complete;
mod difference;
mod file;
pub mod formats;
pub mod memory;
mod output;
pub mod panic_guard;
mod pixels;
mod region;
pub mod sanitize;
mod temporary;
mod view;

pub use complete::is_complete;
pub use difference::{Difference, difference};
pub use file::{Pending, create_beside, remove_stale_beside};
pub use output::Output;
pub use pixels::Pixels;
pub use region::Region;
pub use temporary::remove_temporary_files;
pub use view::{GAMMA, ViewSettings, ViewTransform, encode, to_8_bits, to_16_bits};
