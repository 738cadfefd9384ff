//! Readers of OBJ, PLY and STL files.

use wgray::mesh::{Mesh, Normals};

use super::{corners, load};

const TWO_TRIANGLES: [[[f64; 3]; 3]; 2] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
];
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Returns the positions, of which one is unused, and the polygons of a solid.
fn crystal() -> (Vec<[f32; 3]>, Vec<Vec<u32>>) {
    let positions = vec![
        [0.1, 0.2, 0.3],
        [1.1, 0.2, 0.3],
        [1.1, 1.3, 0.3],
        [0.1, 1.3, 0.3],
        [0.5, 0.75, 1.7e-3],
        [0.6, 0.7, 2.5],
    ];
    let faces = vec![
        vec![0, 1, 5],
        vec![1, 2, 5],
        vec![2, 3, 5],
        vec![3, 0, 5],
        vec![1, 0, 3, 2],
    ];
    (positions, faces)
}

/// Returns the solid of [`crystal`] as a file in each format: name and contents.
pub fn in_all_formats() -> Vec<(&'static str, Vec<u8>)> {
    let (positions, faces) = crystal();
    let fans: Vec<[u32; 3]> = faces
        .iter()
        .flat_map(|face| (2..face.len()).map(|i| [face[0], face[i - 1], face[i]]))
        .collect();

    let mut obj = String::from("o crystal\r\n");
    for [x, y, z] in &positions {
        obj += &format!("v {x} {y} {z}\n");
    }
    let mut ascii_ply = ply_header("ascii");
    for [x, y, z] in &positions {
        ascii_ply += &format!("{x} {y} {z}\n");
    }
    let mut little_endian = ply_header("binary_little_endian").into_bytes();
    let mut big_endian = ply_header("binary_big_endian").into_bytes();
    for x in positions.iter().flatten() {
        little_endian.extend(x.to_le_bytes());
        big_endian.extend(x.to_be_bytes());
    }
    for face in &faces {
        let numbers = |first: u32| face.iter().map(move |i| format!(" {}", i + first)).collect::<String>();
        obj += &format!("f{}\n", numbers(1));
        ascii_ply += &format!("{}{}\n", face.len(), numbers(0));
        for bytes in [&mut little_endian, &mut big_endian] {
            bytes.push(face.len() as u8);
        }
        for i in face {
            little_endian.extend(i.to_le_bytes());
            big_endian.extend(i.to_be_bytes());
        }
    }
    let mut ascii_stl = String::from("solid crystal\n");
    let mut binary_stl = b"solid as many binary files begin".to_vec();
    binary_stl.resize(80, b' ');
    binary_stl.extend((fans.len() as u32).to_le_bytes());
    for fan in &fans {
        ascii_stl += "facet normal 0 0 0\n  outer loop\n";
        binary_stl.extend([0; 12]);
        for [x, y, z] in fan.map(|i| positions[i as usize]) {
            ascii_stl += &format!("    vertex {x} {y} {z}\n");
            binary_stl.extend([x, y, z].iter().flat_map(|x| x.to_le_bytes()));
        }
        ascii_stl += "  endloop\nendfacet\n";
        binary_stl.extend([0; 2]);
    }
    ascii_stl += "endsolid crystal\n";
    vec![
        ("crystal.obj", obj.into_bytes()),
        ("ascii.ply", ascii_ply.into_bytes()),
        ("little.PLY", little_endian),
        ("big.ply", big_endian),
        ("ascii.stl", ascii_stl.into_bytes()),
        ("binary.Stl", binary_stl),
    ]
}

fn ply_header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment of a test\nelement vertex 6\nproperty float x\nproperty float y\n\
         property float z\nelement face 5\nproperty list uchar uint vertex_indices\nend_header\n"
    )
}

