//! STL files (3D Systems, "StereoLithography Interface Specification", 1989), with merged vertices.
//!
//! wgray has its own reader because the crate `stl_io` 0.11 reads only one solid of a text file, reports no line
//! numbers, and treats every file that begins with `solid` as text. The crate is not much faster: for a million
//! triangles, it takes 0.3 s without merging vertices; loading with this reader takes 0.4 s.

use std::hash::BuildHasher;

use glam::{DVec3, Vec3};
use hashbrown::{DefaultHashBuilder, HashTable};

use super::Group;
use super::damage;
use super::error::{Location, MeshFault, quoted};
use super::raw_mesh::{RawMesh, coordinate, counted, unit};
use super::tokens::Tokens;

/// Size in bytes of the header of a binary file. The header ends with the triangle count.
const HEADER: usize = 84;
/// Size in bytes of a triangle of a binary file.
const TRIANGLE: usize = 50;

pub(super) fn read(bytes: &[u8], with_normals: bool) -> Result<RawMesh, MeshFault> {
    let count = bytes
        .get(HEADER - 4..HEADER)
        .map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize);
    let size = count.map(|count| HEADER as u64 + TRIANGLE as u64 * count as u64);
    let is_text = Tokens::new(bytes)
        .next_word()
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let mut facets = Facets {
        with_normals,
        ..Facets::default()
    };
    match size {
        // Binary files are detected by their size, because they may also begin with "solid".
        Some(size) if size == bytes.len() as u64 || (!is_text && size < bytes.len() as u64) => {
            binary(&bytes[HEADER..size as usize], &mut facets)?;
            let extra = bytes.len() as u64 - size;
            if extra > 0 {
                facets.raw.notes.push(counted(
                    extra as usize,
                    "byte after the last triangle was ignored",
                    "bytes after the last triangle were ignored",
                ));
            }
        }
        _ if is_text => text(bytes, &mut facets)?,
        Some(size) => {
            return Err(Location::Byte(HEADER - 4).fault(format!(
                "the triangle count {} requires {size} bytes; the file has {} bytes and is truncated, or is not an STL \
                 file",
                count.unwrap_or_default(),
                bytes.len()
            )));
        }
        None => {
            return Err(Location::File.fault(format!(
                "the file must begin with \"solid\" or a header of {HEADER} bytes; number of bytes of the file: {}",
                bytes.len()
            )));
        }
    }
    Ok(facets.raw)
}

fn binary(bytes: &[u8], facets: &mut Facets) -> Result<(), MeshFault> {
    facets.raw.groups.push(Group::default());
    facets.raw.begin_group(0);
    let count = bytes.len() / TRIANGLE;
    facets.raw.triangles.reserve(count);
    // A closed mesh has about half as many vertices as triangles.
    facets.raw.positions.reserve(count / 2);
    facets.vertices = HashTable::with_capacity(count / 2);
    for (i, bytes) in bytes.chunks_exact(TRIANGLE).enumerate() {
        let number = |k: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|byte| bytes[4 * k + byte])));
        let vector = |k: usize| DVec3::new(number(k), number(k + 1), number(k + 2));
        let location = |k: usize| Location::Byte(HEADER + TRIANGLE * i + 4 * k);
        let normal = vector(0);
        let vertices = [3, 6, 9].map(|k| facets.position(vector(k), |axis, rule| location(k + axis).fault(rule)));
        facets.push(normal, vertices, location(0))?;
    }
    Ok(())
}

fn text(bytes: &[u8], facets: &mut Facets) -> Result<(), MeshFault> {
    let mut words = Tokens::new(bytes);
    while let Some(word) = words.next_word() {
        if !word.eq_ignore_ascii_case(b"solid") {
            return Err(words.fault(format!(
                "expected \"solid\" or the end of the file, found {}",
                quoted(word)
            )));
        }
        facets.raw.begin_group(facets.raw.groups.len() as u32);
        facets.raw.groups.push(Group {
            name: words.name(),
            material: None,
        });
        solid(&mut words, facets)?;
        words.name();
    }
    Ok(())
}

