//! WebP files.

use std::io::Write;

use ::image::ImageResult;
use ::image::codecs::webp::WebPEncoder;

use super::super::flat::Content;

/// Writes a lossless image.
pub fn write(file: impl Write, content: Content) -> ImageResult<()> {
    content.encode(WebPEncoder::new_lossless(file))
}
