//! The film: what a render accumulates, in linear f32.

use bytemuck::Zeroable;
use glam::Vec4;

/// A rectangle of pixels of a picture, half-open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x0: u32,
    /// First row, from the top.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl Region {
    /// The whole of a picture.
    pub fn whole(width: u32, height: u32) -> Region {
        Region {
            x0: 0,
            y0: 0,
            x1: width,
            y1: height,
        }
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width()) * u64::from(self.height())
    }
}

/// The sums of a rectangle of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Which pixels of the picture these are.
    pub region: Region,
    /// Row by row from the top: in rgb the sum of the samples' radiances, in a the sum of their weights.
    pub sums: Vec<Vec4>,
    /// Under adaptive sampling the moments of the same pixels, else nothing: in rgb the sum of the samples' squared
    /// deviations from their mean, in a the number of samples.
    pub moments: Vec<Vec4>,
}

impl Film {
    /// A film without any sample, and without moments.
    pub fn new(region: Region) -> Film {
        Film {
            region,
            sums: vec![Vec4::zeroed(); region.pixels() as usize],
            moments: Vec::new(),
        }
    }

    /// A film without any sample, with moments.
    pub fn adaptive(region: Region) -> Film {
        Film {
            moments: vec![Vec4::zeroed(); region.pixels() as usize],
            ..Film::new(region)
        }
    }

    /// How many samples a pixel has, under adaptive sampling.
    pub fn sample_count(&self, pixel: usize) -> u32 {
        self.moments[pixel].w as u32
    }

    /// How many samples the pixels have, row by row from the top, under adaptive sampling.
    pub fn sample_counts(&self) -> impl Iterator<Item = u32> {
        (0..self.moments.len()).map(|pixel| self.sample_count(pixel))
    }

    /// The variance of a pixel's mean in red, green and blue, under adaptive sampling, estimated as for independent samples:
    /// an upper bound for patterns that are more even. It is what sampling has stopped by, and so the spread of the
    /// radiances at the pixel's corners is part of it.
    pub fn variance(&self, pixel: usize) -> [f32; 3] {
        let (sum, moments) = (self.sums[pixel], self.moments[pixel]);
        let scale = moments.w / ((moments.w - 1.0) * sum.w * sum.w);
        [moments.x, moments.y, moments.z].map(|deviations| deviations * scale)
    }

    /// The means of all pixels: linear RGB, row by row from the top.
    pub fn means(&self) -> impl Iterator<Item = [f32; 3]> {
        self.sums.iter().copied().map(mean)
    }
}

/// The mean of a pixel's samples: linear RGB, black if there are none.
pub fn mean(sum: Vec4) -> [f32; 3] {
    if sum.w == 0.0 {
        [0.0; 3]
    } else {
        [sum.x / sum.w, sum.y / sum.w, sum.z / sum.w]
    }
}
