//! Tests of errors in meshes, and of the placement of meshes.

use std::fs;

use glam::Vec2;
use tempfile::TempDir;

use super::*;
use crate::{Description, Encoding, Image, Scene, SceneError, Texels};

/// A scene with all kinds of references to meshes.
const VALID: &str = r#"image = { width = 4, height = 4 }
camera = { position = [0, -9, 0], look_at = [0, 0, 0], fov = 40 }
[textures.checks]
type = "checker"
even = [1, 1, 1]
odd = [0, 0, 0]
[materials.red]
type = "mirror"
[materials.white]
type = "mirror"
[materials.checked]
type = "mirror"
tint = { texture = "checks" }
[meshes.parts]
file = "parts.obj"
[[shapes]]
type = "mesh"
file = "one.obj"
material = "red"
scale = 2
rotate = [0, 0, 90]
translate = [1, 2, 3]
[[shapes]]
type = "mesh"
file = "one.obj"
material = "white"
matrix = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7]]
[[instances]]
mesh = "parts"
materials = { roof = "red", brick = "white" }
rotate = { axis = [0, 0, 2], degrees = 45 }
"#;

const ONE: &str = "v 0 0 0\nv 1 0 0\nv 0 2 4\nf 1 2 3\n";
/// A triangle with texture coordinates.
const COORDINATES: &str = "v 0 0 0\nv 1 0 0\nv 0 2 4\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
/// Three groups: `roof` without a material, and `wall` and `door` with the material `brick`.
const PARTS: &str = "v 0 0 0\nv 1 0 0\nv 0 2 4\ng roof\nf 1 2 3\nv 0 0 5\nv 1 0 5\nv 0 2 9\nusemtl brick\ng wall\nf 4 5 6\n\
                     v 0 0 7\nv 1 0 7\nv 0 2 8\ng door\nf 7 8 9\n";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("one.obj", ONE);
    write("coordinates.obj", COORDINATES);
    write("parts.obj", PARTS);
    write("broken.obj", "v 0 0 0\nf 1 2 3\n");
    write("far.obj", "v 0 0 0\nv 1e9 0 0\nv 0 1 0\nf 1 2 3\n");
    write("small.obj", "v 0 0 0\nv 1e-8 0 0\nv 0 1e-8 0\nf 1 2 3\n");
    write("degenerate.obj", &format!("{ONE}f 1 1 2\n"));
    folder
}

fn parse_in(folder: &TempDir, text: &str) -> Result<Scene, SceneError> {
    let path = folder.path().join("s.toml");
    Scene::parse(text, &path.display().to_string())
}

fn parse(text: &str) -> Result<Scene, SceneError> {
    parse_in(&folder(), text)
}

fn with_line(line: &str, changed: &str) -> String {
    let line = format!("\n{line}\n");
    assert_eq!(VALID.matches(&line).count(), 1, "{line}");
    VALID.replace(&line, &format!("\n{changed}\n"))
}

fn to_world(scene: &Scene, shape: usize) -> DAffine3 {
    match scene.shapes[shape].geometry {
        Geometry::Mesh { to_world, .. } => to_world,
        _ => panic!("shape {shape} is not a mesh: {:?}", scene.shapes[shape]),
    }
}

fn groups(scene: &Scene, shape: usize) -> &[usize] {
    match &scene.shapes[shape].geometry {
        Geometry::Mesh { materials, .. } => materials,
        _ => panic!("shape {shape} is not a mesh: {:?}", scene.shapes[shape]),
    }
}

const MATERIALS_LINE: &str = r#"materials = { roof = "red", brick = "white" }"#;
const MATRIX_LINE: &str = "matrix = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7]]";

