//! Downscales glTF images to fit the texture memory.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use super::super::decode::{Format, Header, MAX_IMAGE_SIDE, decode};
use super::super::texture::{levels, words};
use super::super::validate::TEXEL_MEMORY;
use super::super::{Assets, Channel, Description, Encoding, MaterialDescription, TextureDescription, ValueDescription};

/// Limit on the number of decoded texels, which limits the loading time: a constant, and an allowance per byte of the
/// image files.
const TEXEL_LIMIT: (u64, u64) = (1 << 28, 64);
/// Memory reserved for other textures and the environment, in bytes.
const RESERVED_BYTES: u64 = 128 << 20;

struct ImportedImage {
    header: Header,
    /// Encoded size in bytes.
    length: u64,
    /// Number of decoded copies: up to one each of sRGB colors, linear data and alpha.
    copies: u64,
    /// True if a texture with this image needs mip levels.
    has_levels: bool,
}

impl ImportedImage {
    /// Returns the memory use in bytes if the image is halved until no side exceeds `max_side`.
    fn bytes(&self, max_side: u32) -> u64 {
        let Header {
            width,
            height,
            exceeds_8_bits,
        } = self.header;
        let halvings = (0..32).take_while(|i| width.max(height) >> i > max_side).count();
        let (width, height) = ((width >> halvings).max(1), (height >> halvings).max(1));
        let levels = if self.has_levels { levels(width, height) } else { 1 };
        4 * self.copies * words(width, height, levels, exceeds_8_bits)
    }
}

/// Returns the maximum image side with which all images fit into the texture memory, and the memory use of the images
/// at full size in bytes; `None` if the images fit at full size. The error is the violated rule.
pub fn longest_side(description: &Description, assets: &Assets) -> Result<Option<(u32, u64)>, String> {
    let images = imported_images(description, assets);
    let texels = |image: &ImportedImage| u64::from(image.header.width) * u64::from(image.header.height) * image.copies;
    let (texels, bytes) = images.iter().fold((0_u64, 0_u64), |(texels_before, bytes), image| {
        (texels_before.saturating_add(texels(image)), bytes + image.length)
    });
    let limit = TEXEL_LIMIT.0 + bytes * TEXEL_LIMIT.1;
    if texels > limit {
        return Err(format!(
            "the images of all glTF files have {texels} texels in total; for files of {bytes} bytes, at most {limit} are allowed"
        ));
    }
    let total_bytes = |max_side: u32| images.iter().map(|image| image.bytes(max_side)).sum::<u64>();
    let full_bytes = total_bytes(MAX_IMAGE_SIDE);
    if full_bytes <= TEXEL_MEMORY - RESERVED_BYTES {
        return Ok(None);
    }
    let mut max_side = MAX_IMAGE_SIDE;
    while max_side > 1 && total_bytes(max_side) > TEXEL_MEMORY - RESERVED_BYTES {
        max_side /= 2;
    }
    Ok(Some((max_side, full_bytes)))
}

/// Returns the images of the glTF files.
fn imported_images(description: &Description, assets: &Assets) -> Vec<ImportedImage> {
    let values = description.materials.values().flat_map(MaterialDescription::values);
    let alpha_textures: BTreeSet<&str> = values
        .filter_map(|value| match value {
            ValueDescription::Texture(reference) if reference.channel == Channel::A => Some(reference.texture.as_str()),
            _ => None,
        })
        .collect();
    // For each file, the required copies (`Some(is_linear)`, or `None` for alpha), and whether mip levels are required.
    let mut files: BTreeMap<&str, (BTreeSet<Option<bool>>, bool)> = BTreeMap::new();
    for (name, texture) in &description.textures {
        if let TextureDescription::Image(image) = texture {
            let (encodings, has_levels) = files.entry(&image.file).or_default();
            encodings.insert(Some(image.encoding == Some(Encoding::Linear)));
            if alpha_textures.contains(name.as_str()) {
                encodings.insert(None);
            }
            *has_levels |= image.filter.needs_levels();
        }
    }
    let images = files.into_iter().filter_map(|(file, (encodings, has_levels))| {
        let bytes = assets.encoded.get(file)?;
        Some(ImportedImage {
            header: header(bytes)?,
            length: bytes.len() as u64,
            copies: encodings.len() as u64,
            has_levels,
        })
    });
    images.collect()
}

/// Returns the header; `None` for unreadable images, which the decoder reports.
fn header(bytes: &[u8]) -> Option<Header> {
    let format = Format::of(bytes)?;
    let found = Cell::new(None);
    let _ = decode(bytes, format, |header| {
        found.set(Some(header));
        Err(String::new())
    });
    found.take()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImageTextureDescription, PerspectiveDescription};

    fn png(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_compression(png::Compression::Fast);
        let rows = vec![7; (width * height) as usize];
        encoder.write_header().unwrap().write_image_data(&rows).unwrap();
        bytes
    }

    #[test]
    fn images_are_halved_until_all_fit() {
        let camera = PerspectiveDescription::new([0.0, -1.0, 0.0], [0.0; 3], 40.0);
        let mut description = Description::new(1, 1, camera);
        let mut assets = Assets::default();
        assets.encoded.insert("large".to_owned(), png(8192, 4096).into());
        assets.encoded.insert("small".to_owned(), png(64, 64).into());
        let texture = |file: &str, encoding| {
            TextureDescription::Image(ImageTextureDescription {
                encoding: Some(encoding),
                ..ImageTextureDescription::new(file)
            })
        };
        // With mip levels, each encoding of "large" takes 180 MB, independent of the number of textures.
        for (name, encoding) in [("a", Encoding::Srgb), ("b", Encoding::Linear), ("c", Encoding::Srgb)] {
            description.textures.insert(name.to_owned(), texture("large", encoding));
        }
        description
            .textures
            .insert("d".to_owned(), texture("small", Encoding::Srgb));
        assert_eq!(longest_side(&description, &assets), Ok(None));
        for i in 0..4 {
            let name = format!("large {i}");
            let bytes = assets.encoded["large"].clone();
            assets.encoded.insert(name.clone(), bytes);
            description
                .textures
                .insert(name.clone(), texture(&name, Encoding::Srgb));
        }
        let (longest, bytes) = longest_side(&description, &assets).unwrap().unwrap();
        assert_eq!(longest, 4096);
        assert!((1.0e9..1.1e9).contains(&(bytes as f64)), "{bytes}");
        assets.longest_side = Some(16);
        let scene = description.validate_with(&assets).unwrap();
        let sizes = scene.textures.iter().map(|texture| match &texture.kind {
            crate::TextureKind::Image { image, .. } => (image.width, image.height),
            _ => (0, 0),
        });
        let sizes: BTreeSet<(u32, u32)> = sizes.collect();
        assert_eq!(sizes, BTreeSet::from([(16, 8), (16, 16)]));
    }
}
