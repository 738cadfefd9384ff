//! The metadata of existing image files.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

use super::formats::{exif, exr};
use super::{Metadata, png};
use wgray_image::panic_guard::catch_panic;

/// Reads the metadata of an image that this program wrote; `None` for other files. The first bytes determine the
/// format. Without the cargo feature `formats`, only PNG files have metadata.
pub fn read_metadata(path: &Path) -> Option<Metadata> {
    let mut file = BufReader::new(File::open(path).ok()?);
    let start = file.fill_buf().ok()?;
    let read = if start.starts_with(b"\x89PNG") {
        png::read_metadata
    } else if start.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        exr::read_metadata
    } else {
        exif::read_metadata
    };
    // The file is untrusted, but the readers expect valid files and may panic.
    let metadata = catch_panic(|| read(file)).ok().flatten();
    metadata.filter(|metadata| {
        metadata
            .software()
            .is_some_and(|software| software.starts_with("wgray "))
    })
}
