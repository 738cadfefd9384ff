//! Tests of a valid scene, and of the error for each kind of invalid value.

mod reporting;

use std::f64::consts::FRAC_PI_2;

use super::super::limits::MAX_COLOR;
use super::super::{Camera, Material, Projection, Reflection, SceneError};
use super::*;
use crate::{Geometry, Parallelogram};

/// A scene with all features. Each line is unique, so that tests can replace it.
const VALID: &str = r#"
[image]
width = 8
height = 4
[camera]
position = [0, -4, 1]
look_at = [0, 0, 1]
fov = 90
focal_length = 2
[render]
ambient = [0.1, 0.1, 0.1]
background = [0.2, 0.2, 0.2]
shadow_epsilon = 1e-4
seed = 7
pixel_samples = { pattern = "grid", count = 4 }
light_samples = { pattern = "random", count = 3 }
[materials.white]
type = "phong"
color = [0.7, 0.7, 0.7]
specular = [1, 1, 1]
shininess = 20
[materials."dark red"]
type = "phong"
ambient = [0.3, 0, 0]
diffuse = [0.4, 0, 0]
specular = [0.5, 0, 0]
[[lights]]
type = "rectangle"
center = [0, 0, 9]
size = [2, 4]
normal = [0, 0, -3]
tangent = [4, 0, 3]
color = [1, 0.5, 0]
[[lights]]
type = "point"
position = [0, 0, 8]
color = [1, 0.6, 0]
[[lights]]
type = "directional"
direction = [0, 3, -4]
color = [1, 0.7, 0]
[[shapes]] # 0
type = "rectangle"
material = "white"
center = [0, 0, 1.5]
size = [6, 2]
normal = [0, 0, 1]
tangent = [0, 1, 0]
[[shapes]] # 1
type = "ellipsoid"
material = "dark red"
center = [0, 0, 2]
a = [1, 0, 0]
b = [1, 2, 0]
c = [0, 0, 3]
[[shapes]] # 2
type = "sphere"
material = "white" # sphere
center = [0, 0, 3]
radius = 0.5
[[shapes]] # 3
type = "triangle"
material = "white" # triangle
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
[[shapes]] # 4
type = "tetrahedron"
material = "white" # tetrahedron
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
[[shapes]] # 5
type = "plane"
material = "white" # plane
point = [0, 0, 0.5]
normal = [0, 0, 2]
tangent = [1, 1, 0]
"#;

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(text, "s.toml")
}

fn with_line(line: &str, changed: &str) -> String {
    let line = format!("\n{line}\n");
    assert_eq!(VALID.matches(&line).count(), 1, "{line}");
    VALID.replace(&line, &format!("\n{changed}\n"))
}

#[test]
fn a_valid_scene_has_the_values_of_its_file() {
    let scene = parse(VALID).unwrap();
    assert_eq!((scene.width, scene.height), (8, 4));
    let camera = Camera {
        position: DVec3::new(0.0, -4.0, 1.0),
        look_at: DVec3::new(0.0, 0.0, 1.0),
        right: DVec3::X,
        up: DVec3::Z,
        forward: DVec3::Y,
        projection: Projection::Perspective { fov: FRAC_PI_2 },
        lens: None,
    };
    assert_eq!(scene.camera, camera);
    let phong = |ambient, diffuse, specular, shininess| Material {
        reflection: Reflection::Phong {
            ambient: Color::Plain(ambient),
            diffuse: Color::Plain(diffuse),
            specular: Color::Plain(specular),
            shininess,
        },
        emission: Color::BLACK,
        visible: true,
        normal_map: None,
    };
    let (white, red) = (DVec3::splat(0.7), DVec3::X);
    let dark_red = phong(red * 0.3, red * 0.4, red * 0.5, 16.0);
    assert_eq!(scene.materials, [dark_red, phong(white, white, DVec3::ONE, 20.0)]);
    let parallelogram_at = |z, u, v| Parallelogram {
        center: DVec3::new(0.0, 0.0, z),
        u,
        v,
    };
    let lights = [
        Light::Rectangle {
            // The tangent is made orthogonal to the normal; the bitangent is -Z x X.
            rectangle: parallelogram_at(9.0, DVec3::X, DVec3::NEG_Y * 2.0),
            color: DVec3::new(1.0, 0.5, 0.0),
            visible: true,
        },
        Light::Point {
            position: DVec3::new(0.0, 0.0, 8.0),
            color: DVec3::new(1.0, 0.6, 0.0),
        },
        Light::Directional {
            direction: DVec3::new(0.0, 0.6, -0.8),
            color: DVec3::new(1.0, 0.7, 0.0),
        },
    ];
    assert_eq!(scene.lights, lights);
    let geometries: Vec<_> = scene.shapes.iter().map(|shape| &shape.geometry).collect();
    let rectangle = parallelogram_at(1.5, DVec3::Y * 3.0, DVec3::NEG_X);
    assert_eq!(geometries[0], &Geometry::Rectangle(rectangle));
    let sphere = Geometry::Ellipsoid {
        center: DVec3::Z * 3.0,
        axes: [DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z * 0.5],
    };
    assert_eq!(geometries[2], &sphere);
    let materials: Vec<_> = scene.shapes.iter().map(|shape| shape.material).collect();
    assert_eq!(materials, [1, 0, 1, 1, 1, 1]);
}

