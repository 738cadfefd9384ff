//! A rendered picture in memory.

use std::io;
use std::path::Path;

use crate::device::DeviceInfo;
use crate::error::{Error, RenderError};
use crate::image::{self, Aov, Band, Format, Layout, Output, Pending, Pixels, SaveOptions, Target};
use wgray_image::Region;
use wgray_render::film::Film;
use wgray_render::records::FirstHit;

/// A rendered picture, or the part of one that was asked for: linear radiance, and the layers beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub(crate) film: Film,
    pub(crate) hits: Vec<FirstHit>,
    pub(crate) layout: Layout,
    pub(crate) device: DeviceInfo,
}

/// The values of one channel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Channel {
    /// Of `R`, `A`, `normal.X` and other measures.
    Floats(Vec<f32>),
    /// Of `primitive.ID` and `sample_count.N`.
    Whole(Vec<u32>),
}

impl Picture {
    /// Columns.
    pub fn width(&self) -> u32 {
        self.layout.region.width()
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.layout.region.height()
    }

    /// Which pixels of the scene's whole picture these are.
    pub fn region(&self) -> Region {
        self.layout.region
    }

    /// What it was rendered on.
    pub fn device(&self) -> &DeviceInfo {
        &self.device
    }

    /// The pixels in linear RGB, row by row from the top. Where the picture has alpha they are weighted by it: those of the
    /// picture over black.
    pub fn pixels(&self) -> Pixels {
        Pixels {
            width: self.width(),
            height: self.height(),
            colors: self.film.means().collect(),
        }
    }

    /// The share of each pixel that is covered, row by row from the top, if the scene's background is transparent. A filter
    /// with weights of either sign may take it out of 0 to 1.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        let pixels = 0..self.film.sums.len();
        self.layout.alpha.then(|| pixels.map(|i| self.film.alpha(i)).collect())
    }

    /// The pixels as a screen and a PNG without alpha show them: red, green and blue of 8 bits each, by the scene's view
    /// transform and exposure, row by row from the top. Where the picture has alpha it is over black.
    pub fn rgb8(&self) -> Vec<u8> {
        self.film.means().flat_map(|mean| self.layout.view.rgb8(mean)).collect()
    }

    /// The pixels as a PNG with alpha has them, row by row from the top: red, green and blue as in [`Picture::rgb8`], but of
    /// what is there by itself, not weighted by alpha; then alpha, linear, 255 where the picture has none.
    pub fn rgba8(&self) -> Vec<u8> {
        let pixel = |(i, mean)| match self.layout.alpha {
            true => self.layout.view.rgba8(mean, self.film.alpha(i)),
            false => self.layout.view.rgba8(mean, 1.0),
        };
        self.film.means().enumerate().flat_map(pixel).collect()
    }

    /// The values of a channel, by the name that it has in an OpenEXR file: `R`, `G`, `B`, `A` with alpha, and those of the layers that were
    /// asked for, such as `depth.Z` or `normal.X`. `None` if there is no such channel.
    pub fn channel(&self, name: &str) -> Option<Channel> {
        if let Some(color) = ["R", "G", "B"].iter().position(|known| *known == name) {
            return Some(Channel::Floats(self.film.means().map(|mean| mean[color]).collect()));
        }
        if name == "A" {
            return self.alpha().map(Channel::Floats);
        }
        let mut channels = self.layout.aovs.iter().flat_map(|aov| aov.channels());
        let channel = channels.find(|channel| channel.name() == name)?;
        let bytes = (0..self.film.sums.len()).map(|pixel| channel.bytes(self.band(), pixel));
        Some(match channel.is_whole() {
            true => Channel::Whole(bytes.map(u32::from_ne_bytes).collect()),
            false => Channel::Floats(bytes.map(f32::from_ne_bytes).collect()),
        })
    }

    /// The layers that it has beside the radiance.
    pub fn aovs(&self) -> &[Aov] {
        &self.layout.aovs
    }

    /// Writes the picture to a file whose name ends in `.png`, `.jpg`, `.jpeg` or `.webp`, as a screen shows it, or in `.exr`, with its linear values.
    /// Layers are further channels of an EXR, and files beside a PNG: `NAME.normal.png` and so on; JPEG and WebP have none. Files appear when they
    /// are whole, in place of those that have their names. Alpha is a further channel of all but JPEG, which is over black.
    ///
    /// # Errors
    ///
    /// Names of another end, pictures larger than the format has them, and files that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        self.save_with(path, &SaveOptions::default())
    }

    /// Writes the picture as [`Picture::save`] does, with other settings than the usual ones.
    ///
    /// # Errors
    ///
    /// Those of [`Picture::save`].
    pub fn save_with(&self, path: impl AsRef<Path>, options: &SaveOptions) -> Result<(), Error> {
        let path = path.as_ref();
        let refused = |rule: &str| {
            let told = format!("{}: {rule}", path.display());
            RenderError::Output(io::Error::new(io::ErrorKind::InvalidInput, told))
        };
        let format = Format::of(path).ok_or_else(|| refused("must end in .png, .exr, .jpg, .jpeg or .webp"))?;
        let size = format.check_size(self.width(), self.height());
        size.map_err(|rule| refused(&rule))?;
        let files = image::files(path, format, &self.layout.aovs);
        let files = files.iter().map(|file| Pending::start(Output::find(file)?));
        let files = files.collect::<Result<_, _>>().map_err(RenderError::Output)?;
        let targets = vec![Target { format, files }];
        image::save(targets, &self.layout, options, &mut |sink| sink(self.band()))?;
        Ok(())
    }

    fn band(&self) -> Band<'_> {
        Band {
            film: &self.film,
            hits: &self.hits,
        }
    }
}
