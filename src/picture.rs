//! A rendered image in memory.

use std::io::{self, Seek, Write};
use std::path::Path;

use crate::device::DeviceInfo;
use crate::error::{Error, RenderError};
use crate::image::{self, Aov, Band, Format, Layout, Output, Pending, Pixels, SaveOptions, Target};
use wgray_image::Region;
use wgray_render::noise::{Noise, NoiseMeter};
use wgray_render::output::channels_of;
use wgray_trace::film::Film;
use wgray_trace::records::FirstHit;

/// A rendered image, or a region of one: linear radiance and additional layers (AOVs).
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub(crate) film: Film,
    pub(crate) hits: Vec<FirstHit>,
    pub(crate) layout: Layout,
    pub(crate) device: DeviceInfo,
}

/// Values of a channel in row-major order, top row first.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ChannelValues {
    /// Values of a floating-point channel, such as `R`, `A` or `normal.X`.
    Floats(Vec<f32>),
    /// Values of an integer channel: `primitive.ID` or `sample_count.N`.
    Whole(Vec<u32>),
}

impl Picture {
    /// Returns the number of columns.
    pub fn width(&self) -> u32 {
        self.layout.region.width()
    }

    /// Returns the number of rows.
    pub fn height(&self) -> u32 {
        self.layout.region.height()
    }

    /// Returns the region of the scene's image that was rendered.
    pub fn region(&self) -> Region {
        self.layout.region
    }

    /// Returns the device that rendered last.
    pub fn device(&self) -> &DeviceInfo {
        &self.device
    }

    /// Returns the pixels as linear RGB in row-major order, top row first. If the image has alpha, the colors are
    /// premultiplied. The colors are not denoised; see [`Picture::denoised`].
    pub fn pixels(&self) -> Pixels {
        Pixels {
            width: self.width(),
            height: self.height(),
            colors: self.film.means().collect(),
        }
    }

    /// Returns the denoised pixels like [`Picture::pixels`], if [`Aov::Denoised`] or the scene requests them.
    pub fn denoised(&self) -> Option<Pixels> {
        (self.layout.aovs.contains(&Aov::Denoised)).then(|| Pixels {
            width: self.width(),
            height: self.height(),
            colors: self.colors().collect(),
        })
    }

