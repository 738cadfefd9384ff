//! Wavefront OBJ files (Wavefront Technologies, "Advanced Visualizer Manual", appendix B, 1995), without smoothing
//! groups (`s`).
//!
//! wgray has its own reader because the crate `tobj` 4 does not join lines at backslashes, reports no line numbers, and
//! takes 0.6 s for a million triangles. With this reader, a mesh of this size loads in 0.25 s.

use std::collections::{BTreeMap, HashMap};
use std::hash::BuildHasher;

use glam::{DVec3, Vec2, Vec3, Vec4};
use hashbrown::{DefaultHashBuilder, HashTable};

use super::error::{Location, MeshFault, quoted};
use super::raw_mesh::{RawMesh, coordinate, counted, texture_coordinate, unit};
use super::tokens::Tokens;
use super::{Group, MAX_ELEMENTS};
use super::{damage, tokens};
use wgray_image::color::srgb_to_linear;

/// Index of an attribute that a corner lacks.
const NONE: u32 = u32::MAX;
/// Maximum number of unknown keywords that are counted.
const MAX_KEYWORDS: usize = 100;
/// Maximum number of `mtllib` lines, and of names per line.
pub(super) const MAX_LIBRARIES: usize = 100;

pub(super) struct Obj {
    pub raw: RawMesh,
    pub libraries: Vec<String>,
}

pub(super) fn read(bytes: &[u8], with_normals: bool) -> Result<Obj, MeshFault> {
    let mut words = Tokens::new(bytes);
    let mut reader = Reader {
        with_normals,
        ..Reader::default()
    };
    while let Some(keyword) = words.next_word() {
        reader.statement(keyword, &mut words)?;
        words.next_line();
    }
    Ok(reader.finish())
}

#[derive(Default)]
struct Reader {
    with_normals: bool,
    positions: Vec<DVec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// The color of each position, or empty.
    colors: Vec<Vec4>,
    vertices: Vertices,
    /// Corners of the current face: indices of the position, the texture coordinates and the normal.
    corners: Vec<[u32; 3]>,
    /// Vertices of the current face.
    face: Vec<u32>,
    raw: RawMesh,
    group_indices: HashMap<Group, u32>,
    /// Group of the following faces.
    group: Group,
    /// True if `group` has no faces yet.
    is_new_group: bool,
    libraries: Vec<String>,
    unknown_keywords: BTreeMap<String, usize>,
}

impl Reader {
    fn statement(&mut self, keyword: &[u8], words: &mut Tokens) -> Result<(), MeshFault> {
        match keyword {
            b"v" => {
                let position = position(words).unwrap_or_else(|fault| {
                    self.raw.defects.add(damage::VERTEX, || fault);
                    DVec3::NAN
                });
                check_count(self.positions.len(), words)?;
                self.color(words);
                self.positions.push(position);
                self.vertices.first.push(NONE);
            }
            b"vt" => {
                let uv = uv(words).unwrap_or_else(|fault| {
                    self.raw.defects.add(damage::UV, || fault);
                    Vec2::ZERO
                });
                check_count(self.uvs.len(), words)?;
                self.uvs.push(uv);
            }
            b"vn" => {
                let normal = vector(words).unwrap_or_else(|fault| {
                    self.raw.defects.add(damage::NORMAL, || fault);
                    DVec3::ZERO
                });
                check_count(self.normals.len(), words)?;
                self.normals.push(unit(normal));
            }
            b"f" => self.face(words)?,
            b"g" | b"o" => {
                self.group.name = words.name();
                self.is_new_group = true;
            }
            b"usemtl" => {
                self.group.material = Some(words.name()).filter(|name| !name.is_empty());
                self.is_new_group = true;
            }
            b"mtllib" => {
                let names = words.name();
                if !names.is_empty() && !self.libraries.contains(&names) {
                    if self.libraries.len() >= MAX_LIBRARIES {
                        return Err(words.fault(format!("there must be at most {MAX_LIBRARIES} files of materials")));
                    }
                    self.libraries.push(names);
                }
            }
            _ => {
                let name = quoted(keyword);
                if self.unknown_keywords.len() < MAX_KEYWORDS || self.unknown_keywords.contains_key(&name) {
                    *self.unknown_keywords.entry(name).or_default() += 1;
                }
            }
        }
        Ok(())
    }