#[test]
fn readers_of_all_formats_return_the_same_triangles() {
    let (positions, faces) = crystal();
    let mut expected = Vec::new();
    for face in &faces {
        for i in 2..face.len() {
            expected.push([face[0], face[i - 1], face[i]].map(|i| positions[i as usize]));
        }
    }
    for (name, bytes) in in_all_formats() {
        for normals in [None, Some(Normals::Flat), Some(Normals::Smooth)] {
            let mesh = load(name, &bytes, normals).unwrap();
            let triangles: Vec<_> = mesh
                .triangles
                .iter()
                .map(|triangle| triangle.map(|vertex| mesh.positions[vertex as usize].to_array()))
                .collect();
            assert_eq!(mesh.center.to_array(), [0.0; 3], "{name}");
            assert_eq!(triangles, expected, "{name}");
            // The unused position is removed.
            assert_eq!(mesh.positions.len(), 5, "{name}");
            assert_eq!(mesh.groups.len(), 1, "{name}");
            assert_eq!(mesh.notes, Vec::<String>::new(), "{name}");
            assert_eq!(mesh.normals.is_empty(), normals != Some(Normals::Smooth), "{name}");
        }
    }
}

#[test]
fn obj_corners_may_have_any_syntax() {
    let text = "# a square\r\nv 0 0 0 1.0 0.5 0.5\r\nv 1 0 0 1\nv 1 1 0\n\tv 0 1 0 # the last one\nvt 0 0\nvt 1 0 0\nvt 1\n\
                vn 0 0 2\nf 1 2 \\\n 3\nf -4/1 -2/3/1 \\\r\n  4//1\ncurv 0 1 \\\n 2 3\ns off\nl 1 2\n";
    let mesh = load("a.obj", text, None).unwrap();
    assert_eq!(corners(&mesh), TWO_TRIANGLES);
    // A corner without texture coordinates needs its own vertex.
    assert_eq!(mesh.positions.len(), 6);
    let uvs: Vec<[f32; 2]> = mesh.uvs.iter().map(|uv| uv.to_array()).collect();
    assert_eq!(uvs[3..], [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]);
    assert!(mesh.normals.iter().all(|normal| normal.to_array() == [0.0, 0.0, 1.0]));
    assert_eq!(mesh.notes.len(), 2, "{:?}", mesh.notes);
}

#[test]
fn equal_obj_corners_share_a_vertex() {
    let text =
        format!("{SQUARE}vt 0 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/2/1 4/1/1\nf 4/1/1 3/2/1 1/1/1\n");
    let mesh = load("a.obj", &text, None).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 3, 4], [4, 3, 0]]);
    // Different normals split a vertex only if normals are read.
    let text = format!("{SQUARE}vn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n");
    let position_count = |normals| load("a.obj", &text, normals).unwrap().positions.len();
    assert_eq!(position_count(None), 6);
    assert_eq!(position_count(Some(Normals::File)), 6);
    assert_eq!(position_count(Some(Normals::Flat)), 4);
    assert_eq!(position_count(Some(Normals::Smooth)), 4);
}

#[test]
fn lines_may_end_with_carriage_returns() {
    let text = format!("mtllib none\\.mtl # a\n{SQUARE}g a b\nf 1 2 \\\n3\nf 1 3 4\n");
    let expected = load("a.obj", &text, None).unwrap();
    let mesh = load("a.obj", text.replace('\n', "\r"), None).unwrap();
    assert_eq!(corners(&mesh), TWO_TRIANGLES);
    assert_eq!(mesh.groups, expected.groups);
    // A lone carriage return ends a line and is counted in line numbers.
    let error = load("a.obj", "v 0 0 0\r\rv 0 1\r", None).unwrap_err();
    assert_eq!(error, "a.obj:3: z is missing");
    let mesh = load("a.stl", SOLIDS.replace('\n', "\r"), None).unwrap();
    assert_eq!((corners(&mesh), mesh.groups.len()), (TWO_TRIANGLES.to_vec(), 3));
    let ply = "ply\rformat ascii 1.0\relement vertex 3\rproperty float x\rproperty float y\rproperty float z\r\
               element face 1\rproperty list uchar int vertex_index\rend_header\r0 0 0\r1 0 0\r1 1 0\r3 0 1 2\r";
    assert_eq!(corners(&load("a.ply", ply, None).unwrap()), TWO_TRIANGLES[..1]);
}

#[test]
fn a_backslash_may_end_a_file() {
    let mesh = load("a.obj", format!("{SQUARE}f 1 2 3\nf 1 3 4 \\"), None).unwrap();
    assert_eq!(corners(&mesh), TWO_TRIANGLES);
    let error = load("a.obj", format!("{SQUARE}f 1 2\\"), None).unwrap_err();
    assert_eq!(error, "a.obj:5: a face must have at least 3 corners, not 2");
}

