//! PNG files.

use std::io::{self, Write};

use ::png::{BitDepth, ColorType, Compression, Encoder, EncodingError, ScaledFloat};
use rayon::prelude::*;

use super::{Aov, Band, Layout, Pending, Sink};
use crate::error::RenderError;
use crate::film::mean;

/// The exponent of the course's display curve.
const DISPLAY: f64 = 1.0 / 2.2;

/// A linear value as 8 bits: clamped to [0, 1], raised to the power 1/2.2, times 255, rounded to the nearest whole
/// number; 0 if it is no number.
pub fn encode(linear: f32) -> u8 {
    quantize(f64::from(linear.clamp(0.0, 1.0)).powf(DISPLAY))
}

/// A pixel of a picture with alpha as a PNG has it: red, green and blue of what is there by itself, and the share that it
/// covers, linear. Where nothing is it is black.
pub fn straight([r, g, b]: [f32; 3], alpha: f32) -> [u8; 4] {
    let by_itself = |value: f32| if alpha > 0.0 { encode(value / alpha) } else { 0 };
    let share = quantize(f64::from(alpha.clamp(0.0, 1.0)));
    [by_itself(r), by_itself(g), by_itself(b), share]
}

/// The nearest of 256 steps from 0 to 1; halves go up.
fn quantize(value: f64) -> u8 {
    (value * 255.0 + 0.5) as u8 // the conversion saturates, and takes NaN to 0
}

/// A PNG file of 8-bit RGB in memory, packed for speed.
///
/// # Errors
///
/// Sizes that do not fit the number of bytes.
pub fn in_memory(width: u32, height: u32, rgb: &[u8]) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut png = png8(&mut file, (width, height), ColorType::Rgb);
    png.set_compression(Compression::Fast);
    png.write_header()
        .and_then(|mut writer| writer.write_image_data(rgb))
        .map_err(plain)?;
    Ok(file)
}

fn png8<W: Write>(file: W, (width, height): (u32, u32), color: ColorType) -> Encoder<'static, W> {
    let mut png = Encoder::new(file, width, height);
    png.set_color(color);
    png.set_depth(BitDepth::Eight);
    png
}

/// Writes the radiance to the first file and the AOVs to those after it.
pub fn write(
    files: &mut [Pending],
    layout: &Layout,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let mut writers = Vec::new();
    let contents = [None].into_iter().chain(layout.aovs.iter().copied().map(Some));
    for (file, content) in files.iter_mut().zip(contents) {
        let color = match layout.alpha && content.is_none() {
            true => ColorType::Rgba,
            false => ColorType::Rgb,
        };
        let mut png = png8(file, (layout.region.width(), layout.region.height()), color);
        if content.is_none() {
            png.set_source_gamma(ScaledFloat::new(DISPLAY as f32));
        }
        writers.push((png.write_header().map_err(plain)?, content));
    }
    let mut streams = Vec::new();
    for (writer, content) in &mut writers {
        streams.push((writer.stream_writer().map_err(plain)?, content));
    }
    render(&mut |band| {
        for (stream, content) in &mut streams {
            let bytes = match &*content {
                None => radiance(band, layout.alpha),
                Some(aov) => colors(band, *aov, layout),
            };
            stream.write_all(&bytes)?;
        }
        Ok(())
    })?;
    for (stream, _) in streams {
        stream.finish().map_err(plain)?;
    }
    for (writer, _) in writers {
        writer.finish().map_err(plain)?;
    }
    Ok(())
}

fn radiance(band: Band, alpha: bool) -> Vec<u8> {
    let sums = &band.film.sums;
    if alpha {
        let color = |i| straight(mean(sums[i]), band.film.alpha(i));
        return (0..sums.len()).into_par_iter().flat_map_iter(color).collect();
    }
    sums.par_iter().flat_map_iter(|sum| mean(*sum).map(encode)).collect()
}

fn colors(band: Band, aov: Aov, layout: &Layout) -> Vec<u8> {
    let color = |i| {
        let color = aov.color(band, i, layout).to_array();
        color.map(|value| match aov.light() {
            Some(_) => encode(value),
            None => quantize(f64::from(value)),
        })
    };
    (0..band.film.sums.len()).into_par_iter().flat_map_iter(color).collect()
}

fn plain(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}