/// Lines of [`VALID`], each with an invalid replacement and the expected error.
const INVALID: &[(&str, &str, &str)] = &[
    (
        "file = \"parts.obj\"",
        "file = \"none.obj\"",
        "meshes.parts.file: \"none.obj\" cannot be read: ",
    ),
    (
        "file = \"parts.obj\"",
        "file = \"../none.obj\"",
        "meshes.parts.file: \"../none.obj\" ",
    ),
    (
        "file = \"parts.obj\"",
        "file = \"s.txt\"",
        "meshes.parts.file: \"s.txt\" cannot be read: ",
    ),
    (
        "file = \"parts.obj\"",
        "file = \".\"",
        "meshes.parts.file: \".\" must be a file",
    ),
    (
        "file = \"parts.obj\"",
        "file = \"parts.obj\"\nnormals = \"file\"",
        "meshes.parts.file: ",
    ),
    (
        "file = \"parts.obj\"",
        "file = \"parts.obj\"\nnormals = \"round\"",
        "meshes.parts.normals: \"round\" must be one of \"smooth\", \"flat\", \"file\"",
    ),
    (
        "file = \"parts.obj\"",
        "file = \"parts.obj\"\nup = \"-y\"",
        "meshes.parts.up: \"-y\" must be one of \"x\", \"y\", \"z\"",
    ),
    (
        "file = \"parts.obj\"",
        "file = \"parts.obj\"\nscale = 2",
        "meshes.parts.scale: unknown key; expected one of \"file\", \"normals\", \"up\"",
    ),
    // Names of meshes.
    (
        "mesh = \"parts\"",
        "mesh = \"part\"",
        "instances[0].mesh: there is no mesh \"part\"; did you mean \"parts\"?",
    ),
    // Placement.
    (
        MATRIX_LINE,
        "scale = 0",
        "shapes[1].scale: 0 must be from 1e-6 to 1e6, or from -1e6 to -1e-6",
    ),
    (
        MATRIX_LINE,
        "scale = [1, -2e6, 1]",
        "shapes[1].scale: -2e6 must be from 1e-6 to 1e6, or from -1e6 to -1e-6",
    ),
    (
        MATRIX_LINE,
        "scale = [1, nan, 1]",
        "shapes[1].scale: nan must be from 1e-6 to 1e6, or from -1e6 to -1e-6",
    ),
    (
        MATRIX_LINE,
        "scale = [1, 2]",
        "shapes[1].scale: [1, 2] must be a number or a list of 3 numbers",
    ),
    (
        MATRIX_LINE,
        "rotate = [0, 361, 0]",
        "shapes[1].rotate: 361 must be from -360 to 360",
    ),
    (
        MATRIX_LINE,
        "rotate = 90",
        "shapes[1].rotate: 90 must be a list of 3 angles in degrees or a table such as",
    ),
    (
        MATRIX_LINE,
        "rotate = { axis = [0, 0, 0], degrees = 9 }",
        "shapes[1].rotate.axis: [0, 0, 0] must not be zero: its length must be at least 1e-9",
    ),
    (
        MATRIX_LINE,
        "rotate = { axis = [0, 0, 1], degrees = inf }",
        "shapes[1].rotate.degrees: inf must be from -360 to 360",
    ),
    (
        MATRIX_LINE,
        "translate = [0, 0, -2e9]",
        "shapes[1].translate: -2e9 must be from -1e9 to 1e9",
    ),
    (
        MATRIX_LINE,
        "translate = [1e9, 0, 0]",
        "shapes[1].file: \"one.obj\" reaches to 1.000000001e9 in world space; coordinates must be from -1e9 to 1e9",
    ),
    (
        "translate = [1, 2, 3]",
        "matrix = []",
        "shapes[0].matrix: cannot be combined with translate, rotate or scale, which matrix replaces",
    ),
    (
        MATRIX_LINE,
        "matrix = [[1, 0, 0, 5], [0, 1, 0, 6]]",
        "shapes[1].matrix: must be a list of 3 rows of 4 numbers, optionally followed by the row [0, 0, 0, 1]; number of rows: 2",
    ),
    (
        MATRIX_LINE,
        "matrix = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 2]]",
        "shapes[1].matrix[3]: [0, 0, 0, 2] must be [0, 0, 0, 1], or absent",
    ),
    (
        MATRIX_LINE,
        "matrix = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1], [0, 0, 0, 1]]",
        "shapes[1].matrix: must be a list of 3 rows of 4 numbers, optionally followed by the row [0, 0, 0, 1]; number of rows: 5",
    ),
    (
        MATRIX_LINE,
        "matrix = [[1, 0, 0, 5], [0, 1, 0, 2e9], [0, 0, 1, 7]]",
        "shapes[1].matrix[1]: 2e9 must be from -1e9 to 1e9",
    ),
    (
        MATRIX_LINE,
        "matrix = [[1, 0, 0, 5], [0, nan, 0, 6], [0, 0, 1, 7]]",
        "shapes[1].matrix[1]: nan must be from -1e9 to 1e9",
    ),
    (
        MATRIX_LINE,
        "matrix = [[1, 0, 0, 5], [0, 0, 0, 6], [0, 0, 1, 7]]",
        "shapes[1].matrix: column 1, [0, 0, 0], must have a length from 1e-6 to 1e6",
    ),
    (
        MATRIX_LINE,
        "matrix = [[1, 0, 1, 5], [0, 1, 1, 6], [0, 0, 0, 7]]",
        "shapes[1].matrix: the first three columns must not lie in one plane",
    ),
    // Materials.
    (
        "material = \"white\"",
        "material = \"blue\"",
        "shapes[1].material: there is no material \"blue\"; the scene has \"checked\", \"red\", \"white\"",
    ),
    (
        "material = \"white\"",
        "material = \"checked\"",
        "shapes[1].material: \"checked\" must have no texture here, because \"one.obj\" has no texture coordinates",
    ),
    (
        "material = \"white\"",
        "materials = { roof = \"white\" }",
        "shapes[1].materials.roof: \"one.obj\" has no groups with names",
    ),
    (
        MATERIALS_LINE,
        "materials = { roof = \"red\", floor = \"white\" }",
        "instances[0].materials.floor: \"parts.obj\" has no such group or material; available: \"brick\", \"door\", \
         \"roof\", \"wall\"",
    ),
    (
        MATERIALS_LINE,
        "materials = { roof = \"red\", brick = \"blue\" }",
        "instances[0].materials.brick: there is no material \"blue\"; the scene has",
    ),
    (
        MATERIALS_LINE,
        "materials = { roof = \"red\", brick = \"checked\" }",
        "instances[0].materials.brick: \"checked\" must have no texture here, because \"parts.obj\" has no texture",
    ),
];