#[test]
fn a_convex_obj_polygon_is_split_into_a_fan() {
    let mesh = load(
        "a.obj",
        "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 5 1 2 3 4\n",
        None,
    )
    .unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert_eq!(mesh.positions[0].to_array(), [0.0, 2.0, 0.0]);
}

#[test]
fn degenerate_triangles_are_dropped_and_counted() {
    // Triangles with equal indices, equal positions or collinear points; the last triangle is only nearly degenerate.
    let text = "v 0 0 0\nv 1 1 1\nv 0.1 0.1 0.1\nv 0 0 0\nv 0.1 0.1 0.10000001\nv -0 0 0\n\
                g a\nf 1 1 2\nf 1 4 2\nf 1 2 3\nf 6 2 1\ng b\nf 1 2 5\n";
    let mesh = load("a.obj", text, Some(Normals::Smooth)).unwrap();
    assert_eq!(mesh.triangles.len(), 1);
    assert_eq!(
        mesh.notes,
        ["4 of 5 triangles have no area (degenerate) and were removed"]
    );
    assert_eq!(mesh.group_of, [1]);
    assert!(mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-6));
    let error = load("a.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", None).unwrap_err();
    assert_eq!(error, "a.obj: has no triangles with an area; degenerate triangles: 1");
    // The last point is collinear in decimal, but not in binary.
    let mesh = load(
        "a.obj",
        "v 0 0 0\nv 0.1 0.3 0\nv 0.2 0.6 0\nv 0.3 0.9 0\nf 1 2 3\nf 1 2 4\n",
        None,
    )
    .unwrap();
    assert_eq!(mesh.triangles.len(), 1);
}

#[test]
fn duplicate_triangles_are_dropped_and_counted() {
    let text = format!("{SQUARE}v 0 0 0\nf 1 2 3\nf 1 3 4\nf 2 3 5\n");
    let mesh = load("a.obj", &text, Some(Normals::Smooth)).unwrap();
    assert_eq!(corners(&mesh), TWO_TRIANGLES);
    assert_eq!(
        (mesh.positions.len(), &mesh.notes[..]),
        (4, &["1 of 3 triangles is a duplicate and was removed".into()][..])
    );
    // A duplicate in another group or with another winding order is kept.
    let mesh = load("a.obj", text.replace("f 2 3 5", "g b\nf 2 3 5"), None).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.notes.len()), (3, 2), "{:?}", mesh.notes);
    let mesh = load("a.obj", text.replace("f 2 3 5", "f 3 2 5"), None).unwrap();
    assert_eq!(mesh.triangles.len(), 3);
    let repeated = load("a.obj", format!("{text}{}", "f 1 3 4\nf 3 4 1\n".repeat(1000)), None).unwrap();
    assert_eq!(corners(&repeated), TWO_TRIANGLES);
    assert_eq!(
        repeated.notes,
        ["2001 of 2003 triangles are duplicates and were removed"]
    );
}

#[test]
fn obj_groups_are_pairs_of_name_and_material() {
    let [first, second, third] = ["f 1 2 3\n", "f 1 3 4\n", "f 1 2 4\n"];
    let text = format!(
        "{SQUARE}{first}o box\nusemtl dark red\n{first}g lid of it\nusemtl blue\n{first}o box\nusemtl dark red\n{second}\
         {third}o empty\ng lid of it\n{first}usemtl blue\n{second}usemtl\n{first}"
    );
    let mesh = load("a.obj", text, None).unwrap();
    let groups: Vec<(&str, Option<&str>)> = mesh
        .groups
        .iter()
        .map(|group| (group.name.as_str(), group.material.as_deref()))
        .collect();
    assert_eq!(
        groups,
        [
            ("", None),
            ("box", Some("dark red")),
            ("lid of it", Some("blue")),
            ("lid of it", Some("dark red")),
            ("lid of it", None)
        ]
    );
    assert_eq!(mesh.group_of, [0, 1, 2, 1, 1, 3, 2, 4]);
}

