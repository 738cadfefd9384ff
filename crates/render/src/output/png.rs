//! PNG files of the radiance and of AOVs, written row by row.

use std::fs::File;
use std::io::{self, BufReader, Write};

use ::png::{
    BitDepth as Bits, ColorType, Compression, Decoder, Encoder, EncodingError, ScaledFloat, SrgbRenderingIntent,
};
use rayon::prelude::*;

use super::{Aov, Band, BitDepth, Layout, Metadata, SaveOptions, Sink, to_8_bits, to_16_bits};
use crate::error::RenderError;
use wgray_image::GAMMA;

/// Encodes 8-bit RGB as a PNG in memory, with fast compression.
///
/// # Errors
///
/// The length of `rgb` does not match the size.
pub fn in_memory(width: u32, height: u32, rgb: &[u8]) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut png = encoder(&mut file, (width, height), ColorType::Rgb, BitDepth::Eight);
    png.set_compression(Compression::Fast);
    png.write_header()
        .and_then(|mut writer| writer.write_image_data(rgb))
        .map_err(to_io_error)?;
    Ok(file)
}

/// Reads the Latin-1 text chunks before the pixels.
pub(super) fn read_metadata(file: BufReader<File>) -> Option<Metadata> {
    let reader = Decoder::new(file).read_info().ok()?;
    let texts = reader.info().uncompressed_latin1_text.iter();
    let pairs = texts.map(|text| (text.keyword.clone(), text.text.clone()));
    Some(Metadata { pairs: pairs.collect() })
}

fn encoder<W: Write>(file: W, (width, height): (u32, u32), color: ColorType, depth: BitDepth) -> Encoder<'static, W> {
    let mut png = Encoder::new(file, width, height);
    png.set_color(color);
    png.set_depth(match depth {
        BitDepth::Eight => Bits::Eight,
        BitDepth::Sixteen => Bits::Sixteen,
    });
    png
}

/// Writes the radiance (`None`) or an AOV to each file.
pub fn write<W: Write>(
    files: impl IntoIterator<Item = (W, Option<Aov>)>,
    layout: &Layout,
    options: &SaveOptions,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let depth = options.bit_depth;
    let mut writers = Vec::new();
    for (file, content) in files {
        let color = match layout.alpha && content.is_none() {
            true => ColorType::Rgba,
            false => ColorType::Rgb,
        };
        let mut png = encoder(file, (layout.region.width(), layout.region.height()), color, depth);
        if content.is_none() {
            match layout.view.is_srgb() {
                true => png.set_source_srgb(SrgbRenderingIntent::Perceptual),
                false => png.set_source_gamma(ScaledFloat::new(GAMMA as f32)),
            }
        }
        write_metadata(&mut png, &options.metadata).map_err(to_io_error)?;
        writers.push((png.write_header().map_err(to_io_error)?, content));
    }
    let mut streams = Vec::new();
    for (writer, content) in &mut writers {
        streams.push((writer.stream_writer().map_err(to_io_error)?, *content));
    }
    render(&mut |band| {
        for (stream, content) in &mut streams {
            stream.write_all(&encode(band, *content, layout, depth))?;
        }
        Ok(())
    })?;
    for (stream, _) in streams {
        stream.finish().map_err(to_io_error)?;
    }
    for (writer, _) in writers {
        writer.finish().map_err(to_io_error)?;
    }
    Ok(())
}

/// Adds metadata: Latin-1 text chunks, which every reader supports, or UTF-8 if required.
fn write_metadata<W: Write>(png: &mut Encoder<'static, W>, metadata: &Metadata) -> Result<(), EncodingError> {
    for (name, text) in metadata.pairs.iter().cloned() {
        match text.chars().all(|c| c <= '\u{ff}') {
            true => png.add_text_chunk(name, text)?,
            false => png.add_itxt_chunk(name, text)?,
        }
    }
    Ok(())
}

fn encode(band: Band, content: Option<Aov>, layout: &Layout, depth: BitDepth) -> Vec<u8> {
    match (content, layout.alpha) {
        (None, true) => quantize(band, depth, |i| {
            layout.view.display_straight(band.film.color(i), band.film.alpha(i))
        }),
        (None, false) => quantize(band, depth, |i| layout.view.display(band.film.color(i))),
        (Some(aov), _) => quantize(band, depth, |i| {
            let color = aov.color(band, i, layout).to_array();
            match (aov, aov.light()) {
                (Aov::Albedo, _) => layout.view.display_reflectance(color),
                (_, Some(_)) => layout.view.display(color),
                (_, None) => color.map(f64::from),
            }
        }),
    }
}

/// Quantizes pixels from 0 to 1.
fn quantize<const N: usize>(band: Band, depth: BitDepth, pixel: impl Fn(usize) -> [f64; N] + Sync) -> Vec<u8> {
    let pixels = (0..band.film.sums.len()).into_par_iter();
    match depth {
        BitDepth::Eight => pixels.flat_map_iter(|i| pixel(i).map(to_8_bits)).collect(),
        BitDepth::Sixteen => {
            let values = pixels.flat_map_iter(|i| pixel(i).map(to_16_bits));
            values.flat_map_iter(u16::to_be_bytes).collect()
        }
    }
}

fn to_io_error(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}