#[test]
fn tetrahedron_faces_point_outwards_for_any_vertex_order() {
    let line = "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]";
    let mirrored = "vertices = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]]";
    for text in [VALID.to_owned(), with_line(line, mirrored)] {
        let scene = parse(&text).unwrap();
        let Geometry::Triangles(faces) = &scene.shapes[4].geometry else {
            panic!("{:?}", scene.shapes[4]);
        };
        assert_eq!(faces.len(), 4);
        for [v0, v1, v2] in faces {
            let normal = (v1 - v0).cross(v2 - v1);
            assert!(normal.dot(*v0 - DVec3::splat(0.2)) > 0.0, "{v0} {v1} {v2}");
        }
    }
}

/// Lines of [`VALID`], each with an invalid replacement and the expected error.
const INVALID: &[(&str, &str, &str)] = &[
    ("width = 8", "width = 0", "image.width: 0 must be from 1 to 65536"),
    (
        "height = 4",
        "height = 65537",
        "image.height: 65537 must be from 1 to 65536",
    ),
    (
        "position = [0, -4, 1]",
        "position = [0, nan, 1]",
        "camera.position: nan must be from -1e9 to 1e9",
    ),
    (
        "look_at = [0, 0, 1]",
        "look_at = [0, -4, 1]",
        "camera.look_at: [0, -4, 1] must differ from the camera's position",
    ),
    (
        "look_at = [0, 0, 1]",
        "look_at = [0, 0, -inf]",
        "camera.look_at: -inf must be from -1e9 to 1e9",
    ),
    (
        "look_at = [0, 0, 1]",
        "look_at = [0, 9, 1]\nup = [0, 1, 0]",
        "camera.look_at: [0, 9, 1] makes the view parallel to up, [0, 1, 0]; choose another up",
    ),
    (
        "fov = 90",
        "up = [0, 0, 0]\nfov = 90",
        "camera.up: [0, 0, 0] must not be zero: its length must be at least 1e-9",
    ),
    ("fov = 90", "fov = 0", "camera.fov: 0 must be from 0.001 to 179.999"),
    ("fov = 90", "fov = 180", "camera.fov: 180 must be from 0.001 to 179.999"),
    ("fov = 90", "fov = nan", "camera.fov: nan must be from 0.001 to 179.999"),
    (
        "focal_length = 2",
        "focal_length = 0",
        "camera.focal_length: 0 must be from 1e-9 to 1e9",
    ),
    (
        "fov = 90\nfocal_length = 2",
        "height = -2\ntype = 'orthographic'",
        "camera.height: -2 must be from 1e-9 to 1e9",
    ),
    (
        "ambient = [0.1, 0.1, 0.1]",
        "ambient = [0, 0, -0.1]",
        "render.ambient: -0.1 must be from 0 to 1e6",
    ),
    (
        "background = [0.2, 0.2, 0.2]",
        "background = [0, inf, 0]",
        "render.background: inf must be from 0 to 1e6",
    ),
    (
        "shadow_epsilon = 1e-4",
        "shadow_epsilon = -1e-9",
        "render.shadow_epsilon: -1e-9 must be from 0 to 0.1",
    ),
    (
        r#"pixel_samples = { pattern = "grid", count = 4 }"#,
        "pixel_samples = { count = 15 }",
        "render.pixel_samples.count: 15 must be a square number, such as 9 or 16: the pattern \"grid\" is an n x n grid; other patterns take any number",
    ),
    (
        r#"light_samples = { pattern = "random", count = 3 }"#,
        "light_samples = { pattern = 'random', count = 0 }",
        "render.light_samples.count: 0 must be from 1 to 65536",
    ),
    (
        "color = [0.7, 0.7, 0.7]",
        "color = [-1, 0, 0]",
        "materials.white.color: -1 must be from 0 to 1e6",
    ),
    (
        "diffuse = [0.4, 0, 0]",
        "diffuse = [0, 2e6, 0]",
        "materials.\"dark red\".diffuse: 2e6 must be from 0 to 1e6",
    ),
    (
        "shininess = 20",
        "shininess = 0",
        "materials.white.shininess: 0 must be from 1e-6 to 1e6",
    ),
    (
        "center = [0, 0, 9]",
        "center = [2e9, 0, 0]",
        "lights[0].center: 2e9 must be from -1e9 to 1e9",
    ),
    (
        "size = [2, 4]",
        "size = [2, inf]",
        "lights[0].size: inf must be from 1e-9 to 1e9",
    ),
    (
        "tangent = [4, 0, 3]",
        "tangent = [0, 0, 5]",
        "lights[0].tangent: [0, 0, 5] must not be parallel to the normal, [0, 0, -3]",
    ),
    (
        "color = [1, 0.5, 0]",
        "color = [nan, 0, 0]",
        "lights[0].color: nan must be from 0 to 1e6",
    ),
    (
        "position = [0, 0, 8]",
        "position = [0, 0, inf]",
        "lights[1].position: inf must be from -1e9 to 1e9",
    ),
    (
        "direction = [0, 3, -4]",
        "direction = [0, 0, 0]",
        "lights[2].direction: [0, 0, 0] must not be zero: its length must be at least 1e-9",
    ),
    (
        "size = [6, 2]",
        "size = [6, -1]",
        "shapes[0].size: -1 must be from 1e-9 to 1e9",
    ),
    (
        "size = [6, 2]",
        "size = [0, 2]",
        "shapes[0].size: 0 must be from 1e-9 to 1e9",
    ),
    (
        "normal = [0, 0, 1]",
        "normal = [0, 0, 0]",
        "shapes[0].normal: [0, 0, 0] must not be zero: its length must be at least 1e-9",
    ),
    (
        "tangent = [0, 1, 0]",
        "tangent = [0, 1e-7, 1]",
        "shapes[0].tangent: [0, 1e-7, 1] must not be parallel to the normal, [0, 0, 1]",
    ),
    (
        "a = [1, 0, 0]",
        "a = [0, 0, 0]",
        "shapes[1].a: [0, 0, 0] must not be zero: its length must be at least 1e-9",
    ),
    (
        "b = [1, 2, 0]",
        "b = [-2, 0, 0]",
        "shapes[1].b: [-2, 0, 0] must not be parallel to a, [1, 0, 0]",
    ),
    (
        "c = [0, 0, 3]",
        "c = [1, 1, 0]",
        "shapes[1].c: [1, 1, 0] must not lie in the plane of a and b, [1, 0, 0] and [1, 2, 0]",
    ),
    (
        "radius = 0.5",
        "radius = -0.5",
        "shapes[2].radius: -0.5 must be from 1e-9 to 1e9",
    ),
    (
        "radius = 0.5",
        "radius = nan",
        "shapes[2].radius: nan must be from 1e-9 to 1e9",
    ),
    (
        "material = \"white\" # sphere",
        "material = \"blue\"",
        "shapes[2].material: there is no material \"blue\"; the scene has \"dark red\", \"white\"",
    ),
    (
        "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
        "vertices = [[0, 0, 0], [1, 1, 1], [2, 2, 2]]",
        "shapes[3].vertices: [[0, 0, 0], [1, 1, 1], [2, 2, 2]] must not lie on one line",
    ),
    (
        "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
        "vertices = [[1, 2, 3], [1, 2, 3], [1, 2, 3]]",
        "shapes[3].vertices: [[1, 2, 3], [1, 2, 3], [1, 2, 3]] must be at least 1e-9 apart",
    ),
    (
        "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
        "vertices = [[0, 0, 0], [1, nan, 0], [0, 1, 0]]",
        "shapes[3].vertices[1]: nan must be from -1e9 to 1e9",
    ),
    (
        "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
        "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]",
        "shapes[4].vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] must not lie in one plane",
    ),
    (
        "tangent = [1, 1, 0]",
        "tangent = [0, 0, -1]",
        "shapes[5].tangent: [0, 0, -1] must not be parallel to the normal, [0, 0, 2]",
    ),
];

