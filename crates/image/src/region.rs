//! Rectangles of pixels.

use std::fmt;

/// A half-open rectangle of pixels of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x0: u32,
    /// First row, counted from the top.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl Region {
    /// Returns the region that covers an image of this size.
    pub fn whole(width: u32, height: u32) -> Region {
        Region {
            x0: 0,
            y0: 0,
            x1: width,
            y1: height,
        }
    }

    /// Returns the number of columns; 0 if `x1` is less than `x0`.
    pub fn width(&self) -> u32 {
        self.x1.saturating_sub(self.x0)
    }

    /// Returns the number of rows; 0 if `y1` is less than `y0`.
    pub fn height(&self) -> u32 {
        self.y1.saturating_sub(self.y0)
    }

    /// Returns true if the region has no pixels.
    pub fn is_empty(&self) -> bool {
        self.pixels() == 0
    }

    /// Returns the number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width()) * u64::from(self.height())
    }

    /// Returns the region enlarged by `pixels` on each side. The added pixels may lie outside of the image.
    pub fn with_border(&self, pixels: u32) -> Region {
        Region {
            x0: self.x0.saturating_sub(pixels),
            y0: self.y0.saturating_sub(pixels),
            x1: self.x1.saturating_add(pixels),
            y1: self.y1.saturating_add(pixels),
        }
    }

    /// Returns the intersection with another region.
    pub fn within(&self, other: Region) -> Region {
        let x = |x: u32| x.max(other.x0).min(other.x1);
        let y = |y: u32| y.max(other.y0).min(other.y1);
        Region {
            x0: x(self.x0),
            y0: y(self.y0),
            x1: x(self.x1),
            y1: y(self.y1),
        }
    }
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x0, self.y0, self.x1, self.y1)
    }
}
