//! KTX 2 files with Basis Universal texels, which glTF files reference by `KHR_texture_basisu` (Khronos Group, "KTX
//! File Format Specification", version 2.0.4). Every length is checked here, because the decoders allocate memory
//! according to the header.

use std::io::Read as _;
use std::ops::Range;

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use image::{DynamicImage, ImageBuffer, RgbaImage};
use ruzstd::decoding::StreamingDecoder;

use super::super::KTX2_IDENTIFIER as IDENTIFIER;
use wgray_image::panic_guard::catch_panic;

/// Position of the index of levels (section 2), and the size of an entry of the index, in bytes.
const INDEX: usize = 80;
const ENTRY: usize = 24;
/// Window size of a Zstandard frame that is always accepted, in bytes (RFC 8878, section 3.1.1.1.2). Larger windows are
/// only accepted for larger images.
const MIN_WINDOW_LIMIT: u64 = 8 << 20;

/// The supercompression schemes (section 3.2).
const NONE: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// Color models and channels (Khronos Data Format Specification 1.3, sections 5.6.9 and 5.6.10).
const ETC1S: u8 = 163;
const UASTC: u8 = 166;
const RGB: u8 = 0;
const UASTC_RGBA: u8 = 3;
const ETC1S_ALPHA: u8 = 15;

/// A file with a valid header.
#[derive(Debug)]
pub(crate) struct Ktx2<'a> {
    bytes: &'a [u8],
    /// Width of the largest level.
    pub width: u32,
    /// Height of the largest level.
    pub height: u32,
    pub has_alpha: bool,
    supercompression: u32,
    descriptor: Range<usize>,
    level: Range<usize>,
    /// Length in bytes of the largest level after Zstandard decompression.
    decompressed_size: usize,
}

/// Returns the name of a channel of a color model.
fn channel_name(model: u8, id: u8) -> String {
    let name = match (model, id) {
        (_, RGB) => "RGB",
        (UASTC, UASTC_RGBA) => "RGBA",
        (ETC1S, ETC1S_ALPHA) => "AAA",
        (ETC1S, 3) | (UASTC, 4) => "RRR",
        (ETC1S, 4) => "GGG",
        (UASTC, 5) => "RRRG",
        _ => return format!("channel id {id}"),
    };
    name.to_owned()
}

fn damaged(reason: impl std::fmt::Display) -> String {
    format!("is damaged or truncated: {reason}")
}

fn read_bytes<const N: usize>(bytes: &[u8], offset: usize) -> Result<[u8; N], String> {
    let found = bytes.get(offset..offset + N).and_then(|bytes| bytes.try_into().ok());
    found.ok_or_else(|| damaged("the KTX2 header ends early"))
}

fn read_u32(bytes: &[u8], offset: usize) -> Result<u32, String> {
    Ok(u32::from_le_bytes(read_bytes(bytes, offset)?))
}

fn read_u64(bytes: &[u8], offset: usize) -> Result<u64, String> {
    Ok(u64::from_le_bytes(read_bytes(bytes, offset)?))
}

fn checked_range(bytes: &[u8], name: &str, offset: u64, length: u64) -> Result<Range<usize>, String> {
    let end = offset.checked_add(length).filter(|end| *end <= bytes.len() as u64);
    let end = end.ok_or_else(|| {
        damaged(format!(
            "{name} must be inside the file; its offset is {offset}, its length {length}"
        ))
    })?;
    Ok(offset as usize..end as usize)
}

/// Returns true if a file is valid and has alpha; `None` if the file is not a KTX 2 file.
pub(crate) fn has_alpha(bytes: &[u8]) -> Option<bool> {
    let is_ktx2 = bytes.starts_with(IDENTIFIER);
    is_ktx2.then(|| Ktx2::parse(bytes).is_ok_and(|file| file.has_alpha))
}

