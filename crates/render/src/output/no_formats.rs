//! The module `formats` without the cargo feature `formats`.

use wgray_image::formats::missing;

pub(super) mod exif {
    use std::fs::File;
    use std::io::{self, BufReader};

    use super::super::Metadata;

    pub fn encode(_: &Metadata) -> io::Result<Option<Vec<u8>>> {
        Ok(None)
    }

    pub fn read_metadata(_: BufReader<File>) -> Option<Metadata> {
        None
    }
}

pub(super) mod exr {
    use std::fs::File;
    use std::io::{self, BufReader, Seek, Write};
    use std::path::Path;

    use super::super::{Layout, Metadata, Pixels, SaveOptions, Sink};
    use crate::error::RenderError;

    pub fn write(
        _: impl Write + Seek,
        _: &Layout,
        _: &SaveOptions,
        _: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
    ) -> Result<u64, RenderError> {
        Err(super::missing("OpenEXR").into())
    }

    pub fn read_metadata(_: BufReader<File>) -> Option<Metadata> {
        None
    }

    /// Returns an error.
    pub fn read_exr(path: &Path) -> io::Result<Pixels> {
        let error = super::missing("OpenEXR");
        Err(io::Error::new(error.kind(), format!("{}: {error}", path.display())))
    }
}

pub(super) mod webp {
    use std::io::Write;

    use ::image::{ImageError, ImageResult};

    use super::super::flat::Content;

    pub fn write(_: impl Write, _: Content) -> ImageResult<()> {
        Err(ImageError::IoError(super::missing("WebP")))
    }
}