#[test]
fn invalid_meshes_are_reported_with_line_key_value_and_rule() {
    let folder = folder();
    for &(line, invalid, expected) in INVALID {
        let message = parse_in(&folder, &with_line(line, invalid)).unwrap_err().to_string();
        let (_, rest) = message.split_once("s.toml:").unwrap();
        let (line_number, rest) = rest.split_once(": ").unwrap();
        assert!(rest.starts_with(expected), "{rest}\n{expected}");
        assert!(line_number.parse::<usize>().unwrap() > 13, "{message}");
    }
}

#[test]
fn errors_in_mesh_files_name_the_mesh_file() {
    let folder = folder();
    for (file, expected) in [
        (
            "broken.obj",
            "broken.obj:2: the face refers to vertex 2, which does not exist",
        ),
        ("far.obj", "\"far.obj\" reaches to "),
        ("small.obj", ""),
    ] {
        // The transform scales by 2: far.obj becomes too large, and small.obj stays large enough.
        let text = VALID.replacen("file = \"one.obj\"", &format!("file = \"{file}\""), 1);
        match parse_in(&folder, &text) {
            Ok(_) => assert_eq!(expected, ""),
            Err(error) => {
                let (_, rest) = error
                    .to_string()
                    .split_once("shapes[0].file: ")
                    .map(|(a, b)| (a.to_owned(), b.to_owned()))
                    .unwrap();
                assert!(rest.contains(expected) && !expected.is_empty(), "{rest}\n{expected}");
            }
        }
    }
    let text = with_line("scale = 2", "scale = 1e-3").replacen("file = \"one.obj\"", "file = \"small.obj\"", 1);
    let error = parse_in(&folder, &text).unwrap_err().to_string();
    assert!(
        error.contains("shapes[0].file: \"small.obj\" must be at least 1e-9 long in world space; its length is "),
        "{error}"
    );
}

