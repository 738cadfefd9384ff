//! Tangents of glTF meshes: MikkTSpace (section 3.7.2.1), and correction for texture transforms.

use std::ops::Range;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::texture::Slot;

pub struct TangentVertices {
    pub triangles: Vec<[u32; 3]>,
    /// Original index of each vertex.
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

pub fn generated(
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
            Some(corners.tangents[part.own].to_vec())
        })
        .collect::<Option<_>>()?;
    let mut made = TangentVertices {
        triangles: Vec::with_capacity(triangles.len()),
        origins: Vec::new(),
        tangents: Vec::new(),
    };
    // Linked lists of new vertices by origin: heads in `last`, links in `before`.
    let mut last = vec![u32::MAX; positions.len()];
    let mut before = Vec::new();
    for (triangle, tangents) in triangles.iter().zip(parts.iter().flatten()) {
        let mut own = *triangle;
        for (vertex, tangent) in own.iter_mut().zip(tangents) {
            let origin = *vertex;
            let mut found = last[origin as usize];
            while found != u32::MAX && made.tangents[found as usize] != *tangent {
                found = before[found as usize];
            }
            if found == u32::MAX {
                found = made.origins.len() as u32;
                made.origins.push(origin);
                made.tangents.push(*tangent);
                before.push(std::mem::replace(&mut last[origin as usize], found));
            }
            *vertex = found;
        }
        made.triangles.push(own);
    }
    Some(made)
}

/// The triangles `own` and the triangles that touch them, in the original order, so that sums are reproducible.
struct Part {
    own: Range<usize>,
    triangles: Vec<[u32; 3]>,
}

/// Partitions the triangles, so that threads can process the parts: tangents only depend on triangles that share a
/// vertex.
fn parts(positions: &[DVec3], normals: &[Vec3], uvs: &[Vec2], triangles: &[[u32; 3]]) -> Vec<Part> {
    const MOST: usize = 1 << 16;
    if triangles.len() <= MOST {
        return vec![Part {
            own: 0..triangles.len(),
            triangles: triangles.to_vec(),
        }];
    }
    // MikkTSpace merges vertices with equal attributes.
    let bits = |i: u32| {
        let i = i as usize;
        let position = positions[i].as_vec3().to_array().map(f32::to_bits);
        (
            position,
            normals[i].to_array().map(f32::to_bits),
            uvs[i].to_array().map(f32::to_bits),
        )
    };
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|i| bits(*i));
    let mut point_of = vec![0; positions.len()];
    let mut point = 0;
    for pair in order.windows(2) {
        point += u32::from(bits(pair[0]) != bits(pair[1]));
        point_of[pair[1] as usize] = point;
    }
    let chunks: Vec<(usize, &[[u32; 3]])> = triangles.chunks(MOST).enumerate().collect();
    let part = |(number, own): (usize, &[[u32; 3]])| {
        let mut is_touched = vec![false; positions.len()];
        for vertex in own.iter().flatten() {
            is_touched[point_of[*vertex as usize] as usize] = true;
        }
        let start = number * MOST;
        let touches = |triangle: &&[u32; 3]| {
            let mut points = triangle.iter().map(|vertex| point_of[*vertex as usize]);
            points.any(|point| is_touched[point as usize])
        };
        let mut part: Vec<[u32; 3]> = triangles[..start].iter().filter(touches).copied().collect();
        let own_place = part.len()..part.len() + own.len();
        part.extend(own);
        part.extend(triangles[start + own.len()..].iter().filter(touches));
        Part {
            own: own_place,
            triangles: part,
        }
    };
    chunks.into_par_iter().map(part).collect()
}

/// Rotates a file's tangent back by the texture transform: the renderer rotates normal maps with the texture, but glTF
/// does not. With the transform's second row (x, y), tangent t and bitangent b, the result is y t - x b up to a factor.
pub fn unturned(tangent: Vec4, normal: Vec3, slot: &Slot) -> Vec4 {
    if !slot.is_turned() {
        return tangent;
    }
    let (row, determinant) = slot.second_row();
    let along = tangent.truncate();
    let across = normal.cross(along) * tangent.w;
    let [x, y] = row.map(|x| x as f32);
    match determinant > 0.0 {
        true => (along * y + across * x).normalize_or_zero().extend(tangent.w),
        false => (across * x - along * y).normalize_or_zero().extend(-tangent.w),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_the_tangents_of_the_whole() {
        // A curved sheet with a half-mirrored texture; squares have their own vertices.
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
            triangles.extend([[0, 1, 2], [2, 1, 3]].map(|of: [u32; 3]| of.map(|vertex| first + vertex)));
        }
        assert!(triangles.len() > 1 << 16);
        let made = generated(&positions, &normals, &uvs, &triangles).unwrap();
        let mut whole = Corners {
            positions: &positions,
            normals: &normals,
            uvs: &uvs,
            triangles: &triangles,
            tangents: vec![[Vec4::ZERO; 3]; triangles.len()],
        };
        generate_tangents(&mut whole).unwrap();
        let mut sides = [false; 2];
        for (i, triangle) in made.triangles.iter().enumerate() {
            let found = triangle.map(|vertex| made.tangents[vertex as usize]);
            assert_eq!(found, whole.tangents[i], "{i}");
            assert_eq!(triangle.map(|vertex| made.origins[vertex as usize]), triangles[i]);
            sides[usize::from(found[0].w > 0.0)] = true;
        }
        assert_eq!(sides, [true; 2]);
    }
}
