//! Images of textures: files, which are decoded within limits and validated, and images in memory.

use std::borrow::Cow;
use std::sync::Arc;

use image::error::LimitErrorKind;
use image::{DynamicImage, ImageError, ImageFormat};

use super::Problem;
use super::decode::{DecodeError, Format, Header, MAX_IMAGE_SIDE, decode};
use super::downsample::halved;
use super::texture::{Encoding, Image, Texels};
use crate::assets::{AssetKey, Assets};
use crate::file_system::NoFiles;
use wgray_image::color::srgb_to_linear;

/// Maximum component of a texel, equal to the maximum component of all colors.
const MAX_TEXEL: f32 = 1e6;

impl Assets {
    /// Returns an image in memory. If `encoding` is set, the image must have this encoding. `fits` checks the size
    /// before the texels are checked. The error contains the value and the violated rule.
    fn image_in_memory(
        &self,
        name: &str,
        encoding: Option<Encoding>,
        fits: impl Fn(Header) -> Result<(), String>,
    ) -> Result<File, String> {
        let image = self
            .images
            .get(name)
            .ok_or_else(|| format!("there is no image {name:?} in memory"))?;
        let Image { width, height, texels } = &**image;
        let (count, default) = match texels {
            Texels::Bytes(encoding, texels) => (texels.len(), *encoding),
            Texels::Floats(texels) => (texels.len(), Encoding::Linear),
        };
        if *width.max(height) > MAX_IMAGE_SIDE {
            return Err(format!(
                "{name:?} must have at most {MAX_IMAGE_SIDE} texels along a side"
            ));
        }
        check_size(name, *width, *height)?;
        if count as u64 != u64::from(*width) * u64::from(*height) {
            return Err(format!("{name:?} has {count} texels; its size is {width} x {height}"));
        }
        if encoding.is_some_and(|encoding| encoding != default) {
            return Err(format!("{name:?} must have the encoding of the image in memory"));
        }
        fits(Header::of(image))?;
        check_texels(name, image)?;
        Ok(File {
            image: Arc::clone(image),
            format: None,
            default,
            encoding: default,
            is_alpha: false,
            damage: None,
        })
    }

    /// Reads an image. `fits` checks the header before the texels are decoded. The error contains the value and the
    /// violated rule.
    pub(super) fn image(
        &self,
        file: &str,
        key: &AssetKey,
        part: Part,
        fits: impl Fn(Header) -> Result<(), String>,
    ) -> Result<File, Problem> {
        let encoding = part.encoding();
        let bytes = match key {
            AssetKey::Memory(_) if part == Part::Alpha => {
                return Err(Problem::new(format!(
                    "{file:?} is an image in memory, which has no alpha channel"
                )));
            }
            AssetKey::Memory(_) => return Ok(self.image_in_memory(file, encoding, fits)?),
            AssetKey::File(path) => Cow::Owned(self.read(file, path)?),
            AssetKey::Encoded(name) => Cow::Borrowed(self.encoded.get(name).map_or(&[][..], |bytes| bytes)),
        };
        let is_file = matches!(key, AssetKey::File(_));
        let format = Format::of(&bytes).ok_or_else(|| {
            Problem::damage(match is_file {
                true => format!("{file:?} must be a PNG, JPEG, WebP, KTX2, EXR or HDR file"),
                false => format!("{file:?} must be a PNG, JPEG, WebP or KTX2 file"),
            })
        })?;
        if is_file {
            check_name(file, format)?;
        }
        let is_float = matches!(format, Format::Image(ImageFormat::OpenExr | ImageFormat::Hdr));
        if is_float && encoding == Some(Encoding::Srgb) {
            return Err(Problem::new(format!(
                "the encoding of {file:?} must not be \"srgb\": {} files are linear",
                format.name()
            )));
        }
        let max_side = self.longest_side.filter(|_| matches!(key, AssetKey::Encoded(_)));
        let halvings = |width: u32, height: u32| {
            let sizes = (0..).map(|i| width.max(height) >> i);
            max_side.map_or(0, |max_side| sizes.take_while(|size| *size > max_side.max(1)).count())
        };
        let fits = |header: Header| {
            let count = halvings(header.width, header.height);
            fits(Header {
                width: (header.width >> count).max(1),
                height: (header.height >> count).max(1),
                ..header
            })
        };
        let decoded = decode(&bytes, format, fits).map_err(|error| match error {
            DecodeError::Rule(rule) => Problem::new(rule),
            DecodeError::File { rule, is_damage } => Problem {
                is_damage,
                ..Problem::new(format!("{file:?} {rule}"))
            },
            DecodeError::Image(error) => Problem {
                is_damage: !matches!(error, ImageError::Limits(_)),
                ..Problem::new(format!("{file:?} {}", image_message(&error)))
            },
        })?;
        drop(bytes);
        let (width, height) = (decoded.width(), decoded.height());
        check_size(file, width, height)?;
        let default = if is_float { Encoding::Linear } else { Encoding::Srgb };
        let texels = match part {
            Part::Colors(_) => texels(decoded, is_float, encoding.unwrap_or(default)),
            Part::Alpha => alpha(decoded).ok_or_else(|| format!("{file:?} must have an alpha channel"))?,
        };
        let mut image = Image { width, height, texels };
        let damage = clamp(&mut image).map(|damage| format!("{file:?} {damage}"));
        for _ in 0..halvings(width, height) {
            image = halved(&image);
        }
        Ok(File {
            image: Arc::new(image),
            format: Some(format).filter(|_| is_file),
            default,
            encoding: encoding.unwrap_or(default),
            is_alpha: part == Part::Alpha,
            damage,
        })
    }
}

