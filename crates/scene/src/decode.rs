//! Decodes image files. The size in the header is checked against limits before any texel is decoded.

#[cfg(feature = "formats")]
mod formats;

use std::io::Cursor;
use std::path::Path;

use image::error::{DecodingError, LimitError, LimitErrorKind};
use image::{DynamicImage, ImageBuffer, ImageDecoder as _, ImageError, ImageFormat, ImageReader, Limits};

use super::texture::{Image, Texels};

/// Maximum number of texels along a side.
pub(super) const MAX_IMAGE_SIDE: u32 = 16_384;
/// Memory limit of the PNG decoder in bytes, not counting the image.
const MAX_DECODER_BYTES: usize = 64 << 20;

/// Limit on the decoded size in bytes: a constant, plus an allowance per byte of the file, because a small file may
/// declare 16,384 x 16,384 texels. A decoder may use twice this limit in total.
const DECODED_LIMIT: (u64, u64) = (256 << 20, 32);

/// First bytes of a KTX 2 file (Khronos Group, "KTX File Format Specification", version 2.0.4, section 3.1).
const KTX2_IDENTIFIER: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Format of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// A format of the crate `image`.
    Image(ImageFormat),
    /// KTX 2 with Basis Universal texels.
    Ktx2,
}

/// The supported formats, and their names in messages.
const FORMATS: [(Format, &str); 6] = [
    (Format::Image(ImageFormat::Png), "PNG"),
    (Format::Image(ImageFormat::Jpeg), "JPEG"),
    (Format::Image(ImageFormat::WebP), "WebP"),
    (Format::Ktx2, "KTX2"),
    (Format::Image(ImageFormat::OpenExr), "EXR"),
    (Format::Image(ImageFormat::Hdr), "HDR"),
];

impl Format {
    /// Detects the format from the first bytes of a file; `None` if the format is not supported.
    pub fn of(bytes: &[u8]) -> Option<Format> {
        let format = match bytes.starts_with(KTX2_IDENTIFIER) {
            true => Format::Ktx2,
            false => Format::Image(image::guess_format(bytes).ok()?),
        };
        let is_supported = FORMATS.iter().any(|(supported, _)| *supported == format);
        is_supported.then_some(format)
    }

    /// Returns the format that belongs to the extension of a file name, whether or not the format is supported.
    pub fn of_name(file: &str) -> Option<Format> {
        let extension = Path::new(file).extension()?;
        match extension.eq_ignore_ascii_case("ktx2") {
            true => Some(Format::Ktx2),
            false => ImageFormat::from_path(file).ok().map(Format::Image),
        }
    }

    pub fn name(self) -> &'static str {
        let found = FORMATS.iter().find(|(supported, _)| *supported == self);
        found.map_or("unknown", |(_, name)| name)
    }
}

/// Size and precision of an image, from its header, before its texels are decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub width: u32,
    pub height: u32,
    /// True if the values have more than 8 bits.
    pub exceeds_8_bits: bool,
}

impl Header {
    pub fn of(image: &Image) -> Header {
        Header {
            width: image.width,
            height: image.height,
            exceeds_8_bits: matches!(image.texels, Texels::Floats(_)),
        }
    }
}

pub(super) enum DecodeError {
    Image(ImageError),
    /// The caller's rule for headers is violated.
    Rule(String),
    /// A limit, or a rule of the format, is violated. The rule follows the file's name.
    File {
        rule: String,
        is_damage: bool,
    },
}

impl DecodeError {
    fn unsupported(rule: String) -> DecodeError {
        DecodeError::File { rule, is_damage: false }
    }
}

impl From<ImageError> for DecodeError {
    fn from(error: ImageError) -> Self {
        DecodeError::Image(error)
    }
}

impl From<png::DecodingError> for DecodeError {
    fn from(error: png::DecodingError) -> Self {
        DecodeError::Image(match error {
            png::DecodingError::LimitsExceeded => LimitErrorKind::InsufficientMemory.into_error(),
            other => ImageError::Decoding(DecodingError::new(ImageFormat::Png.into(), other)),
        })
    }
}

trait IntoError {
    fn into_error(self) -> ImageError;
}

impl IntoError for LimitErrorKind {
    fn into_error(self) -> ImageError {
        ImageError::Limits(LimitError::from_kind(self))
    }
}

/// Decodes an image if `fits` accepts its header. The result has the value type of the file.
pub(super) fn decode(
    bytes: &[u8],
    format: Format,
    fits: impl Fn(Header) -> Result<(), String>,
) -> Result<DynamicImage, DecodeError> {
    match format {
        Format::Image(ImageFormat::Png) => decode_png(bytes, fits),
        Format::Image(format @ (ImageFormat::Jpeg | ImageFormat::Hdr)) => {
            decode_with_reader(bytes, format, fits, |_| Ok(()))
        }
        #[cfg(feature = "formats")]
        _ => formats::decode(bytes, format, fits),
        #[cfg(not(feature = "formats"))]
        _ => Err(DecodeError::unsupported(format!(
            "cannot be decoded: {}",
            wgray_image::formats::rule(format.name())
        ))),
    }
}

