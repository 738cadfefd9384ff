//! Downsampling by two in linear light, for mip levels and for images that exceed
//! [`Assets::longest_side`](crate::Assets::longest_side).

use glam::DVec3;
use rayon::prelude::*;

use super::{Encoding, Image, Texels};
use wgray_image::color::{linear_to_srgb, srgb_to_linear};

/// A mip level in linear light.
pub struct Level {
    /// Number of columns.
    pub width: usize,
    /// Rows, top row first.
    pub rows: Vec<Vec<DVec3>>,
}

/// Returns the linear value of each byte.
pub fn decoded(encoding: Encoding) -> Vec<f64> {
    let decode = |value: u32| match encoding {
        Encoding::Srgb => srgb_to_linear(f64::from(value) / 255.0),
        Encoding::Linear => f64::from(value) / 255.0,
    };
    (0..256).map(decode).collect()
}

/// Returns a function from the index of a texel to its linear color.
pub fn linear(image: &Image) -> impl Fn(usize) -> DVec3 + Sync {
    let texel: Box<dyn Fn(usize) -> DVec3 + Sync> = match &image.texels {
        Texels::Bytes(encoding, bytes) => {
            let table = decoded(*encoding);
            Box::new(move |i| DVec3::from_array(bytes[i].map(|byte| table[usize::from(byte)])))
        }
        Texels::Floats(floats) => Box::new(|i| DVec3::from_array(floats[i].map(f64::from))),
    };
    texel
}

impl Level {
    /// Returns the next coarser level.
    pub fn half(&self) -> Level {
        half(self.width, self.rows.len(), |x, y| self.rows[y][x])
    }
}

/// Returns the image at half size, in linear light. `row` maps row indices to rows of `image`.
pub fn half_of(image: &Image, row: impl Fn(usize) -> usize + Sync) -> Level {
    let (width, height) = (image.width as usize, image.height as usize);
    match &image.texels {
        Texels::Bytes(encoding, bytes) => {
            let table = decoded(*encoding);
            let linear = |byte: u8| table[usize::from(byte)];
            half(width, height, |x, y| {
                DVec3::from_array(bytes[row(y) * width + x].map(linear))
            })
        }
        Texels::Floats(floats) => half(width, height, |x, y| {
            DVec3::from_array(floats[row(y) * width + x].map(f64::from))
        }),
    }
}

/// Returns the next coarser level: area-weighted means of the covered texels.
fn half(width: usize, height: usize, texel: impl Fn(usize, usize) -> DVec3 + Sync) -> Level {
    let (new_width, new_height) = ((width / 2).max(1), (height / 2).max(1));
    let row_indices = (0..new_height).into_par_iter().with_min_len(16);
    let rows = if width.is_multiple_of(2) && height.is_multiple_of(2) {
        // For even sizes, computes the sum of the general case, in the order of the general case, with constant
        // weights.
        let color = |i: usize, j: usize| {
            let texel = |x: usize, y: usize| texel(2 * i + x, 2 * j + y) * 0.25;
            DVec3::ZERO + texel(0, 0) + texel(1, 0) + texel(0, 1) + texel(1, 1)
        };
        row_indices
            .map(|j| (0..new_width).map(|i| color(i, j)).collect())
            .collect()
    } else {
        let (columns, rows) = (covered_texels(width, new_width), covered_texels(height, new_height));
        let color = |column: &[(usize, f64)], row: &[(usize, f64)]| {
            let mut sum = DVec3::ZERO;
            for (y, y_weight) in row {
                for (x, x_weight) in column {
                    sum += texel(*x, *y) * (x_weight * y_weight);
                }
            }
            sum
        };
        row_indices
            .map(|j| columns.iter().map(|column| color(column, &rows[j])).collect())
            .collect()
    };
    Level { width: new_width, rows }
}

/// For each of `new_count` texels, returns the indices and the weights of the old texels that the new texel covers.
/// `new_count` is half of `old_count`, rounded down, and at least 1.
fn covered_texels(old_count: usize, new_count: usize) -> Vec<Vec<(usize, f64)>> {
    let size = old_count as f64 / new_count as f64;
    let cover = |i: usize| {
        let (start, end) = (i as f64 * size, (i + 1) as f64 * size);
        let weight = move |j: usize| (end.min((j + 1) as f64) - start.max(j as f64)) / size;
        let covered = start as usize..old_count.min(end.ceil() as usize);
        covered
            .map(move |j| (j, weight(j)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect()
    };
    (0..new_count).map(cover).collect()
}

/// Returns the image with half the width and height, rounded down, but at least 1.
pub(super) fn halved(image: &Image) -> Image {
    let Level { width, rows } = half_of(image, |row| row);
    let height = rows.len();
    let texels = rows.into_iter().flatten();
    let texels = match &image.texels {
        Texels::Floats(_) => Texels::Floats(texels.map(|color| color.as_vec3().to_array()).collect()),
        Texels::Bytes(encoding, _) => {
            let byte = |x: f64| match encoding {
                Encoding::Srgb => (linear_to_srgb(x) * 255.0).round() as u8,
                Encoding::Linear => (x * 255.0).round() as u8,
            };
            let bytes = texels.map(|color| color.to_array().map(byte));
            Texels::Bytes(*encoding, bytes.collect())
        }
    };
    Image {
        width: width as u32,
        height: height as u32,
        texels,
    }
}
