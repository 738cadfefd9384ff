//! Vertex tangents for normal maps of smooth meshes.
//!
//! The tangents of a triangle are the derivatives of the position with respect to u and v. The tangents of a vertex are
//! the mean of the tangents of its triangles, projected to the plane of the vertex normal, jointly normalized and
//! weighted by angle (Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", University of Copenhagen, 2008;
//! MikkTSpace of glTF). Unlike in MikkTSpace, the derivative with respect to v is kept, so that textures are rotated
//! correctly where the two derivatives are not perpendicular. Tangents from the mesh file are used unchanged.

use glam::{DVec2, DVec3, Vec3, Vec4};
use rayon::prelude::*;

use super::Mesh;
use super::neighbours::Adjacency;

/// Maximum number of vertices with the same position that are joined, because joining compares all pairs.
const MAX_JOINED: usize = 64;
/// Minimum cosine of the angle between normals that count as equal: 1 degree.
const MIN_NORMAL_COSINE: f64 = 0.9998;
/// Minimum cosine of the angle between joined tangents: 60 degrees.
const MIN_TANGENT_COSINE: f64 = 0.5;
/// Tolerance for integer offsets between texture coordinates, because files contain rounded coordinates.
const INTEGER_TOLERANCE: f64 = 1e-4;

/// Tangents of a mesh. Vertices that triangles with a mirrored texture share with unmirrored triangles are split.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VertexTangents {
    /// Triangles of the mesh; mirrored triangles use the copies of split vertices.
    pub triangles: Vec<[u32; 3]>,
    /// The original vertex of each copy; copies are numbered after all vertices.
    pub copies: Vec<u32>,
    /// Tangents of the vertices, then of the copies.
    pub tangents: Vec<Tangents>,
}

/// Derivatives of the position, scaled so that the sum of their squared lengths is 1; zero if undefined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tangents {
    /// Derivative with respect to u.
    pub u: Vec3,
    /// Derivative with respect to v.
    pub v: Vec3,
}

impl VertexTangents {
    /// Returns the tangents; `None` if the mesh has no normals or no texture coordinates.
    pub fn of(mesh: &Mesh) -> Option<VertexTangents> {
        if mesh.uvs.is_empty() || mesh.normals.is_empty() {
            return None;
        }
        let from_mesh = |vertex: usize| {
            mesh.tangents
                .get(vertex)
                .and_then(|t| from_gltf(*t, mesh.normals[vertex]))
        };
        let (triangles, copies) = split_mirrored(mesh);
        let adjacency = Adjacency::of(&mesh.positions, &mesh.triangles);
        let mut tangents = vec![Tangents::default(); mesh.positions.len() + copies.len()];
        let found: Vec<(u32, Tangents)> = (0..adjacency.point_count())
            .into_par_iter()
            .with_min_len(1024)
            .flat_map_iter(|point| tangents_at_point(mesh, &triangles, &adjacency, point))
            .collect();
        for (vertex, found) in found {
            tangents[vertex as usize] = found;
        }
        for (vertex, vertex_tangents) in tangents.iter_mut().enumerate().take(mesh.positions.len()) {
            *vertex_tangents = from_mesh(vertex).unwrap_or(*vertex_tangents);
        }
        Some(VertexTangents {
            triangles,
            copies,
            tangents,
        })
    }
}

/// Converts a glTF tangent (glTF 2.0, 3.7.2.1); `None` if the tangent is zero.
fn from_gltf(tangent: Vec4, normal: Vec3) -> Option<Tangents> {
    let u = tangent.truncate().as_dvec3().try_normalize()?;
    let side = if tangent.w < 0.0 { -1.0 } else { 1.0 };
    let v = normal.as_dvec3().cross(u).try_normalize()? * side;
    let scale = std::f64::consts::FRAC_1_SQRT_2;
    Some(Tangents {
        u: (u * scale).as_vec3(),
        v: (v * scale).as_vec3(),
    })
}

