//! Image file decoding. The format is detected from the first bytes, not from the name.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read as _, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use image::{DynamicImage, ImageDecoder as _, ImageFormat, ImageReader, Limits};

use super::{Channel, Kind, Picture, Plane};
use crate::blocking_path;
use crate::formats;
use crate::memory::fallible;

/// Memory limit of a decoder in addition to the image, in bytes.
const MAX_DECODER_BYTES: usize = 64 << 20;

/// Maximum pixel count per byte of a JPEG: each block of 8 x 8 values takes at least one bit and covers up to 32 x 32
/// pixels.
const MAX_JPEG_PIXELS_PER_BYTE: u64 = 8 * 32 * 32;

/// Limit on the decoded size in bytes: a constant, plus an allowance per byte of the file. Without the limit, a small
/// file could decode to 65,536 x 65,536 zeros.
const MAX_BYTES: (u64, u64) = (1 << 30, 256);

/// Why a file cannot be read as an image.
#[derive(Debug, thiserror::Error)]
pub enum Unreadable {
    /// The file cannot be opened or read. The error is not the `source`, because the message contains its text.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// The path is a directory.
    #[error("is a directory, not an image file")]
    Folder,
    /// The file is empty.
    #[error("is empty")]
    Empty,
    /// The first bytes match no known format.
    #[error("is not an image: it must be a PNG, EXR, JPEG, WebP or Radiance HDR file")]
    Format,
    /// The image is damaged.
    #[error("is damaged or truncated: {0}")]
    Damaged(String),
    /// The format variant is not supported.
    #[error("is not supported: {0}")]
    Kind(String),
    /// The image has too many pixels.
    #[error("has {width} x {height} pixels; the limit is {limit} pixels")]
    Pixels {
        /// Number of columns.
        width: u64,
        /// Number of rows.
        height: u64,
        /// Maximum number of pixels.
        limit: u64,
    },
    /// The image takes far more memory than its file has bytes.
    #[error(
        "has {width} x {height} pixels, which take {bytes} bytes; the limit for a file of {length} bytes is {limit} bytes"
    )]
    Large {
        /// Number of columns.
        width: u64,
        /// Number of rows.
        height: u64,
        /// Size of the values in bytes.
        bytes: u64,
        /// Size of the file in bytes.
        length: u64,
        /// Maximum size of the values in bytes.
        limit: u64,
    },
    /// The image does not fit into memory.
    #[error("does not fit into memory: {width} x {height} pixels take {bytes} bytes")]
    Memory {
        /// Number of columns.
        width: u64,
        /// Number of rows.
        height: u64,
        /// Size of the values in bytes.
        bytes: u64,
    },
}

pub(super) trait Source: BufRead + Seek {}
impl<T: BufRead + Seek> Source for T {}

impl Picture {
    /// Reads an image; `-` is standard input.
    ///
    /// # Errors
    ///
    /// [`Unreadable`], with the reason.
    pub fn read(path: &Path) -> Result<Picture, Unreadable> {
        if path.as_os_str() == "-" {
            let mut bytes = Vec::new();
            io::stdin().lock().read_to_end(&mut bytes)?;
            return Picture::decode(bytes, u64::MAX);
        }
        blocking_path::reject(path)?;
        let mut file = File::open(path)?;
        let data = file.metadata()?;
        if data.is_dir() {
            return Err(Unreadable::Folder);
        }
        if !data.is_file() {
            // Decoders seek, but pipes do not support seeking.
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            return Picture::decode(bytes, u64::MAX);
        }
        decode(&mut BufReader::with_capacity(1 << 16, file), u64::MAX)
    }

    /// Decodes an image in memory.
    ///
    /// # Errors
    ///
    /// [`Unreadable`], with the reason.
    pub fn decode(bytes: Vec<u8>, max_pixels: u64) -> Result<Picture, Unreadable> {
        decode(&mut Cursor::new(bytes), max_pixels)
    }
}

fn decode(source: &mut dyn Source, max_pixels: u64) -> Result<Picture, Unreadable> {
    let mut start = Vec::new();
    source.take(64).read_to_end(&mut start)?;
    source.seek(SeekFrom::Start(0))?;
    if start.is_empty() {
        return Err(Unreadable::Empty);
    }
    match image::guess_format(&start) {
        Ok(ImageFormat::Png) => png(source, max_pixels),
        Ok(ImageFormat::OpenExr) => super::exr::read(source, max_pixels),
        Ok(ImageFormat::WebP) if !cfg!(feature = "formats") => Err(Unreadable::Kind(formats::rule("WebP"))),
        Ok(format @ (ImageFormat::Jpeg | ImageFormat::WebP | ImageFormat::Hdr)) => {
            decode_8_bit_or_hdr(source, format, max_pixels)
        }
        _ => Err(Unreadable::Format),
    }
}

