//! OpenEXR files: scan lines of 32-bit or 16-bit values, lossless, written block by block.

use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom, Write};
use std::path::Path;

use ::exr::block::writer::{ChunkWriter, ChunksWriter};
use ::exr::block::{BlockIndex, UncompressedBlock, write as write_blocks};
use ::exr::compression::Compression;
use ::exr::error::{Error, UnitResult};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{ChannelDescription, IntegerBounds, LineOrder, SampleType, Text};
use ::exr::meta::header::{Header, ImageAttributes};
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, f16};
use rayon::prelude::*;

use super::super::aov::{Channel, channels_of};
use super::super::{Band, ExrCompression, ExrType, Layout, Metadata, Pixels, SaveOptions, Sink};
use crate::error::RenderError;
use wgray_trace::film::mean;

/// Writes the radiance as R, G and B, premultiplied by alpha, alpha as A, and AOVs as further channels of the same
/// part. The display window is the whole image, the data window is the region. Returns the number of finite values that
/// became infinite.
pub fn write(
    mut file: impl Write + Seek,
    layout: &Layout,
    options: &SaveOptions,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<u64, RenderError> {
    let columns = columns(layout);
    let header = header(layout, options, &columns);
    let mut too_large = 0;
    // The closure can only return errors of the library, so an error of the render is stored here.
    let mut render_error = None;
    let start = file.stream_position()?;
    let output = FromStart {
        inner: &mut file,
        start,
    };
    let written = write_blocks(output, [header].into_iter().collect(), true, |meta, writer| {
        let mut rows = Rows {
            columns: &columns,
            layout,
            meta,
            writer,
            is_half: options.exr_type == ExrType::Half,
            block_rows: method(options.exr_compression).scan_lines_per_block(),
            lines: Vec::new(),
            next: 0,
            too_large: 0,
        };
        let rendered = render(&mut |band| Ok(rows.add_band(band).map_err(to_io_error)?));
        too_large = rows.too_large;
        rendered.map_err(|error| {
            render_error = Some(error);
            Error::Aborted
        })
    });
    if let Some(error) = render_error {
        return Err(error);
    }
    written.map_err(to_io_error)?;
    file.seek(SeekFrom::End(0))?; // the table of offsets, at the start, is written last
    Ok(too_large)
}

/// A writer whose positions are counted from `start`.
struct FromStart<W> {
    inner: W,
    start: u64,
}

impl<W: Write> Write for FromStart<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.inner.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<W: Seek> Seek for FromStart<W> {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        let position = match position {
            SeekFrom::Start(offset) => SeekFrom::Start(self.start.saturating_add(offset)),
            relative => relative,
        };
        Ok(self.inner.seek(position)?.saturating_sub(self.start))
    }
}

/// Source of a channel.
enum Column {
    Radiance(usize),
    Alpha,
    Aov(&'static Channel),
}

/// Returns the channels in alphabetical order, as the format requires.
fn columns(layout: &Layout) -> Vec<(&'static str, Column)> {
    let mut columns: Vec<_> = ["R", "G", "B"].into_iter().zip((0..).map(Column::Radiance)).collect();
    if layout.alpha {
        columns.push(("A", Column::Alpha));
    }
    for channel in layout.aovs.iter().flat_map(|aov| channels_of(*aov)) {
        columns.push((channel.name(), Column::Aov(channel)));
    }
    columns.sort_by_key(|(name, _)| *name);
    columns
}

impl Column {
    fn is_integer(&self) -> bool {
        matches!(self, Column::Aov(channel) if channel.is_whole())
    }
}

fn header(layout: &Layout, options: &SaveOptions, columns: &[(&str, Column)]) -> Header {
    let channel = |(name, column): &(&str, Column)| {
        let sample_type = match (column.is_integer(), options.exr_type) {
            (true, _) => SampleType::U32,
            (false, ExrType::Float) => SampleType::F32,
            (false, ExrType::Half) => SampleType::F16,
        };
        ChannelDescription::named(*name, sample_type)
    };
    let channels = columns.iter().map(channel).collect();
    let (width, height) = layout.picture;
    let region = layout.region;
    let mut header = Header::new(
        "wgray".into(),
        Vec2(region.width() as usize, region.height() as usize),
        channels,
    )
    .with_encoding(
        method(options.exr_compression),
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    )
    .with_position(Vec2(region.x0 as i32, region.y0 as i32))
    .with_shared_attributes(ImageAttributes::new(IntegerBounds::from_dimensions(Vec2(
        width as usize,
        height as usize,
    ))));
    // Other attributes are in a hash map and would be written in random order.
    header.own_attributes.software_name = options.metadata.software().map(text);
    header.own_attributes.comments = options.metadata.lines().as_deref().map(text);
    header
}

fn method(compression: ExrCompression) -> Compression {
    match compression {
        ExrCompression::None => Compression::Uncompressed,
        ExrCompression::Rle => Compression::RLE,
        ExrCompression::Zips => Compression::ZIP1,
        ExrCompression::Zip => Compression::ZIP16,
        ExrCompression::Piz => Compression::PIZ,
    }
}

/// Encodes text as UTF-8, since the format defines no encoding.
fn text(text: &str) -> Text {
    Text::from_bytes_unchecked(text.as_bytes().iter().copied().collect())
}

struct Rows<'a, W: Write + Seek> {
    columns: &'a [(&'static str, Column)],
    layout: &'a Layout,
    meta: MetaData,
    writer: &'a mut ChunkWriter<W>,
    /// True for 16-bit floats.
    is_half: bool,
    /// Rows per compressed block.
    block_rows: usize,
    /// Rows of an incomplete block.
    lines: Vec<Vec<u8>>,
    /// Index of the next block.
    next: usize,
    /// Finite values that became infinite.
    too_large: u64,
}