#[test]
fn images_in_memory_are_not_meshes() {
    let image = Image {
        width: 1,
        height: 1,
        texels: Texels::Bytes(Encoding::Linear, vec![[0; 3]]),
    };
    let mut assets = Assets::default();
    assets.images.insert("one.obj".to_owned(), Arc::new(image));
    let camera = crate::PerspectiveDescription::new([0.0, -9.0, 0.0], [0.0; 3], 40.0);
    let scene = Description::new(4, 4, camera).with_shape(MeshDescription::new("red", "one.obj"));
    let error = scene.validate_with(&assets).unwrap_err().to_string();
    assert_eq!(error, "shapes[0].file: \"one.obj\" is an image in memory, not a mesh");
}

#[test]
fn unknown_names_are_reported_in_scenes_without_names() {
    let start = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n";
    let error_of = |text: &str| {
        let message = parse(&format!("{start}{text}")).unwrap_err().to_string();
        message.split_once("s.toml:").unwrap().1.to_owned()
    };
    assert_eq!(
        error_of("[[instances]]\nmesh = 'a'\n"),
        "4: instances[0].mesh: there is no mesh \"a\"; the scene has none"
    );
    assert_eq!(
        error_of("[[shapes]]\ntype = 'mesh'\nfile = 'one.obj'\nmaterial = 'a'\n"),
        "6: shapes[0].material: there is no material \"a\"; the scene has none"
    );
}

#[test]
fn groups_are_counted() {
    let shape = |groups| Shape {
        geometry: Geometry::Mesh {
            mesh: Arc::default(),
            to_world: DAffine3::IDENTITY,
            materials: vec![0; groups],
        },
        material: 0,
    };
    check_group_count(&[shape(MAX_GROUPS / 2), shape(MAX_GROUPS / 2)]).unwrap();
    let error = check_group_count(&[shape(MAX_GROUPS / 2), shape(MAX_GROUPS / 2 + 1)]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the meshes have 16777217 groups in total; at most 16777216 are allowed"
    );
}

#[test]
fn group_names_take_precedence_over_material_names() {
    // Material indices: checked is 0, red is 1, and white is 2.
    let scene = parse(VALID).unwrap();
    assert_eq!((groups(&scene, 0), groups(&scene, 1)), (&[1][..], &[2][..]));
    assert_eq!(groups(&scene, 2), [1, 2, 2]);
    let changed = "material = 'red'\nmaterials = { wall = 'white' }";
    assert_eq!(
        groups(&parse(&with_line(MATERIALS_LINE, changed)).unwrap(), 2),
        [1, 2, 1]
    );
    // The name of a group takes precedence over the name of its material.
    let changed = "material = 'red'\nmaterials = { brick = 'white', door = 'red' }";
    assert_eq!(
        groups(&parse(&with_line(MATERIALS_LINE, changed)).unwrap(), 2),
        [1, 2, 1]
    );
}

