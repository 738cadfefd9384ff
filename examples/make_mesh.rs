//! Writes procedural meshes: the knot of `scenes/meshes/`, and large meshes for measurements.
//!
//! ```sh
//! cargo run --release --example make_mesh -- knot scenes/meshes/knot.obj
//! cargo run --release --example make_mesh -- terrain 1000000 target/terrain.ply
//! cargo run --release --example make_mesh -- rock 1000000 target/rock.ply
//! ```
//!
//! The number is the approximate number of triangles. The file extension selects the format: `.obj`, or one of the
//! binary formats `.ply`, `.stl` and `.glb`. +Z is up, except in `.glb`, where +Y is up.

use std::collections::HashMap;
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let (name, bytes) = match *args {
        [] => ("target/knot.obj", knot().into_bytes()),
        ["knot", file] => (file, knot().into_bytes()),
        ["terrain", count, file] => (file, terrain(count.parse()?).to_bytes(file)?),
        ["rock", count, file] => (file, rock(count.parse()?).to_bytes(file)?),
        _ => return Err("usage: make_mesh [knot FILE | terrain TRIANGLES FILE | rock TRIANGLES FILE]".into()),
    };
    std::fs::write(name, &bytes)?;
    println!("{name}: {} bytes", bytes.len());
    Ok(())
}

/// Number of points along the knot.
const POINTS_ALONG: usize = 216;
/// Number of points around the tube.
const POINTS_AROUND: usize = 12;

/// Returns a closed tube along the (2, 3) torus knot as the text of an OBJ file, with unit normals and texture
/// coordinates. The knot is scaled to a width of 0.8 and rests on the plane z = 0.
pub fn knot() -> String {
    // The major and the minor radius of the torus on which the knot lies, and the radius of the tube.
    const MAJOR_RADIUS: f64 = 0.23;
    const MINOR_RADIUS: f64 = 0.1;
    const TUBE_RADIUS: f64 = 0.065;
    let mut positions = Vec::new();
    let mut normals = Vec::new();
    for i in 0..POINTS_ALONG {
        let t = TAU * i as f64 / POINTS_ALONG as f64;
        let ((sin_a, cos_a), (sin_b, cos_b)) = ((2.0 * t).sin_cos(), (3.0 * t).sin_cos());
        let radius = MAJOR_RADIUS + MINOR_RADIUS * cos_b;
        let center = [radius * cos_a, radius * sin_a, MINOR_RADIUS * sin_b];
        // The curve lies on a torus, so the normal of the torus is perpendicular to the curve.
        let outward = [cos_b * cos_a, cos_b * sin_a, sin_b];
        let tangent = unit([
            -3.0 * MINOR_RADIUS * sin_b * cos_a - 2.0 * radius * sin_a,
            -3.0 * MINOR_RADIUS * sin_b * sin_a + 2.0 * radius * cos_a,
            3.0 * MINOR_RADIUS * cos_b,
        ]);
        let side = cross(outward, tangent);
        for j in 0..POINTS_AROUND {
            let (sin, cos) = (TAU * j as f64 / POINTS_AROUND as f64).sin_cos();
            let normal: [f64; 3] = std::array::from_fn(|k| cos * outward[k] + sin * side[k]);
            let position: [f64; 3] = std::array::from_fn(|k| center[k] + TUBE_RADIUS * normal[k]);
            positions.push(position);
            normals.push(normal);
        }
    }
    let width = 2.0 * positions.iter().map(|p| p[0].abs().max(p[1].abs())).fold(0.0, f64::max);
    let lowest = positions.iter().map(|p| p[2]).fold(0.0, f64::min);

    let mut text = String::from(
        "# A tube along the (2, 3) torus knot. Made by: cargo run --release --example make_mesh -- knot FILE\no knot\n",
    );
    let mut line = |content: std::fmt::Arguments| {
        text.write_fmt(content).expect("writing to a string succeeds");
        text.push('\n');
    };
    let rounded = |x: f64| (x * 1e4).round() / 1e4 + 0.0;
    for p in positions {
        let [x, y, z] = [p[0], p[1], p[2] - lowest].map(|x| rounded(x * 0.8 / width));
        line(format_args!("v {x} {y} {z}"));
    }
    for n in normals {
        let [x, y, z] = n.map(|x| (x * 1e3).round() / 1e3 + 0.0);
        line(format_args!("vn {x} {y} {z}"));
    }
    // One repetition of the texture is about square on the tube.
    for i in 0..=POINTS_ALONG {
        for j in 0..=POINTS_AROUND {
            let (u, v) = (i as f64 / POINTS_AROUND as f64, j as f64 / POINTS_AROUND as f64);
            line(format_args!("vt {} {}", rounded(u), rounded(v)));
        }
    }
    for i in 0..POINTS_ALONG {
        for j in 0..POINTS_AROUND {
            let corner = |i: usize, j: usize| {
                let vertex = i % POINTS_ALONG * POINTS_AROUND + j % POINTS_AROUND + 1;
                format!("{vertex}/{}/{vertex}", i * (POINTS_AROUND + 1) + j + 1)
            };
            let [a, b] = [corner(i, j), corner(i + 1, j)];
            let [c, d] = [corner(i + 1, j + 1), corner(i, j + 1)];
            line(format_args!("f {a} {b} {c} {d}"));
        }
    }
    text
}