#[test]
fn materials_come_from_the_folder_of_the_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir_all(inner.join("more")).unwrap();
    std::fs::write(inner.join("more/my red.mtl"), "newmtl red\nKd 1 0 0\nNs a\nNi b\n").unwrap();
    std::fs::write(inner.join("blue.mtl"), "newmtl blue\n").unwrap();
    std::fs::write(folder.path().join("outside.mtl"), "newmtl secret\n").unwrap();
    let path = inner.join("a.obj");
    let text = format!(
        "mtllib more/my red.mtl\nmtllib ../outside.mtl\nmtllib blue.mtl none.mtl\nmtllib more/my red.mtl\n{SQUARE}f 1 2 3\n"
    );
    std::fs::write(&path, text).unwrap();
    let mesh = Mesh::load(&path, None).unwrap();
    let libraries = &mesh.libraries;
    let files: Vec<_> = libraries.iter().map(|library| library.file.clone()).collect();
    let library_paths = ["more/my red.mtl", "../outside.mtl", "blue.mtl", "none.mtl"];
    assert_eq!(files, library_paths.map(|name| inner.join(name)));
    let names = libraries.iter().flat_map(|library| &library.materials);
    let names: Vec<_> = names.map(|material| (material.name.as_str(), material.line)).collect();
    assert_eq!(names, [("red", 1), ("blue", 1)]);
    assert_eq!(libraries[0].materials[0].diffuse, Some([1.0, 0.0, 0.0]));
    let unread: Vec<bool> = libraries.iter().map(|library| library.problem.is_some()).collect();
    assert_eq!(unread, [false, true, false, true]);
    let problem = |i: usize| libraries[i].problem.as_deref().unwrap_or_default();
    assert_eq!(problem(1), "it must be in the folder of the mesh");
    assert!(problem(3).starts_with("No such file"), "{}", problem(3));
    assert_eq!(
        mesh.notes,
        ["more/my red.mtl:3: Ns: \"a\" must be a number; 1 more line cannot be read"]
    );
}

#[test]
fn material_files_may_have_paths_of_other_machines() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("in")).unwrap();
    std::fs::write(folder.path().join("a b.mtl"), "newmtl a\n").unwrap();
    std::fs::write(folder.path().join("in/c.mtl"), "newmtl c\n").unwrap();
    let path = folder.path().join("a.obj");
    for (library_path, expected) in [
        ("C:\\some body\\a b.mtl", "a"),
        ("/some body/a b.mtl", "a"),
        (".\\in\\c.mtl", "c"),
        ("in/c.mtl", "c"),
    ] {
        std::fs::write(&path, format!("mtllib {library_path}\n{SQUARE}f 1 2 3\n")).unwrap();
        let mesh = Mesh::load(&path, None).unwrap();
        assert_eq!(mesh.notes, Vec::<String>::new(), "{library_path}");
        assert_eq!(mesh.libraries[0].materials[0].name, expected, "{library_path}");
    }
    // A file name without a folder is only looked up in the folder of the mesh.
    std::fs::write(&path, format!("mtllib c.mtl\n{SQUARE}f 1 2 3\n")).unwrap();
    let mesh = Mesh::load(&path, None).unwrap();
    assert!(
        mesh.libraries[0].problem.is_some() && mesh.notes.is_empty(),
        "{:?}",
        mesh.notes
    );
}