#[test]
fn invalid_values_are_reported_with_line_key_value_and_rule() {
    for &(line, invalid, rule) in INVALID {
        let text = with_line(line, invalid);
        let line_number = text[..text.find(invalid).unwrap()].lines().count() + 1;
        let message = parse(&text).unwrap_err().to_string();
        assert_eq!(message, format!("s.toml:{line_number}: {rule}"));
    }
}

#[test]
fn values_at_the_limits_are_valid() {
    for (line, valid) in [
        ("width = 8", "width = 65536"),
        ("height = 4", "height = 1"),
        ("look_at = [0, 0, 1]", "look_at = [1e9, 0, -1e9]"),
        ("fov = 90", "fov = 179.999"),
        ("fov = 90", "fov = 0.001"),
        ("shadow_epsilon = 1e-4", "shadow_epsilon = 0"),
        (
            r#"pixel_samples = { pattern = "grid", count = 4 }"#,
            "pixel_samples = { count = 65536 }",
        ),
        ("color = [0.7, 0.7, 0.7]", "color = [0, -0.0, 1e6]"),
        ("size = [6, 2]", "size = [1e-9, 1e9]"),
        ("tangent = [0, 1, 0]", "tangent = [0, 1e-5, 1]"),
        ("c = [0, 0, 3]", "c = [1, 1, 1e-5]"),
        (
            "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
            "vertices = [[0, 0, 0], [1, 1e-5, 0], [2, 0, 0]]",
        ),
    ] {
        parse(&with_line(line, valid)).unwrap();
    }
}