impl Image {
    /// Decodes a PNG, JPEG, WebP, KTX2, OpenEXR or Radiance HDR file in memory. If `encoding` is `None`, the encoding
    /// is linear for OpenEXR and HDR, otherwise sRGB. Invalid components of float images are clamped to the range 0 to
    /// 1e6.
    ///
    /// # Errors
    ///
    /// The file is damaged, or exceeds a limit on the size of images.
    pub fn from_slice(bytes: &[u8], encoding: Option<Encoding>) -> Result<Image, Problem> {
        const NAME: &str = "image";
        if Format::of(bytes).is_none() {
            let rule = "the image must be a PNG, JPEG, WebP, KTX2, EXR or HDR file";
            return Err(Problem::damage(rule));
        }
        let mut assets = Assets::from_source(NoFiles);
        assets.encoded.insert(NAME.to_owned(), Arc::from(bytes));
        let key = AssetKey::Encoded(NAME.to_owned());
        let decoded = assets.image(NAME, &key, Part::Colors(encoding), |_| Ok(()))?;
        Ok(Arc::unwrap_or_clone(decoded.image))
    }
}

fn check_size(name: &str, width: u32, height: u32) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!(
            "{name:?} must have at least one texel; its size is {width} x {height}"
        ));
    }
    Ok(())
}

fn check_texels(name: &str, image: &Image) -> Result<(), String> {
    if let Texels::Floats(values) = &image.texels {
        let is_invalid = |value: &f32| !(0.0..=MAX_TEXEL).contains(value);
        if let Some(i) = values.iter().position(|texel| texel.iter().any(is_invalid)) {
            let (x, y) = (i as u32 % image.width, i as u32 / image.width);
            let [r, g, b] = values[i];
            let rule = "texel values must be from 0 to 1e6";
            return Err(format!("{name:?} has the texel [{r}, {g}, {b}] at ({x}, {y}); {rule}"));
        }
    }
    Ok(())
}

/// Clamps invalid texels. Returns a description of the damage; `None` if all texels are valid.
fn clamp(image: &mut Image) -> Option<String> {
    let Texels::Floats(values) = &mut image.texels else {
        return None;
    };
    let is_invalid = |value: &f32| !(0.0..=MAX_TEXEL).contains(value);
    let (mut first, mut count) = (0, 0_usize);
    for (i, texel) in values
        .iter_mut()
        .enumerate()
        .filter(|(_, texel)| texel.iter().any(is_invalid))
    {
        first = if count == 0 { i } else { first };
        count += 1;
        // The comparison is false for NaN, which becomes 0.
        *texel = texel.map(|x| if x > 0.0 { x.min(MAX_TEXEL) } else { 0.0 });
    }
    let (x, y) = (first as u32 % image.width, first as u32 / image.width);
    let rule = "texel values must be from 0 to 1e6";
    match count {
        0 => None,
        1 => Some(format!("has 1 invalid texel, at ({x}, {y}); {rule}")),
        _ => Some(format!("has {count} invalid texels, the first at ({x}, {y}); {rule}")),
    }
}