/// Returns twice the area of a triangle in texture space; negative if the texture is mirrored.
fn texture_area([a, b, c]: [DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Splits vertices that mirrored triangles share with unmirrored triangles. Returns the triangles, and the original
/// vertex of each copy.
fn split_mirrored(mesh: &Mesh) -> (Vec<[u32; 3]>, Vec<u32>) {
    const UNMIRRORED: u8 = 1;
    const MIRRORED: u8 = 2;
    let handedness =
        |triangle: &[u32; 3]| match texture_area(triangle.map(|vertex| mesh.uvs[vertex as usize].as_dvec2())) {
            area if area > 0.0 => UNMIRRORED,
            area if area < 0.0 => MIRRORED,
            _ => 0,
        };
    let triangle_handedness: Vec<u8> = mesh.triangles.par_iter().map(handedness).collect();
    let mut vertex_handedness = vec![0; mesh.positions.len()];
    for (triangle, handedness) in mesh.triangles.iter().zip(&triangle_handedness) {
        triangle
            .iter()
            .for_each(|vertex| vertex_handedness[*vertex as usize] |= handedness);
    }
    let mut copies = Vec::new();
    let mut copy_of = vec![0; vertex_handedness.len()];
    for (vertex, handedness) in vertex_handedness.iter().enumerate() {
        let has_tangent = (mesh.tangents.get(vertex)).is_some_and(|t| from_gltf(*t, mesh.normals[vertex]).is_some());
        if *handedness == UNMIRRORED | MIRRORED && !has_tangent {
            copy_of[vertex] = (vertex_handedness.len() + copies.len()) as u32;
            copies.push(vertex as u32);
        }
    }
    let mut triangles = mesh.triangles.clone();
    for (triangle, handedness) in triangles.iter_mut().zip(&triangle_handedness) {
        for vertex in triangle {
            if *handedness == MIRRORED && copy_of[*vertex as usize] != 0 {
                *vertex = copy_of[*vertex as usize];
            }
        }
    }
    (triangles, copies)
}

/// Sums over the triangles of a vertex.
#[derive(Clone, Copy, Debug)]
struct Sum {
    vertex: u32,
    uv: DVec2,
    normal: DVec3,
    u: DVec3,
    v: DVec3,
    /// Sums of the lengths of the vectors added to `u` and `v`.
    lengths: DVec2,
}

impl Sum {
    fn plus(self, other: &Sum) -> Sum {
        Sum {
            u: self.u + other.u,
            v: self.v + other.v,
            lengths: self.lengths + other.lengths,
            ..self
        }
    }

    /// Returns true if a repeating texture is continuous between two vertices at a point, for example where u jumps
    /// from 1 to 0 on a sphere. Charts of an atlas keep separate tangents, as in MikkTSpace.
    fn is_continuous_with(&self, other: &Sum) -> bool {
        let difference = self.uv - other.uv;
        let is_integer_offset = (difference - difference.round()).abs().max_element() < INTEGER_TOLERANCE;
        let agree = |a: DVec3, b: DVec3| a.dot(b) > MIN_TANGENT_COSINE * a.length() * b.length();
        is_integer_offset
            && self.normal.dot(other.normal) > MIN_NORMAL_COSINE
            && agree(self.u, other.u)
            && agree(self.v, other.v)
    }

    fn tangents(&self) -> Tangents {
        let lengths = DVec2::new(self.u.length(), self.v.length());
        if lengths.cmpgt(self.lengths * 1e-3).all() {
            let scale = 1.0 / lengths.length();
            Tangents {
                u: (self.u * scale).as_vec3(),
                v: (self.v * scale).as_vec3(),
            }
        } else {
            Tangents::default()
        }
    }
}

/// Returns the contribution of corner `k` of a triangle; `None` if the triangle has no area in texture space.
fn corner_contribution(mesh: &Mesh, triangle: [u32; 3], k: usize, vertex: u32) -> Option<Sum> {
    let corners = [0, 1, 2].map(|i| triangle[(k + i) % 3] as usize);
    let [p, next, previous] = corners.map(|corner| mesh.positions[corner].as_dvec3());
    let uvs = corners.map(|corner| mesh.uvs[corner].as_dvec2());
    let normal = mesh.normals[corners[0]].as_dvec3();
    let (e, f) = (next - p, previous - p);
    let (a, b) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let sign = texture_area(uvs).signum();
    let in_plane = |d: DVec3| d - normal * normal.dot(d);
    let u = in_plane((e * b.y - f * a.y) * sign);
    let v = in_plane((f * a.x - e * b.x) * sign);
    let angle = f64::atan2(e.cross(f).length(), e.dot(f));
    let scale = angle / (u.length_squared() + v.length_squared()).sqrt();
    (texture_area(uvs) != 0.0 && scale.is_finite()).then(|| Sum {
        vertex,
        uv: uvs[0],
        normal,
        u: u * scale,
        v: v * scale,
        lengths: DVec2::new(u.length(), v.length()) * scale,
    })
}

fn tangents_at_point(mesh: &Mesh, triangles: &[[u32; 3]], adjacency: &Adjacency, point: usize) -> Vec<(u32, Tangents)> {
    let at_triangle = |i: &u32| {
        let triangle = mesh.triangles[*i as usize];
        let k = (0..3).find(|k| adjacency.points[triangle[*k] as usize] as usize == point)?;
        corner_contribution(mesh, triangle, k, triangles[*i as usize][k])
    };
    let mut corners: Vec<Sum> = adjacency.triangles_at(point).iter().filter_map(at_triangle).collect();
    corners.sort_by_key(|corner| corner.vertex);
    let sums: Vec<Sum> = corners
        .chunk_by(|a, b| a.vertex == b.vertex)
        .filter_map(|corners| corners.iter().copied().reduce(|sum, corner| sum.plus(&corner)))
        .collect();
    let joined = |sum: &Sum| {
        let partners = sums
            .iter()
            .filter(|other| other.vertex != sum.vertex && sums.len() <= MAX_JOINED && sum.is_continuous_with(other));
        (sum.vertex, partners.fold(*sum, Sum::plus).tangents())
    };
    sums.iter().map(joined).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    /// A mesh in the xy plane.
    fn plane(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, uv: impl Fn(Vec3) -> Vec2) -> Mesh {
        Mesh {
            uvs: positions.iter().copied().map(uv).collect(),
            normals: vec![Vec3::Z; positions.len()],
            positions,
            triangles,
            ..Mesh::default()
        }
    }

    /// Two triangles with one shared corner.
    fn bow(uv: impl Fn(Vec3) -> Vec2) -> Mesh {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, -Vec3::X, -Vec3::Y];
        plane(positions, vec![[0, 1, 2], [0, 3, 4]], uv)
    }

    #[test]
    fn tangents_have_the_directions_and_proportions_of_the_texture() {
        let mesh = bow(|p| Vec2::new(p.x / 4.0, p.x / 3.0 + p.y / 3.0));
        let found = VertexTangents::of(&mesh).unwrap();
        assert_eq!((&found.triangles, found.copies.len()), (&mesh.triangles, 0));
        for Tangents { u, v } in found.tangents {
            let expected = [Vec3::new(4.0, -4.0, 0.0), Vec3::new(0.0, 3.0, 0.0)].map(|d| d / 41f32.sqrt());
            assert!(u.abs_diff_eq(expected[0], 1e-6) && v.abs_diff_eq(expected[1], 1e-6));
        }
    }

    #[test]
    fn tangents_do_not_depend_on_triangle_size_or_number() {
        // The texture direction changes at x = 0.
        let u_at_origin = |rim: &[Vec3]| {
            let positions: Vec<Vec3> = [Vec3::ZERO].iter().chain(rim).copied().collect();
            let triangles = (1..rim.len() as u32).map(|i| [0, i, i + 1]).collect();
            let mesh = plane(positions, triangles, |p| Vec2::new(p.x, p.y - p.x.min(0.0)));
            VertexTangents::of(&mesh).unwrap().tangents[0].u
        };
        let left = Vec3::new(-0.3, 0.3, 0.0);
        let found = u_at_origin(&[Vec3::X, Vec3::Y, -Vec3::X]);
        assert!(found.y > 0.1 && found.abs_diff_eq(u_at_origin(&[Vec3::X * 9.0, Vec3::Y, left, -Vec3::X]), 1e-6));
    }

    #[test]
    fn normal_seams_split_tangents() {
        let with_normal = |normal: Vec3| {
            let mut mesh = bow(|p| Vec2::new(p.x, p.y - p.x.min(0.0)));
            mesh.triangles[1][0] = 5;
            mesh.positions.push(Vec3::ZERO);
            mesh.uvs.push(Vec2::ZERO);
            mesh.normals.push(normal.normalize());
            VertexTangents::of(&mesh).unwrap().tangents[0].u.normalize()
        };
        assert!(with_normal(Vec3::Z).y > 0.1);
        assert!(with_normal(Vec3::new(0.1, 0.0, 1.0)).abs_diff_eq(Vec3::X, 1e-6));
    }

    #[test]
    fn tangents_that_cancel_are_zero() {
        // The texture of the second triangle is rotated by 180 degrees.
        let mesh = bow(|p| p.truncate().abs());
        let found = VertexTangents::of(&mesh).unwrap().tangents;
        assert_eq!(found[0], Tangents::default());
        assert!(found[1].u.x > 0.0 && found[3].u.x < 0.0);
    }

    #[test]
    fn a_vertex_has_a_copy_for_mirrored_triangles() {
        let mesh = bow(|p| Vec2::new(p.x.abs(), p.y));
        let found = VertexTangents::of(&mesh).unwrap();
        assert_eq!((found.triangles, found.copies), (vec![[0, 1, 2], [5, 3, 4]], vec![0]));
        assert!(found.tangents[0].u.x > 0.0 && found.tangents[5].u.x < 0.0);
        assert_eq!(found.tangents.len(), 6);
    }

    #[test]
    fn too_many_vertices_at_a_point_are_not_joined() {
        // A disk of triangles with separate center vertices.
        let u_at_center = |count: u32| {
            let rim = |i: u32| Vec2::from_angle(std::f32::consts::TAU * i as f32 / count as f32).extend(0.0);
            let positions = (0..2 * count).map(|i| if i < count { rim(i) } else { Vec3::ZERO });
            let triangles = (0..count).map(|i| [count + i, i, (i + 1) % count]);
            let mesh = plane(positions.collect(), triangles.collect(), |p| {
                Vec2::new(p.x, p.y + 0.1 * p.x * p.x)
            });
            VertexTangents::of(&mesh).unwrap().tangents[count as usize]
                .u
                .normalize()
        };
        // A bent texture: the first triangle's direction is not the mean.
        assert!(u_at_center(64).y.abs() < 0.01);
        assert!(u_at_center(65).y.abs() > 0.05);
    }

    #[test]
    fn flat_or_unmapped_meshes_have_no_tangents() {
        let mesh = bow(|p| p.truncate());
        let incomplete = |lacks_uvs: bool| Mesh {
            uvs: if lacks_uvs { vec![] } else { mesh.uvs.clone() },
            normals: if lacks_uvs { mesh.normals.clone() } else { vec![] },
            ..mesh.clone()
        };
        assert_eq!(VertexTangents::of(&incomplete(true)), None);
        assert_eq!(VertexTangents::of(&incomplete(false)), None);
    }
}
