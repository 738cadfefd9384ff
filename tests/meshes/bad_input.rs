//! Invalid mesh files: errors with location, value and rule; no panics.

use glam::DVec3;
use wgray::mesh::{Mesh, MeshError, Normals};
use wgray::scene::{Color, Note, Reflection, Scene};

use super::load;
use super::readers::in_all_formats;
use crate::random::Random;

/// File name, contents, expected error.
const CASES: &[(&str, &str, &str)] = &[
    ("a.fbx", "", "a.fbx: the name of a mesh must end in .obj, .ply or .stl"),
    ("a", "", "a: the name of a mesh must end in .obj, .ply or .stl"),
    ("a.obj", "", "a.obj: the file is empty"),
    (
        "a.obj",
        "v 0 0 0\nv 1 0 0\nl 1 2\n",
        "a.obj: has no triangles: points and lines are not rendered",
    ),
    ("a.obj", "\nv 1 2\n", "a.obj:2: z is missing"),
    ("a.obj", "v 1 2 1,5\n", "a.obj:1: z: \"1,5\" must be a number"),
    ("a.obj", "v 1 nan 2\n", "a.obj:1: y: NaN must be from -1e9 to 1e9"),
    ("a.obj", "v \\\n1e99 2 3\n", "a.obj:2: x: 1e99 must be from -1e9 to 1e9"),
    (
        "a.obj",
        "vt 1e40 2\n",
        "a.obj:1: u: 1e40 must be finite as a 32-bit float",
    ),
    (
        "a.obj",
        "vt 1 inf\n",
        "a.obj:1: v: inf must be finite as a 32-bit float",
    ),
    ("a.obj", "vt 1 b\n", "a.obj:1: v: \"b\" must be a number"),
    ("a.obj", "vn 1 2\n", "a.obj:1: z is missing"),
    (
        "a.obj",
        "v 1 2 3\nf 1 1 2\n",
        "a.obj:2: the face refers to vertex 2, which does not exist; defined so far: 1",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1 1 -2\n",
        "a.obj:2: the face refers to vertex -2, which does not exist; defined so far: 1",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 0 1 1\n",
        "a.obj:2: the face refers to vertex 0; indices count from 1, or from -1 backwards",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1/1 1 1\n",
        "a.obj:2: the face refers to texture coordinate 1, which does not exist; defined so far: 0",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1//4294967297 1 1\n",
        "a.obj:2: the face refers to normal 4294967297, which does not exist; defined so far: 0",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1 1 99999999999999999999999999999999999999\n",
        "a.obj:2: the face refers to vertex 999999999999999999999999999999, which does not exist; defined so far: 1",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1 1\n",
        "a.obj:2: a face must have at least 3 corners, not 2",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1 1 1/2/3/4\n",
        "a.obj:2: \"1/2/3/4\" must be a corner of a face: v, v/t, v//n or v/t/n",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1 1 /\n",
        "a.obj:2: \"/\" must be a corner of a face: v, v/t, v//n or v/t/n",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1 1 1.5\n",
        "a.obj:2: \"1.5\" must be a corner of a face: v, v/t, v//n or v/t/n",
    ),
    (
        "a.obj",
        "v 1 2 3\nf 1 1 -\n",
        "a.obj:2: \"-\" must be a corner of a face: v, v/t, v//n or v/t/n",
    ),
    ("a.ply", "", "a.ply: the file is empty"),
    ("a.ply", "solid\n", "a.ply:1: the file must begin with \"ply\""),
    (
        "a.ply",
        "ply\n",
        "a.ply:2: the file ends inside the header; \"end_header\" is missing",
    ),
    (
        "a.ply",
        "ply\nend_header\n",
        "a.ply:3: the header must have a line \"format\"",
    ),
    (
        "a.ply",
        "ply\nformat text 1.0\n",
        "a.ply:2: format: \"text\" must be ascii, binary_little_endian or binary_big_endian",
    ),
    (
        "a.ply",
        "ply\nformat ascii 2.0\n",
        "a.ply:2: format: version \"2.0\" must be 1.0",
    ),
    (
        "a.ply",
        "ply\nfromat ascii\n",
        "a.ply:3: the file ends inside the header; \"end_header\" is missing",
    ),
    (
        "a.ply",
        "ply\nelement vertex -1\n",
        "a.ply:2: element \"vertex\": count \"-1\" must be a non-negative whole number that fits into memory",
    ),
    (
        "a.ply",
        "ply\nproperty float x\n",
        "a.ply:2: a property must follow its element",
    ),
    (
        "a.ply",
        "ply\nelement vertex 1\nproperty half x\n",
        "a.ply:3: property: \"half\" must be a type: char, uchar, short, ushort, int, uint, float or double",
    ),
    (
        "a.ply",
        "ply\nelement vertex 1\nproperty list float int x\n",
        "a.ply:3: property: \"float\" must be an integer type",
    ),
    (
        "a.ply",
        "ply\nelement vertex 1\nproperty int\n",
        "a.ply:3: property: the name is missing",
    ),
    ("a.stl", "", "a.stl: the file is empty"),
    (
        "a.stl",
        "solid",
        "a.stl:1: the file ends inside a solid; \"endsolid\" is missing",
    ),
    ("a.stl", "solid a\nendsolid", "a.stl: has no triangles"),
    (
        "a.stl",
        "solid\nendsolid\nfacet",
        "a.stl:3: expected \"solid\" or the end of the file, found \"facet\"",
    ),
    (
        "a.stl",
        "solid\nface",
        "a.stl:2: \"face\" must be \"facet\" or \"endsolid\"",
    ),
    ("a.stl", "solid\nfacet normal 0 0\nouter", "a.stl:2: z is missing"),
    (
        "a.stl",
        "solid\nfacet normal 0 0 1\nloop",
        "a.stl:3: \"loop\" must be \"outer\"",
    ),
    (
        "a.stl",
        "solid\nfacet normal 0 0 1\nouter",
        "a.stl:3: the file ends before \"loop\"",
    ),
    (
        "a.stl",
        "solid\nfacet normal 0 0 1\nouter loop\nvertex 1 -inf 2",
        "a.stl:4: the file ends before \"vertex\"",
    ),
];