/// Rejects images with too many pixels, or with values that take far more memory than the file.
pub(super) fn check(
    max_pixels: u64,
    length: u64,
    (width, height): (u64, u64),
    bytes_per_pixel: u64,
) -> Result<(), Unreadable> {
    if width.saturating_mul(height) > max_pixels {
        return Err(Unreadable::Pixels {
            width,
            height,
            limit: max_pixels,
        });
    }
    let bytes = width.saturating_mul(height).saturating_mul(bytes_per_pixel);
    let limit = MAX_BYTES.0.saturating_add(length.saturating_mul(MAX_BYTES.1));
    match bytes <= limit {
        true => Ok(()),
        false => Err(Unreadable::Large {
            width,
            height,
            bytes,
            length,
            limit,
        }),
    }
}

/// Reserves memory for `count` values, or returns [`Unreadable::Memory`].
pub(super) fn reserve<T>(width: u64, height: u64, count: u64) -> Result<Vec<T>, Unreadable> {
    let too_large = Unreadable::Memory {
        width,
        height,
        bytes: count.saturating_mul(size_of::<T>() as u64),
    };
    let mut values = Vec::new();
    match usize::try_from(count) {
        Ok(count) if fallible(|| values.try_reserve_exact(count)).is_ok() => Ok(values),
        _ => Err(too_large),
    }
}

impl From<io::Error> for Unreadable {
    fn from(error: io::Error) -> Self {
        Unreadable::Io(error)
    }
}

impl From<png::DecodingError> for Unreadable {
    fn from(error: png::DecodingError) -> Self {
        match error {
            png::DecodingError::IoError(error) if error.kind() != io::ErrorKind::UnexpectedEof => Unreadable::Io(error),
            error => Unreadable::Damaged(error.to_string()),
        }
    }
}

/// Returns the length in bytes, and seeks to the start.
pub(super) fn file_length(source: &mut dyn Source) -> io::Result<u64> {
    let length = source.seek(SeekFrom::End(0))?;
    source.seek(SeekFrom::Start(0))?;
    Ok(length)
}

/// Decodes a PNG row by row, which saves memory, unless it is interlaced.
fn png(source: &mut dyn Source, max_pixels: u64) -> Result<Picture, Unreadable> {
    let length = file_length(source)?;
    let mut options = png::DecodeOptions::default();
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    let mut decoder = png::Decoder::new_with_options(source, options);
    decoder.set_limits(png::Limits {
        bytes: MAX_DECODER_BYTES,
    });
    decoder.set_transformations(png::Transformations::EXPAND); // palettes to colors, fewer than 8 bits to 8
    let mut reader = decoder.read_info()?;
    let (width, height) = (reader.info().width, reader.info().height);
    let is_interlaced = reader.info().interlaced;
    let (color, depth) = reader.output_color_type();
    let channel_count = color.samples();
    let is_deep = depth == png::BitDepth::Sixteen;
    let (columns, rows) = (u64::from(width), u64::from(height));
    let bytes_per_pixel = channel_count as u64 * if is_deep { 2 } else { 1 };
    check(max_pixels, length, (columns, rows), bytes_per_pixel)?;
    let mut planes = Planes::new(columns, rows, channel_count, is_deep)?;
    if is_interlaced {
        let size = reader.output_buffer_size().unwrap_or(usize::MAX) as u64;
        let mut bytes = reserve(columns, rows, size)?;
        bytes.resize(size as usize, 0);
        reader.next_frame(&mut bytes)?;
        planes.append(&bytes);
    } else {
        while let Some(row) = reader.next_row()? {
            planes.append(row.data());
        }
    }
    reader.finish()?;
    Ok(planes.picture(width, height))
}

/// Display values, one plane per channel: `bytes` for 8-bit values, `words` for 16-bit values.
struct Planes {
    channel_count: usize,
    bytes: Vec<Vec<u8>>,
    words: Vec<Vec<u16>>,
}

impl Planes {
    fn new(width: u64, height: u64, channel_count: usize, is_deep: bool) -> Result<Planes, Unreadable> {
        let count = width * height;
        let mut planes = Planes {
            channel_count,
            bytes: Vec::new(),
            words: Vec::new(),
        };
        for _ in 0..channel_count {
            match is_deep {
                true => planes.words.push(reserve(width, height, count)?),
                false => planes.bytes.push(reserve(width, height, count)?),
            }
        }
        Ok(planes)
    }

