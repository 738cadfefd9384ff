//! Mesh construction: 32-bit positions, removal of degenerate triangles, and normals.

use crate::note::Note;
use glam::{DVec3, DVec4, Vec3, Vec4};
use rayon::prelude::*;
use robust::{Coord, orient2d};

use super::error::{Location, MeshFault};
use super::neighbours::Neighbours;
use super::raw_mesh::{RawMesh, counted};
use super::{MAX_COLOR, MOST, Mesh, Normals, polygon};

pub(super) fn build_mesh(mut draft: RawMesh, normals: Option<Normals>) -> Result<Mesh, MeshFault> {
    polygon::triangulate(&mut draft);
    let mut mesh = Mesh {
        normals: draft.normals,
        uvs: draft.uvs,
        more_uvs: draft.more_uvs,
        colors: draft.colors,
        tangents: draft.tangents,
        triangles: draft.triangles,
        groups: draft.groups,
        notes: draft.notes,
        ..Mesh::default()
    };
    let count = mesh.triangles.len();
    if count == 0 {
        let reason = draft.without_triangles.map(|reason| format!(": {reason}"));
        return Err(MeshFault::empty(&reason.unwrap_or_default()));
    }
    if mesh.groups.len() > 1 {
        let ends = draft.runs.iter().skip(1).map(|(start, _)| *start).chain([count]);
        for ((_, group), end) in draft.runs.iter().zip(ends) {
            mesh.group_of.resize(end, *group);
        }
    }
    // NaN becomes 0.
    let bounded = |x: f32, most: f32| if x > 0.0 { x.min(most) } else { 0.0 };
    for color in &mut mesh.colors {
        let most = Vec4::new(MAX_COLOR, MAX_COLOR, MAX_COLOR, 1.0);
        *color = Vec4::from_array(std::array::from_fn(|i| bounded(color[i], most[i])));
    }
    keep_triangles(&mut mesh, |triangle| {
        triangle
            .iter()
            .all(|vertex| draft.positions[*vertex as usize].is_finite())
    });
    let count = mesh.triangles.len();
    if count == 0 {
        return Err(MeshFault::empty(""));
    }
    round(&mut mesh, &draft.positions);
    drop(draft.positions);
    drop_degenerate(&mut mesh);
    drop_unused(&mut mesh);
    let dropped = count - mesh.triangles.len();
    if mesh.triangles.is_empty() {
        return Err(MeshFault::empty(&format!(" but {dropped} without an area")));
    }
    if dropped > 0 {
        mesh.notes.push(removed(
            dropped,
            count,
            "has no area (degenerate)",
            "have no area (degenerate)",
        ));
    }

    // Together with the edges, this takes 0.05 s for a million triangles: a third of the time to load a binary PLY
    // file.
    let mut neighbours = Neighbours::of(&mesh.positions, &mesh.triangles);
    let edges = neighbours.edges(&mesh.triangles, &mesh.group_of);
    if !edges.repeated.is_empty() {
        drop_repeated(&mut mesh, &edges.repeated);
        neighbours = Neighbours::of(&mesh.positions, &mesh.triangles);
    }
    if edges.crowded > 0 {
        mesh.notes.push(counted(
            edges.crowded,
            "edge is shared by more than two triangles (non-manifold mesh); rendered unchanged",
            "edges are shared by more than two triangles (non-manifold mesh); rendered unchanged",
        ));
    }
    if edges.turned > 0 {
        mesh.notes.push(counted(
            edges.turned,
            "edge has inconsistent winding order (its triangles face opposite sides); rendered unchanged",
            "edges have inconsistent winding order (their triangles face opposite sides); rendered unchanged",
        ));
    }
    match normals {
        Some(Normals::Smooth) => mesh.normals = smooth(&mesh, &neighbours),
        Some(Normals::Flat) => mesh.normals = Vec::new(),
        Some(Normals::File) if mesh.normals.is_empty() => {
            return Err(
                Location::File.fault("has no normals; \"smooth\" and \"flat\" ones are made from the triangles")
            );
        }
        Some(Normals::File) | None => {
            let missing = mesh.normals.iter().filter(|normal| **normal == Vec3::ZERO).count();
            if missing > 0 {
                mesh.notes.push(counted(
                    missing,
                    "vertex has no normal, or one that is zero or not finite; it gets that of its triangles",
                    "vertices have no normal, or one that is zero or not finite; they get those of their triangles",
                ));
            }
        }
    }
    fill_normals(&mut mesh)?;
    mesh.positions.shrink_to_fit();
    mesh.normals.shrink_to_fit();
    mesh.uvs.shrink_to_fit();
    mesh.more_uvs.iter_mut().for_each(Vec::shrink_to_fit);
    mesh.colors.shrink_to_fit();
    mesh.tangents.shrink_to_fit();
    mesh.triangles.shrink_to_fit();
    Ok(mesh)
}