impl<'a> Ktx2<'a> {
    /// Checks the header. The error is the violated rule, which follows the file's name in messages.
    pub fn parse(bytes: &'a [u8]) -> Result<Ktx2<'a>, String> {
        let [format, _, width, height, depth, layers, faces, levels, supercompression] = {
            let mut fields = [0; 9];
            for (i, field) in fields.iter_mut().enumerate() {
                *field = read_u32(bytes, IDENTIFIER.len() + 4 * i)?;
            }
            fields
        };
        if width == 0 || height == 0 || depth != 0 || layers > 1 || faces != 1 {
            return Err("must contain one 2D image, not an array, a cube map or a volume".to_owned());
        }
        let descriptor = checked_range(
            bytes,
            "the data format descriptor",
            read_u32(bytes, 48)?.into(),
            read_u32(bytes, 52)?.into(),
        )?;
        let descriptor_bytes = &bytes[descriptor.clone()];
        let model = descriptor_bytes.get(12).copied().unwrap_or(0);
        let is_supported = matches!((model, supercompression), (ETC1S, BASIS_LZ) | (UASTC, NONE | ZSTANDARD));
        if format != 0 || !is_supported {
            return Err(format!(
                "must contain ETC1S texels with BasisLZ, or UASTC texels with or without Zstandard; it has \
                 format {format}, color model {model} and supercompression {supercompression}"
            ));
        }
        // The descriptor has a header of 28 bytes, and 16 bytes for each channel.
        let channels: Vec<u8> = match descriptor_bytes.len() {
            44 | 60 => (descriptor_bytes[28..].chunks(16))
                .map(|channel| channel[3] & 15)
                .collect(),
            length => return Err(damaged(format!("the data format descriptor has {length} bytes"))),
        };
        let has_alpha = match (model, &channels[..]) {
            (_, [RGB]) => false,
            (ETC1S, [RGB, ETC1S_ALPHA]) | (UASTC, [UASTC_RGBA]) => true,
            _ => {
                let names: Vec<String> = channels.iter().map(|id| channel_name(model, *id)).collect();
                let names = names.join(", ");
                return Err(format!("must have the channels RGB or RGBA; it has {names}"));
            }
        };
        if !(1..=16).contains(&levels) {
            return Err(damaged(format!("it has {levels} levels")));
        }
        let level = checked_range(bytes, "level 0", read_u64(bytes, INDEX)?, read_u64(bytes, INDEX + 8)?)?;
        let decompressed_size = read_u64(bytes, INDEX + 16)?;
        let blocks = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4));
        let expected_length = blocks.saturating_mul(16);
        let length = match supercompression {
            NONE => level.len() as u64,
            ZSTANDARD => decompressed_size,
            _ => expected_length,
        };
        if length != expected_length {
            let rule = format!("{width} x {height} UASTC texels have {expected_length} bytes, not {length}");
            return Err(damaged(rule));
        }
        checked_range(bytes, "the global data", read_u64(bytes, 64)?, read_u64(bytes, 72)?)?;
        Ok(Ktx2 {
            bytes,
            width,
            height,
            has_alpha,
            supercompression,
            descriptor,
            level,
            decompressed_size: decompressed_size as usize,
        })
    }

    /// Decodes the largest level, to 8 bits per channel. In messages, the error follows the file's name.
    pub fn decode(&self) -> Result<DynamicImage, String> {
        let decompressed;
        let bytes = match self.supercompression {
            ZSTANDARD => {
                let file = catch_panic(|| self.decompressed());
                decompressed = file.and_then(|file| file).map_err(damaged)?;
                &decompressed
            }
            _ => self.bytes,
        };
        let texels = catch_panic(|| {
            let file = Transcoder::new(bytes)?;
            file.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
        });
        let texels = texels.map_err(damaged)?;
        let texels = texels.map_err(|_| damaged("its Basis Universal data cannot be decoded"))?;
        let image: Option<RgbaImage> = ImageBuffer::from_raw(self.width, self.height, texels);
        let image = DynamicImage::ImageRgba8(image.ok_or_else(|| damaged("it has too few texels"))?);
        Ok(match self.has_alpha {
            true => image,
            false => DynamicImage::ImageRgb8(image.into_rgb8()),
        })
    }

    /// Returns the file with only the largest level, decompressed. The decompression of the crate `basisu` 0.1.0 is not
    /// used, because it depends on ruzstd 0.7, which does not limit the length of a block.
    fn decompressed(&self) -> Result<Vec<u8>, String> {
        let message = |cause: &dyn std::fmt::Display| format!("its Zstandard data cannot be decompressed: {cause}");
        let window = (self.decompressed_size as u64)
            .next_power_of_two()
            .max(MIN_WINDOW_LIMIT);
        let data = &self.bytes[self.level.clone()];
        let mut data = StreamingDecoder::new_with_max_window_size(data, window).map_err(|cause| message(&cause))?;
        let descriptor = &self.bytes[self.descriptor.clone()];
        let index_end = INDEX + ENTRY;
        let start = (index_end + descriptor.len()).next_multiple_of(16);
        let mut file = vec![0; start + self.decompressed_size];
        file[..40].copy_from_slice(&self.bytes[..40]);
        for (offset, value) in [
            (40, 1),
            (44, NONE),
            (48, index_end as u32),
            (52, descriptor.len() as u32),
        ] {
            file[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
        }
        for (offset, value) in [(0, start), (8, self.decompressed_size), (16, self.decompressed_size)] {
            file[INDEX + offset..INDEX + offset + 8].copy_from_slice(&(value as u64).to_le_bytes());
        }
        file[index_end..index_end + descriptor.len()].copy_from_slice(descriptor);
        data.read_exact(&mut file[start..]).map_err(|cause| message(&cause))?;
        match data.read(&mut [0]) {
            Ok(0) => Ok(file),
            Ok(_) => Err(message(&"it is longer than its header declares")),
            Err(cause) => Err(message(&cause)),
        }
    }
}

#[cfg(test)]
mod tests;