#[test]
fn meshes_with_texture_coordinates_may_have_textures() {
    let text = with_line("material = \"white\"", "material = \"checked\"");
    let scene = parse(&text.replace("one.obj", "coordinates.obj")).unwrap();
    assert_eq!(groups(&scene, 1), [0]);
    let Geometry::Mesh { mesh, .. } = &scene.shapes[1].geometry else {
        panic!("{:?}", scene.shapes[1]);
    };
    assert_eq!(mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
}

#[test]
fn every_texture_of_a_material_needs_texture_coordinates() {
    let texture = "{ texture = \"checks\" }";
    let plain = "[1, 1, 1]";
    for (needs_coordinates, lines) in [
        (false, format!("type = \"diffuse\"\ncolor = {plain}\nroughness = 0.5")),
        (true, format!("type = \"diffuse\"\ncolor = {texture}")),
        (
            true,
            format!("type = \"diffuse\"\ncolor = {plain}\nroughness = {texture}"),
        ),
        (
            true,
            format!("type = \"diffuse\"\ncolor = {plain}\nemission = {texture}"),
        ),
        (false, format!("type = \"conductor\"\ncolor = {plain}")),
        (true, format!("type = \"conductor\"\ncolor = {texture}")),
        (false, format!("type = \"dielectric\"\nior = 1.5\ncolor = {plain}")),
        (true, format!("type = \"dielectric\"\nior = 1.5\ncolor = {texture}")),
        (true, format!("type = \"phong\"\ncolor = {plain}\nemission = {texture}")),
        (true, format!("type = \"mirror\"\nemission = {texture}")),
        (true, format!("type = \"glass\"\nior = 1.5\nemission = {texture}")),
    ] {
        let text = with_line("material = \"white\"", "material = \"checked\"")
            .replace("type = \"mirror\"\ntint = { texture = \"checks\" }", &lines)
            .replace("[meshes.parts]", "[render]\nintegrator = \"path\"\n[meshes.parts]");
        assert!(text.contains(&lines));
        parse(&text.replace("one.obj", "coordinates.obj")).unwrap();
        match parse(&text) {
            Ok(_) => assert!(!needs_coordinates, "{lines}"),
            Err(error) => {
                assert!(needs_coordinates, "{lines}: {error}");
                assert!(error.to_string().contains("shapes[1].material: "), "{error}");
            }
        }
    }
}

#[test]
fn meshes_are_scaled_then_rotated_then_translated() {
    let scene = parse(VALID).unwrap();
    let transformed = |shape, p: [f64; 3]| to_world(&scene, shape).transform_point3(p.into());
    assert_eq!(transformed(0, [1.0, 0.0, 0.0]), DVec3::new(1.0, 4.0, 3.0));
    assert_eq!(transformed(0, [0.0, 2.0, 4.0]), DVec3::new(-3.0, 2.0, 11.0));
    assert_eq!(transformed(1, [1.0, 2.0, 4.0]), DVec3::new(6.0, 8.0, 11.0));
    let sqrt_half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(transformed(2, [1.0, 0.0, 0.0]).distance(DVec3::new(sqrt_half, sqrt_half, 0.0)) < 1e-15);
}

#[test]
fn rotations_apply_in_the_order_of_the_axes() {
    let text = with_line("rotate = [0, 0, 90]", "rotate = [90, 0, 90]").replace("scale = 2\n", "");
    let scene = parse(&text).unwrap();
    let rotated = |p: [f64; 3]| to_world(&scene, 0).transform_vector3(p.into());
    // The rotation about x maps y to z; then, the rotation about z maps x to y.
    assert_eq!(rotated([0.0, 1.0, 0.0]), DVec3::Z);
    assert_eq!(rotated([1.0, 0.0, 0.0]), DVec3::Y);
    assert_eq!(rotated([0.0, 0.0, 1.0]), DVec3::X);
    let text = with_line("rotate = [0, 0, 90]", "rotate = [30, -50, 70]");
    let scene = parse(&text).unwrap();
    let rotation_matrix = |axis: DVec3, degrees: f64| DMat3::from_axis_angle(axis, degrees.to_radians());
    let expected =
        rotation_matrix(DVec3::Z, 70.0) * rotation_matrix(DVec3::Y, -50.0) * rotation_matrix(DVec3::X, 30.0) * 2.0;
    assert!(to_world(&scene, 0).matrix3.abs_diff_eq(expected, 1e-14));
}

#[test]
fn any_axis_may_be_up() {
    for (up, x, y, z) in [
        ("x", DVec3::Z, DVec3::X, DVec3::Y),
        ("y", DVec3::X, DVec3::Z, DVec3::NEG_Y),
        ("z", DVec3::X, DVec3::Y, DVec3::Z),
    ] {
        let text = with_line(MATRIX_LINE, &format!("up = '{up}'"));
        let transform = to_world(&parse(&text).unwrap(), 1);
        assert_eq!(
            (transform.x_axis, transform.y_axis, transform.z_axis),
            (x, y, z),
            "{up}"
        );
        // The transform is not a reflection.
        assert_eq!(transform.matrix3.determinant(), 1.0);
        // The scale and the translation are applied after this rotation.
        let text = with_line(
            MATRIX_LINE,
            &format!("up = '{up}'\nscale = [1, 2, 3]\ntranslate = [5, 6, 7]"),
        );
        let transform = to_world(&parse(&text).unwrap(), 1);
        let scale = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(
            (transform.x_axis, transform.y_axis, transform.z_axis),
            (x * scale, y * scale, z * scale)
        );
        assert_eq!(transform.translation, DVec3::new(5.0, 6.0, 7.0));
    }
}

#[test]
fn a_matrix_may_have_a_fourth_row_or_mirror() {
    let expected = to_world(&parse(VALID).unwrap(), 1);
    let four_rows = "matrix = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]";
    assert_eq!(
        to_world(&parse(&with_line(MATRIX_LINE, four_rows)).unwrap(), 1),
        expected
    );
    let mirrored = "matrix = [[-1, 0, 0, 5], [0.5, 1, 0, 6], [0, 0, 1, 7]]";
    let transform = to_world(&parse(&with_line(MATRIX_LINE, mirrored)).unwrap(), 1);
    assert_eq!(transform.transform_point3(DVec3::ONE), DVec3::new(4.0, 7.5, 8.0));
}

#[test]
fn values_at_the_limits_are_valid() {
    for valid in [
        "scale = [1e-6, -1e-6, 1e6]",
        "rotate = [360, -360, 0]",
        "translate = [0, 999999999, -1e9]\nscale = [1, 1e-6, 0.25]",
        "matrix = [[1, 0, 1, 5], [0, 1, 1, 6], [0, 0, 1e-5, 7]]",
    ] {
        parse(&with_line(MATRIX_LINE, valid)).unwrap();
    }
}

#[test]
fn warnings_appear_once_per_file_name() {
    assert_eq!(parse(VALID).unwrap().notes, Vec::<String>::new());
    let scene = parse(&VALID.replace("one.obj", "degenerate.obj")).unwrap();
    assert_eq!(
        scene.notes,
        ["degenerate.obj: 1 of 2 triangles has no area (degenerate) and was removed"]
    );
    let text = VALID.replace("one.obj", "degenerate.obj") + "[meshes.other]\nfile = './degenerate.obj'\n";
    assert_eq!(parse(&text).unwrap().notes.len(), 2);
}

#[test]
fn shapes_and_instances_of_a_file_share_its_mesh() {
    let scene = parse(&(VALID.to_owned() + "[[instances]]\nmesh = 'parts'\nmaterial = 'red'\n")).unwrap();
    let mesh = |shape: usize| match &scene.shapes[shape].geometry {
        Geometry::Mesh { mesh, .. } => mesh,
        _ => panic!("shape {shape} is not a mesh"),
    };
    assert!(Arc::ptr_eq(mesh(0), mesh(1)));
    assert!(Arc::ptr_eq(mesh(2), mesh(3)));
    assert!(!Arc::ptr_eq(mesh(0), mesh(2)));
}
