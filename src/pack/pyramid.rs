//! Mip pyramids: Williams, "Pyramidal Parametrics", SIGGRAPH 1983.

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::halves::{Level, decoded, half, linear};
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
            None => write_finest(image, texels),
            Some(level) => write_level(image, level, texels),
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

/// Lines of this many words behind what is there, for all threads.
fn lines(
    texels: &mut Vec<u32>,
    words: usize,
    count: usize,
) -> impl IndexedParallelIterator<Item = (usize, &mut [u32])> {
    let start = texels.len();
    texels.resize(start + words * count, 0);
    let lines = texels[start..].par_chunks_mut(words);
    lines.with_min_len(16).enumerate()
}

fn write_finest(image: &Image, texels: &mut Vec<u32>) {
    let (width, height) = (image.width as usize, image.height as usize);
    let row = |line: usize| (height - 1 - line) * width..(height - line) * width; // from the bottom
    match &image.texels {
        Texels::Bytes(encoding, bytes) => {
            let table: Vec<f64> = decoded(*encoding).into_iter().map(|x| steps(x, *encoding)).collect();
            lines(texels, width, height).for_each(|(line, words)| {
                for (word, texel) in words.iter_mut().zip(&bytes[row(line)]) {
                    *word = packed(texel.map(|byte| table[usize::from(byte)]));
                }
            });
        }
        Texels::Floats(floats) => lines(texels, 3 * width, height).for_each(|(line, words)| {
            for (words, texel) in words.chunks_exact_mut(3).zip(&floats[row(line)]) {
                words.copy_from_slice(&texel.map(f32::to_bits));
            }
        }),
    }
}

fn write_level(image: &Image, level: &Level, texels: &mut Vec<u32>) {
    let colors = level.texels.chunks_exact(level.width);
    let colors: Vec<&[DVec3]> = colors.collect();
    match &image.texels {
        Texels::Bytes(encoding, _) => lines(texels, level.width, level.height).for_each(|(line, words)| {
            for (word, color) in words.iter_mut().zip(colors[line]) {
                *word = packed(color.to_array().map(|x| steps(x, *encoding)));
            }
        }),
        Texels::Floats(_) => lines(texels, 3 * level.width, level.height).for_each(|(line, words)| {
            for (words, color) in words.chunks_exact_mut(3).zip(colors[line]) {
                words.copy_from_slice(&color.as_vec3().to_array().map(f32::to_bits));
            }
        }),
    }
}

/// The texels of the finest level, row by row from the bottom.
fn finest(image: &Image) -> impl Fn(usize) -> DVec3 + Sync {
    let (width, height) = (image.width as usize, image.height as usize);
    let texel = linear(image);
    move |i| texel((height - 1 - i / width) * width + i % width)
}

/// A value by the encoding's curve, in steps of 8 bits.
fn steps(x: f64, encoding: Encoding) -> f64 {
    match encoding {
        Encoding::Srgb => linear_to_srgb(x) * 255.0,
        Encoding::Linear => x * 255.0,
    }
}

/// A colour in such steps as a word: see `unpacked_color` in `shaders/texel.wgsl`.
fn packed(steps: [f64; 3]) -> u32 {
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