#[test]
fn ply_may_have_all_types_in_any_order() {
    let text = "ply\r\nformat ascii 1.0\r\nobj_info made by hand\r\nelement extra 2\r\nproperty list char double what\r\n\
                property int8 n\r\nelement nothing 99999999999\r\nelement vertex 4\r\nproperty uchar red\r\n\
                property double y\r\nproperty list uchar int ring\r\nproperty short x\r\nproperty float32 z\r\n\
                property float t\r\nproperty float s\r\nelement face 2\r\nproperty list uchar float texcoord\r\n\
                property uint16 flags\r\nproperty list int16 uint8 vertex_index\r\nend_header\r\n\
                2 1.5 2.5 7\r\n0 8\r\n\
                255 0 1 9 0 0 0 0\r\n255 0 0 1 0 0 1\r\n255 1 0 1 0 1 1\r\n255 1 0 0 0 1 0\r\n\
                2 0.5 0.5 1 3 0 1 2\r\n0 2 3 0 2 3\r\n";
    let mesh = load("a.ply", text, None).unwrap();
    assert_eq!(corners(&mesh), TWO_TRIANGLES);
    let uvs: Vec<[f32; 2]> = mesh.uvs.iter().map(|uv| uv.to_array()).collect();
    assert_eq!(uvs, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    assert_eq!(
        mesh.notes,
        [
            "texture coordinates per face corner (\"texcoord\") are not supported and were ignored; use texture coordinates per vertex"
        ]
    );
}

/// Returns a binary PLY file with the faces before the vertices, 64-bit floats and normals.
fn faces_first(is_big_endian: bool, normal: [f64; 3]) -> Vec<u8> {
    let name = if is_big_endian { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{name}_endian 1.0\nelement face 1\nproperty list ushort short polygon\nproperty int flags\n\
         element vertex 3\nproperty double x\nproperty double y\nproperty double z\nproperty double nx\n\
         property double ny\nproperty double nz\nproperty double texture_u\nproperty double texture_v\nend_header\n"
    )
    .into_bytes();
    let mut append = |little: &[u8]| {
        let mut value = little.to_vec();
        if is_big_endian {
            value.reverse();
        }
        bytes.extend(value);
    };
    append(&3u16.to_le_bytes());
    (0..3i16).for_each(|i| append(&i.to_le_bytes()));
    append(&77i32.to_le_bytes());
    for position in TWO_TRIANGLES[0] {
        let row = position.iter().chain(&normal).chain(&[0.25, 0.75]);
        row.for_each(|x| append(&x.to_le_bytes()));
    }
    bytes
}

#[test]
fn binary_ply_has_normals_and_texture_coordinates() {
    for is_big_endian in [false, true] {
        let mesh = load("a.ply", faces_first(is_big_endian, [0.0, -3e200, 4e200]), None).unwrap();
        assert_eq!(corners(&mesh), TWO_TRIANGLES[..1]);
        assert_eq!(mesh.normals[2].to_array(), [0.0, -0.6, 0.8]);
        assert_eq!(mesh.uvs[2].to_array(), [0.25, 0.75]);
        // Invalid normals are replaced.
        for invalid in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 1.0]] {
            let mesh = load("a.ply", faces_first(is_big_endian, invalid), Some(Normals::File)).unwrap();
            assert_eq!(mesh.normals[2].to_array(), [0.0, 0.0, 1.0]);
            let rule = "have no valid normals; the triangle normals are used instead";
            assert_eq!(mesh.notes, [format!("3 vertices {rule}")]);
        }
    }
}

const SOLIDS: &str = "solid a b\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\n\
                      endfacet\nendsolid a b\nSOLID\n FACET NORMAL 0 0 1 OUTER LOOP\n  VERTEX 0 0 0\n VERTEX 1 1 0\n\
                      VERTEX 0 1 0\n ENDLOOP ENDFACET\nENDSOLID whatever\nsolid a b\nendsolid\n";

#[test]
fn stl_solids_are_groups() {
    let mesh = load("a.stl", SOLIDS, None).unwrap();
    assert_eq!(corners(&mesh), TWO_TRIANGLES);
    assert_eq!(mesh.positions.len(), 4);
    assert!(mesh.normals.is_empty());
    let names: Vec<&str> = mesh.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!((names, mesh.group_of), (vec!["a b", "", "a b"], vec![0, 1]));
    // Different facet normals split a vertex.
    let mesh = load("a.stl", SOLIDS, Some(Normals::File)).unwrap();
    let normals: Vec<f32> = mesh.normals.iter().map(|normal| normal.z).collect();
    assert_eq!(normals, [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0]);
}

#[test]
fn binary_stl_is_recognized_by_its_size() {
    let (_, bytes) = in_all_formats().pop().unwrap();
    assert!(bytes.starts_with(b"solid"));
    let mut longer = bytes.clone();
    longer[0] = b'S'; // still the keyword of an ASCII file
    longer.push(0);
    let error = load("a.stl", &longer, None).unwrap_err();
    assert!(error.starts_with("a.stl:1: "), "{error}");
    longer[0] = b'x';
    let mesh = load("a.stl", &longer, None).unwrap();
    assert_eq!(mesh.notes, ["1 byte after the last triangle was ignored"]);
    assert_eq!(
        load("a.stl", &longer[..300], None).unwrap_err(),
        "a.stl: byte 80: the triangle count 6 requires 384 bytes; the file has 300 bytes and is truncated, or is not an STL file"
    );
}