/// An indexed triangle mesh.
pub struct Triangles {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Vertex indices, counterclockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// Encodes the mesh as a file; the extension of `file` selects the format.
    pub fn to_bytes(&self, file: &str) -> Result<Vec<u8>, Box<dyn Error>> {
        match Path::new(file).extension().and_then(|extension| extension.to_str()) {
            Some("obj") => Ok(self.to_obj()),
            Some("ply") => Ok(self.to_ply()),
            Some("stl") => Ok(self.to_stl()),
            Some("glb") => Ok(self.to_glb()),
            _ => Err(format!("{file:?} must end in .obj, .ply, .stl or .glb").into()),
        }
    }

    fn to_obj(&self) -> Vec<u8> {
        let mut text = String::new();
        for [x, y, z] in &self.positions {
            writeln!(text, "v {x} {y} {z}").expect("writing to a string succeeds");
        }
        for [a, b, c] in self.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + 1)) {
            writeln!(text, "f {a} {b} {c}").expect("writing to a string succeeds");
        }
        text.into_bytes()
    }

    /// Returns a .glb file with one mesh of one primitive.
    fn to_glb(&self) -> Vec<u8> {
        let (vertices, indices) = (self.positions.len(), 3 * self.triangles.len());
        let mut binary = Vec::with_capacity(12 * vertices + 4 * indices);
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for [x, y, z] in &self.positions {
            for (k, x) in [*x, *z, -*y].into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(x), high[k].max(x));
                binary.extend(x.to_le_bytes());
            }
        }
        for vertex in self.triangles.iter().flatten() {
            binary.extend(vertex.to_le_bytes());
        }
        let (binary_len, index_offset) = (binary.len(), 12 * vertices);
        let mut json =
            r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"#.to_owned();
        json += r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],"#;
        json += r#""materials":[{"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.5}}],"#;
        json += &format!(r#""accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","#);
        json += &format!(r#""min":{low:?},"max":{high:?}}},"#);
        json += &format!(r#"{{"bufferView":1,"componentType":5125,"count":{indices},"type":"SCALAR"}}],"#);
        json += &format!(r#""bufferViews":[{{"buffer":0,"byteLength":{index_offset}}},"#);
        json += &format!(
            r#"{{"buffer":0,"byteOffset":{index_offset},"byteLength":{}}}],"buffers":[{{"byteLength":{binary_len}}}]}}"#,
            binary_len - index_offset
        );
        json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
        let mut bytes = b"glTF".to_vec();
        let word = |bytes: &mut Vec<u8>, x: usize| bytes.extend((x as u32).to_le_bytes());
        word(&mut bytes, 2);
        word(&mut bytes, 12 + 8 + json.len() + 8 + binary_len);
        word(&mut bytes, json.len());
        bytes.extend(b"JSON");
        bytes.extend(json.as_bytes());
        word(&mut bytes, binary_len);
        bytes.extend(b"BIN\0");
        bytes.extend(binary);
        bytes
    }

    fn to_ply(&self) -> Vec<u8> {
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
             property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.triangles.len()
        )
        .into_bytes();
        for x in self.positions.iter().flatten() {
            bytes.extend(x.to_le_bytes());
        }
        for triangle in &self.triangles {
            bytes.push(3);
            triangle.iter().for_each(|vertex| bytes.extend(vertex.to_le_bytes()));
        }
        bytes
    }

    fn to_stl(&self) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((self.triangles.len() as u32).to_le_bytes());
        for triangle in &self.triangles {
            bytes.extend([0; 12]); // no normal
            for x in triangle.iter().flat_map(|vertex| self.positions[*vertex as usize]) {
                bytes.extend(x.to_le_bytes());
            }
            bytes.extend([0; 2]);
        }
        bytes
    }
}