    fn face(&mut self, words: &mut Tokens) -> Result<(), MeshFault> {
        if self.is_new_group || self.raw.runs.is_empty() {
            self.begin_group();
        }
        self.corners.clear();
        while let Some(word) = words.next_on_line() {
            match self.corner(word, words.location()) {
                Ok(corner) => self.corners.push(corner),
                Err(message) => {
                    self.raw.defects.add(damage::FACE, || words.fault(message));
                    return Ok(());
                }
            }
        }
        let count = self.corners.len();
        if count < 3 {
            let rule = || words.fault(format!("a face must have at least 3 corners, not {count}"));
            self.raw.defects.add(damage::FACE, rule);
            return Ok(());
        }
        let corners = std::mem::take(&mut self.corners);
        self.face.clear();
        self.face
            .extend(corners.iter().map(|corner| self.vertices.index_of(*corner)));
        self.corners = corners;
        self.raw.face(&self.face, words.location())
    }

    /// Reads the color after a position. The color is sRGB, as in files of MeshLab and Blender.
    fn color(&mut self, words: &mut Tokens) {
        let mut values = [0.0; 3];
        let mut count = 0;
        while let Some(word) = words.next_on_line() {
            if let Some(value) = values.get_mut(count) {
                *value = tokens::number(word).unwrap_or(f64::NAN);
            }
            count += 1;
        }
        // A single number is a weight. A fourth number is an opacity, which viewers ignore.
        if count < 3 {
            if !self.colors.is_empty() {
                self.colors.push(Vec4::ONE);
            }
            return;
        }
        let mut color = Vec4::ONE;
        match values.iter().all(|x| x.is_finite()) {
            true => color = Vec3::from(values.map(|x| srgb_to_linear(x.clamp(0.0, 1.0)) as f32)).extend(1.0),
            false => {
                let rule = || words.fault("the color of the vertex must be three finite numbers");
                self.raw.defects.add(damage::COLOR, rule);
            }
        }
        self.colors.resize(self.positions.len(), Vec4::ONE);
        self.colors.push(color);
    }

    fn begin_group(&mut self) {
        let next_index = self.raw.groups.len() as u32;
        let index = match self.group_indices.get(&self.group) {
            Some(index) => *index,
            None => {
                self.group_indices.insert(self.group.clone(), next_index);
                self.raw.groups.push(self.group.clone());
                next_index
            }
        };
        self.raw.begin_group(index);
        self.is_new_group = false;
    }

    /// Returns the position, texture coordinate and normal indices of a corner. The error is the value and the rule.
    #[inline]
    fn corner(&mut self, word: &[u8], location: Location) -> Result<[u32; 3], String> {
        let mut fields = [&word[..0]; 3];
        for (i, field) in word.split(|byte| *byte == b'/').enumerate() {
            match fields.get_mut(i) {
                Some(slot) => *slot = field,
                None => return Err(invalid_corner(word)),
            }
        }
        let [position, uv, normal] = fields;
        let index = |field: &[u8], count: usize, kind: &str| match field {
            [] => Ok(NONE),
            _ => index(field, count, kind).unwrap_or_else(|| Err(invalid_corner(word))),
        };
        if position.is_empty() {
            return Err(invalid_corner(word));
        }
        let position = index(position, self.positions.len(), "vertex")?;
        let defects = &mut self.raw.defects;
        let mut or_none = |found: Result<u32, String>, remedy| {
            found.unwrap_or_else(|message| {
                defects.add(remedy, || location.fault(message));
                NONE
            })
        };
        let uv = or_none(index(uv, self.uvs.len(), "texture coordinate"), damage::UV);
        let normal = or_none(index(normal, self.normals.len(), "normal"), damage::NORMAL);
        Ok([position, uv, if self.with_normals { normal } else { NONE }])
    }

    fn finish(self) -> Obj {
        for (keyword, count) in &self.unknown_keywords {
            let lines = counted(*count, "line with the keyword", "lines with the keyword");
            tracing::debug!("{lines} {keyword}: ignored");
        }
        let corners = &self.vertices.corners;
        let mut raw = self.raw;
        raw.no_triangles_reason = match ["\"l\"", "\"p\""]
            .iter()
            .any(|keyword| self.unknown_keywords.contains_key(*keyword))
        {
            true => Some("points and lines are not rendered"),
            false => (!self.positions.is_empty()).then_some("the file has vertices, but no faces"),
        };
        raw.positions = corners.iter().map(|[v, _, _]| self.positions[*v as usize]).collect();
        if !self.colors.is_empty() {
            let color = |v: u32| self.colors.get(v as usize).copied().unwrap_or(Vec4::ONE);
            raw.colors = corners.iter().map(|[v, _, _]| color(*v)).collect();
        }
        let missing = corners.iter().filter(|[_, t, _]| *t == NONE).count();
        if missing < corners.len() {
            let uv = |i: u32| self.uvs.get(i as usize).copied().unwrap_or_default();
            raw.uvs = corners.iter().map(|[_, t, _]| uv(*t)).collect();
            if missing > 0 {
                raw.notes.push(counted(
                    missing,
                    "vertex has no texture coordinates, unlike other vertices; (0, 0) is used instead",
                    "vertices have no texture coordinates, unlike other vertices; (0, 0) is used instead",
                ));
            }
        }
        if corners.iter().any(|[_, _, n]| *n != NONE) {
            let normal = |i: u32| self.normals.get(i as usize).copied().unwrap_or_default();
            raw.normals = corners.iter().map(|[_, _, n]| normal(*n)).collect();
        }
        Obj {
            raw,
            libraries: self.libraries,
        }
    }
}