#[test]
fn a_phong_material_needs_each_factor_or_a_color() {
    let message = parse(&with_line("diffuse = [0.4, 0, 0]", "")).unwrap_err().to_string();
    let line = VALID
        .lines()
        .position(|line| line.starts_with("[materials.\"dark"))
        .unwrap()
        + 1;
    let rule = "is missing; set diffuse or color";
    assert_eq!(message, format!("s.toml:{line}: materials.\"dark red\".diffuse {rule}"));
}

#[test]
fn empty_scenes_are_valid_but_unknown_materials_are_not() {
    let empty = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n";
    assert_eq!(parse(empty).unwrap().shapes, []);
    let text = format!("{empty}[[shapes]]\ntype = 'sphere'\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'a'\n");
    let rule = "s.toml:7: shapes[0].material: there is no material \"a\"; the scene has none";
    assert_eq!(parse(&text).unwrap_err().to_string(), rule);
}

#[test]
fn the_page_has_the_limits() {
    let page = include_str!("../../../../docs/scene-format.md");
    let page = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let (shortest, longest) = LENGTHS;
    for limit in [
        format!("each from -{0} to {0}", number(MAX_COORDINATE)),
        format!("any length from {} on", number(shortest)),
        format!("A *length* is from {} to {}", number(shortest), number(longest)),
        format!("each from 0 to {}", number(MAX_COLOR)),
        format!(
            "accepts {} to {} |",
            Integrator::Phong.depths().0,
            Integrator::Phong.depths().1
        ),
        format!("| `rr_depth` | integer, 0 to {MAX_DEPTH} | {RR_DEPTH} |"),
        format!("sine of their angle must be above {}", number(MIN_SINE)),
        format!("unit vectors span must be above {}", number(MIN_SINE)),
        format!("twice the area is above {} times", number(MIN_SINE)),
        format!("six times the volume is above {} times", number(MIN_SINE)),
    ] {
        assert!(page.contains(&limit), "{limit}");
    }
}

