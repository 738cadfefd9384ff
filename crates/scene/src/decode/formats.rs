//! The formats of the cargo feature `formats`: OpenEXR, WebP and KTX 2.

mod gray_exr;
pub(super) mod ktx2;

use std::cell::Cell;

use image::{DynamicImage, ImageFormat};

use self::gray_exr::gray_exr;
use self::ktx2::Ktx2;
use super::{
    DECODED_LIMIT, DecodeError, Format, Header, check_decoded_size, check_header, check_sides, decode_with_reader,
};

/// Memory limit in bytes for texels of an EXR display window outside of the stored data window, because a small file
/// may declare a huge display window. The limit increases with the file size like [`DECODED_LIMIT`].
const UNSTORED_TEXELS_LIMIT: u64 = 64 << 20;

pub(super) fn decode(
    bytes: &[u8],
    format: Format,
    fits: impl Fn(Header) -> Result<(), String>,
) -> Result<DynamicImage, DecodeError> {
    match format {
        Format::Image(ImageFormat::OpenExr) => decode_exr(bytes, fits),
        Format::Image(format) => decode_with_reader(bytes, format, fits, |_| Ok(())),
        Format::Ktx2 => decode_ktx2(bytes, fits),
    }
}

fn decode_exr(bytes: &[u8], fits: impl Fn(Header) -> Result<(), String>) -> Result<DynamicImage, DecodeError> {
    // Number of texels that an EXR file stores; the display window may have a different size.
    let stored = Cell::new(0);
    let gray = gray_exr(
        bytes,
        |size, bytes_per_pixel| {
            stored.set(stored.get() + u64::from(size.0) * u64::from(size.1));
            check_sides(size).and_then(|()| check_decoded_size(bytes, size, bytes_per_pixel))
        },
        |header| {
            check_header(header, &fits)?;
            check_decoded_size(bytes, (header.width, header.height), 3 * size_of::<f32>() as u64)
        },
    )?;
    match gray {
        Some(image) => Ok(image),
        None => decode_with_reader(bytes, ImageFormat::OpenExr, fits, |size| {
            check_unstored_size(bytes, size, stored.get())
        }),
    }
}

/// Rejects an EXR file that declares too many texels without storing them.
fn check_unstored_size(file: &[u8], (width, height): (u32, u32), stored: u64) -> Result<(), DecodeError> {
    let unstored = (u64::from(width) * u64::from(height)).saturating_sub(stored);
    let (bytes, length) = (unstored * 3 * size_of::<f32>() as u64, file.len() as u64);
    let limit = UNSTORED_TEXELS_LIMIT + length * DECODED_LIMIT.1;
    match bytes <= limit {
        true => Ok(()),
        false => Err(DecodeError::unsupported(format!(
            "declares {width} x {height} texels and stores {stored}; the missing texels need {bytes} bytes; the limit for a file of {length} bytes is {limit} bytes"
        ))),
    }
}

fn decode_ktx2(bytes: &[u8], fits: impl Fn(Header) -> Result<(), String>) -> Result<DynamicImage, DecodeError> {
    let damaged = |rule| DecodeError::File { rule, is_damage: true };
    let file = Ktx2::parse(bytes).map_err(damaged)?;
    let (width, height) = (file.width, file.height);
    let header = Header {
        width,
        height,
        exceeds_8_bits: false,
    };
    check_header(header, fits)?;
    check_decoded_size(bytes, (width, height), 4)?;
    file.decode().map_err(damaged)
}
