//! Tangents of glTF meshes (glTF 2.0, section 3.7.2.1): generated with MikkTSpace, and corrected for texture
//! transforms.

use std::ops::Range;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::texture::Slot;

/// Triangles whose vertices are split where tangents differ.
pub struct TangentVertices {
    pub triangles: Vec<[u32; 3]>,
    /// For each new vertex, the index of the original vertex.
    pub origins: Vec<u32>,
    pub tangents: Vec<Vec4>,
}

struct Corners<'a> {
    positions: &'a [DVec3],
    normals: &'a [Vec3],
    uvs: &'a [Vec2],
    triangles: &'a [[u32; 3]],
    tangents: Vec<[Vec4; 3]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.triangles[face][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.positions[self.vertex(face, corner)].as_vec3().to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = space {
            let tangent = Vec4::from_array(space.tangent_encoded());
            if tangent.is_finite() && tangent.truncate() != Vec3::ZERO {
                self.tangents[face][corner] = tangent;
            }
        }
    }
}

/// Generates MikkTSpace tangents. Vertices are split where tangents differ.
pub fn generate(
    positions: &[DVec3],
    normals: &[Vec3],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
) -> Option<TangentVertices> {
    let parts = parts(positions, normals, uvs, triangles);
    let parts: Vec<Vec<[Vec4; 3]>> = (parts.into_par_iter())
        .map(|part| {
            let mut corners = Corners {
                positions,
                normals,
                uvs,
                tangents: vec![[Vec4::ZERO; 3]; part.triangles.len()],
                triangles: &part.triangles,
            };
            generate_tangents(&mut corners).ok()?;
            Some(corners.tangents[part.range].to_vec())
        })
        .collect::<Option<_>>()?;
    let mut result = TangentVertices {
        triangles: Vec::with_capacity(triangles.len()),
        origins: Vec::new(),
        tangents: Vec::new(),
    };
    // A linked list of new vertices for each original vertex.
    let mut heads = vec![u32::MAX; positions.len()];
    let mut links = Vec::new();
    for (triangle, tangents) in triangles.iter().zip(parts.iter().flatten()) {
        let mut new_triangle = *triangle;
        for (vertex, tangent) in new_triangle.iter_mut().zip(tangents) {
            let origin = *vertex;
            let mut found = heads[origin as usize];
            while found != u32::MAX && result.tangents[found as usize] != *tangent {
                found = links[found as usize];
            }
            if found == u32::MAX {
                found = result.origins.len() as u32;
                result.origins.push(origin);
                result.tangents.push(*tangent);
                links.push(std::mem::replace(&mut heads[origin as usize], found));
            }
            *vertex = found;
        }
        result.triangles.push(new_triangle);
    }
    Some(result)
}

/// A chunk of the triangles, and all triangles that touch the chunk, in the original order, so that MikkTSpace adds up
/// tangents in the order of the full mesh.
struct Part {
    /// Range of the chunk in `triangles`.
    range: Range<usize>,
    triangles: Vec<[u32; 3]>,
}

