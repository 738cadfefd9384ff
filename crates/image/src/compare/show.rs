//! Visualization of a comparison: both images and the error map as three panels, side by side, or stacked if the images
//! are wide.

use super::color_map;
use super::colors::Colors;
use super::flip::Map;
use super::picture::{Picture, Plane};
use super::plain::{COLOR, Layer};

/// Maximum side of a displayed image. Larger images are subsampled by an integer step.
const LONGEST: usize = 4096;
/// Smaller images are magnified by an integer factor up to this size.
const SHORTEST: usize = 256;
/// Minimum width and height of a displayed image.
const NARROWEST: usize = 16;
/// Cells along the longer side. Cells with a differing pixel are outlined.
const CELLS: usize = 64;
const GAP: usize = 8;
/// Side of a glyph dot in pixels, and height of a label including its margin.
const DOT: usize = 2;
const LABEL: usize = 7 * DOT + 6;
/// Height of the color scale below the map.
const SCALE: usize = 10;

const GROUND: [u8; 3] = [40, 40, 40];
const INK: [u8; 3] = [230, 230, 230];
const LINE: [u8; 3] = [0, 220, 220];

/// A visualization that is computed row by row.
pub struct ErrorImage<'a> {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    source: Source<'a>,
    columns: usize,
    error: Map,
    /// For each cell in row-major order, whether it contains a differing pixel; cells per row; side of a cell in
    /// squares of the map.
    marked: Vec<bool>,
    cells: usize,
    cell: usize,
    /// Integer magnification in x and y.
    zoom: (usize, usize),
    panel: (usize, usize),
    is_stacked: bool,
    names: [&'static str; 2],
}