#[test]
fn invalid_files_are_reported() {
    for (name, text, message) in CASES {
        assert_eq!(load(name, text, None).unwrap_err(), *message, "{text:?}");
    }
}

fn ply(vertex: &str, face: &str, lines: &str) -> String {
    format!("ply\nformat ascii 1.0\n{vertex}{face}end_header\n{lines}")
}

#[test]
fn invalid_ply_bodies_are_reported() {
    let vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list char int vertex_indices\n";
    let points = "0 0 0\n1 0 0\n0 1 0\n";
    for (text, message) in [
        (ply("", face, ""), "a.ply: the header must have an element \"vertex\""),
        (
            ply(vertex, "", points),
            "a.ply: has no triangles: points and lines are not rendered",
        ),
        (
            ply(vertex, "element face 0\n", points),
            "a.ply: has no triangles: points and lines are not rendered",
        ),
        (
            ply(
                vertex,
                "element tristrips 1\nproperty list int int vertex_indices\n",
                points,
            ),
            "a.ply: tristrips are not supported; the file must have an element \"face\"",
        ),
        (
            ply(
                "element vertex 1\nproperty float x\nproperty list int float z\nproperty float y\n",
                face,
                points,
            ),
            "a.ply:3: element \"vertex\": the property \"z\" is missing",
        ),
        (
            ply(
                vertex,
                "element face 1\nproperty list int float vertex_indices\n",
                points,
            ),
            "a.ply:7: element \"face\": a list of whole numbers, \"vertex_indices\", is missing",
        ),
        (
            ply(vertex, face, points),
            "a.ply:13: the file ends too early: values are missing",
        ),
        (
            ply(vertex, face, "0 0 0\n1 0 1e10\n0 1 0\n3 0 1 2\n"),
            "a.ply:11: vertex 1: z: 10000000000 must be from -1e9 to 1e9",
        ),
        (
            ply(vertex, face, "0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n"),
            "a.ply:11: \"x\" must be a number",
        ),
        (
            ply(vertex, face, &format!("{points}3 0 1 3\n")),
            "a.ply:13: face 0: vertex 3 does not exist; number of vertices, counted from 0: 3",
        ),
        (
            ply(vertex, face, &format!("{points}3 0 1 -1\n")),
            "a.ply:13: face 0: vertex -1 does not exist; number of vertices, counted from 0: 3",
        ),
        (
            ply(vertex, face, &format!("{points}3 0 1 1.5\n")),
            "a.ply:13: face 0: vertex 1.5 does not exist; number of vertices, counted from 0: 3",
        ),
        (
            ply(vertex, face, &format!("{points}2 0 1\n")),
            "a.ply:13: face 0: must have at least 3 vertices, not 2",
        ),
        (
            ply(vertex, face, &format!("{points}-3 0 1 2\n")),
            "a.ply:13: vertex_indices: the length -3 must be a whole number, 0 or greater",
        ),
        (
            ply(vertex, face, &format!("{points}4 0 1 2\n")),
            "a.ply:14: the file ends too early: values are missing",
        ),
    ] {
        let error = load("a.ply", &text, None).unwrap_err();
        assert_eq!(error, message, "{text}");
    }
}

