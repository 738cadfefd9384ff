//! OpenEXR decoding: all channels of all parts at the highest resolution level. Each channel keeps its value type.

use std::collections::BTreeSet;
use std::io;
use std::sync::Arc;

use exr::block::reader::ChunksReader as _;
use exr::error::Error;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;

use super::read::{Source, Unreadable, check, file_length, reserve};
use super::{Channel, Kind, Picture, Plane};

impl From<Error> for Unreadable {
    fn from(error: Error) -> Self {
        match error {
            Error::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => Unreadable::Io(error),
            Error::NotSupported(feature) => Unreadable::Kind(feature.into_owned()),
            Error::Io(error) => Unreadable::Damaged(error.to_string()),
            error => Unreadable::Damaged(error.to_string()),
        }
    }
}

/// Decodes an image block by block, which saves memory.
pub(super) fn read(source: &mut dyn Source, max_pixels: u64) -> Result<Picture, Unreadable> {
    let length = file_length(source)?;
    let reader = exr::block::read(source, false)?;
    let headers = reader.headers().to_vec();
    let first = headers
        .first()
        .ok_or_else(|| Unreadable::Damaged("it has no parts".to_owned()))?;
    let (width, height) = (first.layer_size.width(), first.layer_size.height());
    let position = first.own_attributes.layer_position;
    for header in &headers {
        if header.deep {
            return Err(Unreadable::Kind("deep data".to_owned()));
        }
        if header.layer_size != first.layer_size || header.own_attributes.layer_position != position {
            return Err(Unreadable::Kind("parts of different sizes or positions".to_owned()));
        }
    }
    let side = |length: usize| u32::try_from(length).ok().filter(|length| *length > 0);
    let (Some(columns), Some(rows)) = (side(width), side(height)) else {
        return Err(Unreadable::Damaged("it has no pixels".to_owned()));
    };
    let channels = headers.iter().flat_map(|header| &header.channels.list);
    let bytes_per_pixel = channels
        .map(|channel| channel.sample_type.bytes_per_sample() as u64)
        .sum();
    check(max_pixels, length, (columns.into(), rows.into()), bytes_per_pixel)?;
    let names = names(&headers)?;
    let mut planes = Vec::new();
    for header in &headers {
        let mut part_planes = Vec::new();
        for channel in &header.channels.list {
            part_planes.push(empty(columns, rows, channel.sample_type)?);
        }
        planes.push(part_planes);
    }
    let chunks = reader.filter_chunks(false, |_, _, block| (block.level.x(), block.level.y()) == (0, 0))?;
    // A file may contain a block twice and omit another block.
    let (mut blocks, mut area) = (BTreeSet::new(), 0);
    chunks.decompress_parallel(false, |_, block| {
        let damaged = || Error::Invalid("block".into());
        let part_planes = planes.get_mut(block.index.layer).ok_or_else(damaged)?;
        let (position, size) = (block.index.pixel_position, block.index.pixel_size);
        if position.x().checked_add(size.x()).is_none_or(|end| end > width) {
            return Err(damaged());
        }
        if position.y().checked_add(size.y()).is_none_or(|end| end > height) {
            return Err(damaged());
        }
        if blocks.insert((block.index.layer, position.x(), position.y())) {
            area += size.area() as u64;
        }
        let mut bytes = block.data.as_slice();
        for y in position.y()..position.y() + size.y() {
            for plane in part_planes.iter_mut() {
                let line = bytes.split_off(..size.x() * bytes_of(plane)).ok_or_else(damaged)?;
                store(plane, y * width + position.x(), line);
            }
        }
        Ok(())
    })?;
    if area != u64::from(columns) * u64::from(rows) * headers.len() as u64 {
        return Err(Unreadable::Damaged("blocks are missing".to_owned()));
    }
    let channels = names.into_iter().zip(planes.into_iter().flatten());
    Ok(Picture {
        width: columns,
        height: rows,
        position: (position.x(), position.y()),
        kind: Kind::Linear,
        channels: channels
            .map(|(name, plane)| Channel {
                name,
                plane: Arc::new(plane),
            })
            .collect(),
    })
}

/// Returns the channel names. In multi-part files, the part name is prepended unless already present.
fn names(headers: &[Header]) -> Result<Vec<String>, Unreadable> {
    let mut names = Vec::new();
    let mut unique = BTreeSet::new();
    for header in headers {
        let part_name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
        let part_name = part_name.filter(|name| headers.len() > 1 && !name.is_empty());
        for channel in &header.channels.list {
            let channel = channel.name.to_string();
            let name = match &part_name {
                Some(part) if !channel.starts_with(&format!("{part}.")) => format!("{part}.{channel}"),
                _ => channel,
            };
            if !unique.insert(name.clone()) {
                return Err(Unreadable::Kind(format!("two channels are called {name}")));
            }
            names.push(name);
        }
    }
    if names.is_empty() {
        return Err(Unreadable::Damaged("it has no channels".to_owned()));
    }
    Ok(names)
}

fn empty(columns: u32, rows: u32, sample_type: SampleType) -> Result<Plane, Unreadable> {
    /// Allocates zeros. The system maps their memory on first use, because a header may claim any size.
    fn zeros<T: Clone + Default>(width: u64, height: u64) -> Result<Vec<T>, Unreadable> {
        let count = width * height;
        drop(reserve::<T>(width, height, count)?);
        Ok(vec![T::default(); count as usize])
    }
    let (width, height) = (u64::from(columns), u64::from(rows));
    Ok(match sample_type {
        SampleType::U32 => Plane::Integers(zeros(width, height)?),
        SampleType::F16 => Plane::Halves(zeros(width, height)?),
        SampleType::F32 => Plane::Floats(zeros(width, height)?),
    })
}

fn bytes_of(plane: &Plane) -> usize {
    if matches!(plane, Plane::Halves(_)) { 2 } else { 4 }
}

fn store(plane: &mut Plane, start: usize, line: &[u8]) {
    fn copy<T, const N: usize>(to: &mut [T], line: &[u8], value: impl Fn([u8; N]) -> T) {
        for (to, bytes) in to.iter_mut().zip(line.as_chunks::<N>().0) {
            *to = value(*bytes);
        }
    }
    match plane {
        Plane::Integers(values) => copy(&mut values[start..], line, u32::from_ne_bytes),
        Plane::Halves(values) => copy(&mut values[start..], line, u16::from_ne_bytes),
        Plane::Floats(values) => copy(&mut values[start..], line, f32::from_ne_bytes),
        Plane::Bytes(_) | Plane::Shorts(_) | Plane::One => {} // not in OpenEXR
    }
}