enum Source<'a> {
    Colors(Colors<'a>),
    /// Up to three channels, with their value ranges.
    Numbers(Vec<([&'a Plane; 2], f64, f64)>),
}

/// Returns the subsampling step for images of this size.
pub fn step(picture: &Picture) -> usize {
    (picture.width.max(picture.height) as usize).div_ceil(LONGEST)
}

/// Lays out a layer of two images. `error` is the map of [`flip`](super::flip()) with the step of [`step`]; without it,
/// the panel shows relative differences.
pub fn show<'a>(a: &'a Picture, b: &'a Picture, layer: &Layer<'a>, error: Option<Map>) -> ErrorImage<'a> {
    let step = step(b);
    let (differing, apart) = layer.maps(b, step);
    let names = match error {
        Some(_) => ["FLIP", "1"],
        None => ["DIFF", "MAX"],
    };
    let error = error.unwrap_or(apart);
    let (columns, rows) = (error.width, error.values.len() / error.width.max(1));
    let longest = columns.max(rows);
    let cell = longest.div_ceil(CELLS);
    let cells = columns.div_ceil(cell);
    let mut marked = vec![false; cells * rows.div_ceil(cell)];
    for (i, value) in differing.values.iter().enumerate() {
        if let (true, Some(marked)) = (
            *value > 0,
            marked.get_mut(i / columns / cell * cells + i % columns / cell),
        ) {
            *marked = true;
        }
    }
    let both = SHORTEST / longest;
    let zoom = |side: usize| both.max(NARROWEST.div_ceil(side)).max(1);
    let zoom = (zoom(columns), zoom(rows));
    let panel = (columns * zoom.0, rows * zoom.1);
    let is_stacked = panel.0 > 2 * panel.1;
    // The longest label has four letters; each is six dots wide.
    let (across, down) = (panel.0.max(4 * 6 * DOT), LABEL + panel.1);
    let (width, height) = match is_stacked {
        true => (across, 3 * (down + GAP)),
        false => (3 * (across + GAP) - GAP, down + GAP),
    };
    let source = match Colors::of(a, b) {
        Some(colors) if layer.name == COLOR => Source::Colors(colors),
        _ => Source::Numbers(layer.ranges(b)),
    };
    ErrorImage {
        width: width + 2 * GAP,
        height: height + SCALE + LABEL + GAP,
        source,
        columns: b.width as usize,
        error,
        marked,
        cells,
        cell,
        zoom,
        panel,
        is_stacked,
        names,
    }
}

impl ErrorImage<'_> {
    /// Returns a row of pixels as RGB bytes.
    pub fn row(&self, y: usize) -> Vec<u8> {
        let mut row = vec![GROUND; self.width];
        let across = self.panel.0.max(4 * 6 * DOT) + GAP;
        let down = LABEL + self.panel.1 + GAP;
        for panel in 0..3 {
            let (left, top) = match self.is_stacked {
                true => (GAP, GAP + panel * down),
                false => (GAP + panel * across, GAP),
            };
            let Some(y) = y.checked_sub(top) else { continue };
            let Some(to) = row.get_mut(left..) else { continue };
            if y < LABEL {
                let name = ["A", "B", self.names[0]][panel];
                letters(to, name, y);
            } else if y < LABEL + self.panel.1 {
                let pixels = match panel {
                    2 => self.map(y - LABEL),
                    _ => self.picture(panel, y - LABEL),
                };
                for (to, pixel) in to.iter_mut().zip(pixels) {
                    *to = pixel;
                }
            } else if panel == 2 {
                self.scale(to, y - LABEL - self.panel.1);
            }
        }
        row.into_flattened()
    }

    fn scale(&self, to: &mut [[u8; 3]], y: usize) {
        let width = self.panel.0;
        if (2..SCALE).contains(&y) {
            for (x, to) in to.iter_mut().take(width).enumerate() {
                *to = color_map::color((x * 255 / (width - 1).max(1)).min(255) as u8);
            }
        } else if let Some(y) = y.checked_sub(SCALE + 2) {
            letters(to, "0", y);
            let end = self.names[1];
            if let Some(to) = to.get_mut(width.saturating_sub(end.len() * 6 * DOT - DOT).max(6 * DOT)..) {
                letters(to, end, y);
            }
        }
    }

    fn map(&self, y: usize) -> Vec<[u8; 3]> {
        let square_y = y / self.zoom.1;
        let width = self.error.width;
        let row = self
            .error
            .values
            .get(square_y * width..(square_y + 1) * width)
            .unwrap_or_default();
        let pixel = |x: usize| match self.is_line(x, y) {
            true => LINE,
            false => color_map::color(row.get(x / self.zoom.0).copied().unwrap_or(0)),
        };
        (0..self.panel.0).map(pixel).collect()
    }

    /// Returns true for pixels of the outlines, which surround the marked cells.
    fn is_line(&self, x: usize, y: usize) -> bool {
        let (wide, high) = (self.cell * self.zoom.0, self.cell * self.zoom.1);
        let thick = (wide.min(high) / 16).max(1);
        let is_marked = |x: usize, y: usize| {
            x < self.panel.0
                && self
                    .marked
                    .get(y / high * self.cells + x / wide)
                    .copied()
                    .unwrap_or(false)
        };
        let (left, top) = (x.saturating_sub(thick), y.saturating_sub(thick));
        !is_marked(x, y)
            && [left, x + thick]
                .iter()
                .any(|x| [top, y + thick].iter().any(|y| is_marked(*x, *y)))
    }

    fn picture(&self, which: usize, y: usize) -> Vec<[u8; 3]> {
        let step = self.error.step;
        let y = y / self.zoom.1 * step;
        let byte = |value: f64| (value * 255.0 + 0.5) as u8; // saturates
        let shown: Vec<[u8; 3]> = match &self.source {
            Source::Colors(colors) => {
                let (a, b) = colors.shown(y, 0..colors.width);
                let [red, green, blue] = if which == 0 { a } else { b };
                let pixels = red.iter().zip(&green).zip(&blue).step_by(step);
                pixels.map(|((r, g), b)| [*r, *g, *b].map(byte)).collect()
            }
            Source::Numbers(channels) => {
                let width = self.error.width;
                let value = |x: usize, channel: usize| {
                    let found = channels.get(channel).or(channels.first());
                    let Some((planes, low, high)) = found else { return 0 };
                    let pixel = y * self.columns + x * step;
                    byte((planes[which].value(pixel) - low) / (high - low).max(f64::MIN_POSITIVE))
                };
                (0..width).map(|x| [0, 1, 2].map(|channel| value(x, channel))).collect()
            }
        };
        shown
            .into_iter()
            .flat_map(|pixel| std::iter::repeat_n(pixel, self.zoom.0))
            .collect()
    }
}

/// Glyphs of 5 x 7 dots, one byte per row.
const LETTERS: [(char, [u8; 7]); 11] = [
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

fn letters(to: &mut [[u8; 3]], word: &str, y: usize) {
    for (i, letter) in word.chars().enumerate() {
        let known = LETTERS.iter().find(|(known, _)| *known == letter);
        let Some(dots) = known.and_then(|(_, rows)| rows.get(y / DOT)) else {
            continue;
        };
        for x in 0..5 * DOT {
            if let (true, Some(to)) = (dots >> (4 - x / DOT) & 1 == 1, to.get_mut(i * 6 * DOT + x)) {
                *to = INK;
            }
        }
    }
}