#[test]
fn disks_accept_all_radii_in_the_range_of_lengths() {
    let scene = |radius: &str, normal: &str| {
        let text = format!(
            "image = {{ width = 1, height = 1 }}\ncamera = {{ position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }}\n\
             materials.m = {{ type = 'mirror' }}\nshapes = [{{ type = 'disk', material = 'm', center = [0, 0, 0], \
             radius = {radius}, normal = {normal} }}]\n"
        );
        crate::Scene::parse(&text, "s.toml").map_err(|error| error.to_string())
    };
    for radius in ["1e-9", "1", "1e9"] {
        for normal in ["[1, 0, 0]", "[-1, 0, 0]", "[0, 1, 0]", "[0, 0, -1]", "[0.9, 0.1, 0.42]"] {
            let scene = scene(radius, normal).unwrap();
            let Geometry::Disk(disk) = &scene.shapes[0].geometry else {
                panic!("shape 0 is not a disk");
            };
            let radius: f64 = radius.parse().unwrap();
            assert!((disk.u.length() / radius - 1.0).abs() < 1e-12 && (disk.v.length() / radius - 1.0).abs() < 1e-12);
        }
    }
    let message = scene("1.1e9", "[0, 0, 1]").unwrap_err();
    assert!(message.contains("shapes[0].radius: 1.1e9 must be"), "{message}");
}

#[test]
fn cylinders_accept_all_radii_and_heights_in_the_range_of_lengths() {
    let scene = |start: f64, end: f64, more_keys: &str| {
        let [start, end] = [start, end].map(|x| format!("{x:?}").to_lowercase());
        let text = format!(
            "image = {{ width = 1, height = 1 }}\ncamera = {{ position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }}\n\
             materials.m = {{ type = 'mirror' }}\nshapes = [{{ type = 'cylinder', material = 'm', start = [0, 0, {start}], \
             end = [0, 0, {end}], {more_keys} }}]\n"
        );
        crate::Scene::parse(&text, "s.toml").map_err(|error| error.to_string())
    };
    for radius in [1e-9, 1.0, 1e9] {
        for height in [1e-9, 1.0, 1e9] {
            let scene = scene(0.0, height, &format!("radius = {radius:e}")).unwrap();
            let Geometry::Cylinder {
                center,
                axes: [u, v, w],
            } = scene.shapes[0].geometry
            else {
                panic!("shape 0 is not a cylinder");
            };
            assert_eq!(w, DVec3::Z * height / 2.0);
            assert_eq!((center, u, v), (w, DVec3::X * radius, DVec3::Y * radius));
        }
    }
    for (start, end, more_keys, error) in [
        (
            1.0,
            1.0,
            "radius = 1",
            "shapes[0].end: [0, 0, 1] must be at least 1e-9 from the start, [0, 0, 1]",
        ),
        (0.0, 1.0, "radius = 0", "shapes[0].radius: 0 must be from 1e-9 to 1e9"),
        (
            0.0,
            1.0,
            "radius = 1, tangent = [0, 0, 2]",
            "shapes[0].tangent: [0, 0, 2] must not be parallel to the axis, [0, 0, 1]",
        ),
        (f64::NAN, 1.0, "radius = 1", "shapes[0].start: "),
    ] {
        let message = scene(start, end, more_keys).unwrap_err();
        assert!(message.contains(error), "{message}");
    }
}
