//! PLY files (Greg Turk, "The PLY Polygon File Format", 1994), ASCII or binary.
//!
//! wgray has its own reader because the crate `ply-rs-bw` 4 builds a map per row and takes more than 1 s for a million
//! triangles. With this reader, a mesh of this size loads in 0.15 s.

mod header;
mod values;

use glam::{DVec3, Vec2, Vec4};

use self::header::{Element, Format, Header, Property, Scalar, header};
use self::values::{Ascii, Binary, Values};
use super::damage::{self, Defects};
use super::error::{Location, MeshFault, format_number};
use super::raw_mesh::{RawMesh, coordinate, texture_coordinate, unit};
use super::tokens::Tokens;
use super::{Group, MAX_ELEMENTS};
use wgray_image::color::srgb_to_linear;

pub(super) fn read(bytes: &[u8], with_normals: bool) -> Result<RawMesh, MeshFault> {
    let mut words = Tokens::new(bytes);
    let mut defects = Defects::default();
    let header = header(&mut words, &mut defects)?;
    match header.format {
        Format::Ascii => {
            // Each line is a row, as in other readers, unless there are fewer lines than rows.
            let row_per_line = words.lines_left() as u128 >= header.rows();
            body(&header, Ascii { words, row_per_line }, with_normals, defects)
        }
        Format::Binary { is_big_endian } => {
            let offset = words.offset();
            body(
                &header,
                Binary {
                    bytes,
                    offset,
                    is_big_endian,
                },
                with_normals,
                defects,
            )
        }
    }
}

fn body(header: &Header, mut values: impl Values, with_normals: bool, defects: Defects) -> Result<RawMesh, MeshFault> {
    let element = |name: &str| header.elements.iter().find(|element| element.name == name);
    let vertices =
        element("vertex").ok_or_else(|| Location::File.fault("the header must have an element \"vertex\""))?;
    if element("face").is_none_or(|faces| faces.count == 0) {
        return Err(Location::File.fault(match element("tristrips") {
            Some(_) => "tristrips are not supported; the file must have an element \"face\"",
            None => "has no triangles: points and lines are not rendered",
        }));
    }
    if vertices.count > MAX_ELEMENTS {
        let rule = format!("{} vertices; there must be at most {MAX_ELEMENTS}", vertices.count);
        return Err(vertices.location.fault(rule));
    }
    let mut raw = RawMesh {
        defects,
        ..RawMesh::default()
    };
    raw.groups.push(Group::default());
    raw.begin_group(0);
    // Further elements with the same name are skipped.
    let (mut has_vertices, mut has_faces) = (false, false);
    for element in &header.elements {
        check_size(element, &values)?;
        match element.name.as_str() {
            "vertex" if !std::mem::replace(&mut has_vertices, true) => {
                read_vertices(element, &mut values, with_normals, &mut raw)?
            }
            "face" if !std::mem::replace(&mut has_faces, true) => {
                read_faces(element, &mut values, vertices.count, &mut raw)?
            }
            _ => {
                // If an element has no properties, its rows have no values.
                let rows = if element.properties.is_empty() {
                    0
                } else {
                    element.count
                };
                for _ in 0..rows {
                    element
                        .properties
                        .iter()
                        .try_for_each(|property| skip(property, &mut values))?;
                    end_row(&mut values, &mut raw);
                }
            }
        }
    }
    Ok(raw)
}

/// Rejects an element count that needs more bytes than remain in the file.
fn check_size(element: &Element, values: &impl Values) -> Result<(), MeshFault> {
    let min_bytes = |property: &Property| values.min_bytes(property.count.unwrap_or(property.scalar));
    let row_bytes = element.properties.iter().map(min_bytes).sum::<usize>();
    let total = row_bytes as u128 * element.count as u128;
    match total <= values.bytes_left() as u128 {
        true => Ok(()),
        false => Err(element.location.fault(format!(
            "the file is truncated: element {:?} with the count {} takes {total} bytes or more; remaining bytes: {}",
            element.name,
            element.count,
            values.bytes_left()
        ))),
    }
}

