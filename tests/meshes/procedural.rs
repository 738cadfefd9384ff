//! Procedural meshes for tests.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use wgray::scene::{Assets, Description};
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use crate::random::Random;

/// An indexed triangle mesh. Seen from outside, the corners of triangles are counterclockwise.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Returns the cube from -1 to 1.
    pub fn cube() -> TriangleMesh {
        let point = |i: u32| {
            let side = |axis: u32| if i >> axis & 1 == 1 { 1.0 } else { -1.0 };
            DVec3::new(side(0), side(1), side(2))
        };
        let faces = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        TriangleMesh {
            points: (0..8).map(point).collect(),
            triangles: faces
                .iter()
                .flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]])
                .collect(),
        }
    }

    /// Returns a unit icosphere, subdivided `subdivisions` times.
    pub fn icosphere(subdivisions: u32) -> TriangleMesh {
        let golden_ratio = (1.0 + 5f64.sqrt()) / 2.0;
        let mut points = Vec::new();
        for (a, b) in [
            (1.0, golden_ratio),
            (-1.0, golden_ratio),
            (1.0, -golden_ratio),
            (-1.0, -golden_ratio),
        ] {
            points.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)].map(DVec3::normalize));
        }
        // Faces are triples of adjacent points.
        let is_adjacent = |i: usize, j: usize| points[i].distance(points[j]) < 1.1;
        let mut triangles = Vec::new();
        for i in 0..12 {
            for j in i + 1..12 {
                for k in j + 1..12 {
                    if is_adjacent(i, j) && is_adjacent(j, k) && is_adjacent(k, i) {
                        let faces_outward = (points[j] - points[i]).cross(points[k] - points[i]).dot(points[i]) > 0.0;
                        triangles.push(if faces_outward { [i, j, k] } else { [i, k, j] }.map(|i| i as u32));
                    }
                }
            }
        }
        let mut triangle_mesh = TriangleMesh { points, triangles };
        for _ in 0..subdivisions {
            triangle_mesh = triangle_mesh.subdivided();
        }
        triangle_mesh
    }

    fn subdivided(&self) -> TriangleMesh {
        let (mut points, mut middles, mut triangles) = (self.points.clone(), HashMap::new(), Vec::new());
        for &[a, b, c] in &self.triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i as usize] + points[j as usize]).normalize());
                    points.len() as u32 - 1
                })
            });
            triangles.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        TriangleMesh { points, triangles }
    }

    /// Returns a bipyramid over a polygon with sides of very different lengths.
    pub fn slivers(sides: u32, random: &Random) -> TriangleMesh {
        let mut angles: Vec<f64> = (0..sides).map(|_| TAU * random.unit()).collect();
        angles.sort_by(f64::total_cmp);
        let rim = angles.iter().map(|angle| DVec3::new(angle.cos(), angle.sin(), 0.0));
        let points = [DVec3::Z, DVec3::NEG_Z].into_iter().chain(rim).collect();
        let next = |i: u32| 2 + (i + 1) % sides;
        let triangles = (0..sides)
            .flat_map(|i| [[0, 2 + i, next(i)], [1, next(i), 2 + i]])
            .collect();
        TriangleMesh { points, triangles }
    }

    /// Returns triangles of random size and shape, some of which share vertices.
    pub fn soup(triangles: u32, random: &Random) -> TriangleMesh {
        let point = || DVec3::from_array([(); 3].map(|()| random.between(-1.0, 1.0)));
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for i in 0..triangles {
            let (center, size) = (point(), random.magnitude(-2.0, 0.0));
            let mut corners = [(); 3].map(|()| center + point() * size);
            match random.below(6) {
                0 => corners[2] = corners[0].lerp(corners[1], random.unit()) + point() * size * 1e-4,
                1 => corners.iter_mut().for_each(|corner| corner.z = center.z), // flat bounding box
                2 => corners = corners.map(|corner| (corner * 8.0).round() / 8.0), // on a lattice: coplanar triangles
                _ => {}
            }
            let first = points.len() as u32;
            points.extend(corners);
            faces.push([
                first,
                first + 1,
                if i > 0 && random.once_in(4) {
                    first - 1
                } else {
                    first + 2
                },
            ]);
        }
        TriangleMesh {
            points,
            triangles: faces,
        }
    }

    /// Returns a Wavefront OBJ file with three groups and per-point `vn` and `vt`.
    pub fn obj(&self, normals: Option<&[DVec3]>, uvs: Option<&[[f64; 2]]>) -> String {
        let mut text = String::new();
        for p in &self.points {
            let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
        }
        for [u, v] in uvs.unwrap_or_default() {
            let _ = writeln!(text, "vt {u} {v}");
        }
        for n in normals.unwrap_or_default() {
            let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
        }
        let third = self.triangles.len().div_ceil(3);
        for (i, triangle) in self.triangles.iter().enumerate() {
            if i % third == 0 {
                let _ = writeln!(text, "g {}", ["first", "second", "third"][i / third]);
            }
            let corner = |i: u32| match (normals.is_some(), uvs.is_some()) {
                (false, false) => format!("{}", i + 1),
                (true, false) => format!("{0}//{0}", i + 1),
                (false, true) => format!("{0}/{0}", i + 1),
                (true, true) => format!("{0}/{0}/{0}", i + 1),
            };
            let [a, b, c] = triangle.map(corner);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        text
    }
}