impl<W: Write + Seek> Rows<'_, W> {
    fn add_band(&mut self, band: Band) -> UnitResult {
        let width = self.layout.region.width() as usize;
        let rows = band.film.region.height() as usize;
        let lines = (0..rows)
            .into_par_iter()
            .map(|y| encode_row(self.columns, band, y * width..(y + 1) * width, self.is_half));
        for (line, too_large) in lines.collect::<Vec<_>>() {
            self.lines.push(line);
            self.too_large += too_large;
        }
        let height = self.layout.region.height() as usize;
        let is_last = self.next * self.block_rows + self.lines.len() == height;
        let complete_rows = self.lines.len() / self.block_rows * self.block_rows;
        let ready: Vec<Vec<u8>> = self
            .lines
            .drain(..if is_last { self.lines.len() } else { complete_rows })
            .collect();
        let (first, headers, block_rows) = (self.next, &self.meta.headers, self.block_rows);
        let chunks = ready.par_chunks(block_rows).enumerate().map(|(i, lines)| {
            let index = BlockIndex {
                layer: 0,
                pixel_position: Vec2(0, (first + i) * block_rows),
                pixel_size: Vec2(width, lines.len()),
                level: Vec2(0, 0),
            };
            UncompressedBlock {
                index,
                data: lines.concat(),
            }
            .compress_to_chunk(headers)
        });
        for chunk in chunks.collect::<Vec<_>>() {
            self.writer.write_chunk(self.next, chunk?)?;
            self.next += 1;
        }
        Ok(())
    }
}

/// Returns a row's bytes, channel by channel, and the number of finite values that became infinite in 16 bits.
fn encode_row(columns: &[(&str, Column)], band: Band, pixels: std::ops::Range<usize>, is_half: bool) -> (Vec<u8>, u64) {
    let mut bytes = Vec::with_capacity(4 * columns.len() * pixels.len());
    let mut too_large = 0;
    for (_, column) in columns {
        for i in pixels.clone() {
            let bytes_of_value = match column {
                Column::Radiance(channel) => mean(band.film.sums[i])[*channel].to_ne_bytes(),
                Column::Alpha => band.film.alpha(i).to_ne_bytes(),
                Column::Aov(channel) => channel.bytes(band, i),
            };
            if is_half && !column.is_integer() {
                let value = f32::from_ne_bytes(bytes_of_value);
                let rounded = f16::from_f32(value); // to nearest, ties to even
                too_large += u64::from(value.is_finite() && rounded.is_infinite());
                bytes.extend(rounded.to_ne_bytes());
            } else {
                bytes.extend(bytes_of_value);
            }
        }
    }
    (bytes, too_large)
}

fn to_io_error(error: Error) -> io::Error {
    match error {
        Error::Io(error) => error,
        other => io::Error::other(other),
    }
}

pub fn read_metadata(file: BufReader<File>) -> Option<Metadata> {
    let meta = MetaData::read_from_buffered(file, false).ok()?;
    let attributes = &meta.headers.first()?.own_attributes;
    let comments = attributes.comments.as_ref().map(Text::to_string);
    let software = attributes.software_name.as_ref().map(Text::to_string);
    Some(Metadata::from_lines(software, &comments.unwrap_or_default()))
}

/// Reads R, G and B of an EXR file's first layer. In files with alpha, colors are premultiplied, as if over a black
/// background.
///
/// # Errors
///
/// Unreadable files, files of other formats, files without these channels, and all files without the cargo feature
/// `formats`.
pub fn read_exr(path: &Path) -> io::Result<Pixels> {
    let create = |size: Vec2<usize>, _: &_| Pixels {
        width: size.x() as u32,
        height: size.y() as u32,
        colors: vec![[0.0; 3]; size.area()],
    };
    let set = |pixels: &mut Pixels, position: Vec2<usize>, (r, g, b): (f32, f32, f32)| {
        pixels.colors[position.y() * pixels.width as usize + position.x()] = [r, g, b];
    };
    let image = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(create, set)
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(to_io_error)?;
    Ok(image.layer_data.channel_data.pixels)
}
