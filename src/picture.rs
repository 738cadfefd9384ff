//! A rendered picture in memory.

use std::path::Path;

use crate::device::DeviceInfo;
use crate::error::{Error, RenderError};
use crate::film::{Film, Region};
use crate::image::{self, Aov, Band, Format, Layout, Output, Pending, Pixels};
use crate::pack::FirstHit;

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

    /// The pixels as a screen and a PNG without alpha show them: red, green and blue of 8 bits each, clamped to [0, 1] and
    /// raised to the power 1/2.2, row by row from the top. Where the picture has alpha it is over black.
    pub fn rgb8(&self) -> Vec<u8> {
        self.film.means().flat_map(|mean| mean.map(image::encode)).collect()
    }

    /// The pixels as a PNG with alpha has them, row by row from the top: red, green and blue as in [`Picture::rgb8`], but of
    /// what is there by itself, not weighted by alpha; then alpha, linear, 255 where the picture has none.
    pub fn rgba8(&self) -> Vec<u8> {
        let pixel = |(i, mean)| match self.layout.alpha {
            true => image::straight(mean, self.film.alpha(i)),
            false => image::straight(mean, 1.0),
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

    /// Writes the picture to a file whose name ends in `.png`, as a screen shows it, or in `.exr`, with its linear values.
    /// Layers are further channels of an EXR, and files beside a PNG: `NAME.normal.png` and so on. Files appear when they
    /// are whole, in place of those that have their names. Alpha is a further channel of either.
    ///
    /// # Errors
    ///
    /// Names of another end, and files that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let format = Format::of(path).ok_or_else(|| {
            let rule = format!("{}: must end in .png or .exr", path.display());
            RenderError::Output(std::io::Error::new(std::io::ErrorKind::InvalidInput, rule))
        })?;
        let files = image::files(path, format, &self.layout.aovs);
        let pending = files.iter().map(|file| Pending::start(Output::find(file)?));
        let pending = pending.collect::<Result<_, _>>().map_err(RenderError::Output)?;
        Ok(image::save(pending, format, &self.layout, &mut |sink| {
            sink(self.band())
        })?)
    }

    fn band(&self) -> Band<'_> {
        Band {
            film: &self.film,
            hits: &self.hits,
        }
    }
}
