//! Damaged mesh files: the valid parts are used, with a warning that names the first damage and its replacement.

use super::{corners, load};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const FIRST_TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];

#[test]
fn damaged_lines_of_obj_files_are_replaced() {
    for (lines, note) in [
        (
            "v nan 0 0\nf 1 2 3\n",
            "line 5: x: NaN must be from -1e9 to 1e9; faces with this vertex were removed",
        ),
        (
            "v 0 inf 0\nv 0 0 1e10\nf 1 2 3\nf 1 2 5\nf 5 1 3 2 4\n",
            "line 5: y: inf must be from -1e9 to 1e9; faces with this vertex were removed (and 1 similar problem)",
        ),
        (
            "v 3.1+e2 0 0\nf 1 2 3\nf 3 2 5\n",
            "line 5: x: \"3.1+e2\" must be a number; faces with this vertex were removed",
        ),
        (
            "v 1\nf 1 2 3\n",
            "line 5: y is missing; faces with this vertex were removed",
        ),
        (
            "f 1 2 3\nf 1 2\nf 3\n",
            "line 6: a face must have at least 3 corners, not 2; the face was removed (and 1 similar problem)",
        ),
        (
            "f 1 2 3\nf 1 2 9\n",
            "line 6: the face refers to vertex 9, which does not exist; defined so far: 4; the face was removed",
        ),
        (
            "f 1 2 3\nf 1 2 x\n",
            "line 6: \"x\" must be a corner of a face: v, v/t, v//n or v/t/n; the face was removed",
        ),
        (
            "f 1/1 2/2 3/3\n",
            "line 5: the face refers to texture coordinate 1, which does not exist; defined so far: 0; \
             the texture coordinates (0, 0) are used instead (and 2 similar problems)",
        ),
        (
            "f 1//1 2//2 3//3\n",
            "line 5: the face refers to normal 1, which does not exist; defined so far: 0; the normal of the triangles is used instead (and 2 similar problems)",
        ),
        (
            "vt 0 nan\nf 1/1 2/1 3/1\n",
            "line 5: v: NaN must be finite as a 32-bit float; the texture coordinates (0, 0) are used instead",
        ),
        (
            "vn 0 1\nf 1//1 2//1 3//1\n",
            "line 5: z is missing; the normal of the triangles is used instead",
        ),
        (
            "v 0 0 0 0.5 nan 0\nv 0 0 0 red 0 0\nf 1 2 3\n",
            "line 5: the color of the vertex must be three finite numbers; white is used instead (and 1 similar problem)",
        ),
    ] {
        let mesh = load("a.obj", format!("{SQUARE}{lines}"), None).unwrap();
        assert_eq!(corners(&mesh), [FIRST_TRIANGLE], "{lines}");
        assert_eq!(mesh.notes[0], note, "{lines}");
    }
}

#[test]
fn facets_of_a_truncated_stl_file_are_kept() {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n";
    let mesh = load("a.stl", format!("solid a\n{facet}"), None).unwrap();
    assert_eq!(corners(&mesh), [FIRST_TRIANGLE]);
    let note = "line 9: the file ends inside a solid; \"endsolid\" is missing; the facets before the end are used";
    assert_eq!(mesh.notes, [note]);
}

#[test]
fn files_without_a_valid_face_are_errors() {
    for (text, message) in [
        ("v 0 0 nan\nf 1 1 1\n", "a.obj:1: z: NaN must be from -1e9 to 1e9"),
        (
            "v 0 0 0\nf 1 1\n",
            "a.obj:2: a face must have at least 3 corners, not 2",
        ),
    ] {
        assert_eq!(load("a.obj", text, None).unwrap_err(), message);
    }
}

fn ply(vertices: &str, faces: &str) -> String {
    let count = |lines: &str| lines.lines().count();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n{vertices}{faces}",
        count(vertices),
        count(faces)
    )
}

const POINTS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

#[test]
fn damaged_rows_of_ply_files_are_removed() {
    for (vertices, faces, note) in [
        (
            "0 0 0\n1 0 0\n1 1 0\n0 nan 0\n",
            "3 0 1 2\n3 0 1 3\n",
            "line 13: vertex 3: y: NaN must be from -1e9 to 1e9; faces with this vertex were removed",
        ),
        (
            POINTS,
            "3 0 1 2\n2 0 1\n",
            "line 15: face 1: must have at least 3 vertices, not 2; the face was removed",
        ),
        (
            POINTS,
            "3 0 1 4\n3 0 1 2\n",
            "line 14: face 0: vertex 4 does not exist; number of vertices, counted from 0: 4; the face was removed",
        ),
    ] {
        let mesh = load("a.ply", ply(vertices, faces), None).unwrap();
        assert_eq!((corners(&mesh), mesh.notes.len()), (vec![FIRST_TRIANGLE], 1));
        assert_eq!(mesh.notes[0], note);
    }
}