/// Splits the triangles into parts that threads process independently: the tangents of a vertex only depend on the
/// triangles around the vertex.
fn parts(positions: &[DVec3], normals: &[Vec3], uvs: &[Vec2], triangles: &[[u32; 3]]) -> Vec<Part> {
    /// Maximum number of triangles of a chunk.
    const MAX_TRIANGLES: usize = 1 << 16;
    if triangles.len() <= MAX_TRIANGLES {
        return vec![Part {
            range: 0..triangles.len(),
            triangles: triangles.to_vec(),
        }];
    }
    // MikkTSpace merges vertices with equal attributes, so these get equal indices in `merged_indices`.
    let attribute_bits = |i: u32| {
        let i = i as usize;
        let position = positions[i].as_vec3().to_array().map(f32::to_bits);
        (
            position,
            normals[i].to_array().map(f32::to_bits),
            uvs[i].to_array().map(f32::to_bits),
        )
    };
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|i| attribute_bits(*i));
    let mut merged_indices = vec![0; positions.len()];
    let mut merged_index = 0;
    for pair in order.windows(2) {
        merged_index += u32::from(attribute_bits(pair[0]) != attribute_bits(pair[1]));
        merged_indices[pair[1] as usize] = merged_index;
    }
    let chunks: Vec<(usize, &[[u32; 3]])> = triangles.chunks(MAX_TRIANGLES).enumerate().collect();
    let part = |(chunk_index, chunk): (usize, &[[u32; 3]])| {
        let mut is_touched = vec![false; positions.len()];
        for vertex in chunk.iter().flatten() {
            is_touched[merged_indices[*vertex as usize] as usize] = true;
        }
        let start = chunk_index * MAX_TRIANGLES;
        let touches = |triangle: &&[u32; 3]| {
            let mut merged_vertices = triangle.iter().map(|vertex| merged_indices[*vertex as usize]);
            merged_vertices.any(|vertex| is_touched[vertex as usize])
        };
        let mut selected: Vec<[u32; 3]> = triangles[..start].iter().filter(touches).copied().collect();
        let range = selected.len()..selected.len() + chunk.len();
        selected.extend(chunk);
        selected.extend(triangles[start + chunk.len()..].iter().filter(touches));
        Part {
            range,
            triangles: selected,
        }
    };
    chunks.into_par_iter().map(part).collect()
}

/// Rotates a tangent of the file back by the texture transform: the renderer rotates normal maps with the texture, but
/// glTF does not. With the second row (x, y) of the transform, tangent t and bitangent b, the result is y t + x b up to
/// a factor; if the determinant is negative, x b - y t with the opposite handedness.
pub fn rotate_back(tangent: Vec4, normal: Vec3, slot: &Slot) -> Vec4 {
    if !slot.rotates_tangents() {
        return tangent;
    }
    let (row, determinant) = slot.second_row();
    let t = tangent.truncate();
    let b = normal.cross(t) * tangent.w;
    let [x, y] = row.map(|x| x as f32);
    match determinant > 0.0 {
        true => (t * y + b * x).normalize_or_zero().extend(tangent.w),
        false => (b * x - t * y).normalize_or_zero().extend(-tangent.w),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_the_tangents_of_the_full_mesh() {
        // A curved sheet with a texture that is mirrored at the middle; each square has its own vertices.
        const SIDE: usize = 190;
        let mut positions = Vec::new();
        let (mut normals, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..SIDE * SIDE {
            let first = positions.len() as u32;
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let x = (i % SIDE + dx) as f64 / SIDE as f64;
                let y = (i / SIDE + dy) as f64 / SIDE as f64;
                positions.push(DVec3::new(x, y, (9.0 * x).sin() * (7.0 * y).cos()));
                normals.push(Vec3::new(x as f32 - 0.5, y as f32 - 0.5, 1.0).normalize());
                uvs.push(Vec2::new((x - 0.5).abs() as f32, (y + 0.2 * x * x) as f32));
            }
            triangles.extend([[0, 1, 2], [2, 1, 3]].map(|triangle: [u32; 3]| triangle.map(|vertex| first + vertex)));
        }
        assert!(triangles.len() > 1 << 16);
        let result = generate(&positions, &normals, &uvs, &triangles).unwrap();
        let mut full = Corners {
            positions: &positions,
            normals: &normals,
            uvs: &uvs,
            triangles: &triangles,
            tangents: vec![[Vec4::ZERO; 3]; triangles.len()],
        };
        generate_tangents(&mut full).unwrap();
        let mut sides = [false; 2];
        for (i, triangle) in result.triangles.iter().enumerate() {
            let found = triangle.map(|vertex| result.tangents[vertex as usize]);
            assert_eq!(found, full.tangents[i], "{i}");
            assert_eq!(triangle.map(|vertex| result.origins[vertex as usize]), triangles[i]);
            sides[usize::from(found[0].w > 0.0)] = true;
        }
        assert_eq!(sides, [true; 2]);
    }
}
