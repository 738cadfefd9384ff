//! Mesh construction: 32-bit positions, removal of degenerate and duplicate triangles, and normals.

use crate::note::Note;
use glam::{DVec3, DVec4, Vec3, Vec4};
use rayon::prelude::*;
use robust::{Coord, orient2d};

use super::error::{Location, MeshFault};
use super::neighbours::Adjacency;
use super::raw_mesh::{RawMesh, counted};
use super::{MAX_COLOR, MAX_ELEMENTS, Mesh, Normals, polygon};

pub(super) fn build_mesh(mut raw: RawMesh, normals: Option<Normals>) -> Result<Mesh, MeshFault> {
    polygon::triangulate(&mut raw);
    let mut mesh = Mesh {
        normals: raw.normals,
        uvs: raw.uvs,
        more_uvs: raw.more_uvs,
        colors: raw.colors,
        tangents: raw.tangents,
        triangles: raw.triangles,
        groups: raw.groups,
        notes: raw.notes,
        ..Mesh::default()
    };
    let count = mesh.triangles.len();
    if count == 0 {
        let reason = raw.no_triangles_reason.map(|reason| format!(": {reason}"));
        return Err(MeshFault::empty(&reason.unwrap_or_default()));
    }
    if mesh.groups.len() > 1 {
        let ends = raw.runs.iter().skip(1).map(|(start, _)| *start).chain([count]);
        for ((_, group), end) in raw.runs.iter().zip(ends) {
            mesh.group_of.resize(end, *group);
        }
    }
    // Clamps a color component; NaN becomes 0.
    let bounded = |x: f32, max: f32| if x > 0.0 { x.min(max) } else { 0.0 };
    for color in &mut mesh.colors {
        let max = Vec4::new(MAX_COLOR, MAX_COLOR, MAX_COLOR, 1.0);
        *color = Vec4::from_array(std::array::from_fn(|i| bounded(color[i], max[i])));
    }
    keep_triangles(&mut mesh, |triangle| {
        triangle
            .iter()
            .all(|vertex| raw.positions[*vertex as usize].is_finite())
    });
    let count = mesh.triangles.len();
    if count == 0 {
        return Err(MeshFault::empty(""));
    }
    round(&mut mesh, &raw.positions);
    drop(raw.positions);
    drop_degenerate(&mut mesh);
    drop_unused(&mut mesh);
    let dropped = count - mesh.triangles.len();
    if mesh.triangles.is_empty() {
        return Err(MeshFault::empty(&format!(
            " with an area; degenerate triangles: {dropped}"
        )));
    }
    if dropped > 0 {
        mesh.notes.push(removal_note(
            dropped,
            count,
            "has no area (degenerate)",
            "have no area (degenerate)",
        ));
    }

    // For a million triangles, the adjacency and the irregularities are computed in 0.05 s, a third of the loading time
    // of a binary PLY file.
    let mut adjacency = Adjacency::of(&mesh.positions, &mesh.triangles);
    let irregularities = adjacency.find_irregularities(&mesh.triangles, &mesh.group_of);
    if !irregularities.duplicates.is_empty() {
        drop_duplicates(&mut mesh, &irregularities.duplicates);
        adjacency = Adjacency::of(&mesh.positions, &mesh.triangles);
    }
    if irregularities.non_manifold > 0 {
        mesh.notes.push(counted(
            irregularities.non_manifold,
            "edge is shared by more than two triangles (non-manifold mesh); rendered unchanged",
            "edges are shared by more than two triangles (non-manifold mesh); rendered unchanged",
        ));
    }
    if irregularities.inconsistent > 0 {
        mesh.notes.push(counted(
            irregularities.inconsistent,
            "edge has inconsistent winding order (its triangles face opposite sides); rendered unchanged",
            "edges have inconsistent winding order (their triangles face opposite sides); rendered unchanged",
        ));
    }
    match normals {
        Some(Normals::Smooth) => mesh.normals = smooth(&mesh, &adjacency),
        Some(Normals::Flat) => mesh.normals = Vec::new(),
        Some(Normals::File) if mesh.normals.is_empty() => {
            return Err(
                Location::File.fault("has no normals; \"smooth\" and \"flat\" normals are computed from the triangles")
            );
        }
        Some(Normals::File) | None => {
            let missing = mesh.normals.iter().filter(|normal| **normal == Vec3::ZERO).count();
            if missing > 0 {
                mesh.notes.push(counted(
                    missing,
                    "vertex has no valid normal; the triangle normal is used instead",
                    "vertices have no valid normals; the triangle normals are used instead",
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

/// Converts positions to 32 bits, relative to the center of the used positions.
fn round(mesh: &mut Mesh, positions: &[DVec3]) {
    let used = used_vertices(&mesh.triangles, positions.len());
    mesh.center = center(positions.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p));
    let center = mesh.center;
    // -0 becomes +0, so that equal positions have equal bits.
    let rounded = |p: &DVec3| (*p - center).as_vec3() + Vec3::ZERO;
    mesh.positions = positions.iter().map(rounded).collect();
}

fn used_vertices(triangles: &[[u32; 3]], vertex_count: usize) -> Vec<bool> {
    let mut used = vec![false; vertex_count];
    for vertex in triangles.iter().flatten() {
        used[*vertex as usize] = true;
    }
    used
}

fn drop_unused(mesh: &mut Mesh) {
    let used = used_vertices(&mesh.triangles, mesh.positions.len());
    if !used.contains(&false) {
        return;
    }
    let mut next = 0;
    let mut new_indices = vec![0; used.len()];
    for (new_index, used) in new_indices.iter_mut().zip(&used) {
        *new_index = next;
        next += u32::from(*used);
    }
    for vertex in mesh.triangles.iter_mut().flatten() {
        *vertex = new_indices[*vertex as usize];
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
fn push_copy<T: Copy>(list: &mut Vec<T>, vertex: usize) {
    if let Some(value) = list.get(vertex).copied() {
        list.push(value);
    }
}

/// Returns the center, rounded to a grid. The cell size of the grid is the extent, rounded up to a power of 2.
/// Therefore, meshes around the origin keep their coordinates, and subtracting the center adds no significant bits to a
/// coordinate.
fn center(positions: impl Iterator<Item = DVec3>) -> DVec3 {
    let (low, high) = positions.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    let extent = (high - low).max_element().max(f64::from(f32::MIN_POSITIVE));
    let floor_power = f64::from_bits(extent.to_bits() & !((1 << 52) - 1));
    let cell = if floor_power < extent {
        2.0 * floor_power
    } else {
        floor_power
    };
    let middle = (low + high) / 2.0;
    // Rounds ties to even, so that a mesh from 0 to 1 keeps its coordinates.
    DVec3::from_array(middle.to_array().map(|x| (x / cell).round_ties_even() * cell + 0.0))
}

/// Returns the triangle normal, with twice the area as length. The normal is zero only if the exact area is zero
/// (Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997).
fn area([a, b, c]: [Vec3; 3]) -> DVec3 {
    let projected_area = |x: usize, y: usize| {
        let [a, b, c] = [a, b, c].map(|p| Coord {
            x: f64::from(p[x]),
            y: f64::from(p[y]),
        });
        orient2d(a, b, c)
    };
    DVec3::new(projected_area(1, 2), projected_area(2, 0), projected_area(0, 1))
}

fn drop_degenerate(mesh: &mut Mesh) {
    let positions = std::mem::take(&mut mesh.positions);
    let has_area = |triangle: &[u32; 3]| area(triangle.map(|vertex| positions[vertex as usize])) != DVec3::ZERO;
    keep_triangles(mesh, has_area);
    mesh.positions = positions;
}

fn keep_triangles(mesh: &mut Mesh, predicate: impl Fn(&[u32; 3]) -> bool + Send + Sync) {
    let marks: Vec<bool> = mesh.triangles.par_iter().map(predicate).collect();
    if marks.contains(&false) {
        keep(&mut mesh.triangles, &marks);
        keep(&mut mesh.group_of, &marks);
    }
}

/// Removes duplicate triangles, which have no visible effect and which a BVH cannot separate.
fn drop_duplicates(mesh: &mut Mesh, duplicates: &[u32]) {
    let mut marks = vec![true; mesh.triangles.len()];
    for triangle in duplicates {
        marks[*triangle as usize] = false;
    }
    keep(&mut mesh.triangles, &marks);
    keep(&mut mesh.group_of, &marks);
    drop_unused(mesh);
    let (singular, plural) = ("is a duplicate", "are duplicates");
    mesh.notes
        .push(removal_note(duplicates.len(), marks.len(), singular, plural));
}

fn removal_note(count: usize, total: usize, singular: &str, plural: &str) -> Note {
    let (reason, were) = match count {
        1 => (singular, "was"),
        _ => (plural, "were"),
    };
    let triangles = if total == 1 { "triangle" } else { "triangles" };
    format!("{count} of {total} {triangles} {reason} and {were} removed").into()
}

/// Returns angle-weighted vertex normals (Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets",
/// Journal of Graphics Tools 3(1), 1998); zero if the triangle normals cancel.
fn smooth(mesh: &Mesh, adjacency: &Adjacency) -> Vec<Vec3> {
    let normal = |point: usize| {
        let sum: DVec4 = adjacency
            .triangles_at(point)
            .iter()
            .map(|triangle| {
                let triangle = mesh.triangles[*triangle as usize];
                let corners = triangle.map(|vertex| mesh.positions[vertex as usize]);
                let k = (0..3)
                    .find(|k| adjacency.points[triangle[*k] as usize] as usize == point)
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
    let normals: Vec<Vec3> = (0..adjacency.point_count()).into_par_iter().map(normal).collect();
    adjacency.points.iter().map(|point| normals[*point as usize]).collect()
}

/// Replaces missing normals by triangle normals; splits vertices whose triangles have different normals.
fn fill_normals(mesh: &mut Mesh) -> Result<(), MeshFault> {
    let is_missing: Vec<bool> = mesh.normals.iter().map(|normal| *normal == Vec3::ZERO).collect();
    if !is_missing.contains(&true) {
        return Ok(());
    }
    for triangle in &mut mesh.triangles {
        let corners = triangle.map(|vertex| mesh.positions[vertex as usize]);
        for (vertex, position) in triangle.iter_mut().zip(corners) {
            let i = *vertex as usize;
            if !is_missing[i] {
                continue;
            }
            let normal = area(corners).normalize().as_vec3();
            if mesh.normals[i] == Vec3::ZERO {
                mesh.normals[i] = normal;
            } else if mesh.normals[i] != normal {
                if mesh.positions.len() >= MAX_ELEMENTS {
                    return Err(Location::File.fault(format!("there must be at most {MAX_ELEMENTS} vertices")));
                }
                *vertex = mesh.positions.len() as u32;
                mesh.positions.push(position);
                mesh.normals.push(normal);
                push_copy(&mut mesh.uvs, i);
                mesh.more_uvs.iter_mut().for_each(|uvs| push_copy(uvs, i));
                push_copy(&mut mesh.colors, i);
                push_copy(&mut mesh.tangents, i);
            }
        }
    }
    Ok(())
}
