//! Mip pyramids: Williams, "Pyramidal Parametrics", SIGGRAPH 1983.

use glam::DVec3;

use crate::scene::halves::{Level, half, linear};
use crate::scene::image_file::linear_to_srgb;
use crate::scene::texture::words;
use crate::scene::{Encoding, Image, Texels};

/// Adds an image's levels to the texels, from the finest on, each row by row from the bottom; a table of the levels'
/// places comes before them. Returns the table's place.
pub fn pyramid(image: &Image, levels: u32, texels: &mut Vec<u32>) -> u32 {
    let table = texels.len();
    let is_float = matches!(image.texels, Texels::Floats(_));
    let more = words(image.width, image.height, levels, is_float) as usize;
    match more > 1 << 20 {
        true => texels.reserve_exact(more), // nothing spare: there are few of that size
        false => texels.reserve(more),
    }
    texels.resize(table + levels as usize, 0);
    let (width, height) = (image.width as usize, image.height as usize);
    let finest = finest(image);
    // The finest level is not kept in linear light: it would take six times the memory of its texels.
    let mut level = None;
    for i in 0..levels as usize {
        texels[table + i] = texels.len() as u32;
        match &level {
            None => write_level(image, (0..width * height).map(&finest), texels),
            Some(Level { texels: colors, .. }) => write_level(image, colors.iter().copied(), texels),
        }
        if i + 1 < levels as usize {
            level = Some(match &level {
                None => half(width, height, &finest),
                Some(level) => half(level.width, level.height, |i| level.texels[i]),
            });
        }
    }
    table as u32
}

fn write_level(image: &Image, colors: impl Iterator<Item = DVec3>, texels: &mut Vec<u32>) {
    match &image.texels {
        Texels::Bytes(encoding, _) => texels.extend(colors.map(|c| packed(c, *encoding))),
        Texels::Floats(_) => texels.extend(colors.flat_map(|c| c.as_vec3().to_array()).map(f32::to_bits)),
    }
}

/// The texels of the finest level, row by row from the bottom.
fn finest(image: &Image) -> impl Fn(usize) -> DVec3 {
    let (width, height) = (image.width as usize, image.height as usize);
    let texel = linear(image);
    move |i| texel((height - 1 - i / width) * width + i % width)
}

/// A colour by the encoding's curve, in steps of 8 bits: see `unpacked_color` in `shaders/texel.wgsl`.
fn packed(color: DVec3, encoding: Encoding) -> u32 {
    let steps = color.to_array().map(|x| match encoding {
        Encoding::Srgb => linear_to_srgb(x) * 255.0,
        Encoding::Linear => x * 255.0,
    });
    let largest = steps.into_iter().fold(0.0, f64::max);
    // The largest value has nine binary digits, or fewer where the least unit is too large for that.
    let exponent = ((largest as f32).to_bits() >> 23).clamp(103, 134) - 103;
    let exponent = exponent + u32::from((largest / unit(exponent)).round() > 511.0);
    let [red, green, blue] = steps.map(|x| (x / unit(exponent)).round() as u32);
    red | green << 9 | blue << 18 | exponent << 27
}

fn unit(exponent: u32) -> f64 {
    f64::from(f32::from_bits((exponent + 95) << 23))
}
