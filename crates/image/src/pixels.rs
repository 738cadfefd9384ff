//! Images in memory.

/// An image with linear RGB pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Linear RGB in row-major order, top row first.
    pub colors: Vec<[f32; 3]>,
}
