//! Pictures as files: 8-bit PNG as a screen shows it, OpenEXR with the linear values. Rows are written as they come, so
//! that a picture need not fit memory, and under another name until all are there, so that no half file is ever seen.

mod aov;
mod difference;
mod exr;
mod file;
mod output;
mod png;

use std::path::{Path, PathBuf};

use crate::error::RenderError;
use crate::film::{Film, Region};
use crate::pack::FirstHit;

pub use aov::{Aov, AovSource};
pub use difference::{Difference, difference};
pub use exr::read_exr;
pub use file::Pending;
pub use output::Output;
pub use png::{encode, in_memory, straight};

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// RGB of 8 bits a channel, clamped to [0, 1] and raised to the power 1/2.2, and alpha where the picture has it, which is
    /// linear. Every [`Aov`] is a file of its own.
    Png,
    /// RGB of 32-bit floats, linear, and alpha where the picture has it; [`Aov`]s are further layers.
    Exr,
}

impl Format {
    /// The format that a file's name asks for by its end, `.png` or `.exr`.
    pub fn of(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?;
        [("png", Format::Png), ("exr", Format::Exr)]
            .into_iter()
            .find_map(|(known, format)| extension.eq_ignore_ascii_case(known).then_some(format))
    }
}

/// What a picture file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Width and height of the whole picture in pixels.
    pub picture: (u32, u32),
    /// The pixels that are written.
    pub region: Region,
    /// What is written besides the radiance.
    pub aovs: Vec<Aov>,
    /// Whether the picture has alpha, by which its colours are weighted. The film has layers then.
    pub alpha: bool,
    /// The distance that is half bright in a PNG of the depth.
    pub middle_depth: f32,
    /// The number of samples that is bright in a PNG of their counts.
    pub most_samples: u32,
}

/// Some whole rows of a region, in full width.
#[derive(Clone, Copy, Debug)]
pub struct Band<'a> {
    /// The radiance.
    pub film: &'a Film,
    /// The first hits of the same pixels; empty where the layout has no [`Aov`] of them ([`AovSource::FirstHit`]).
    pub hits: &'a [FirstHit],
}

/// Takes the bands of a region one after the other, from the top.
pub type Sink<'a> = dyn FnMut(Band) -> Result<(), RenderError> + 'a;

/// A picture in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear RGB, row by row from the top.
    pub colors: Vec<[f32; 3]>,
}

/// The files that a picture is written to: the path itself, and `NAME.normal.png` and the like for a PNG's [`Aov`]s.
pub fn files(path: &Path, format: Format, aovs: &[Aov]) -> Vec<PathBuf> {
    let mut files = vec![path.to_owned()];
    if format == Format::Png {
        files.extend(
            aovs.iter()
                .map(|aov| path.with_extension(format!("{}.png", aov.name()))),
        );
    }
    files
}

/// Writes what `render` hands to the sink, the picture to the first of the files, those of its AOVs to the others, in the
/// order of [`files`]. They have their names when all rows are written; if anything fails they are as they were before.
///
/// # Errors
///
/// The errors of `render`, and [`RenderError::Output`] if a file cannot be written.
pub fn save(
    mut pending: Vec<Pending>,
    format: Format,
    layout: &Layout,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    match (format, pending.first_mut()) {
        (Format::Exr, Some(first)) => exr::write(first, layout, render)?,
        _ => png::write(&mut pending, layout, render)?,
    }
    pending.iter_mut().try_for_each(Pending::complete)?;
    Ok(pending.into_iter().try_for_each(Pending::finish)?)
}
