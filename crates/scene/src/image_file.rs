//! Images of textures: files, which are located, decoded within limits and validated, and images in memory.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::error::LimitErrorKind;
use image::{DynamicImage, ImageError, ImageFormat};

use super::Problem;
use super::decode::{Channels, DecodeError, Format, Header, MAX_IMAGE_SIDE, decode};
use super::downsample::halved;
use super::key_path::list;
use super::texture::{Encoding, Image, Texels};
use crate::file_system::{AssetSource, FileSystem, NoFiles, or_current};
use crate::mesh::Mesh;
use wgray_image::color::srgb_to_linear;

/// Maximum size of a file in bytes.
const MAX_FILE_BYTES: u64 = 512 << 20;
/// Maximum component of a texel, equal to the maximum component of all colors.
const MAX_TEXEL: f32 = 1e6;

/// The images and meshes of a scene: the folder or source of files, and those in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Assets {
    /// Folder of the scene file; file names are relative to it.
    pub folder: PathBuf,
    /// Folder that must contain all files.
    pub root: PathBuf,
    /// Files outside of `root` that are allowed, by their absolute paths in the scene.
    pub elsewhere: BTreeSet<PathBuf>,
    /// Images in memory, by name. A texture uses an image in memory instead of a file with the same name.
    pub images: BTreeMap<String, Arc<Image>>,
    /// Encoded image files in memory, by name.
    pub encoded: BTreeMap<String, Arc<[u8]>>,
    /// Maximum side in texels of images in `encoded`. Larger images are halved until they fit.
    pub longest_side: Option<u32>,
    /// Reasons for missing image files, by the names that textures use.
    pub(super) absent: BTreeMap<String, String>,
    /// Meshes in memory, by name.
    pub meshes: BTreeMap<String, Arc<Mesh>>,
    /// True to report damage to a file as an error, instead of using a placeholder with a warning.
    pub strict: bool,
    pub(super) file_system: FileSystem,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum AssetKey {
    /// A canonical path.
    File(PathBuf),
    Memory(String),
    Encoded(String),
}

impl Default for Assets {
    /// Returns the assets of the current folder, without images in memory.
    fn default() -> Self {
        Assets::beside(Path::new("."))
    }
}

impl Assets {
    /// Returns the assets of a folder, without images in memory.
    pub fn beside(folder: &Path) -> Assets {
        let folder = or_current(folder);
        Assets {
            folder: folder.to_owned(),
            root: folder.to_owned(),
            elsewhere: BTreeSet::new(),
            images: BTreeMap::new(),
            encoded: BTreeMap::new(),
            longest_side: None,
            absent: BTreeMap::new(),
            meshes: BTreeMap::new(),
            strict: false,
            file_system: FileSystem::Disk,
        }
    }

    /// Returns the assets of a source, without images in memory. `folder` is relative to the source.
    pub fn from_source(source: impl AssetSource + 'static) -> Assets {
        Assets {
            folder: PathBuf::new(),
            root: PathBuf::new(),
            file_system: FileSystem::of(Arc::new(source)),
            ..Assets::default()
        }
    }

    /// Returns these assets with file names relative to another folder, which must also contain all files unless they
    /// are in a source.
    pub(super) fn in_folder(&self, folder: &Path) -> Assets {
        let mut assets = Assets {
            folder: folder.to_owned(),
            ..self.clone()
        };
        if self.file_system.is_disk() {
            assets.folder = or_current(folder).to_owned();
            assets.root = assets.folder.clone();
        }
        assets
    }

    /// Returns the warning about damage to a file, which names the placeholder.
    ///
    /// # Errors
    ///
    /// The damage itself if [`Assets::strict`] is set.
    pub(super) fn tolerate(&self, damage: Problem, stand_in: &str) -> Result<String, Problem> {
        match self.strict {
            true => Err(damage),
            false => Ok(format!("{}; {stand_in}", damage.message)),
        }
    }

    /// Returns an image in memory, which must have this `encoding` if given. `fits` checks the header first. The error
    /// is the value with the violated rule.
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

