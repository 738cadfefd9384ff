//! Squares of pixels around a pixel, clipped to the image.

use std::ops::Range;

use rayon::prelude::*;

/// Returns the pixels of a square of 2 * `radius` + 1 pixels around pixel `i`, clipped to the image.
pub fn window(i: usize, width: usize, count: usize, radius: usize) -> impl Iterator<Item = usize> {
    let columns = around(i % width, width, radius);
    around(i / width, count / width, radius).flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// Returns the numbers from `i` - `radius` to `i` + `radius`, clipped to a size.
pub fn around(i: usize, size: usize, radius: usize) -> Range<usize> {
    i.saturating_sub(radius)..(i + radius + 1).min(size)
}

/// Returns the means of squares of 2 * `radius` + 1 pixels, clipped to the image.
pub fn box_means(values: &[f32], width: usize, radius: usize) -> Vec<f32> {
    let height = values.len() / width.max(1);
    let row_sum = |i: usize| {
        let row = i - i % width;
        around(i % width, width, radius).map(|x| values[row + x]).sum()
    };
    let row_sums: Vec<f32> = (0..values.len()).into_par_iter().map(row_sum).collect();
    let mean = |i: usize| {
        let (rows, columns) = (
            around(i / width, height, radius),
            around(i % width, width, radius).len(),
        );
        let count = (rows.len() * columns) as f32;
        rows.map(|y| row_sums[y * width + i % width]).sum::<f32>() / count
    };
    (0..values.len()).into_par_iter().map(mean).collect()
}
