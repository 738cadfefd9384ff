//! Mip pyramids: Williams, "Pyramidal Parametrics", SIGGRAPH 1983.

use glam::DVec3;

use crate::scene::image_file::{linear_to_srgb, srgb_to_linear};
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

/// A level in linear light.
struct Level {
    width: usize,
    height: usize,
    texels: Vec<DVec3>,
}

/// The texels of the finest level, row by row from the bottom.
fn finest(image: &Image) -> impl Fn(usize) -> DVec3 {
    let (width, height) = (image.width as usize, image.height as usize);
    let texel = linear(image);
    move |i| texel((height - 1 - i / width) * width + i % width)
}

/// The texels of an image in linear light, in its own order.
pub fn linear(image: &Image) -> impl Fn(usize) -> DVec3 {
    let texel: Box<dyn Fn(usize) -> DVec3> = match &image.texels {
        Texels::Bytes(encoding, bytes) => {
            let decode = |value: u32| match encoding {
                Encoding::Srgb => srgb_to_linear(f64::from(value) / 255.0),
                Encoding::Linear => f64::from(value) / 255.0,
            };
            let table: Vec<f64> = (0..256).map(decode).collect();
            Box::new(move |i| DVec3::from_array(bytes[i].map(|byte| table[usize::from(byte)])))
        }
        Texels::Floats(floats) => Box::new(|i| DVec3::from_array(floats[i].map(f64::from))),
    };
    texel
}

/// The level after one: each texel the mean over the part of that level that it covers.
fn half(width: usize, height: usize, texel: impl Fn(usize) -> DVec3) -> Level {
    let (columns, rows) = (covers(width, (width / 2).max(1)), covers(height, (height / 2).max(1)));
    let mut texels = Vec::with_capacity(columns.len() * rows.len());
    for row in &rows {
        for column in &columns {
            let mut sum = DVec3::ZERO;
            for (y, v) in row {
                for (x, u) in column {
                    sum += texel(y * width + x) * (u * v);
                }
            }
            texels.push(sum);
        }
    }
    Level {
        width: columns.len(),
        height: rows.len(),
        texels,
    }
}

/// Which of `from` texels in a line each of `to` covers, and with what weight; `to` is half of `from`, rounded down.
fn covers(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let size = from as f64 / to as f64;
    let cover = |i: usize| {
        let (start, end) = (i as f64 * size, (i + 1) as f64 * size);
        let inside = move |j: usize| (end.min((j + 1) as f64) - start.max(j as f64)) / size;
        let touched = start as usize..from.min(end.ceil() as usize);
        touched
            .map(move |j| (j, inside(j)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect()
    };
    (0..to).map(cover).collect()
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