#[test]
fn counts_without_bytes_are_refused_at_once() {
    let vertex = |count: &str, properties: &str| format!("element vertex {count}\n{properties}");
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list int int vertex_indices\n";
    for format in ["ascii", "binary_little_endian"] {
        for (elements, message) in [
            (vertex("99999999999", xyz) + face, "must be at most 1073741824"),
            (
                vertex("99999999999999999999", xyz) + face,
                "must be a non-negative whole number that fits into memory",
            ),
            (vertex("1073741824", xyz) + face, "bytes or more; remaining bytes: "),
            (
                format!(
                    "element other 99999999999\nproperty list uchar int x\n{}{face}",
                    vertex("3", xyz)
                ),
                "bytes or more; remaining bytes: ",
            ),
            (
                vertex("3", xyz) + "element face 18446744073709551615\nproperty list uchar int vertex_indices\n",
                "takes ",
            ),
        ] {
            let text = format!(
                "ply\nformat {format} 1.0\n{elements}end_header\n{}",
                "0 0 0 0 0 0 ".repeat(4)
            );
            let error = load("a.ply", text, None).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }
    // The length of a list and the number of triangles exceed the file.
    let mut list = format!(
        "ply\nformat binary_little_endian 1.0\n{}{face}end_header\n",
        vertex("3", xyz)
    )
    .into_bytes();
    list.extend([0; 36]);
    list.extend(i32::MAX.to_le_bytes());
    list.extend([0; 24]);
    let error = load("a.ply", &list, None).unwrap_err();
    assert!(
        error.ends_with("the file ends too early: values are missing"),
        "{error}"
    );
    let mut stl = vec![0; 84];
    stl[80..].fill(0xff);
    let error = load("a.stl", &stl, None).unwrap_err();
    assert_eq!(
        error,
        "a.stl: byte 80: the triangle count 4294967295 requires 214748364834 bytes; the file has 84 bytes and is truncated, or is not an STL file"
    );
}

#[test]
fn unusable_paths_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none.obj");
    let error = Mesh::load(&path, None).unwrap_err();
    assert!(matches!(error, MeshError::Read { .. }), "{error}");
    assert!(error.to_string().contains("none.obj: cannot be read: "), "{error}");
    std::fs::create_dir(&path).unwrap();
    let error = Mesh::load(&path, None).unwrap_err().to_string();
    assert!(
        error.ends_with("none.obj: cannot be read: it must be a file"),
        "{error}"
    );
}

