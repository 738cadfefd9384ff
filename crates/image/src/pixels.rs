//! Images in memory.

/// An image with linear RGB pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear RGB in row-major order, top row first.
    pub colors: Vec<[f32; 3]>,
}
