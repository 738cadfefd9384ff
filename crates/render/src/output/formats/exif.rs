//! Metadata of JPEG and WebP files: Exif tags.

use std::fs::File;
use std::io::{self, BufReader, Cursor};

use exif::experimental::Writer as ExifWriter;
use exif::{Field, In, Tag, Value};

use super::super::Metadata;

/// Reads Exif tags of a JPEG or WebP file.
pub fn read_metadata(mut file: BufReader<File>) -> Option<Metadata> {
    let exif = exif::Reader::new().read_from_container(&mut file).ok()?;
    let text = |tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(lines) => Some(String::from_utf8_lossy(lines.first()?).into_owned()),
        _ => None,
    };
    let lines = text(Tag::ImageDescription).unwrap_or_default();
    Some(Metadata::from_lines(text(Tag::Software), &lines))
}

/// Returns the Exif tags of metadata as bytes. Returns `None` if the metadata is empty.
pub fn encode(metadata: &Metadata) -> io::Result<Option<Vec<u8>>> {
    let tags = [
        (Tag::Software, metadata.software().map(str::to_owned)),
        (Tag::ImageDescription, metadata.lines()),
    ];
    let field = |(tag, text): (Tag, Option<String>)| {
        let value = Value::Ascii(vec![text?.into_bytes()]);
        let ifd_num = In::PRIMARY;
        Some(Field { tag, ifd_num, value })
    };
    let fields: Vec<Field> = tags.into_iter().filter_map(field).collect();
    if fields.is_empty() {
        return Ok(None);
    }
    let mut writer = ExifWriter::new();
    fields.iter().for_each(|field| writer.push_field(field));
    let mut bytes = Cursor::new(Vec::new());
    writer.write(&mut bytes, false).map_err(io::Error::other)?;
    Ok(Some(bytes.into_inner()))
}
