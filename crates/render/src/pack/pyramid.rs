//! Mip pyramids: Williams, "Pyramidal Parametrics", SIGGRAPH 1983.

use glam::DVec3;
use rayon::prelude::*;

use wgray_image::color::linear_to_srgb;
use wgray_scene::downsample::{Level, decoded, half_of};
use wgray_scene::texture::words;
use wgray_scene::{Encoding, Image, Texels};

/// Appends the table of an image's levels, then the levels, finest first, in row-major order, bottom row first. Returns
/// the offset of the table.
pub fn pyramid(image: &Image, levels: u32, texels: &mut Vec<u32>) -> u32 {
    let table = texels.len();
    let is_float = matches!(image.texels, Texels::Floats(_));
    let word_count = words(image.width, image.height, levels, is_float) as usize;
    match word_count > 1 << 20 {
        true => texels.reserve_exact(word_count), // large images are few, so spare capacity would be wasted
        false => texels.reserve(word_count),
    }
    texels.resize(table + levels as usize, 0);
    let height = image.height as usize;
    // The image is not decoded at once, because linear colors take six times the memory of the texels.
    let mut level = None;
    for i in 0..levels as usize {
        texels[table + i] = texels.len() as u32;
        match &level {
            None => write_finest(image, texels),
            Some(level) => write_level(image, level, texels),
        }
        if i + 1 < levels as usize {
            level = Some(match &level {
                None => half_of(image, |row| height - 1 - row), // from the bottom
                Some(level) => level.half(),
            });
        }
    }
    table as u32
}

/// Appends rows of `words` words in parallel. Writes to uninitialized memory, because a single thread would zero the
/// memory.
fn append<I: Iterator<Item = u32>>(
    texels: &mut Vec<u32>,
    (words, rows): (usize, usize),
    row: impl Fn(usize) -> I + Sync,
) {
    let (start, count) = (texels.len(), words * rows);
    texels.reserve(count);
    let slots = texels.spare_capacity_mut()[..count].par_chunks_mut(words);
    slots.with_min_len(16).enumerate().for_each(|(i, slots)| {
        let mut values = row(i);
        for slot in slots {
            slot.write(values.next().expect("a row has a value for each word"));
        }
    });
    // SAFETY: the loop wrote every slot up to the new length, or panicked.
    unsafe { texels.set_len(start + count) };
}

fn write_finest(image: &Image, texels: &mut Vec<u32>) {
    let (width, height) = (image.width as usize, image.height as usize);
    let row = |i: usize| (height - 1 - i) * width..(height - i) * width; // from the bottom
    match &image.texels {
        Texels::Bytes(encoding, bytes) => {
            let table = PackedBytes::new(*encoding);
            append(texels, (width, height), |i| {
                bytes[row(i)].iter().map(|texel| table.packed(*texel))
            });
        }
        Texels::Floats(floats) => append(texels, (3 * width, height), |i| {
            floats[row(i)].as_flattened().iter().map(|x| x.to_bits())
        }),
    }
}

fn write_level(image: &Image, level: &Level, texels: &mut Vec<u32>) {
    let (width, height) = (level.width, level.rows.len());
    let exact = |color: DVec3, encoding| packed(color.to_array().map(|x| steps(x, encoding)));
    match &image.texels {
        Texels::Bytes(Encoding::Srgb, _) => append(texels, (width, height), |i| {
            let word = |color: &DVec3| approximately_packed(*color).unwrap_or_else(|| exact(*color, Encoding::Srgb));
            level.rows[i].iter().map(word)
        }),
        Texels::Bytes(Encoding::Linear, _) => append(texels, (width, height), |i| {
            level.rows[i].iter().map(|color| exact(*color, Encoding::Linear))
        }),
        Texels::Floats(_) => append(texels, (3 * width, height), |i| {
            level.rows[i]
                .iter()
                .flat_map(|color| color.to_array().map(|x| (x as f32).to_bits()))
        }),
    }
}

/// Encodes a linear value in units of 8-bit steps.
fn steps(x: f64, encoding: Encoding) -> f64 {
    match encoding {
        Encoding::Srgb => linear_to_srgb(x) * 255.0,
        Encoding::Linear => x * 255.0,
    }
}

/// Packs a color, in units of 8-bit steps, into a word: see `unpacked_color` in `shaders/texel.wgsl`.
fn packed(steps: [f64; 3]) -> u32 {
    let exponent = exponent(steps.into_iter().fold(0.0, f64::max));
    join_bits(steps.map(|x| mantissa(x, exponent)), exponent)
}

/// Returns the exponent for a color's largest component, with a mantissa of nine binary digits, or fewer if the
/// smallest unit is too large.
fn exponent(largest: f64) -> u32 {
    let exponent = ((largest as f32).to_bits() >> 23).clamp(103, 134) - 103;
    exponent + u32::from(largest * units(exponent) >= 511.5) // rounds to 512
}

fn mantissa(x: f64, exponent: u32) -> u32 {
    // Rounds half up, without calling the C library.
    let x = x * units(exponent);
    let integer = x as u32;
    integer.saturating_add(u32::from(x - f64::from(integer) >= 0.5)) // tables include exponents too small for x
}