/// Returns hills of about `count` triangles over the square |x|, |y| <= 1, with z >= 0.
pub fn terrain(count: usize) -> Triangles {
    // Cells along an edge of the square.
    let side = ((count as f64 / 2.0).sqrt().round() as usize).max(1);
    let coordinate = |i: usize| 2.0 * i as f64 / side as f64 - 1.0;
    let mut positions = Vec::with_capacity((side + 1) * (side + 1));
    for (i, j) in (0..=side).flat_map(|i| (0..=side).map(move |j| (i, j))) {
        let (x, y) = (coordinate(j), coordinate(i));
        let height = 0.25 + 0.3 * noise([1.5 * x, 1.5 * y, 0.0], 10);
        positions.push([x, y, height.max(0.0)].map(|x| x as f32));
    }
    let mut triangles = Vec::with_capacity(2 * side * side);
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        let a = (i * (side + 1) + j) as u32;
        let [b, d] = [a + 1, a + side as u32 + 1];
        triangles.extend([[a, b, d + 1], [a, d + 1, d]]);
    }
    Triangles { positions, triangles }
}

/// Returns a closed asteroid of about `count` triangles and a radius of about 0.4 around the origin: a cube projected
/// onto a sphere, displaced by noise of ten octaves.
pub fn rock(count: usize) -> Triangles {
    // Cells along an edge of the cube.
    let side = ((count as f64 / 12.0).sqrt().round() as usize).max(1);
    let mut positions = Vec::with_capacity(6 * side * side + 2);
    let mut triangles = Vec::with_capacity(12 * side * side);
    let mut vertices = HashMap::with_capacity(6 * side * side + 2);
    let mut vertex = |lattice: [usize; 3]| -> u32 {
        *vertices.entry(lattice).or_insert_with(|| {
            // Equiangular coordinates: the tangent gives the cells similar sizes on the sphere.
            let on_cube = lattice.map(|i| ((2.0 * i as f64 / side as f64 - 1.0) * TAU / 8.0).tan());
            let direction = unit(on_cube);
            let radius = 0.4 + 0.16 * noise(direction.map(|x| 1.3 * x + 7.0), 10);
            positions.push(direction.map(|x| (radius * x) as f32));
            positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for (face_position, i, j) in [0, side]
            .into_iter()
            .flat_map(|face_position| (0..side).flat_map(move |i| (0..side).map(move |j| (face_position, i, j))))
        {
            let mut corner = |i: usize, j: usize| {
                let mut lattice = [face_position; 3];
                (lattice[(axis + 1) % 3], lattice[(axis + 2) % 3]) = (i, j);
                vertex(lattice)
            };
            let [a, b] = [corner(i, j), corner(i + 1, j)];
            let [c, d] = [corner(i + 1, j + 1), corner(i, j + 1)];
            triangles.extend(match face_position {
                0 => [[a, c, b], [a, d, c]],
                _ => [[a, b, c], [a, c, d]],
            });
        }
    }
    Triangles { positions, triangles }
}

/// Returns value noise from about -1 to 1, summed over octaves; each octave halves the size and the amplitude. Ebert et
/// al., "Texturing and Modeling: A Procedural Approach", chapters 2 and 16.
fn noise(mut point: [f64; 3], octaves: u32) -> f64 {
    let mut sum = 0.0;
    let mut amplitude = 0.5;
    for octave in 0..octaves {
        let cell = point.map(f64::floor);
        // Smoothstep: 3 t^2 - 2 t^3.
        let weight: [f64; 3] = std::array::from_fn(|k| {
            let t = point[k] - cell[k];
            t * t * (3.0 - 2.0 * t)
        });
        let cell = cell.map(|x| x as i64);
        let value_at = |corner: [i64; 3]| value(std::array::from_fn(|k| cell[k] + corner[k]), octave);
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let edge = |y: i64, z: i64| mix(value_at([0, y, z]), value_at([1, y, z]), weight[0]);
        let face = |z: i64| mix(edge(0, z), edge(1, z), weight[1]);
        sum += amplitude * mix(face(0), face(1), weight[2]);
        amplitude *= 0.5;
        // The offset prevents the lattices of the octaves from coinciding.
        point = point.map(|x| 2.0 * x + 0.37);
    }
    2.0 * sum
}

/// Returns a random value from -1 to 1 for a lattice point, by the mixing function of SplitMix64: Steele, Lea and
/// Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
fn value(cell: [i64; 3], octave: u32) -> f64 {
    let mut z = u64::from(octave);
    for k in cell {
        z = (z ^ k as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
    }
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
    a.map(|x| x / length)
}