/// Returns valid mesh files, which together use all features of the formats.
fn valid_files() -> Vec<(&'static str, Vec<u8>)> {
    let mut files = in_all_formats();
    let text = "mtllib none.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0 1\nvt 0 0.5\nvt 1\nvn 0 0 -1\nvn 0 1 0\nusemtl red\n\
                f 1/1/1 2/1/1 \\\n-1/2/2\ng b # c\nf 3//1 2//1 1//2\ns 1\nvt 2 3 4\nf 1/3 2/2 3/1\n";
    files.push(("all.obj", text.into()));
    files
}

/// Checks the invariants of a mesh or of an error message. Returns true if the file is undamaged.
fn check(name: &str, result: Result<Mesh, String>) -> bool {
    match result {
        Ok(mesh) => {
            let count = mesh.positions.len();
            assert!(!mesh.triangles.is_empty() && !mesh.groups.is_empty());
            assert!(mesh.positions.iter().all(|p| p.is_finite()));
            assert!(mesh.triangles.iter().flatten().all(|vertex| (*vertex as usize) < count));
            assert!(mesh.group_of.iter().all(|group| (*group as usize) < mesh.groups.len()));
            assert!(mesh.group_of.is_empty() || mesh.group_of.len() == mesh.triangles.len());
            assert!(mesh.uvs.is_empty() || mesh.uvs.len() == count);
            assert!(mesh.uvs.iter().all(|uv| uv.is_finite()));
            assert!(mesh.normals.is_empty() || mesh.normals.len() == count);
            for normal in &mesh.normals {
                assert!((normal.length() - 1.0).abs() < 1e-5, "{normal}");
            }
            let is_damage = |note: &Note| note.line.is_some() || note.message.starts_with("byte ");
            !mesh.notes.iter().any(is_damage)
        }
        Err(message) => {
            assert!(message.starts_with(&format!("{name}:")), "{message}");
            assert!(message.len() < 300, "{message}");
            false
        }
    }
}

const ALL_NORMALS: [Option<Normals>; 4] = [None, Some(Normals::Smooth), Some(Normals::Flat), Some(Normals::File)];

#[test]
fn truncated_files_are_meshes_or_errors() {
    for (name, bytes) in valid_files() {
        let mut errors = 0;
        for end in 0..=bytes.len() {
            let normals = ALL_NORMALS[end % 4];
            errors += usize::from(!check(name, load(name, &bytes[..end], normals)));
        }
        assert!(errors > 10, "{name}");
        assert!(check(name, load(name, &bytes, None)), "{name}");
    }
}

/// An MTL file with every supported statement, for the materials `a` and `b c`.
const MTL: &str = "# all\nnewmtl a\nKa 1 1 1\nKd 0.5 0.25 \\\n0.125\nKs 0.5\nNs 20\nd 0.5\nillum 2\nmap_Kd -s 2 2 a.png\n\
                   newmtl b c\r\nKe 1 0 0\r\nTr 1\r\nNi 1.5\r\nmap_Bump -bm 1 b.png\r\n";