/// Converts positions to 32 bits, relative to their centre.
fn round(mesh: &mut Mesh, positions: &[DVec3]) {
    let used = used(&mesh.triangles, positions.len());
    mesh.center = center(positions.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p));
    let center = mesh.center;
    // -0 becomes +0, so that equal positions have equal bits.
    let rounded = |p: &DVec3| (*p - center).as_vec3() + Vec3::ZERO;
    mesh.positions = positions.iter().map(rounded).collect();
}

fn used(triangles: &[[u32; 3]], vertices: usize) -> Vec<bool> {
    let mut used = vec![false; vertices];
    for vertex in triangles.iter().flatten() {
        used[*vertex as usize] = true;
    }
    used
}

fn drop_unused(mesh: &mut Mesh) {
    let used = used(&mesh.triangles, mesh.positions.len());
    if !used.contains(&false) {
        return;
    }
    let mut next = 0;
    let mut numbers = vec![0; used.len()];
    for (number, used) in numbers.iter_mut().zip(&used) {
        *number = next;
        next += u32::from(*used);
    }
    for vertex in mesh.triangles.iter_mut().flatten() {
        *vertex = numbers[*vertex as usize];
    }
    keep(&mut mesh.positions, &used);
    keep(&mut mesh.normals, &used);
    keep(&mut mesh.uvs, &used);
    mesh.more_uvs.iter_mut().for_each(|uvs| keep(uvs, &used));
    keep(&mut mesh.colors, &used);
    keep(&mut mesh.tangents, &used);
}

/// Keeps only the marked elements of a list, which may be empty.
fn keep<T>(list: &mut Vec<T>, marks: &[bool]) {
    let mut marks = marks.iter();
    list.retain(|_| marks.next() == Some(&true));
}

/// Appends a copy of an element to a list, which may be empty.
fn repeat<T: Copy>(list: &mut Vec<T>, vertex: usize) {
    if let Some(value) = list.get(vertex).copied() {
        list.push(value);
    }
}

/// Returns the centre, rounded to a grid whose cell size is the extent, rounded up to a power of 2. Meshes around the
/// origin thus keep their coordinates, and no coordinate needs more bits than before.
fn center(positions: impl Iterator<Item = DVec3>) -> DVec3 {
    let (low, high) = positions.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    let extent = (high - low).max_element().max(f64::from(f32::MIN_POSITIVE));
    let below = f64::from_bits(extent.to_bits() & !((1 << 52) - 1));
    let cell = if below < extent { 2.0 * below } else { below };
    let middle = (low + high) / 2.0;
    // Rounds ties to even, so that a mesh from 0 to 1 keeps its coordinates.
    DVec3::from_array(middle.to_array().map(|x| (x / cell).round_ties_even() * cell + 0.0))
}

/// Returns the triangle normal; its length is twice the area. It is zero only if the exact area is zero (Shewchuk,
/// "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997).
fn area([a, b, c]: [Vec3; 3]) -> DVec3 {
    let along = |x: usize, y: usize| {
        let [a, b, c] = [a, b, c].map(|p| Coord {
            x: f64::from(p[x]),
            y: f64::from(p[y]),
        });
        orient2d(a, b, c)
    };
    DVec3::new(along(1, 2), along(2, 0), along(0, 1))
}

