//! Visualization of a comparison: both images and the error map as three panels, side by side, or stacked if the images
//! are wide.

use super::color_map;
use super::colors::Colors;
use super::flip::Map;
use super::picture::{Picture, Plane};
use super::plain::{COLOR, Layer};

/// Maximum side of a displayed image. Larger images are subsampled by an integer step.
const MAX_SIDE: usize = 4096;
/// Smaller images are magnified by an integer factor up to this size.
const MAX_MAGNIFIED_SIDE: usize = 256;
/// Minimum width and height of a displayed image.
const MIN_SIDE: usize = 16;
/// Maximum number of cells along the longer side. Cells with a differing pixel are outlined.
const CELLS: usize = 64;
const GAP: usize = 8;
/// Side of a glyph dot in pixels.
const DOT: usize = 2;
/// Height of a label with its margin.
const LABEL_HEIGHT: usize = 7 * DOT + 6;
/// Height of the color scale below the map.
const SCALE_HEIGHT: usize = 10;

const BACKGROUND: [u8; 3] = [40, 40, 40];
const TEXT_COLOR: [u8; 3] = [230, 230, 230];
const OUTLINE_COLOR: [u8; 3] = [0, 220, 220];

/// Three panels: images A and B, and their error map. Rows are computed on demand.
pub struct ErrorImage<'a> {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    source: Source<'a>,
    /// Width of the compared images in pixels.
    columns: usize,
    error: Map,
    /// For each cell in row-major order, true if the cell contains a differing pixel.
    marked: Vec<bool>,
    cells_per_row: usize,
    /// Side of a cell in squares of the map.
    cell_side: usize,
    /// Integer magnification in x and y.
    zoom: (usize, usize),
    /// Width and height of a panel.
    panel: (usize, usize),
    is_stacked: bool,
    /// Label of the error map, and label at the upper end of its color scale.
    names: [&'static str; 2],
}