    /// Appends complete pixels; 16-bit values are big-endian.
    fn append(&mut self, pixels: &[u8]) {
        let channel_count = self.channel_count;
        for (i, plane) in self.bytes.iter_mut().enumerate() {
            plane.extend(pixels.iter().skip(i).step_by(channel_count));
        }
        for (i, plane) in self.words.iter_mut().enumerate() {
            let pairs = pixels.as_chunks().0.iter().skip(i).step_by(channel_count);
            plane.extend(pairs.map(|pair| u16::from_be_bytes(*pair)));
        }
    }

    fn picture(self, width: u32, height: u32) -> Picture {
        let bits = if self.bytes.is_empty() { 16 } else { 8 };
        let bytes = self.bytes.into_iter().map(Plane::Bytes);
        let planes: Vec<_> = bytes
            .chain(self.words.into_iter().map(Plane::Shorts))
            .map(Arc::new)
            .collect();
        // Gray images share one plane among R, G and B.
        let names: &[(&str, usize)] = match planes.len() {
            1 => &[("R", 0), ("G", 0), ("B", 0)],
            2 => &[("R", 0), ("G", 0), ("B", 0), ("A", 1)],
            3 => &[("R", 0), ("G", 1), ("B", 2)],
            _ => &[("R", 0), ("G", 1), ("B", 2), ("A", 3)],
        };
        let channels = names.iter().filter_map(|(name, i)| {
            Some(Channel {
                name: (*name).to_owned(),
                plane: Arc::clone(planes.get(*i)?),
            })
        });
        Picture {
            width,
            height,
            position: (0, 0),
            kind: Kind::Display { bits },
            channels: channels.collect(),
        }
    }
}

/// Decodes JPEG, WebP and Radiance files.
fn decode_8_bit_or_hdr(source: &mut dyn Source, format: ImageFormat, max_pixels: u64) -> Result<Picture, Unreadable> {
    let length = file_length(source)?;
    let mut reader = ImageReader::with_format(source, format);
    reader.limits(Limits::no_limits());
    let decoder = reader.into_decoder().map_err(decode_error)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(Unreadable::Damaged("it has no pixels".to_owned()));
    }
    if format == ImageFormat::Jpeg
        && length.saturating_mul(MAX_JPEG_PIXELS_PER_BYTE) < u64::from(width) * u64::from(height)
    {
        return Err(Unreadable::Damaged(format!(
            "its header specifies {width} x {height} pixels, which do not fit into {length} bytes"
        )));
    }
    let color = decoder.color_type();
    let size = (width.into(), height.into());
    check(max_pixels, length, size, color.bytes_per_pixel().into())?;
    // Memory is reserved here first, because a failed allocation in the library aborts the process.
    drop(reserve::<u8>(width.into(), height.into(), decoder.total_bytes())?);
    let image = DynamicImage::from_decoder(decoder).map_err(decode_error)?;
    let (columns, rows) = (u64::from(width), u64::from(height));
    if format == ImageFormat::Hdr {
        let values = image.into_rgb32f().into_raw();
        let channels = ["R", "G", "B"].into_iter().enumerate().map(|(i, name)| {
            let mut plane = reserve(columns, rows, columns * rows)?;
            plane.extend(values.iter().skip(i).step_by(3));
            Ok(Channel {
                name: name.to_owned(),
                plane: Arc::new(Plane::Floats(plane)),
            })
        });
        return Ok(Picture {
            width,
            height,
            position: (0, 0),
            kind: Kind::Linear,
            channels: channels.collect::<Result<_, Unreadable>>()?,
        });
    }
    let image = match color {
        image::ColorType::L8 | image::ColorType::La8 | image::ColorType::Rgb8 | image::ColorType::Rgba8 => image,
        color => {
            return Err(Unreadable::Kind(format!(
                "its values are {color:?}; they must have 8 bits"
            )));
        }
    };
    let mut planes = Planes::new(columns, rows, usize::from(color.channel_count()), false)?;
    planes.append(image.as_bytes());
    Ok(planes.picture(width, height))
}

fn decode_error(error: image::ImageError) -> Unreadable {
    match error {
        image::ImageError::IoError(error) if error.kind() != io::ErrorKind::UnexpectedEof => Unreadable::Io(error),
        image::ImageError::Unsupported(error) => Unreadable::Kind(error.to_string()),
        error => Unreadable::Damaged(error.to_string()),
    }
}