#[test]
fn smooth_normals_are_weighted_by_angles() {
    // A corner of a cube, with two, three and two triangles on the three faces; texture coordinates split the vertex.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 0\nv 1 0 1\nv 1 0 0.5\nv 0 1 1\nvt 0 0\nvt 0 1\nvt 1 0\n\
                f 1/1 3/1 5/1\nf 1/1 5/1 2/1\nf 1/2 2/2 7/2\nf 1/2 7/2 6/2\nf 1/2 6/2 4/2\nf 1/3 4/3 8/3\nf 1/3 8/3 3/3\n";
    let mesh = load("a.obj", text, Some(Normals::Smooth)).unwrap();
    assert_eq!(mesh.positions.len(), 4 + 5 + 4);
    let third = -(1.0f64 / 3.0).sqrt() as f32;
    let mut count = 0;
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        if position.to_array() == [0.0; 3] {
            assert!((*normal - third).length() < 1e-6, "{normal}");
            count += 1;
        }
    }
    assert_eq!(count, 3);
}

#[test]
fn canceling_vertex_normals_are_replaced_by_triangle_normals() {
    let text = format!("{SQUARE}vt 0.5 0.5\nf 1/1 2/1 3/1\nf 3/1 2/1 1/1\n");
    let mesh = load("a.obj", text, Some(Normals::Smooth)).unwrap();
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.uvs.len(), 6);
    assert_eq!(
        corners(&mesh),
        [TWO_TRIANGLES[0], [2, 1, 0].map(|i| TWO_TRIANGLES[0][i])]
    );
    for (triangle, up) in mesh.triangles.iter().zip([1.0, -1.0]) {
        for vertex in triangle {
            assert_eq!(mesh.normals[*vertex as usize].to_array(), [0.0, 0.0, up]);
        }
    }
}

#[test]
fn requesting_normals_of_a_file_without_normals_is_an_error() {
    for (name, bytes) in in_all_formats() {
        let result = load(name, bytes, Some(Normals::File));
        if name.to_lowercase().ends_with("stl") {
            // STL files always have normals, which are zero in this file.
            assert!(result.unwrap().notes[0].message.contains("no valid normal"));
        } else {
            let rule = "has no normals; \"smooth\" and \"flat\" normals are computed from the triangles";
            assert_eq!(result.unwrap_err(), format!("{name}: {rule}"));
        }
    }
}

#[test]
fn a_mesh_far_from_the_origin_keeps_its_precision() {
    let text = "v 500000.001 -3 4\nv 500000.002 -3 4\nv 500000.002 -3 4.0009765625\nv -9e8 0 0\nf 1 2 3\n";
    let mesh = load("a.obj", text, None).unwrap();
    for (corner, x) in corners(&mesh)[0].iter().zip([500_000.001, 500_000.002, 500_000.002]) {
        assert!((corner[0] - x).abs() < 1e-9, "{corner:?}");
    }
    assert_eq!(mesh.center.y, -3.0);
    // A mesh whose bounds contain the origin is not recentered.
    let mesh = load("a.obj", "v 0 0 1e-20\nv 0.7 0 1\nv 1 0.1 0\nf 1 2 3\n", None).unwrap();
    assert_eq!(mesh.center.to_array(), [0.0; 3]);
    assert_eq!(mesh.positions[0].to_array(), [0.0, 0.0, 1e-20]);
}

#[test]
fn non_manifold_edges_and_inconsistent_winding_are_reported() {
    let text = format!("{SQUARE}v 0 0 1\nf 1 2 3\nf 1 4 3\nf 1 5 3\n");
    let mesh = load("a.obj", text, None).unwrap();
    assert_eq!(
        mesh.notes,
        ["1 edge is shared by more than two triangles (non-manifold mesh); rendered unchanged"]
    );
    let mesh = load("a.obj", format!("{SQUARE}f 1 2 3\nf 1 4 3\n"), None).unwrap();
    let note = "1 edge has inconsistent winding order (its triangles face opposite sides); rendered unchanged";
    assert_eq!(mesh.notes, [note]);
}