    /// Reads an image; `fits` checks the header first. The error is the value with the violated rule.
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
        let is_named = matches!(key, AssetKey::File(_));
        let format = Format::of(&bytes).ok_or_else(|| {
            Problem::damage(match is_named {
                true => format!("{file:?} must be a PNG, JPEG, WebP, KTX2, EXR or HDR file"),
                false => format!("{file:?} must be a PNG, JPEG, WebP or KTX2 file"),
            })
        })?;
        if is_named {
            check_name(file, format)?;
        }
        let is_float = matches!(format, Format::Image(ImageFormat::OpenExr | ImageFormat::Hdr));
        if is_float && encoding == Some(Encoding::Srgb) {
            return Err(Problem::new(format!(
                "{file:?} must not be \"srgb\": files of type {} are linear",
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
            DecodeError::Large(rule) => Problem::new(format!("{file:?} {rule}")),
            DecodeError::Damaged(rule) => Problem::damage(format!("{file:?} {rule}")),
            DecodeError::Channels(channels) => Problem::new(format!("{file:?} {}", channels_message(&channels))),
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
            format: Some(format).filter(|_| is_named),
            default,
            encoding: encoding.unwrap_or(default),
            is_alpha: part == Part::Alpha,
            damage,
        })
    }

    /// Returns a file's name for messages: relative to the current folder if the file was named on the command line.
    fn display_name<'f>(&self, file: &'f str) -> &'f str {
        let is_from_command_line = self.elsewhere.contains(Path::new(file));
        let current_folder = std::env::current_dir().ok().filter(|_| is_from_command_line);
        let relative =
            current_folder.and_then(|current_folder| Path::new(file).strip_prefix(current_folder).ok()?.to_str());
        relative.unwrap_or(file)
    }

    pub(super) fn find(&self, file: &str) -> Result<AssetKey, Problem> {
        if let Some(reason) = self.absent.get(file) {
            return Err(Problem::damage(reason));
        }
        if self.images.contains_key(file) {
            return Ok(AssetKey::Memory(file.to_owned()));
        }
        if self.encoded.contains_key(file) {
            return Ok(AssetKey::Encoded(file.to_owned()));
        }
        let path = self.file_system.canonical_file(&self.folder.join(file));
        let path = path.map_err(|error| {
            let similar = self.file_system.in_other_case(&self.folder, file);
            let similar = similar
                .as_deref()
                .map(|similar| similar.strip_prefix(&self.folder).unwrap_or(similar));
            let hint = similar.map_or_else(String::new, |name| format!("; did you mean {name:?}?"));
            Problem::damage(unreadable(self.display_name(file), &error) + &hint).with_file(file, error.kind())
        })?;
        let root = self.file_system.canonical_folder(&self.root).map_err(|error| {
            let root = self.root.display();
            format!("{file:?} must lie in the asset root, {root}, which cannot be found: {error}; check --asset-root")
        })?;
        if !path.starts_with(&root) && !self.elsewhere.contains(Path::new(file)) {
            let root = self.root.display();
            return Err(Problem::new(match self.root == self.folder {
                true => format!(
                    "{file:?} lies outside of the scene's folder, {root}; pass --asset-root with a folder that contains both"
                ),
                false => format!(
                    "{file:?} resolves to {}, which is outside the asset root {root}; pass another --asset-root",
                    path.display()
                ),
            }));
        }
        if !self.file_system.is_file(&path) {
            return Err(Problem::new(format!("{file:?} must be a file")));
        }
        Ok(AssetKey::File(path))
    }

    fn read(&self, file: &str, path: &Path) -> Result<Vec<u8>, Problem> {
        let read = self.file_system.read(path, MAX_FILE_BYTES);
        read.map_err(|error| match error.kind() {
            io::ErrorKind::FileTooLarge => {
                Problem::new(format!("{file:?} must not be larger than {} MiB", MAX_FILE_BYTES >> 20))
            }
            // Not damage to the file, which a placeholder could replace.
            io::ErrorKind::OutOfMemory => Problem::new(unreadable(file, &error)).with_file(file, error.kind()),
            _ => Problem::damage(unreadable(file, &error)).with_file(file, error.kind()),
        })
    }
}

impl Image {
    /// Decodes a PNG, JPEG, WebP, KTX2, OpenEXR or Radiance HDR file in memory. `None` is the usual encoding of the
    /// format: linear for OpenEXR and HDR, otherwise sRGB. Invalid texels of floats are clamped to 0 to 1e6.
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

#[derive(Clone)]
pub(super) struct File {
    pub image: Arc<Image>,
    /// `None` for images in memory, whose names do not determine the format.
    format: Option<Format>,
    default: Encoding,
    encoding: Encoding,
    is_alpha: bool,
    pub damage: Option<String>,
}

/// The part of an image that a texture uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// Colors, decoded with this encoding if given.
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
    /// Returns true if the image is this part of its file, in the encoding that the part requests.
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
            "{file:?} must match its extension; it is a file of type {}",
            format.name()
        )),
        _ => Ok(()),
    }
}

fn unreadable(file: &str, error: &io::Error) -> String {
    format!("{file:?} cannot be read: {error}")
}

/// Returns the message about an invalid image, without the name of the image.
fn image_message(error: &ImageError) -> String {
    match error {
        ImageError::Limits(limit) if matches!(limit.kind(), LimitErrorKind::DimensionError) => {
            format!("must have at most {MAX_IMAGE_SIDE} texels along a side")
        }
        ImageError::Limits(_) => "requires more memory than its header declares".to_string(),
        ImageError::Unsupported(_) => format!("must have a supported format: {error}"),
        _ => format!("is damaged or truncated: {error}"),
    }
}

/// Returns the message about an EXR file without supported channels, without the name of the file.
fn channels_message(channels: &Channels) -> String {
    match channels.are_deep {
        true => "must have one value for each pixel and channel; deep images are not supported".to_owned(),
        false => format!(
            "must have the channels \"R\", \"G\" and \"B\", or a single channel; it has {}",
            list(&channels.names)
        ),
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