fn position(words: &mut Tokens) -> Result<DVec3, MeshFault> {
    let mut x = [0.0; 3];
    for (x, name) in x.iter_mut().zip(["x", "y", "z"]) {
        let value = words.number(name)?;
        *x = coordinate(value).map_err(|rule| words.fault(format!("{name}: {rule}")))?;
    }
    Ok(x.into())
}

fn vector(words: &mut Tokens) -> Result<DVec3, MeshFault> {
    Ok(DVec3::new(words.number("x")?, words.number("y")?, words.number("z")?))
}

fn uv(words: &mut Tokens) -> Result<Vec2, MeshFault> {
    let u = words.number("u")?;
    // v is optional (1D textures).
    let v = match words.next_on_line() {
        Some(word) => {
            tokens::number(word).ok_or_else(|| words.fault(format!("v: {} must be a number", quoted(word))))?
        }
        None => 0.0,
    };
    let check = |name: &str, x| texture_coordinate(x).map_err(|rule| words.fault(format!("{name}: {rule}")));
    Ok(Vec2::new(check("u", u)?, check("v", v)?))
}

fn check_count(count: usize, words: &Tokens) -> Result<(), MeshFault> {
    match count < MAX_ELEMENTS {
        true => Ok(()),
        false => Err(words.fault(format!("there must be at most {MAX_ELEMENTS} vertices"))),
    }
}

/// Parses an index into `count` elements, and returns the index counted from 0; `None` if the text is not an integer.
#[inline]
fn index(text: &[u8], count: usize, kind: &str) -> Option<Result<u32, String>> {
    let (is_negative, digits) = match text {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    if digits.is_empty() {
        return None;
    }
    let mut n: usize = 0;
    for digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        n = n.saturating_mul(10).saturating_add(usize::from(digit - b'0'));
    }
    // Valid indices are 1 to `count`, and -1 to -`count`.
    let is_in_range = n.wrapping_sub(1) < count;
    Some(match (is_in_range, is_negative) {
        (true, false) => Ok((n - 1) as u32),
        (true, true) => Ok((count - n) as u32),
        (false, _) if n == 0 => Err(format!(
            "the face refers to {kind} 0; indices count from 1, or from -1 backwards"
        )),
        (false, _) => {
            let number = String::from_utf8_lossy(&text[..text.len().min(30)]);
            Err(format!(
                "the face refers to {kind} {number}, which does not exist; defined so far: {count}"
            ))
        }
    })
}

#[cold]
fn invalid_corner(word: &[u8]) -> String {
    format!("{} must be a corner of a face: v, v/t, v//n or v/t/n", quoted(word))
}

#[derive(Default)]
struct Vertices {
    /// For each vertex, the indices of the position, the texture coordinates and the normal.
    corners: Vec<[u32; 3]>,
    /// The first vertex of each position; [`NONE`] if the position has no vertices.
    first: Vec<u32>,
    vertices_by_corner: HashTable<u32>,
    hasher: DefaultHashBuilder,
}

impl Vertices {
    /// Returns the index of the vertex of a corner, and adds the vertex if it is new.
    #[inline]
    fn index_of(&mut self, corner: [u32; 3]) -> u32 {
        let next = self.corners.len() as u32;
        let first = &mut self.first[corner[0] as usize];
        if *first == NONE {
            *first = next;
            self.corners.push(corner);
            return next;
        }
        if self.corners[*first as usize] == corner {
            return *first;
        }
        let hash = |corner: &[u32; 3]| self.hasher.hash_one(corner);
        let corners = &self.corners;
        let entry = self.vertices_by_corner.entry(
            hash(&corner),
            |vertex| corners[*vertex as usize] == corner,
            |vertex| hash(&corners[*vertex as usize]),
        );
        let index = *entry.or_insert(next).get();
        if index == next {
            self.corners.push(corner);
        }
        index
    }
}
