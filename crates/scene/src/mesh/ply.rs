//! PLY files (Greg Turk, "The PLY Polygon File Format", 1994), ASCII or binary.
//!
//! The crate `ply-rs-bw` 4 builds a map per row and takes more than 1 s for a million triangles; loading with this
//! reader takes 0.15 s in total.

mod header;
mod values;

use glam::{DVec3, Vec2, Vec4};

use self::header::{Element, Format, Header, Property, Scalar, header};
use self::values::{Ascii, Binary, Values};
use super::damage::{self, Damages};
use super::error::{Location, MeshFault, shown_number};
use super::raw_mesh::{RawMesh, coordinate, texture_coordinate, unit};
use super::tokens::Tokens;
use super::{Group, MOST};
use wgray_image::color::srgb_to_linear;

pub(super) fn read(bytes: &[u8], normals_wanted: bool) -> Result<RawMesh, MeshFault> {
    let mut words = Tokens::new(bytes);
    let mut damages = Damages::default();
    let header = header(&mut words, &mut damages)?;
    match header.format {
        Format::Ascii => {
            // Each line is a row, as in other readers, unless there are fewer lines than rows.
            let by_lines = words.lines_left() as u128 >= header.rows();
            body(&header, Ascii { words, by_lines }, normals_wanted, damages)
        }
        Format::Binary { is_big } => {
            let at = words.offset();
            body(&header, Binary { bytes, at, is_big }, normals_wanted, damages)
        }
    }
}

fn body(
    header: &Header,
    mut values: impl Values,
    normals_wanted: bool,
    damages: Damages,
) -> Result<RawMesh, MeshFault> {
    let element = |name: &str| header.elements.iter().find(|element| element.name == name);
    let vertices =
        element("vertex").ok_or_else(|| Location::File.fault("the header must have an element \"vertex\""))?;
    if element("face").is_none_or(|faces| faces.count == 0) {
        return Err(Location::File.fault(match element("tristrips") {
            Some(_) => "has tristrips, which are not read: it must have an element \"face\"",
            None => "has no triangles: points and lines are not rendered",
        }));
    }
    if vertices.count > MOST {
        let rule = format!("{} vertices; there must be at most {MOST}", vertices.count);
        return Err(vertices.place.fault(rule));
    }
    let mut draft = RawMesh {
        damages,
        ..RawMesh::default()
    };
    draft.groups.push(Group::default());
    draft.begin(0);
    // Repeated elements are skipped.
    let (mut seen_vertices, mut seen_faces) = (false, false);
    for element in &header.elements {
        check_size(element, &values)?;
        match element.name.as_str() {
            "vertex" if !std::mem::replace(&mut seen_vertices, true) => {
                read_vertices(element, &mut values, normals_wanted, &mut draft)?
            }
            "face" if !std::mem::replace(&mut seen_faces, true) => {
                read_faces(element, &mut values, vertices.count, &mut draft)?
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
                    end_row(&mut values, &mut draft);
                }
            }
        }
    }
    Ok(draft)
}

/// Rejects an element count that needs more bytes than remain in the file.
fn check_size(element: &Element, values: &impl Values) -> Result<(), MeshFault> {
    let fewest = |property: &Property| values.fewest_bytes(property.count.unwrap_or(property.scalar));
    let row = element.properties.iter().map(fewest).sum::<usize>();
    let all = row as u128 * element.count as u128;
    match all <= values.left() as u128 {
        true => Ok(()),
        false => Err(element.place.fault(format!(
            "the file is truncated: {} elements {:?} take {all} bytes or more; the file has {} left",
            element.count,
            element.name,
            values.left()
        ))),
    }
}