/// Decodes an image with the crate `image`. `check_size` checks the size before texels are decoded.
fn decode_with_reader(
    bytes: &[u8],
    format: ImageFormat,
    fits: impl Fn(Header) -> Result<(), String>,
    check_size: impl Fn((u32, u32)) -> Result<(), DecodeError>,
) -> Result<DynamicImage, DecodeError> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(MAX_IMAGE_SIDE);
    limits.max_image_height = Some(MAX_IMAGE_SIDE);
    reader.limits(limits);
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let exceeds_8_bits = color.bytes_per_pixel() > color.channel_count();
    let header = Header {
        width,
        height,
        exceeds_8_bits,
    };
    check_header(header, &fits)?;
    check_decoded_size(bytes, (width, height), color.bytes_per_pixel().into())?;
    check_size((width, height))?;
    Ok(DynamicImage::from_decoder(decoder)?)
}

/// Returns true if an image has alpha; false for unreadable images, which [`decode`] reports.
pub(super) fn has_alpha(bytes: &[u8]) -> bool {
    #[cfg(feature = "formats")]
    if let Some(has_alpha) = formats::ktx2::has_alpha(bytes) {
        return has_alpha;
    }
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let decoder = reader.ok().and_then(|reader| reader.into_decoder().ok());
    decoder.is_some_and(|decoder| decoder.color_type().has_alpha())
}

/// Rejects an image that is too large for the size of its file.
fn check_decoded_size(file: &[u8], (width, height): (u32, u32), bytes_per_texel: u64) -> Result<(), DecodeError> {
    let bytes = u64::from(width) * u64::from(height) * bytes_per_texel;
    let length = file.len() as u64;
    let limit = DECODED_LIMIT.0 + length * DECODED_LIMIT.1;
    match bytes <= limit {
        true => Ok(()),
        false => Err(DecodeError::unsupported(format!(
            "has {width} x {height} texels and needs {bytes} bytes; the limit for a file of {length} bytes is {limit} bytes"
        ))),
    }
}

fn check_sides((width, height): (u32, u32)) -> Result<(), DecodeError> {
    match width.max(height) <= MAX_IMAGE_SIDE {
        true => Ok(()),
        false => Err(LimitErrorKind::DimensionError.into_error().into()),
    }
}

fn check_header(header: Header, fits: impl Fn(Header) -> Result<(), String>) -> Result<(), DecodeError> {
    check_sides((header.width, header.height))?;
    fits(header).map_err(DecodeError::Rule)
}

/// Decodes a PNG file with the crate `png`, which can skip color profiles and text chunks, whose decompressed size is
/// unknown.
fn decode_png(bytes: &[u8], fits: impl Fn(Header) -> Result<(), String>) -> Result<DynamicImage, DecodeError> {
    let mut options = png::DecodeOptions::default();
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    let mut decoder = png::Decoder::new_with_options(Cursor::new(bytes), options);
    decoder.set_limits(png::Limits {
        bytes: MAX_DECODER_BYTES,
    });
    decoder.set_transformations(png::Transformations::EXPAND); // palettes to colors, values to at least 8 bits
    let info = decoder.read_header_info()?;
    let (width, height) = (info.width, info.height);
    let is_16_bit = info.bit_depth == png::BitDepth::Sixteen;
    let header = Header {
        width,
        height,
        exceeds_8_bits: is_16_bit,
    };
    check_header(header, fits)?;
    let mut reader = decoder.read_info()?;
    let size = reader.output_buffer_size();
    let (color, depth) = reader.output_color_type();
    let bytes_per_texel = color.samples() as u64 * if depth == png::BitDepth::Sixteen { 2 } else { 1 };
    check_decoded_size(bytes, (width, height), bytes_per_texel)?;
    let mut values = vec![0; size.ok_or_else(|| LimitErrorKind::InsufficientMemory.into_error())?];
    reader.next_frame(&mut values)?;
    let color = reader.output_color_type().0;
    let image = match is_16_bit {
        true => {
            let values_u16 = values
                .chunks_exact(2)
                .map(|pair| u16::from_be_bytes([pair[0], pair[1]]));
            let values_u16: Vec<u16> = values_u16.collect();
            drop(values);
            match color {
                png::ColorType::Grayscale => {
                    ImageBuffer::from_raw(width, height, values_u16).map(DynamicImage::ImageLuma16)
                }
                png::ColorType::GrayscaleAlpha => {
                    ImageBuffer::from_raw(width, height, values_u16).map(DynamicImage::ImageLumaA16)
                }
                png::ColorType::Rgba => ImageBuffer::from_raw(width, height, values_u16).map(DynamicImage::ImageRgba16),
                _ => ImageBuffer::from_raw(width, height, values_u16).map(DynamicImage::ImageRgb16),
            }
        }
        false => match color {
            png::ColorType::Grayscale => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLuma8),
            png::ColorType::GrayscaleAlpha => {
                ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLumaA8)
            }
            png::ColorType::Rgba => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgba8),
            _ => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgb8),
        },
    };
    image.ok_or_else(|| LimitErrorKind::InsufficientMemory.into_error().into())
}