/// A validated image, and the part of the file that it contains.
#[derive(Clone)]
pub(super) struct File {
    pub image: Arc<Image>,
    /// `None` for images in memory, whose names do not determine the format.
    format: Option<Format>,
    /// Default encoding of the format.
    default: Encoding,
    encoding: Encoding,
    is_alpha: bool,
    /// Message about invalid texels, if any.
    pub damage: Option<String>,
}

/// The part of an image that a texture uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// Colors, decoded with this encoding; `None` is the default encoding of the file.
    Colors(Option<Encoding>),
    /// Alpha, as gray.
    Alpha,
}

impl Part {
    fn encoding(self) -> Option<Encoding> {
        match self {
            Part::Colors(encoding) => encoding,
            Part::Alpha => Some(Encoding::Linear),
        }
    }
}

impl File {
    /// Returns true if the image is this part of its file, in the encoding that the part requires.
    pub fn contains(&self, part: Part) -> bool {
        self.is_alpha == (part == Part::Alpha) && part.encoding().unwrap_or(self.default) == self.encoding
    }

    /// Rejects a name whose extension belongs to a different format.
    pub fn check_name(&self, file: &str) -> Result<(), String> {
        self.format.map_or(Ok(()), |format| check_name(file, format))
    }
}

fn check_name(file: &str, format: Format) -> Result<(), String> {
    match Format::of_name(file) {
        Some(expected) if expected != format => Err(format!(
            "{file:?} must have the extension of its format, {}",
            format.name()
        )),
        _ => Ok(()),
    }
}

/// Returns the message about an invalid image, without the name of the image.
fn image_message(error: &ImageError) -> String {
    match error {
        ImageError::Limits(limit) if matches!(limit.kind(), LimitErrorKind::DimensionError) => {
            format!("must have at most {MAX_IMAGE_SIDE} texels along a side")
        }
        ImageError::Limits(_) => "needs too much memory to be decoded".to_string(),
        ImageError::Unsupported(_) => format!("must have a supported format: {error}"),
        _ => format!("is damaged or truncated: {error}"),
    }
}

fn texels(image: DynamicImage, is_float: bool, encoding: Encoding) -> Texels {
    use DynamicImage::{ImageLuma16, ImageLumaA16, ImageRgb16, ImageRgba16};
    if is_float {
        return Texels::Floats(image.into_rgb32f().pixels().map(|texel| texel.0).collect());
    }
    if matches!(image, ImageLuma16(_) | ImageLumaA16(_) | ImageRgb16(_) | ImageRgba16(_)) {
        let decode = |value: u16| {
            let value = f64::from(value) / 65_535.0;
            match encoding {
                Encoding::Srgb => srgb_to_linear(value) as f32,
                Encoding::Linear => value as f32,
            }
        };
        return Texels::Floats(image.into_rgb16().pixels().map(|texel| texel.0.map(decode)).collect());
    }
    let bytes = match image {
        DynamicImage::ImageLuma8(gray) => gray.pixels().map(|texel| [texel.0[0]; 3]).collect(),
        DynamicImage::ImageLumaA8(gray) => gray.pixels().map(|texel| [texel.0[0]; 3]).collect(),
        DynamicImage::ImageRgba8(colors) => colors
            .pixels()
            .map(|texel| [texel.0[0], texel.0[1], texel.0[2]])
            .collect(),
        colors => colors.into_rgb8().pixels().map(|texel| texel.0).collect(),
    };
    Texels::Bytes(encoding, bytes)
}

/// Returns the alpha channel as a gray image; `None` if there is no alpha channel.
fn alpha(image: DynamicImage) -> Option<Texels> {
    if !image.color().has_alpha() {
        return None;
    }
    let bytes = |alpha: Vec<u8>| Texels::Bytes(Encoding::Linear, alpha.into_iter().map(|a| [a; 3]).collect());
    Some(match image {
        DynamicImage::ImageLumaA8(gray) => bytes(gray.pixels().map(|texel| texel.0[1]).collect()),
        DynamicImage::ImageRgba8(colors) => bytes(colors.pixels().map(|texel| texel.0[3]).collect()),
        image => Texels::Floats(image.into_rgba32f().pixels().map(|texel| [texel.0[3]; 3]).collect()),
    })
}
