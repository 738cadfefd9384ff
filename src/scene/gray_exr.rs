//! EXR files of one channel, whatever its name, as gray: the image library reads such of red, green and blue alone.

use std::io::Cursor;

use exr::error::Error;
use exr::prelude::{ReadChannels as _, ReadLayers as _};
use image::{DynamicImage, ImageBuffer};

use super::image_file::{LARGEST_IMAGE, LONGEST_SIDE};

/// The image, if the file has one layer with one channel, and perhaps an opacity `A`, which is ignored. The error is what
/// follows on the file's name.
pub(super) fn gray_exr(bytes: &[u8]) -> Result<Option<DynamicImage>, String> {
    let damaged = |error: Error| format!("is damaged or cut short: {error}");
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    let [header] = meta.headers.as_slice() else {
        return Ok(None);
    };
    let names = header.channels.list.iter().map(|channel| channel.name.to_string());
    let names: Vec<String> = names.filter(|name| name != "A").collect();
    let [name] = names.as_slice() else { return Ok(None) };
    if header.deep {
        return Ok(None);
    }
    let size = header.layer_size;
    if size.width() > LONGEST_SIDE as usize || size.height() > LONGEST_SIDE as usize {
        let (width, height) = (size.width(), size.height());
        return Err(format!(
            "has {width} x {height} texels; it must have at most {LONGEST_SIDE} along a side"
        ));
    }
    // The channel and its opacity as the library gives them, and the colours.
    let texel = 2 * 4 + 3 * 4;
    if (size.area() * texel) as u64 > LARGEST_IMAGE {
        return Err(format!("must take at most {} MiB when it is read", LARGEST_IMAGE >> 20));
    }
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
