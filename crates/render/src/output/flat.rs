//! JPEG and WebP files, for thumbnails: 8 bits per channel. The encoders require the whole image in memory.

use std::io::{self, Write};

use ::image::codecs::jpeg::JpegEncoder;
use ::image::{ExtendedColorType, ImageEncoder, ImageError, ImageResult};
use rayon::prelude::*;

use super::formats::{exif, webp};
use super::{Band, Format, Layout, SaveOptions, Sink};
use crate::error::RenderError;
use wgray_image::memory::fallible;

/// Maximum size of the Exif tags of a JPEG in bytes: a segment has a length of 16 bits, which includes itself, and starts
/// with 6 bytes that identify Exif.
const JPEG_EXIF_BYTES: usize = 65_535 - 2 - 6;
/// Bytes per pixel that the WebP encoder allocates: a copy of four channels, and the file in a growing buffer.
const WEBP_ENCODER_BYTES: u64 = 12;

/// Writes the radiance; in a JPEG, the radiance is composited over black.
pub fn write(
    mut file: impl Write,
    format: Format,
    layout: &Layout,
    options: &SaveOptions,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let exif = exif::encode(&options.metadata)?;
    let exif_bytes = exif.as_ref().map_or(0, Vec::len);
    if format == Format::Jpeg && exif_bytes > JPEG_EXIF_BYTES {
        let rule = format!("metadata: {exif_bytes} bytes of Exif tags exceed the limit of a JPEG, {JPEG_EXIF_BYTES}");
        return Err(RenderError::Output(io::Error::new(io::ErrorKind::InvalidInput, rule)));
    }
    let (width, height) = (layout.region.width(), layout.region.height());
    format.check_size(width, height).map_err(io::Error::other)?;
    let alpha = layout.alpha && format == Format::WebP;
    let (channels, color) = match alpha {
        true => (4, ExtendedColorType::Rgba8),
        false => (3, ExtendedColorType::Rgb8),
    };
    let bytes = layout.region.pixels() * channels;
    let encoder_bytes = match format {
        Format::WebP => layout.region.pixels() * WEBP_ENCODER_BYTES,
        _ => 0,
    };
    // Allocated before rendering, because a later failure would abort the process. The memory for the encoder is freed
    // at once, because the encoder allocates its own memory.
    let mut pixels: Vec<u8> = allocate(bytes).ok_or(RenderError::Memory(bytes + encoder_bytes))?;
    allocate(encoder_bytes).ok_or(RenderError::Memory(bytes + encoder_bytes))?;
    render(&mut |band| {
        pixels.par_extend(match alpha {
            true => with_alpha(band, layout),
            false => without_alpha(band, layout),
        });
        Ok(())
    })?;
    let content = Content {
        pixels: &pixels,
        size: (width, height),
        color,
        exif,
    };
    let written = match format {
        Format::WebP => webp::write(&mut file, content),
        _ => content.encode(JpegEncoder::new_with_quality(&mut file, options.quality)),
    };
    written.map_err(|error| match error {
        ImageError::IoError(error) => RenderError::Output(error),
        other => RenderError::Output(io::Error::other(other)),
    })
}

fn allocate(bytes: u64) -> Option<Vec<u8>> {
    let mut memory = Vec::new();
    let bytes = usize::try_from(bytes).ok()?;
    fallible(|| memory.try_reserve_exact(bytes)).ok()?;
    Some(memory)
}

fn without_alpha(band: Band, layout: &Layout) -> Vec<u8> {
    let pixel = |i| layout.view.rgb8(band.film.color(i));
    (0..band.film.sums.len()).into_par_iter().flat_map_iter(pixel).collect()
}

fn with_alpha(band: Band, layout: &Layout) -> Vec<u8> {
    let pixel = |i| layout.view.rgba8(band.film.color(i), band.film.alpha(i));
    (0..band.film.sums.len()).into_par_iter().flat_map_iter(pixel).collect()
}

/// Content of a file.
pub(super) struct Content<'a> {
    pixels: &'a [u8],
    size: (u32, u32),
    color: ExtendedColorType,
    exif: Option<Vec<u8>>,
}

impl Content<'_> {
    pub fn encode(self, mut encoder: impl ImageEncoder) -> ImageResult<()> {
        if let Some(exif) = self.exif {
            encoder.set_exif_metadata(exif).map_err(ImageError::Unsupported)?;
        }
        encoder.write_image(self.pixels, self.size.0, self.size.1, self.color)
    }
}