fn solid(words: &mut Tokens, facets: &mut Facets) -> Result<(), MeshFault> {
    loop {
        match words.next_word() {
            Some(word) if word.eq_ignore_ascii_case(b"endsolid") => return Ok(()),
            Some(word) if word.eq_ignore_ascii_case(b"facet") => {}
            Some(word) => return Err(words.fault(format!("{} must be \"facet\" or \"endsolid\"", quoted(word)))),
            None => {
                let rule = "the file ends inside a solid; \"endsolid\" is missing";
                facets.raw.defects.add(damage::TRUNCATED, || words.fault(rule));
                return Ok(());
            }
        }
        let location = words.location();
        expect(words, "normal")?;
        let normal = vector(words)?;
        expect(words, "outer")?;
        expect(words, "loop")?;
        let mut vertices = [DVec3::ZERO; 3];
        for vertex in &mut vertices {
            expect(words, "vertex")?;
            let point = vector(words)?;
            let fault = |axis: usize, rule| words.fault(format!("{}: {rule}", ["x", "y", "z"][axis]));
            *vertex = facets.position(point, fault);
        }
        expect(words, "endloop")?;
        expect(words, "endfacet")?;
        facets.push(normal, vertices, location)?;
    }
}

fn vector(words: &mut Tokens) -> Result<DVec3, MeshFault> {
    Ok(DVec3::new(words.number("x")?, words.number("y")?, words.number("z")?))
}

fn expect(words: &mut Tokens, keyword: &str) -> Result<(), MeshFault> {
    match words.next_word() {
        Some(word) if word.eq_ignore_ascii_case(keyword.as_bytes()) => Ok(()),
        Some(word) => Err(words.fault(format!("{} must be \"{keyword}\"", quoted(word)))),
        None => Err(words.fault(format!("the file ends before \"{keyword}\""))),
    }
}

/// The mesh under construction; triangles share bitwise equal vertices.
#[derive(Default)]
struct Facets {
    with_normals: bool,
    raw: RawMesh,
    vertices: HashTable<u32>,
    hasher: DefaultHashBuilder,
}

impl Facets {
    /// Checks a vertex. The result is NaN if the vertex is invalid; its facet is then skipped. `fault` is called with
    /// the axis and the rule.
    fn position(&mut self, p: DVec3, fault: impl FnOnce(usize, String) -> MeshFault) -> DVec3 {
        for axis in 0..3 {
            if let Err(rule) = coordinate(p[axis]) {
                self.raw.defects.add(damage::FACE, || fault(axis, rule));
                return DVec3::NAN;
            }
        }
        p + DVec3::ZERO // -0 becomes +0, so that equal positions have equal bits
    }

    fn push(&mut self, normal: DVec3, vertices: [DVec3; 3], location: Location) -> Result<(), MeshFault> {
        if !vertices.iter().all(|vertex| vertex.is_finite()) {
            return Ok(());
        }
        let normal = if self.with_normals { unit(normal) } else { Vec3::ZERO };
        let triangle = vertices.map(|vertex| self.vertex_index(vertex, normal));
        self.raw.face(&triangle, location)
    }

    fn vertex_index(&mut self, position: DVec3, normal: Vec3) -> u32 {
        let RawMesh { positions, normals, .. } = &mut self.raw;
        let bits = |p: DVec3, n: Vec3| {
            (
                p.x.to_bits(),
                p.y.to_bits(),
                p.z.to_bits(),
                n.to_array().map(f32::to_bits),
            )
        };
        let hash = |p, n| self.hasher.hash_one(bits(p, n));
        let normal_of = |i: usize| normals.get(i).copied().unwrap_or(Vec3::ZERO);
        let key = bits(position, normal);
        let next = positions.len() as u32;
        let entry = self.vertices.entry(
            hash(position, normal),
            |i| bits(positions[*i as usize], normal_of(*i as usize)) == key,
            |i| hash(positions[*i as usize], normal_of(*i as usize)),
        );
        let index = *entry.or_insert(next).get();
        if index == next {
            positions.push(position);
            if self.with_normals {
                normals.push(normal);
            }
        }
        index
    }
}
