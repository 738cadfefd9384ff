//! Output of a render to several image files, which receive the same rows.

use std::path::{Path, PathBuf};

use super::{Aov, Band, Layout, Pending, SaveOptions, Sink, exr, flat, png};
use crate::error::RenderError;

/// A format of image files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Display RGB of 8 or 16 bits per channel, with linear alpha if any. [`Aov`]s are separate files.
    Png,
    /// Linear float RGB, with alpha if any. [`Aov`]s are further layers.
    Exr,
    /// Display RGB of 8 bits per channel, lossy, without alpha and [`Aov`]s. Kept in memory until complete.
    Jpeg,
    /// Like [`Format::Jpeg`], but lossless, and with alpha if any.
    WebP,
}

impl Format {
    /// All formats.
    pub const ALL: [Format; 4] = [Format::Png, Format::Exr, Format::Jpeg, Format::WebP];

    /// Returns the name in options.
    pub const fn name(self) -> &'static str {
        match self {
            Format::Png => "png",
            Format::Exr => "exr",
            Format::Jpeg => "jpeg",
            Format::WebP => "webp",
        }
    }

    /// Returns the format that a path's extension selects: `.png`, `.exr`, `.jpg`, `.jpeg` or `.webp`.
    pub fn of(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        let known = |format: &Format| extension == format.name() || (*format == Format::Jpeg && extension == "jpg");
        Format::ALL.into_iter().find(known)
    }

    /// Returns the location of layers.
    pub fn layers(self) -> Layers {
        match self {
            Format::Exr => Layers::Inside,
            Format::Png => Layers::Beside,
            Format::Jpeg | Format::WebP => Layers::Unsupported,
        }
    }

    /// Returns the maximum side in pixels, if it is below the maximum of scenes.
    pub const fn longest_side(self) -> Option<u32> {
        match self {
            Format::Png | Format::Exr => None,
            Format::Jpeg => Some(65_535),
            Format::WebP => Some(16_383),
        }
    }

    /// Checks a size against the format's limit.
    ///
    /// # Errors
    ///
    /// The violated rule.
    pub fn check_size(self, width: u32, height: u32) -> Result<(), String> {
        match self.longest_side() {
            Some(most) if width.max(height) > most => Err(format!(
                "{width} x {height} pixels are too many for {}; the limit is {most} along a side",
                self.title()
            )),
            _ => Ok(()),
        }
    }

    /// Returns the name in messages.
    pub const fn title(self) -> &'static str {
        match self {
            Format::Png => "a PNG",
            Format::Exr => "an EXR",
            Format::Jpeg => "a JPEG",
            Format::WebP => "a WebP",
        }
    }
}

/// Location of the [`Aov`]s of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layers {
    /// In the image file.
    Inside,
    /// In separate files.
    Beside,
    /// Unsupported.
    Unsupported,
}

/// The files of an image.
#[derive(Debug)]
pub struct Target {
    /// Format of the files.
    pub format: Format,
    /// Files in the order of [`files`].
    pub files: Vec<Pending>,
}

/// Report on written images.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SaveReport {
    /// Files in which finite values became infinite (16-bit floats end at 65,504), and the number of these values.
    pub too_large: Vec<(String, u64)>,
}

/// Returns an image's files: the path itself, and `NAME.normal.png` etc. for the [`Aov`]s of a PNG.
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

/// Writes the bands that `render` passes on to all targets. Files are renamed into place when all are complete. On
/// failure existing files are unchanged.
///
/// # Errors
///
/// Errors of `render`, and [`RenderError::Output`] if a file cannot be written.
pub fn save(
    mut targets: Vec<Target>,
    layout: &Layout,
    options: &SaveOptions,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<SaveReport, RenderError> {
    let mut saved = SaveReport::default();
    write(&mut targets, layout, options, &mut saved, &mut |_| Ok(()), render)?;
    let mut files: Vec<Pending> = targets.into_iter().flat_map(|target| target.files).collect();
    files.iter_mut().try_for_each(Pending::complete)?;
    files.into_iter().try_for_each(Pending::finish)?;
    Ok(saved)
}

/// Passes every band to `before`, then to the targets. Writers pull bands from a callback, so they are nested.
fn write(
    targets: &mut [Target],
    layout: &Layout,
    options: &SaveOptions,
    saved: &mut SaveReport,
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