#[test]
fn vertex_colors_that_are_not_finite_are_white() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  property float red\nproperty float green\nproperty float blue\nelement face 1\n\
                  property list uchar int vertex_indices\nend_header\n";
    let text = format!("{header}0 0 0 0.5 0.25 0\n1 0 0 nan 0 0\n1 1 0 0 1e39 0\n3 0 1 2\n");
    let mesh = load("a.ply", text, None).unwrap();
    let note = "line 14: vertex 1: color: the values must be finite as 32-bit floats; \
                white is used instead (and 1 similar problem)";
    assert_eq!(mesh.notes, [note]);
    assert_eq!(mesh.colors[0].to_array(), [0.5, 0.25, 0.0, 1.0]);
    assert_eq!(mesh.colors[1..], [glam::Vec4::ONE; 2]);
}

#[test]
fn ply_lines_may_have_more_values_than_declared() {
    let long_lines = "0 0 0 255 1 2\n1 0 0 3\n1 1 0\n0 1 0 7 8\n";
    let mesh = load("a.ply", ply(long_lines, "3 0 1 2 200 100 50\n"), None).unwrap();
    assert_eq!(corners(&mesh), [FIRST_TRIANGLE]);
    assert_eq!(
        mesh.notes,
        [
            "line 10: the line has more values than the header declares; the extra values were ignored (and 3 similar problems)"
        ]
    );
    // A row may span several lines, and a line may contain several rows.
    for points in [POINTS.replace("1 1 0", "1 1\n\n0"), POINTS.replace("\n1", " 1")] {
        let text = ply(POINTS, "3 0 1 2\n").replace(POINTS, &points);
        let mesh = load("a.ply", text, None).unwrap();
        assert_eq!(
            (corners(&mesh), mesh.notes.len()),
            (vec![FIRST_TRIANGLE], 0),
            "{points}"
        );
    }
}

#[test]
fn unknown_lines_of_ply_headers_are_ignored() {
    let text = ply(POINTS, "3 0 1 2\n").replace("element face", "Created by a program\nelement face");
    let mesh = load("a.ply", text, None).unwrap();
    assert_eq!(corners(&mesh), [FIRST_TRIANGLE]);
    assert!(
        mesh.notes[0].message.ends_with("; the line was ignored"),
        "{:?}",
        mesh.notes
    );
}

#[test]
fn stl_facets_with_non_finite_vertices_are_skipped() {
    let facet = |z: &str| {
        format!("facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n")
    };
    let text = format!("solid a\n{}{}endsolid a\n", facet("0"), facet("nan"));
    let mesh = load("a.stl", text, None).unwrap();
    assert_eq!(corners(&mesh), [FIRST_TRIANGLE]);
    assert_eq!(
        mesh.notes,
        ["line 11: z: NaN must be from -1e9 to 1e9; the face was removed"]
    );
}

#[test]
fn obj_files_may_be_utf_16() {
    let text = format!("{SQUARE}f 1 2 3\n");
    for is_big_endian in [true, false] {
        let bytes = |unit: u16| {
            if is_big_endian {
                unit.to_be_bytes()
            } else {
                unit.to_le_bytes()
            }
        };
        let encoded: Vec<u8> = std::iter::once(0xfeff)
            .chain(text.encode_utf16())
            .flat_map(bytes)
            .collect();
        assert_eq!(corners(&load("a.obj", encoded, None).unwrap()), [FIRST_TRIANGLE]);
    }
}

#[test]
fn obj_files_may_have_colors() {
    let text = "v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0 1\nv 1 1 0 0.5\nf 1 2 3\n";
    let mesh = load("a.obj", text, None).unwrap();
    let colors: Vec<[f32; 4]> = mesh.colors.iter().map(|color| color.to_array()).collect();
    // 0.5 is decoded from sRGB to 0.214; a vertex without a color is white.
    assert_eq!(colors[0][..2], [1.0, 0.0]);
    assert!((colors[0][2] - 0.214_041).abs() < 1e-6);
    assert_eq!(colors[1..], [[0.0, 1.0, 0.0, 1.0], [1.0; 4]]);
    assert!(
        load("a.obj", format!("{SQUARE}f 1 2 3\n"), None)
            .unwrap()
            .colors
            .is_empty()
    );
}
