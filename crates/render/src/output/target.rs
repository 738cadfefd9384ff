//! Pictures on their way to files: several of one render, which all get the same rows.

use std::path::{Path, PathBuf};

use super::{Aov, Band, Layout, Pending, SaveOptions, Sink, exr, flat, png};
use crate::error::RenderError;

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// RGB of 8 or 16 bits a channel, as a display shows it, and alpha where the picture has it, which is
    /// linear. Every [`Aov`] is a file of its own.
    Png,
    /// RGB of floats, linear, and alpha where the picture has it; [`Aov`]s are further layers.
    Exr,
    /// RGB of 8 bits a channel, with loss, as a display shows it. It has neither alpha nor [`Aov`]s, and is in memory until it is whole.
    Jpeg,
    /// RGB of 8 bits a channel, without loss, as a display shows it, and alpha where the picture has it. It has no [`Aov`]s, and
    /// is in memory until it is whole.
    WebP,
}

impl Format {
    /// All of them.
    pub const ALL: [Format; 4] = [Format::Png, Format::Exr, Format::Jpeg, Format::WebP];

    /// The name in options.
    pub const fn name(self) -> &'static str {
        match self {
            Format::Png => "png",
            Format::Exr => "exr",
            Format::Jpeg => "jpeg",
            Format::WebP => "webp",
        }
    }

    /// The format that a file's name asks for by its end: `.png`, `.exr`, `.jpg`, `.jpeg` or `.webp`.
    pub fn of(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        let known = |format: &Format| extension == format.name() || (*format == Format::Jpeg && extension == "jpg");
        Format::ALL.into_iter().find(known)
    }

    /// What it makes of layers.
    pub fn layers(self) -> Layers {
        match self {
            Format::Exr => Layers::Inside,
            Format::Png => Layers::Beside,
            Format::Jpeg | Format::WebP => Layers::Unsupported,
        }
    }

    /// The most pixels along a side, where fewer than a scene may have.
    pub const fn longest_side(self) -> Option<u32> {
        match self {
            Format::Png | Format::Exr => None,
            Format::Jpeg => Some(65_535),
            Format::WebP => Some(16_383),
        }
    }

    /// Refuses a size that the format does not have.
    ///
    /// # Errors
    ///
    /// The rule that it breaks.
    pub fn check_size(self, width: u32, height: u32) -> Result<(), String> {
        match self.longest_side() {
            Some(most) if width.max(height) > most => Err(format!(
                "{width} x {height} pixels are too many for {}; the limit is {most} along a side",
                self.title()
            )),
            _ => Ok(()),
        }
    }

    /// The name in messages.
    pub const fn title(self) -> &'static str {
        match self {
            Format::Png => "a PNG",
            Format::Exr => "an EXR",
            Format::Jpeg => "a JPEG",
            Format::WebP => "a WebP",
        }
    }
}

/// Where the [`Aov`]s of a picture are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layers {
    /// In the picture's file.
    Inside,
    /// In files of their own.
    Beside,
    /// Unsupported.
    Unsupported,
}

/// A picture's files.
#[derive(Debug)]
pub struct Target {
    /// What they are.
    pub format: Format,
    /// In the order of [`files`].
    pub files: Vec<Pending>,
}

/// What was noticed when pictures were written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Saved {
    /// The files with finite values that became infinite, as 16 bits hold none above 65,504, and how many.
    pub too_large: Vec<(String, u64)>,
}

/// The files that a picture is written to: the path itself, and `NAME.normal.png` and the like for a PNG's [`Aov`]s.
pub fn files(path: &Path, format: Format, aovs: &[Aov]) -> Vec<PathBuf> {
    let mut files = vec![path.to_owned()];
    if format.layers() == Layers::Beside {
        files.extend(
            aovs.iter()
                .map(|aov| path.with_extension(format!("{}.png", aov.name()))),
        );
    }
    files
}

/// Writes what `render` hands to the sink to all targets. The files have their names when all rows are written; if anything
/// fails they are as they were before.
///
/// # Errors
///
/// The errors of `render`, and [`RenderError::Output`] if a file cannot be written.
pub fn save(
    mut targets: Vec<Target>,
    layout: &Layout,
    options: &SaveOptions,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<Saved, RenderError> {
    let mut saved = Saved::default();
    write(&mut targets, layout, options, &mut saved, &mut |_| Ok(()), render)?;
    let mut files: Vec<Pending> = targets.into_iter().flat_map(|target| target.files).collect();
    files.iter_mut().try_for_each(Pending::complete)?;
    files.into_iter().try_for_each(Pending::finish)?;
    Ok(saved)
}

/// Hands every band to `before` and then to the targets. Each writer calls what fills it, so that they lie in each other.
fn write(
    targets: &mut [Target],
    layout: &Layout,
    options: &SaveOptions,
    saved: &mut Saved,
    before: &mut Sink,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let shown = options.of(layout.view);
    let Some((Target { format, files }, others)) = targets.split_first_mut() else {
        return render(before);
    };
    let mut fill = |sink: &mut Sink| {
        let mut both = |band: Band| {
            before(band)?;
            sink(band)
        };
        write(others, layout, options, saved, &mut both, render)
    };
    match format {
        Format::Png => png::write(files, layout, &shown, &mut fill),
        Format::Exr => {
            let too_large = exr::write(files, layout, options, &mut fill)?;
            let name = files.first().map(|file| file.name().to_owned());
            saved
                .too_large
                .extend(name.filter(|_| too_large > 0).map(|name| (name, too_large)));
            Ok(())
        }
        Format::Jpeg | Format::WebP => flat::write(files, *format, layout, &shown, &mut fill),
    }
}
