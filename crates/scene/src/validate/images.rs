//! Images of textures and of the environment, each read once, with a limit on the total memory of the texels.

use std::sync::Arc;

use super::{BTreeMap, Checked, Problem};
use crate::decode::Header;
use crate::image_file::{AssetKey, File, Part};
use crate::texture::{levels, words, words_around};
use crate::{Assets, Image, ImageTextureDescription, Texels};

/// Limit on the total memory of all texels in their render format, in bytes.
pub(crate) const TEXEL_MEMORY: u64 = 1 << 30;

pub(super) struct Images<'a> {
    pub(super) assets: &'a Assets,
    /// False if the scene is invalid; images of 1 x 1 texels then replace the files.
    pub(super) reads_files: bool,
    /// Images by location, each with its size in 32-bit words.
    files: BTreeMap<AssetKey, Vec<(File, u64)>>,
    /// Total size of all images in bytes.
    taken: u64,
    /// Warnings about damaged files, without duplicates.
    pub(super) notes: Vec<String>,
}

impl<'a> Images<'a> {
    pub(super) fn new(assets: &'a Assets, reads_files: bool) -> Images<'a> {
        Images {
            assets,
            reads_files,
            files: BTreeMap::new(),
            taken: 0,
            notes: Vec::new(),
        }
    }

    /// Warns of a damaged file, or returns an error ([`Assets::tolerate`]).
    pub(super) fn tolerate(&mut self, damage: Problem, stand_in: &str) -> Checked<()> {
        let note = self.assets.tolerate(damage, stand_in)?;
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
        Ok(())
    }

    pub(super) fn image(&mut self, texture: &ImageTextureDescription, part: Part) -> Checked<Arc<Image>> {
        let needs_levels = texture.filter.needs_levels();
        self.with_words(&texture.file, part, |header| {
            let Header { width, height, is_deep } = header;
            let levels = if needs_levels { levels(width, height) } else { 1 };
            words(width, height, levels, is_deep)
        })
    }

    /// Returns the environment map, which is stored separately from a texture with the same file.
    pub(super) fn around(&mut self, file: &str) -> Checked<Arc<Image>> {
        let others = self.taken;
        let image = self.with_words(file, Part::Colors(None), |header| {
            words_around(header.width, header.height)
        })?;
        let words = words_around(image.width, image.height);
        // The size of the file was counted as the size of a texture.
        if self.taken - others < 4 * words {
            let bytes = others + 4 * words;
            if bytes > TEXEL_MEMORY {
                return Err(too_much(file, (image.width, image.height), 4 * words, others).into());
            }
            self.taken = bytes;
        }
        Ok(image)
    }

    pub(super) fn own(&mut self, name: &str, image: &Image) -> Result<(), String> {
        let bytes = 4 * words_around(image.width, image.height);
        if self.taken + bytes > TEXEL_MEMORY {
            return Err(too_much(name, (image.width, image.height), bytes, self.taken));
        }
        self.taken += bytes;
        Ok(())
    }

    /// Returns an image. `wanted` returns the size of the image in 32-bit words.
    fn with_words(&mut self, file: &str, part: Part, wanted: impl Fn(Header) -> u64) -> Checked<Arc<Image>> {
        let place = self.assets.find(file)?;
        if !self.reads_files {
            return Ok(Arc::new(Image {
                width: 1,
                height: 1,
                texels: Texels::Floats(vec![[0.0; 3]]),
            }));
        }
        let taken = self.taken;
        // `before` is the size that is counted already.
        let fits = |header: Header, before: u64| {
            let words = wanted(header).max(before);
            let (bytes, others) = (4 * words, taken - 4 * before);
            match bytes + others <= TEXEL_MEMORY {
                true => Ok(words),
                false => Err(too_much(file, (header.width, header.height), bytes, others)),
            }
        };
        let known = self
            .files
            .get_mut(&place)
            .and_then(|files| files.iter_mut().find(|(known, _)| known.is(part)));
        if let Some((known, before)) = known {
            known.check_name(file)?;
            let words = fits(Header::of(&known.image), *before)?;
            self.taken += 4 * (words - *before);
            *before = words;
            return Ok(Arc::clone(&known.image));
        }
        let read = self
            .assets
            .image(file, &place, part, |header| fits(header, 0).map(|_| ()))?;
        if let Some(damage) = &read.damage {
            self.tolerate(Problem::damage(damage), "they are clamped")?;
        }
        let words = fits(Header::of(&read.image), 0)?;
        let known = self.files.entry(place).or_default();
        self.taken += 4 * words;
        let image = Arc::clone(&read.image);
        known.push((read, words));
        Ok(image)
    }
}

fn too_much(file: &str, (width, height): (u32, u32), bytes: u64, others: u64) -> String {
    let mib = |bytes: u64| format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20));
    let (bytes, others, limit) = (mib(bytes), mib(others), mib(TEXEL_MEMORY));
    format!(
        "{file:?} ({width} x {height} texels) needs {bytes} and the textures before it {others}; the limit is {limit}"
    )
}
