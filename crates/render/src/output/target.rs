//! Output of a render to several image files, which receive the same rows.

use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

use super::formats::exr;
use super::{Aov, Band, Layout, Pending, SaveOptions, Sink, flat, png};
use crate::error::RenderError;
use wgray_image::formats::missing;

/// A format of image files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Display RGB of 8 or 16 bits per channel, with linear alpha if any. [`Aov`]s are separate files.
    Png,
    /// Linear float RGB, with alpha if any. [`Aov`]s are further layers. Needs the cargo feature `formats`.
    Exr,
    /// Display RGB of 8 bits per channel, lossy, without alpha and [`Aov`]s. Kept in memory until complete.
    Jpeg,
    /// Like [`Format::Jpeg`], but lossless, and with alpha if any. Needs the cargo feature `formats`.
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
        let matches = |format: &Format| extension == format.name() || (*format == Format::Jpeg && extension == "jpg");
        Format::ALL.into_iter().find(matches)
    }

    /// Returns the location of [`Aov`]s.
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
            Some(max) if width.max(height) > max => Err(format!(
                "{width} x {height} pixels are too many for {}; the limit is {max} along a side",
                self.title()
            )),
            _ => Ok(()),
        }
    }

    /// Rejects the formats that need the cargo feature `formats` if it is disabled.
    fn check_feature(self) -> io::Result<()> {
        match self {
            Format::Exr if !cfg!(feature = "formats") => Err(missing("OpenEXR")),
            Format::WebP if !cfg!(feature = "formats") => Err(missing("WebP")),
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
                .filter(|aov| aov.has_file())
                .map(|aov| path.with_extension(format!("{}.png", aov.name()))),
        );
    }
    files
}

/// Writes the bands that `render` produces to temporary files of all targets. When all files are complete, renames them
/// into place. After a failure, existing files are unchanged.
///
/// # Errors
///
/// Errors of `render`, and [`RenderError::Output`] if a file cannot be written or a format needs the disabled cargo
/// feature `formats`.
pub fn save(
    mut targets: Vec<Target>,
    layout: &Layout,
    options: &SaveOptions,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<SaveReport, RenderError> {
    for Target { format, files } in &targets {
        format.check_feature().map_err(|error| match files.first() {
            Some(file) => io::Error::new(error.kind(), format!("{}: {error}", file.name())),
            None => error,
        })?;
    }
    let mut report = SaveReport::default();
    write(&mut targets, layout, options, &mut report, &mut |_| Ok(()), render)?;
    let mut files: Vec<Pending> = targets.into_iter().flat_map(|target| target.files).collect();
    files.iter_mut().try_for_each(Pending::complete)?;
    files.into_iter().try_for_each(Pending::finish)?;
    Ok(report)
}

/// Passes every band to `first_sink`, then to the targets. A writer calls `render` itself, so the writers are nested.
fn write(
    targets: &mut [Target],
    layout: &Layout,
    options: &SaveOptions,
    report: &mut SaveReport,
    first_sink: &mut Sink,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let display_options = options.with_view(layout.view);
    let Some((Target { format, files }, other_targets)) = targets.split_first_mut() else {
        return render(first_sink);
    };
    let mut render_nested = |sink: &mut Sink| {
        let mut both_sinks = |band: Band| {
            first_sink(band)?;
            sink(band)
        };
        write(other_targets, layout, options, report, &mut both_sinks, render)
    };
    match (*format, files.as_mut_slice()) {
        (Format::Png, files) => {
            let aovs = layout.aovs.iter().copied().filter(|aov| aov.has_file());
            let contents = [None].into_iter().chain(aovs.map(Some));
            png::write(
                files.iter_mut().zip(contents),
                layout,
                &display_options,
                &mut render_nested,
            )
        }
        (Format::Exr, [file]) => {
            let too_large = exr::write(&mut *file, layout, options, &mut render_nested)?;
            if too_large > 0 {
                report.too_large.push((file.name().to_owned(), too_large));
            }
            Ok(())
        }
        (format @ (Format::Jpeg | Format::WebP), [file]) => {
            flat::write(file, format, layout, &display_options, &mut render_nested)
        }
        // Unreachable: see [`files`].
        _ => Err(std::io::Error::other("images of this format have one file").into()),
    }
}

/// Writes an image, or one of its layers as a PNG, to a writer.
///
/// # Errors
///
/// Errors of `render`, and [`RenderError::Output`] if the writer fails, the image is too large for the format, or the
/// format needs the disabled cargo feature `formats`.
pub fn write_to(
    writer: impl Write + Seek,
    (format, layer): (Format, Option<Aov>),
    layout: &Layout,
    options: &SaveOptions,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    format.check_feature()?;
    let display_options = options.with_view(layout.view);
    match format {
        Format::Png => png::write([(writer, layer)], layout, &display_options, render),
        Format::Exr => exr::write(writer, layout, options, render).map(|_| ()),
        Format::Jpeg | Format::WebP => flat::write(writer, format, layout, &display_options, render),
    }
}
