//! Images in memory and as files: PNG, JPEG and WebP with display values, OpenEXR with linear values.

pub use wgray_image::{
    Difference, Output, Pending, Pixels, difference, encode, is_complete, remove_temporary_files, to_8_bits, to_16_bits,
};
pub(crate) use wgray_render::output::write_to;
pub use wgray_render::output::{
    Aov, AovSource, Band, BitDepth, ExrCompression, ExrType, Format, Layers, Layout, Metadata, SaveOptions, SaveReport,
    Sink, Target, files, in_memory, read_exr, read_metadata, save,
};