/// Returns true if both materials are defined.
fn check_mtl(folder: &std::path::Path, mtl: &[u8]) -> bool {
    std::fs::write(folder.join("a.mtl"), mtl).unwrap();
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 1\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b c\nf 3/1 2/1 1/1\n";
    std::fs::write(folder.join("a.obj"), text).unwrap();
    let scene = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n\
                 [[shapes]]\ntype = 'mesh'\nfile = 'a.obj'\n";
    let origin = folder.join("s.toml").display().to_string();
    match Scene::parse(scene, &origin) {
        Ok(scene) => {
            for material in &scene.materials {
                let Reflection::Phong {
                    ambient,
                    diffuse,
                    specular,
                    shininess,
                } = &material.reflection
                else {
                    panic!("{material:?}")
                };
                for color in [ambient, diffuse, specular] {
                    let range = 0.0..=1e6;
                    let is_valid = |c: DVec3| c.to_array().iter().all(|x| range.contains(x));
                    assert!(
                        !matches!(color, Color::Plain(color) if !is_valid(*color)),
                        "{material:?}"
                    );
                }
                assert!((1e-6..=1e6).contains(shininess), "{material:?}");
            }
            assert!(
                scene.notes.iter().all(|note| note.message.len() < 500),
                "{:?}",
                scene.notes
            );
            !scene
                .notes
                .iter()
                .any(|note| note.message.ends_with("a gray material is used instead"))
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn scenes_with_truncated_material_files_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = (0..=MTL.len()).filter(|end| check_mtl(folder.path(), &MTL.as_bytes()[..*end]));
    let last = MTL.find("b c").unwrap() + 3;
    // Both materials are defined once the file contains the end of the second name.
    assert_eq!(scenes.collect::<Vec<_>>(), (last..=MTL.len()).collect::<Vec<_>>());
}

#[test]
fn scenes_with_random_bytes_in_material_files_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let random = Random::new(17);
    let long = [b"newmtl ".as_slice(), &[b'x'; 5000], b"\nmap_Kd ", &[b'y'; 5000], b"\n"].concat();
    let words: &[&[u8]] = &[
        b"nan",
        b"-1",
        b"1e308",
        b"\\\n",
        b"\n",
        b"newmtl a",
        b"newmtl b c",
        b"Kd ",
        b"map_Kd ",
        b"-o",
        b"/",
        b"..",
        b"\0",
        b"#",
        b"\xff",
        &long,
    ];
    let (mut complete, mut incomplete) = (0, 0);
    for _ in 0..1000 {
        let mut bytes = MTL.as_bytes().to_vec();
        for _ in 0..=random.below(6) {
            let offset = random.below(bytes.len() as u32) as usize;
            match random.below(4) {
                0 => bytes[offset] = random.bits() as u8,
                1 => bytes[offset] ^= 1 << random.below(8),
                2 => drop(bytes.splice(offset..offset + 1, random.pick(words).iter().copied())),
                _ => drop(bytes.drain(offset..(offset + random.below(9) as usize).min(bytes.len()))),
            }
            if bytes.is_empty() {
                break;
            }
        }
        match check_mtl(folder.path(), &bytes) {
            true => complete += 1,
            false => incomplete += 1,
        }
    }
    assert!(
        complete > 100 && incomplete > 100,
        "both materials are defined: {complete}, not defined: {incomplete}"
    );
}

#[test]
fn files_with_random_bytes_are_meshes_or_errors() {
    let random = Random::new(13);
    let words: &[&[u8]] = &[
        b"nan",
        b"-1",
        b"1e308",
        b" 99999999999",
        b"\\\n",
        b"\n",
        b"/",
        b"f ",
        b"v ",
        b"list ",
        b"\xff\xff\xff\xff",
        b"\0",
        b"#",
        b"-",
        b"4294967295",
        b"5e-324",
        b"0",
    ];
    for (name, bytes) in valid_files() {
        let (mut meshes, mut errors) = (0, 0);
        for i in 0..1000 {
            let mut bytes = bytes.clone();
            for _ in 0..=random.below(3) {
                let offset = random.below(bytes.len() as u32) as usize;
                match random.below(4) {
                    0 => bytes[offset] = random.bits() as u8,
                    1 => bytes[offset] ^= 1 << random.below(8),
                    2 => drop(bytes.splice(offset..offset + 1, random.pick(words).iter().copied())),
                    _ => drop(bytes.drain(offset..(offset + random.below(20) as usize).min(bytes.len()))),
                }
                if bytes.is_empty() {
                    break;
                }
            }
            match check(name, load(name, &bytes, ALL_NORMALS[i % 4])) {
                true => meshes += 1,
                false => errors += 1,
            }
        }
        assert!(meshes > 20 && errors > 20, "{name}: {meshes} meshes, {errors} errors");
    }
}