fn drop_degenerate(mesh: &mut Mesh) {
    let positions = std::mem::take(&mut mesh.positions);
    let has_area = |triangle: &[u32; 3]| area(triangle.map(|vertex| positions[vertex as usize])) != DVec3::ZERO;
    keep_triangles(mesh, has_area);
    mesh.positions = positions;
}

fn keep_triangles(mesh: &mut Mesh, condition: impl Fn(&[u32; 3]) -> bool + Send + Sync) {
    let marks: Vec<bool> = mesh.triangles.par_iter().map(condition).collect();
    if marks.contains(&false) {
        keep(&mut mesh.triangles, &marks);
        keep(&mut mesh.group_of, &marks);
    }
}

/// Removes duplicate triangles, which have no visible effect and which a BVH cannot separate.
fn drop_repeated(mesh: &mut Mesh, repeated: &[u32]) {
    let mut marks = vec![true; mesh.triangles.len()];
    for triangle in repeated {
        marks[*triangle as usize] = false;
    }
    keep(&mut mesh.triangles, &marks);
    keep(&mut mesh.group_of, &marks);
    drop_unused(mesh);
    let (one, several) = ("is a duplicate", "are duplicates");
    mesh.notes.push(removed(repeated.len(), marks.len(), one, several));
}

fn removed(count: usize, all: usize, one: &str, several: &str) -> Note {
    let (why, were) = match count {
        1 => (one, "was"),
        _ => (several, "were"),
    };
    let triangles = if all == 1 { "triangle" } else { "triangles" };
    format!("{count} of {all} {triangles} {why} and {were} removed").into()
}

/// Returns angle-weighted vertex normals (Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets",
/// Journal of Graphics Tools 3(1), 1998); zero if the triangle normals cancel.
fn smooth(mesh: &Mesh, neighbours: &Neighbours) -> Vec<Vec3> {
    let normal = |point: usize| {
        let sum: DVec4 = neighbours
            .around(point)
            .iter()
            .map(|triangle| {
                let triangle = mesh.triangles[*triangle as usize];
                let corners = triangle.map(|vertex| mesh.positions[vertex as usize]);
                let k = (0..3)
                    .find(|k| neighbours.points[triangle[*k] as usize] as usize == point)
                    .unwrap_or_default();
                let [p, next, previous] = [0, 1, 2].map(|i| corners[(k + i) % 3].as_dvec3());
                let (to_next, to_previous) = (next - p, previous - p);
                let angle = f64::atan2(to_next.cross(to_previous).length(), to_next.dot(to_previous));
                (area(corners).normalize() * angle).extend(angle)
            })
            .sum();
        match sum.truncate().length() > 1e-9 * sum.w {
            true => sum.truncate().normalize().as_vec3(),
            false => Vec3::ZERO,
        }
    };
    let normals: Vec<Vec3> = (0..neighbours.count()).into_par_iter().map(normal).collect();
    neighbours.points.iter().map(|point| normals[*point as usize]).collect()
}

/// Sets missing normals to triangle normals; splits vertices whose triangles have different normals.
fn fill_normals(mesh: &mut Mesh) -> Result<(), MeshFault> {
    let missing: Vec<bool> = mesh.normals.iter().map(|normal| *normal == Vec3::ZERO).collect();
    if !missing.contains(&true) {
        return Ok(());
    }
    for triangle in &mut mesh.triangles {
        let corners = triangle.map(|vertex| mesh.positions[vertex as usize]);
        for (vertex, position) in triangle.iter_mut().zip(corners) {
            let i = *vertex as usize;
            if !missing[i] {
                continue;
            }
            let normal = area(corners).normalize().as_vec3();
            if mesh.normals[i] == Vec3::ZERO {
                mesh.normals[i] = normal;
            } else if mesh.normals[i] != normal {
                if mesh.positions.len() >= MOST {
                    return Err(Location::File.fault(format!("there must be at most {MOST} vertices")));
                }
                *vertex = mesh.positions.len() as u32;
                mesh.positions.push(position);
                mesh.normals.push(normal);
                repeat(&mut mesh.uvs, i);
                mesh.more_uvs.iter_mut().for_each(|uvs| repeat(uvs, i));
                repeat(&mut mesh.colors, i);
                repeat(&mut mesh.tangents, i);
            }
        }
    }
    Ok(())
}