fn join_bits([red, green, blue]: [u32; 3], exponent: u32) -> u32 {
    red | green << 9 | blue << 18 | exponent << 27
}

/// Returns [`packed`] of an sRGB-encoded color, computed in 32-bit floats in a third of the time; `None` if the error
/// could change a bit.
fn approximately_packed(color: DVec3) -> Option<u32> {
    /// Bound of the relative error of the curve, about a hundred units in the last place.
    const ERROR: f64 = 1e-5;
    /// A mantissa (at most 512) within this distance of an integer rounds to that integer despite the error of the
    /// approximation.
    const MAX_DISTANCE: f64 = 0.5 - 2.0 * 512.0 * ERROR;
    let steps = color.as_vec3().to_array().map(|x| {
        let curve = if x <= 0.003_130_8 {
            12.92 * x
        } else {
            1.055 * x.powf(1.0 / 2.4) - 0.055
        };
        f64::from(curve) * 255.0
    });
    let largest = steps.into_iter().fold(0.0, f64::max);
    let exponent = self::exponent(largest * (1.0 - ERROR));
    if exponent != self::exponent(largest * (1.0 + ERROR)) {
        return None;
    }
    let mantissas = steps.map(|x| x * units(exponent));
    // Faster than `round`, and equal to it if `is_certain`.
    let rounded = mantissas.map(|x| (x + 0.5) as u32);
    let is_certain = (mantissas.iter().zip(rounded)).all(|(x, rounded)| (x - f64::from(rounded)).abs() < MAX_DISTANCE);
    is_certain.then(|| join_bits(rounded, exponent))
}

/// Tables of [`packed`] for bytes: most texels belong to the finest levels.
struct PackedBytes {
    /// Exponent for each value of the largest byte.
    exponents: [u32; 256],
    /// For each exponent, the mantissa of every byte value.
    mantissas: Vec<[u32; 256]>,
}

impl PackedBytes {
    fn new(encoding: Encoding) -> PackedBytes {
        let table: Vec<f64> = decoded(encoding).into_iter().map(|x| steps(x, encoding)).collect();
        let exponents = std::array::from_fn(|byte| exponent(table[byte]));
        let mantissas =
            (0..=exponents[255]).map(|exponent| std::array::from_fn(|byte| mantissa(table[byte], exponent)));
        PackedBytes {
            exponents,
            mantissas: mantissas.collect(),
        }
    }

    fn packed(&self, color: [u8; 3]) -> u32 {
        let [red, green, blue] = color.map(usize::from);
        let exponent = self.exponents[red.max(green).max(blue)];
        let mantissas = &self.mantissas[exponent as usize];
        join_bits([mantissas[red], mantissas[green], mantissas[blue]], exponent)
    }
}

/// Returns the units of an exponent per 8-bit step, a power of two.
fn units(exponent: u32) -> f64 {
    f64::from(f32::from_bits((159 - exponent) << 23))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An additive recurrence with the golden ratio, 0 to 1.
    fn additive(start: f64) -> impl Iterator<Item = f64> {
        (0..).map(move |i| (start + 0.618_033_988_749_895 * f64::from(i)).fract())
    }

    #[test]
    fn packing_by_tables_and_in_32_bits_matches_64_bits() {
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            let (table, bytes) = (decoded(encoding), PackedBytes::new(encoding));
            for i in 0..1_u32 << 16 {
                let color = [i as u8, (i >> 8) as u8, ((i * 40_503) >> 8) as u8];
                let exact = packed(color.map(|byte| steps(table[usize::from(byte)], encoding)));
                assert_eq!(bytes.packed(color), exact, "{encoding:?} {color:?}");
            }
        }
        let mut approximate_count = 0;
        let colors = additive(0.1).zip(additive(0.5)).zip(additive(0.9)).take(200_000);
        for (i, ((r, g), b)) in colors.enumerate() {
            // From dark to bright, with black in some components.
            let scale = 0.5_f64.powi(i as i32 % 30) * if i % 7 == 0 { 0.0 } else { 1.0 };
            let color = DVec3::new(r * 0.5_f64.powi(i as i32 / 30 % 30), g * scale, b.powi(4));
            let exact = packed(color.to_array().map(|x| steps(x, Encoding::Srgb)));
            let approximate = approximately_packed(color);
            assert_eq!(approximate.unwrap_or(exact), exact, "{color}");
            approximate_count += usize::from(approximate.is_some());
        }
        assert!(approximate_count > 150_000, "{approximate_count} of 200000");
        assert_eq!(approximately_packed(DVec3::ZERO), Some(packed([0.0; 3])));
        assert_eq!(approximately_packed(DVec3::ONE), Some(packed([255.0; 3])));
    }

    #[test]
    fn mantissas_above_511_have_the_next_exponent() {
        // The largest mantissa of an exponent, and the smallest of the next.
        for steps in [511.4 / units(20), 511.6 / units(20)] {
            assert_eq!(packed([steps; 3]) >> 27, exponent(steps), "{steps}");
        }
        assert_ne!(exponent(511.4 / units(20)), exponent(511.6 / units(20)));
    }
}