/// Ends a row. Extra values on the line count as damage.
#[inline]
fn end_row(values: &mut impl Values, raw: &mut RawMesh) {
    if let Some(location) = values.end_row() {
        let rule = "the line has more values than the header declares";
        raw.defects.add(damage::EXTRA_VALUES, || location.fault(rule));
    }
}

fn skip(property: &Property, values: &mut impl Values) -> Result<(), MeshFault> {
    let count = match property.count {
        Some(count) => list_length(count, property, values)?,
        None => 1,
    };
    values.skip(property.scalar, count)
}

#[inline]
fn list_length(count: Scalar, property: &Property, values: &mut impl Values) -> Result<usize, MeshFault> {
    let location = values.location();
    let length = values.next(count)?;
    // The upper limit exceeds the size of any file.
    match length >= 0.0 && length.fract() == 0.0 && length < (1u64 << 52) as f64 {
        true => Ok(length as usize),
        false => Err(location.fault(format!(
            "{}: the length {} must be a whole number, 0 or greater",
            property.name,
            format_number(length)
        ))),
    }
}

/// Property names by column: position, normal, texture coordinates, color.
const COLUMNS: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u"],
    &["v", "t", "texture_v"],
    &["red"],
    &["green"],
    &["blue"],
    &["alpha"],
];

/// Converts a component of a vertex color. Integers are normalized; then red, green and blue are decoded from sRGB
/// (IEC 61966-2-1). Floats are linear, and are not changed.
fn color_value(value: f64, scalar: Scalar, is_opacity: bool) -> f32 {
    let Some(max_value) = scalar.max_value() else {
        return value as f32;
    };
    let fraction = (value / max_value).clamp(0.0, 1.0);
    match is_opacity {
        true => fraction as f32,
        false => srgb_to_linear(fraction) as f32,
    }
}

fn read_vertices(
    element: &Element,
    values: &mut impl Values,
    with_normals: bool,
    raw: &mut RawMesh,
) -> Result<(), MeshFault> {
    // For each property, the column; for each column, whether it is present.
    let mut is_present = [false; 12];
    let columns: Vec<Option<usize>> = element
        .properties
        .iter()
        .map(|property| {
            let matches = |names: &&[&str]| names.contains(&property.name.as_str());
            let column = COLUMNS.iter().position(matches)?;
            let is_first = property.count.is_none() && !is_present[column];
            is_present[column] |= is_first;
            is_first.then_some(column)
        })
        .collect();
    if let Some(missing) = (0..3).find(|column| !is_present[*column]) {
        let name = COLUMNS[missing][0];
        return Err(element
            .location
            .fault(format!("element \"vertex\": the property {name:?} is missing")));
    }
    let has_normals = with_normals && is_present[3] && is_present[4] && is_present[5];
    let has_uvs = is_present[6] && is_present[7];
    let has_colors = is_present[8] && is_present[9] && is_present[10];
    let mut color_types = [Scalar::F32; 4];
    for (property, column) in element.properties.iter().zip(&columns) {
        if let Some(color_type) = column.and_then(|column| color_types.get_mut(column.wrapping_sub(8))) {
            *color_type = property.scalar;
        }
    }
    raw.positions.reserve_exact(element.count);
    if has_normals {
        raw.normals.reserve_exact(element.count);
    }
    if has_uvs {
        raw.uvs.reserve_exact(element.count);
    }
    if has_colors {
        raw.colors.reserve_exact(element.count);
    }
    for i in 0..element.count {
        let location = values.location();
        let mut row = [0.0; 12];
        row[11] = color_types[3].max_value().unwrap_or(1.0);
        for (property, column) in element.properties.iter().zip(&columns) {
            match column {
                Some(column) => row[*column] = values.next(property.scalar)?,
                None => skip(property, values)?,
            }
        }
        end_row(values, raw);
        let fault = |(name, rule): (&str, String)| location.fault(format!("vertex {i}: {name}: {rule}"));
        let [x, y, z, nx, ny, nz, u, v, ..] = row;
        let position = |name: &'static str, x: f64| coordinate(x).map_err(|rule| (name, rule));
        let position = || Ok(DVec3::new(position("x", x)?, position("y", y)?, position("z", z)?));
        raw.positions.push(position().unwrap_or_else(|violation| {
            raw.defects.add(damage::VERTEX, || fault(violation));
            DVec3::NAN
        }));
        if has_normals {
            raw.normals.push(unit(DVec3::new(nx, ny, nz)));
        }
        if has_uvs {
            let uv = |name: &'static str, x: f64| texture_coordinate(x).map_err(|rule| (name, rule));
            let uv = || Ok(Vec2::new(uv("u", u)?, uv("v", v)?));
            raw.uvs.push(uv().unwrap_or_else(|violation| {
                raw.defects.add(damage::UV, || fault(violation));
                Vec2::ZERO
            }));
        }
        if has_colors {
            let value = |k: usize| color_value(row[8 + k], color_types[k], k == 3);
            let mut color = Vec4::from_array(std::array::from_fn(value));
            if !color.is_finite() {
                let rule = "the values must be finite as 32-bit floats".to_owned();
                raw.defects.add(damage::COLOR, || fault(("color", rule)));
                color = Vec4::ONE;
            }
            raw.colors.push(color);
        }
    }
    Ok(())
}