/// Ends a row; extra values on its line are damage.
#[inline]
fn end_row(values: &mut impl Values, draft: &mut RawMesh) {
    if let Some(place) = values.end_row() {
        let rule = "the line has more values than the header declares";
        draft.damages.add(damage::REST, || place.fault(rule));
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
    let place = values.place();
    let length = values.next(count)?;
    // The limit is larger than any file.
    match length >= 0.0 && length.fract() == 0.0 && length < (1u64 << 52) as f64 {
        true => Ok(length as usize),
        false => Err(place.fault(format!(
            "{}: the length {} must be a whole number, 0 or greater",
            property.name,
            shown_number(length)
        ))),
    }
}

/// Property names by column: position, normal, texture coordinates, colour.
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

/// Converts to linear RGB or opacity. Integers are normalized; colors are decoded from sRGB (IEC 61966-2-1), opacity is
/// linear. Floats are not changed.
fn color_value(value: f64, scalar: Scalar, is_opacity: bool) -> f32 {
    let Some(largest) = scalar.largest() else {
        return value as f32;
    };
    let share = (value / largest).clamp(0.0, 1.0);
    match is_opacity {
        true => share as f32,
        false => srgb_to_linear(share) as f32,
    }
}

fn read_vertices(
    element: &Element,
    values: &mut impl Values,
    normals_wanted: bool,
    draft: &mut RawMesh,
) -> Result<(), MeshFault> {
    // The column of each property, and whether each column is present.
    let mut has = [false; 12];
    let columns: Vec<Option<usize>> = element
        .properties
        .iter()
        .map(|property| {
            let names = |names: &&[&str]| names.contains(&property.name.as_str());
            let column = COLUMNS.iter().position(names)?;
            let is_free = property.count.is_none() && !has[column];
            has[column] |= is_free;
            is_free.then_some(column)
        })
        .collect();
    if let Some(missing) = (0..3).find(|column| !has[*column]) {
        let name = COLUMNS[missing][0];
        return Err(element
            .place
            .fault(format!("element \"vertex\": it must have a property {name:?}")));
    }
    let has_normals = normals_wanted && has[3] && has[4] && has[5];
    let has_uvs = has[6] && has[7];
    let has_colors = has[8] && has[9] && has[10];
    let mut of_colors = [Scalar::F32; 4];
    for (property, column) in element.properties.iter().zip(&columns) {
        if let Some(of_color) = column.and_then(|column| of_colors.get_mut(column.wrapping_sub(8))) {
            *of_color = property.scalar;
        }
    }
    draft.positions.reserve_exact(element.count);
    if has_normals {
        draft.normals.reserve_exact(element.count);
    }
    if has_uvs {
        draft.uvs.reserve_exact(element.count);
    }
    if has_colors {
        draft.colors.reserve_exact(element.count);
    }
    for i in 0..element.count {
        let place = values.place();
        let mut row = [0.0; 12];
        row[11] = of_colors[3].largest().unwrap_or(1.0);
        for (property, column) in element.properties.iter().zip(&columns) {
            match column {
                Some(column) => row[*column] = values.next(property.scalar)?,
                None => skip(property, values)?,
            }
        }
        end_row(values, draft);
        let fault = |(name, rule): (&str, String)| place.fault(format!("vertex {i}: {name}: {rule}"));
        let [x, y, z, nx, ny, nz, u, v, ..] = row;
        let position = |name: &'static str, x: f64| coordinate(x).map_err(|rule| (name, rule));
        let position = || Ok(DVec3::new(position("x", x)?, position("y", y)?, position("z", z)?));
        draft.positions.push(position().unwrap_or_else(|broken| {
            draft.damages.add(damage::VERTEX, || fault(broken));
            DVec3::NAN
        }));
        if has_normals {
            draft.normals.push(unit(DVec3::new(nx, ny, nz)));
        }
        if has_uvs {
            let uv = |name: &'static str, x: f64| texture_coordinate(x).map_err(|rule| (name, rule));
            let uv = || Ok(Vec2::new(uv("u", u)?, uv("v", v)?));
            draft.uvs.push(uv().unwrap_or_else(|broken| {
                draft.damages.add(damage::UV, || fault(broken));
                Vec2::ZERO
            }));
        }
        if has_colors {
            let value = |k: usize| color_value(row[8 + k], of_colors[k], k == 3);
            let mut color = Vec4::from_array(std::array::from_fn(value));
            if !color.is_finite() {
                let rule = "its values must be finite as 32-bit floats".to_owned();
                draft.damages.add(damage::COLOR, || fault(("the color", rule)));
                color = Vec4::ONE;
            }
            draft.colors.push(color);
        }
    }
    Ok(())
}

fn read_faces(
    element: &Element,
    values: &mut impl Values,
    vertices: usize,
    draft: &mut RawMesh,
) -> Result<(), MeshFault> {
    let is_list = |property: &Property| property.count.is_some() && property.scalar.is_whole();
    let named = |property: &Property| ["vertex_indices", "vertex_index"].contains(&property.name.as_str());
    let indices = element
        .properties
        .iter()
        .position(|property| is_list(property) && named(property))
        .or_else(|| element.properties.iter().position(is_list));
    let Some(indices) = indices else {
        let rule = "it must have a list of whole numbers, \"vertex_indices\"";
        return Err(element.place.fault(format!("element \"face\": {rule}")));
    };
    if element.properties.iter().any(|property| property.name == "texcoord") {
        let note = "texture coordinates per face corner (\"texcoord\") are not supported and were ignored; use those per vertex";
        draft.notes.push(note.into());
    }
    draft.triangles.reserve_exact(element.count.min(MOST));
    let mut corners = Vec::new();
    for i in 0..element.count {
        for (k, property) in element.properties.iter().enumerate() {
            let count = match property.count {
                Some(count) if k == indices => count,
                _ => {
                    skip(property, values)?;
                    continue;
                }
            };
            let place = values.place();
            let length = list_length(count, property, values)?;
            corners.clear();
            let mut broken = None;
            for _ in 0..length {
                let place = values.place();
                let vertex = values.next(property.scalar)?;
                corners.push(vertex as u32);
                if !(vertex >= 0.0 && vertex < vertices as f64 && vertex.fract() == 0.0) {
                    broken.get_or_insert((place, vertex));
                }
            }
            if let Some((place, vertex)) = broken {
                let vertex = shown_number(vertex);
                let rule = || format!("face {i}: vertex {vertex} does not exist; there are {vertices}, counted from 0");
                draft.damages.add(damage::FACE, || place.fault(rule()));
            } else if length < 3 {
                let rule = || format!("face {i}: must have 3 vertices or more; it has {length}");
                draft.damages.add(damage::FACE, || place.fault(rule()));
            } else {
                draft.face(&corners, place)?;
            }
        }
        end_row(values, draft);
    }
    Ok(())
}
