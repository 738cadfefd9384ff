//! Decodes EXR files with one channel of any name as gray. The crate `image` requires R, G and B. Files that
//! have neither R, G and B nor exactly one channel are rejected here.

use std::io::Cursor;

use exr::error::Error;
use exr::prelude::{ReadChannels as _, ReadLayers as _};
use image::error::DecodingError;
use image::{DynamicImage, ImageBuffer, ImageError, ImageFormat};

use super::{DecodeError, Header};
use crate::key_path::list;

const COLORS: [&str; 3] = ["R", "G", "B"];

/// Returns the image if the file has one layer with one channel and an optional, ignored `A`; `None` if a layer has R,
/// G and B. Before decoding, the function calls `check_layer` with the size and the bytes per pixel of each layer, and
/// `check_header` with the header of the image.
pub(super) fn gray_exr(
    bytes: &[u8],
    check_layer: impl Fn((u32, u32), u64) -> Result<(), DecodeError>,
    check_header: impl Fn(Header) -> Result<(), DecodeError>,
) -> Result<Option<DynamicImage>, DecodeError> {
    let damaged = |error: Error| ImageError::Decoding(DecodingError::new(ImageFormat::OpenExr.into(), error));
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    let to_u32 = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
    let size =
        |header: &exr::meta::header::Header| (to_u32(header.layer_size.width()), to_u32(header.layer_size.height()));
    for header in &meta.headers {
        check_layer(size(header), header.channels.bytes_per_pixel as u64)?;
    }
    let names = |header: &exr::meta::header::Header| -> Vec<String> {
        (header.channels.list.iter())
            .map(|channel| channel.name.to_string())
            .collect()
    };
    let has_colors = |header: &exr::meta::header::Header| {
        let names = names(header);
        !header.deep && COLORS.iter().all(|color| names.iter().any(|name| name == color))
    };
    if meta.headers.iter().any(has_colors) {
        return Ok(None);
    }
    let unsupported_channels = || {
        DecodeError::unsupported(match meta.headers.iter().all(|header| header.deep) {
            true => "must have one value for each pixel and channel; deep images are not supported".to_owned(),
            false => format!(
                "must have the channels \"R\", \"G\" and \"B\", or a single channel; it has {}",
                list(meta.headers.iter().flat_map(names).collect::<Vec<_>>())
            ),
        })
    };
    let [header] = meta.headers.as_slice() else {
        return Err(unsupported_channels());
    };
    let mut names = names(header);
    names.retain(|name| name != "A");
    let [name] = names.as_slice() else {
        return Err(unsupported_channels());
    };
    if header.deep {
        return Err(unsupported_channels());
    }
    let (width, height) = size(header);
    check_header(Header {
        width,
        height,
        exceeds_8_bits: true,
    })?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(damaged)?;
    let layer = image.layer_data;
    let channel = (layer.channel_data.list.iter()).find(|channel| channel.name.to_string() == *name);
    let values = channel.iter().flat_map(|channel| channel.sample_data.values_as_f32());
    let colors: Vec<f32> = values.flat_map(|value| [value; 3]).collect();
    let (width, height) = (layer.size.width() as u32, layer.size.height() as u32);
    Ok(ImageBuffer::from_vec(width, height, colors).map(DynamicImage::ImageRgb32F))
}