enum Source<'a> {
    Colors(Colors<'a>),
    /// Up to three channels, and their value ranges.
    Numbers(Vec<([&'a Plane; 2], f64, f64)>),
}

/// Returns the factor by which an error image subsamples images of this size; 1 if neither side exceeds 4,096
/// pixels.
pub fn step(picture: &Picture) -> usize {
    (picture.width.max(picture.height) as usize).div_ceil(MAX_SIDE)
}

/// Lays out a layer of two images. `error` is the map of [`flip`](super::flip()) with the step of [`step`]. Without an
/// `error` map, the third panel shows relative differences.
pub fn show<'a>(a: &'a Picture, b: &'a Picture, layer: &Layer<'a>, error: Option<Map>) -> ErrorImage<'a> {
    let step = step(b);
    let (differing, differences) = layer.maps(b, step);
    let names = match error {
        Some(_) => ["FLIP", "1"],
        None => ["DIFF", "MAX"],
    };
    let error = error.unwrap_or(differences);
    let (columns, rows) = (error.width, error.values.len() / error.width.max(1));
    let longest = columns.max(rows);
    let cell_side = longest.div_ceil(CELLS);
    let cells_per_row = columns.div_ceil(cell_side);
    let mut marked = vec![false; cells_per_row * rows.div_ceil(cell_side)];
    for (i, value) in differing.values.iter().enumerate() {
        if let (true, Some(marked)) = (
            *value > 0,
            marked.get_mut(i / columns / cell_side * cells_per_row + i % columns / cell_side),
        ) {
            *marked = true;
        }
    }
    let common_zoom = MAX_MAGNIFIED_SIDE / longest;
    let zoom = |side: usize| common_zoom.max(MIN_SIDE.div_ceil(side)).max(1);
    let zoom = (zoom(columns), zoom(rows));
    let panel = (columns * zoom.0, rows * zoom.1);
    let is_stacked = panel.0 > 2 * panel.1;
    // The longest label has four letters; each letter is six dots wide.
    let (panel_width, panel_height) = (panel.0.max(4 * 6 * DOT), LABEL_HEIGHT + panel.1);
    let (width, height) = match is_stacked {
        true => (panel_width, 3 * (panel_height + GAP)),
        false => (3 * (panel_width + GAP) - GAP, panel_height + GAP),
    };
    let source = match Colors::of(a, b) {
        Some(colors) if layer.name == COLOR => Source::Colors(colors),
        _ => Source::Numbers(layer.ranges(b)),
    };
    ErrorImage {
        width: width + 2 * GAP,
        height: height + SCALE_HEIGHT + LABEL_HEIGHT + GAP,
        source,
        columns: b.width as usize,
        error,
        marked,
        cells_per_row,
        cell_side,
        zoom,
        panel,
        is_stacked,
        names,
    }
}

impl ErrorImage<'_> {
    /// Returns a row of pixels as RGB bytes.
    pub fn row(&self, y: usize) -> Vec<u8> {
        let mut row = vec![BACKGROUND; self.width];
        let panel_width = self.panel.0.max(4 * 6 * DOT) + GAP;
        let panel_height = LABEL_HEIGHT + self.panel.1 + GAP;
        for panel in 0..3 {
            let (left, top) = match self.is_stacked {
                true => (GAP, GAP + panel * panel_height),
                false => (GAP + panel * panel_width, GAP),
            };
            let Some(y) = y.checked_sub(top) else { continue };
            let Some(panel_row) = row.get_mut(left..) else { continue };
            if y < LABEL_HEIGHT {
                let name = ["A", "B", self.names[0]][panel];
                draw_text(panel_row, name, y);
            } else if y < LABEL_HEIGHT + self.panel.1 {
                let pixels = match panel {
                    2 => self.map_row(y - LABEL_HEIGHT),
                    _ => self.image_row(panel, y - LABEL_HEIGHT),
                };
                for (target, pixel) in panel_row.iter_mut().zip(pixels) {
                    *target = pixel;
                }
            } else if panel == 2 {
                self.draw_scale(panel_row, y - LABEL_HEIGHT - self.panel.1);
            }
        }
        row.into_flattened()
    }

    /// Draws row `y` of the color scale and its labels into a row of pixels.
    fn draw_scale(&self, pixels: &mut [[u8; 3]], y: usize) {
        let width = self.panel.0;
        if (2..SCALE_HEIGHT).contains(&y) {
            for (x, pixel) in pixels.iter_mut().take(width).enumerate() {
                *pixel = color_map::color((x * 255 / (width - 1).max(1)).min(255) as u8);
            }
        } else if let Some(y) = y.checked_sub(SCALE_HEIGHT + 2) {
            draw_text(pixels, "0", y);
            let end = self.names[1];
            if let Some(label_pixels) = pixels.get_mut(width.saturating_sub(end.len() * 6 * DOT - DOT).max(6 * DOT)..) {
                draw_text(label_pixels, end, y);
            }
        }
    }

    /// Returns row `y` of the error map.
    fn map_row(&self, y: usize) -> Vec<[u8; 3]> {
        let square_y = y / self.zoom.1;
        let width = self.error.width;
        let row = self
            .error
            .values
            .get(square_y * width..(square_y + 1) * width)
            .unwrap_or_default();
        let pixel = |x: usize| match self.is_outline(x, y) {
            true => OUTLINE_COLOR,
            false => color_map::color(row.get(x / self.zoom.0).copied().unwrap_or(0)),
        };
        (0..self.panel.0).map(pixel).collect()
    }

    /// Returns true for pixels of the outlines around the marked cells.
    fn is_outline(&self, x: usize, y: usize) -> bool {
        let (cell_width, cell_height) = (self.cell_side * self.zoom.0, self.cell_side * self.zoom.1);
        let thickness = (cell_width.min(cell_height) / 16).max(1);
        let is_marked = |x: usize, y: usize| {
            x < self.panel.0
                && self
                    .marked
                    .get(y / cell_height * self.cells_per_row + x / cell_width)
                    .copied()
                    .unwrap_or(false)
        };
        let (left, top) = (x.saturating_sub(thickness), y.saturating_sub(thickness));
        !is_marked(x, y)
            && [left, x + thickness]
                .iter()
                .any(|x| [top, y + thickness].iter().any(|y| is_marked(*x, *y)))
    }

    /// Returns row `y` of the first (0) or the second image (1).
    fn image_row(&self, image: usize, y: usize) -> Vec<[u8; 3]> {
        let step = self.error.step;
        let y = y / self.zoom.1 * step;
        let byte = |value: f64| (value * 255.0 + 0.5) as u8; // saturates
        let pixels: Vec<[u8; 3]> = match &self.source {
            Source::Colors(colors) => {
                let (a, b) = colors.display_values(y, 0..colors.width);
                let [red, green, blue] = if image == 0 { a } else { b };
                let pixels = red.iter().zip(&green).zip(&blue).step_by(step);
                pixels.map(|((r, g), b)| [*r, *g, *b].map(byte)).collect()
            }
            Source::Numbers(channels) => {
                let width = self.error.width;
                let value = |x: usize, channel: usize| {
                    let channel = channels.get(channel).or(channels.first());
                    let Some((planes, low, high)) = channel else { return 0 };
                    let pixel = y * self.columns + x * step;
                    byte((planes[image].value(pixel) - low) / (high - low).max(f64::MIN_POSITIVE))
                };
                (0..width).map(|x| [0, 1, 2].map(|channel| value(x, channel))).collect()
            }
        };
        pixels
            .into_iter()
            .flat_map(|pixel| std::iter::repeat_n(pixel, self.zoom.0))
            .collect()
    }
}

/// Glyphs of 5 x 7 dots, one byte per row.
const GLYPHS: [(char, [u8; 7]); 11] = [
    ('A', [0x0e, 0x11, 0x11, 0x1f, 0x11, 0x11, 0x11]),
    ('B', [0x1e, 0x11, 0x11, 0x1e, 0x11, 0x11, 0x1e]),
    ('D', [0x1e, 0x11, 0x11, 0x11, 0x11, 0x11, 0x1e]),
    ('F', [0x1f, 0x10, 0x10, 0x1e, 0x10, 0x10, 0x10]),
    ('I', [0x0e, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0e]),
    ('L', [0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x1f]),
    ('M', [0x11, 0x1b, 0x15, 0x15, 0x11, 0x11, 0x11]),
    ('P', [0x1e, 0x11, 0x11, 0x1e, 0x10, 0x10, 0x10]),
    ('X', [0x11, 0x11, 0x0a, 0x04, 0x0a, 0x11, 0x11]),
    ('0', [0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e]),
    ('1', [0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e]),
];

/// Draws row `y` of a label into a row of pixels.
fn draw_text(pixels: &mut [[u8; 3]], text: &str, y: usize) {
    for (i, letter) in text.chars().enumerate() {
        let glyph = GLYPHS.iter().find(|(name, _)| *name == letter);
        let Some(dots) = glyph.and_then(|(_, rows)| rows.get(y / DOT)) else {
            continue;
        };
        for x in 0..5 * DOT {
            if let (true, Some(pixel)) = (dots >> (4 - x / DOT) & 1 == 1, pixels.get_mut(i * 6 * DOT + x)) {
                *pixel = TEXT_COLOR;
            }
        }
    }
}
