//! Images of textures and of the environment, each read once, with a limit on the total memory of the texels.

use std::sync::Arc;

use super::{BTreeMap, Checked, Problem};
use crate::assets::AssetKey;
use crate::decode::Header;
use crate::image_file::{File, Part};
use crate::texture::{environment_words, levels, words};
use crate::{Assets, Image, ImageTextureDescription, Texels};

/// Limit on the total memory of all texels in their render format, in bytes.
pub(crate) const TEXEL_MEMORY: u64 = 1 << 30;

/// The images that a scene refers to, and their total size.
pub(super) struct Images<'a> {
    pub(super) assets: &'a Assets,
    /// False if the scene is invalid; images of 1 x 1 texels then replace the files.
    pub(super) reads_files: bool,
    /// Images by location, each with its size in 32-bit words.
    files: BTreeMap<AssetKey, Vec<(File, u64)>>,
    /// Total size of all images in bytes.
    used_bytes: u64,
    /// Warnings about damaged files, without duplicates.
    pub(super) notes: Vec<String>,
}

impl<'a> Images<'a> {
    pub(super) fn new(assets: &'a Assets, reads_files: bool) -> Images<'a> {
        Images {
            assets,
            reads_files,
            files: BTreeMap::new(),
            used_bytes: 0,
            notes: Vec::new(),
        }
    }

    /// Adds a warning about a damaged file, or returns an error in strict mode ([`Assets::tolerate`]).
    pub(super) fn tolerate(&mut self, damage: Problem, placeholder: &str) -> Checked<()> {
        let note = self.assets.tolerate(damage, placeholder)?;
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
        Ok(())
    }

    pub(super) fn image(&mut self, texture: &ImageTextureDescription, part: Part) -> Checked<Arc<Image>> {
        let needs_levels = texture.filter.needs_levels();
        self.with_words(&texture.file, part, |header| {
            let Header {
                width,
                height,
                exceeds_8_bits,
            } = header;
            let levels = if needs_levels { levels(width, height) } else { 1 };
            words(width, height, levels, exceeds_8_bits)
        })
    }

    /// Returns the environment map, which is stored separately from a texture with the same file.
    pub(super) fn environment_map(&mut self, file: &str) -> Checked<Arc<Image>> {
        let other_bytes = self.used_bytes;
        let image = self.with_words(file, Part::Colors(None), |header| {
            environment_words(header.width, header.height)
        })?;
        let words = environment_words(image.width, image.height);
        // A texture with the same file was counted before; the environment map is stored in addition.
        if self.used_bytes - other_bytes < 4 * words {
            let bytes = other_bytes + 4 * words;
            if bytes > TEXEL_MEMORY {
                return Err(size_error(file, (image.width, image.height), 4 * words, other_bytes).into());
            }
            self.used_bytes = bytes;
        }
        Ok(image)
    }

    /// Adds the size of a built-in environment map to the total size.
    pub(super) fn count_builtin(&mut self, name: &str, image: &Image) -> Result<(), String> {
        let bytes = 4 * environment_words(image.width, image.height);
        if self.used_bytes + bytes > TEXEL_MEMORY {
            return Err(size_error(name, (image.width, image.height), bytes, self.used_bytes));
        }
        self.used_bytes += bytes;
        Ok(())
    }

    /// Returns an image and counts its size. `words_of` returns the size of the image in 32-bit words.
    fn with_words(&mut self, file: &str, part: Part, words_of: impl Fn(Header) -> u64) -> Checked<Arc<Image>> {
        let asset = self.assets.find(file)?;
        if !self.reads_files {
            return Ok(Arc::new(Image {
                width: 1,
                height: 1,
                texels: Texels::Floats(vec![[0.0; 3]]),
            }));
        }
        let used_bytes = self.used_bytes;
        // `counted` is the size in words that `used_bytes` already contains.
        let fits = |header: Header, counted: u64| {
            let words = words_of(header).max(counted);
            let (bytes, other_bytes) = (4 * words, used_bytes - 4 * counted);
            match bytes + other_bytes <= TEXEL_MEMORY {
                true => Ok(words),
                false => Err(size_error(file, (header.width, header.height), bytes, other_bytes)),
            }
        };
        let cached = self
            .files
            .get_mut(&asset)
            .and_then(|files| files.iter_mut().find(|(cached, _)| cached.contains(part)));
        if let Some((cached, counted)) = cached {
            cached.check_name(file)?;
            let words = fits(Header::of(&cached.image), *counted)?;
            self.used_bytes += 4 * (words - *counted);
            *counted = words;
            return Ok(Arc::clone(&cached.image));
        }
        let decoded = self
            .assets
            .image(file, &asset, part, |header| fits(header, 0).map(|_| ()))?;
        if let Some(damage) = &decoded.damage {
            self.tolerate(Problem::damage(damage), "they are clamped")?;
        }
        let words = fits(Header::of(&decoded.image), 0)?;
        let files = self.files.entry(asset).or_default();
        self.used_bytes += 4 * words;
        let image = Arc::clone(&decoded.image);
        files.push((decoded, words));
        Ok(image)
    }
}

fn size_error(file: &str, (width, height): (u32, u32), bytes: u64, other_bytes: u64) -> String {
    let mib = |bytes: u64| format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20));
    let (bytes, other_bytes, limit) = (mib(bytes), mib(other_bytes), mib(TEXEL_MEMORY));
    format!(
        "{file:?} ({width} x {height} texels) needs {bytes}, in addition to {other_bytes} for the previous textures; the limit is {limit}"
    )
}
