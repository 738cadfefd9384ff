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
}

impl Film {
    /// A film without any sample.
    pub fn new(region: Region) -> Film {
        Film {
            region,
            sums: vec![Vec4::zeroed(); region.pixels() as usize],
        }
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