fn read_faces(
    element: &Element,
    values: &mut impl Values,
    vertices: usize,
    raw: &mut RawMesh,
) -> Result<(), MeshFault> {
    let is_list = |property: &Property| property.count.is_some() && property.scalar.is_integer();
    let has_name = |property: &Property| ["vertex_indices", "vertex_index"].contains(&property.name.as_str());
    let indices_property = element
        .properties
        .iter()
        .position(|property| is_list(property) && has_name(property))
        .or_else(|| element.properties.iter().position(is_list));
    let Some(indices_property) = indices_property else {
        let rule = "a list of whole numbers, \"vertex_indices\", is missing";
        return Err(element.location.fault(format!("element \"face\": {rule}")));
    };
    if element.properties.iter().any(|property| property.name == "texcoord") {
        let note = "texture coordinates per face corner (\"texcoord\") are not supported and were ignored; \
                    use texture coordinates per vertex";
        raw.notes.push(note.into());
    }
    raw.triangles.reserve_exact(element.count.min(MAX_ELEMENTS));
    let mut corners = Vec::new();
    for i in 0..element.count {
        for (k, property) in element.properties.iter().enumerate() {
            let count = match property.count {
                Some(count) if k == indices_property => count,
                _ => {
                    skip(property, values)?;
                    continue;
                }
            };
            let location = values.location();
            let length = list_length(count, property, values)?;
            corners.clear();
            let mut invalid = None;
            for _ in 0..length {
                let location = values.location();
                let vertex = values.next(property.scalar)?;
                corners.push(vertex as u32);
                if !(vertex >= 0.0 && vertex < vertices as f64 && vertex.fract() == 0.0) {
                    invalid.get_or_insert((location, vertex));
                }
            }
            if let Some((location, vertex)) = invalid {
                let vertex = format_number(vertex);
                let rule = || {
                    format!("face {i}: vertex {vertex} does not exist; number of vertices, counted from 0: {vertices}")
                };
                raw.defects.add(damage::FACE, || location.fault(rule()));
            } else if length < 3 {
                let rule = || format!("face {i}: must have at least 3 vertices, not {length}");
                raw.defects.add(damage::FACE, || location.fault(rule()));
            } else {
                raw.face(&corners, location)?;
            }
        }
        end_row(values, raw);
    }
    Ok(())
}