    /// Returns the displayed colors.
    fn colors(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.film.sums.len()).map(|pixel| self.film.color(pixel))
    }

    /// Returns the alpha values in row-major order, top row first, if the background is transparent. With filters that
    /// have negative weights, the values may be outside 0 ... 1.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        let pixels = 0..self.film.sums.len();
        self.layout.alpha.then(|| pixels.map(|i| self.film.alpha(i)).collect())
    }

    /// Returns the pixels as 8-bit RGB in row-major order, top row first, with the scene's view transform and exposure,
    /// as in a PNG: denoised if the image has [`Picture::denoised`] pixels. Alpha is composited over black.
    pub fn rgb8(&self) -> Vec<u8> {
        self.colors().flat_map(|color| self.layout.view.rgb8(color)).collect()
    }

    /// Returns the pixels as 8-bit RGBA in row-major order, top row first, as in a PNG with alpha. The colors are
    /// straight and encoded as in [`Picture::rgb8`]. Alpha is linear, and 255 if the image has no alpha.
    pub fn rgba8(&self) -> Vec<u8> {
        let pixel = |(i, mean)| match self.layout.alpha {
            true => self.layout.view.rgba8(mean, self.film.alpha(i)),
            false => self.layout.view.rgba8(mean, 1.0),
        };
        self.colors().enumerate().flat_map(pixel).collect()
    }

    /// Returns a channel by its OpenEXR name: `R`, `G`, `B`, `A`, and the channels of requested layers, such as `depth.Z`
    /// or `normal.X` ([`Aov::channel_names`]). `None` if the image has no channel with this name.
    pub fn channel(&self, name: &str) -> Option<ChannelValues> {
        if let Some(color) = ["R", "G", "B"].iter().position(|color_name| *color_name == name) {
            return Some(ChannelValues::Floats(
                self.film.means().map(|mean| mean[color]).collect(),
            ));
        }
        if name == "A" {
            return self.alpha().map(ChannelValues::Floats);
        }
        let mut channels = self.layout.aovs.iter().flat_map(|aov| channels_of(*aov));
        let channel = channels.find(|channel| channel.name() == name)?;
        let bytes = (0..self.film.sums.len()).map(|pixel| channel.bytes(self.band(), pixel));
        Some(match channel.is_whole() {
            true => ChannelValues::Whole(bytes.map(u32::from_ne_bytes).collect()),
            false => ChannelValues::Floats(bytes.map(f32::from_ne_bytes).collect()),
        })
    }

    /// Returns the noise of the image; `None` unless [`Options::noise`](crate::Options::noise) requested estimates.
    pub fn noise(&self) -> Option<Noise> {
        self.film.has_noise().then(|| {
            let mut meter = NoiseMeter::new(self.layout.view.exposure);
            meter.add(&self.film);
            meter.noise()
        })
    }

    /// Returns the additional layers.
    pub fn aovs(&self) -> &[Aov] {
        &self.layout.aovs
    }

    /// Writes the image to a file. Files named `.png`, `.jpg`, `.jpeg` or `.webp` contain the displayed image, `.exr`
    /// the linear values.
    ///
    /// Layers become channels of an EXR, and separate files such as `NAME.normal.png` for a PNG; JPEG and WebP have no
    /// layers. Alpha becomes a channel, except in a JPEG, which is composited over black. Existing files are replaced
    /// atomically.
    ///
    /// # Errors
    ///
    /// The file type is unknown or needs the cargo feature `formats`, the image is too large for the format, or a file
    /// cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        self.save_with(path, &SaveOptions::default())
    }

    /// Like [`Picture::save`], with options.
    ///
    /// # Errors
    ///
    /// The errors of [`Picture::save`].
    pub fn save_with(&self, path: impl AsRef<Path>, options: &SaveOptions) -> Result<(), Error> {
        let path = path.as_ref();
        let invalid_input = |rule: &str| {
            let message = format!("{}: {rule}", path.display());
            RenderError::Output(io::Error::new(io::ErrorKind::InvalidInput, message))
        };
        let format = Format::of(path).ok_or_else(|| invalid_input("must end in .png, .exr, .jpg, .jpeg or .webp"))?;
        let size = format.check_size(self.width(), self.height());
        size.map_err(|rule| invalid_input(&rule))?;
        let files = image::files(path, format, &self.layout.aovs);
        let files = files.iter().map(|file| Pending::start(Output::find(file)?));
        let files = files.collect::<Result<_, _>>().map_err(RenderError::Output)?;
        let targets = vec![Target { format, files }];
        image::save(targets, &self.layout, options, &mut |sink| sink(self.band()))?;
        Ok(())
    }

    /// Writes the image to a writer, for example a `Cursor<Vec<u8>>`. The layers are in an EXR;
    /// [`Picture::write_layer_to`] writes them as PNG images.
    ///
    /// ```
    /// # fn main() -> Result<(), wgray::Error> {
    /// use wgray::image::{Format, SaveOptions};
    ///
    /// # let smaller = wgray::Overrides { size: Some((16, 16)), ..Default::default() };
    /// # let scene = wgray::Scene::load_with("scenes/turntable.toml", &smaller)?;
    /// let image = wgray::render(&scene, &wgray::Options::default())?;
    /// let mut png = std::io::Cursor::new(Vec::new());
    /// image.write_to(&mut png, Format::Png, &SaveOptions::default())?;
    /// assert!(png.into_inner().starts_with(b"\x89PNG"));
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// The image is too large for the format, the format needs the cargo feature `formats`, or the writer fails.
    pub fn write_to(&self, writer: impl Write + Seek, format: Format, options: &SaveOptions) -> Result<(), Error> {
        let size = format.check_size(self.width(), self.height());
        size.map_err(|rule| RenderError::Output(io::Error::new(io::ErrorKind::InvalidInput, rule)))?;
        self.write_content(writer, (format, None), options)
    }

    /// Writes a layer as a PNG to a writer, as [`Picture::save`] does to `NAME.normal.png`.
    ///
    /// # Errors
    ///
    /// The image does not have the layer, the layer is [`Aov::Denoised`], which is the image of a PNG, or the writer
    /// fails.
    pub fn write_layer_to(&self, layer: Aov, writer: impl Write + Seek, options: &SaveOptions) -> Result<(), Error> {
        if !self.layout.aovs.contains(&layer) {
            let rule = format!("the image does not have the layer {}", layer.name());
            return Err(RenderError::Output(io::Error::new(io::ErrorKind::InvalidInput, rule)).into());
        }
        if !layer.has_file() {
            let rule = format!("the layer {} is the image of a PNG: use write_to", layer.name());
            return Err(RenderError::Output(io::Error::new(io::ErrorKind::InvalidInput, rule)).into());
        }
        self.write_content(writer, (Format::Png, Some(layer)), options)
    }

    fn write_content(
        &self,
        writer: impl Write + Seek,
        content: (Format, Option<Aov>),
        options: &SaveOptions,
    ) -> Result<(), Error> {
        Ok(image::write_to(writer, content, &self.layout, options, &mut |sink| {
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