/// Packs a scene whose files are in `folder`.
pub fn scene(text: &str, folder: &Path) -> Packed {
    let description = Description::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let scene = description.validate_with(&Assets::beside(folder));
    pack(&scene.unwrap_or_else(|problem| panic!("{problem}\n{text}")))
}

/// Start of the scenes: an image, a camera towards the origin, materials.
pub const SCENE_START: &str = "image = { width = 48, height = 36 }
camera = { position = [0.3, -4, 1.6], look_at = [0, 0, 0], fov = 40 }
[materials.m]
type = 'phong'
color = [0.7, 0.7, 0.7]
shininess = 16
[materials.glass]
type = 'glass'
ior = 1.5
";

/// A grid of vertices on a parametric surface over u and v from 0 to 1. Vertices of a seam are duplicated.
#[derive(Clone, Debug)]
pub struct Sheet {
    pub triangle_mesh: TriangleMesh,
    pub normals: Vec<DVec3>,
    pub uvs: Vec<[f64; 2]>,
}

impl Sheet {
    /// Returns `columns` by `rows` quads; `surface` returns position and outward normal.
    pub fn of(columns: u32, rows: u32, surface: impl Fn(f64, f64) -> [DVec3; 2]) -> Sheet {
        let (mut points, mut normals, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for j in 0..=rows {
            for i in 0..=columns {
                let (u, v) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
                let [point, normal] = surface(u, v);
                points.push(point);
                normals.push(normal);
                uvs.push([u, v]);
                if i < columns && j < rows {
                    let a = j * (columns + 1) + i;
                    let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        Sheet {
            triangle_mesh: TriangleMesh { points, triangles },
            normals,
            uvs,
        }
    }

    /// Returns the unit sphere; u points east, v north.
    pub fn sphere(columns: u32, rows: u32) -> Sheet {
        Sheet::of(columns, rows, |u, v| {
            let ((sin, cos), angle) = ((TAU * u.fract()).sin_cos(), TAU / 2.0 * (v - 0.5));
            // All vertices of a pole coincide.
            let radius = if v == v.fract() && v > 0.0 { angle.cos() } else { 0.0 };
            [DVec3::new(radius * cos, radius * sin, angle.sin()); 2]
        })
    }

    /// Returns a torus around the z axis.
    pub fn torus(columns: u32, rows: u32) -> Sheet {
        Sheet::of(columns, rows, |u, v| {
            let ((sin, cos), (up, out)) = ((TAU * u.fract()).sin_cos(), (TAU * v.fract()).sin_cos());
            let normal = DVec3::new(out * cos, out * sin, up);
            [DVec3::new(cos, sin, 0.0) + normal * 0.4, normal]
        })
    }

    pub fn obj(&self) -> String {
        self.triangle_mesh.obj(Some(&self.normals), Some(&self.uvs))
    }
}
