//! Functions that load and render glTF files. Coordinates are those of the file.

use std::path::Path;

use glam::{DVec2, DVec3};
use wgray::scene::{Color, Geometry, Material, Principled, Reflection, Scene, Value};
use wgray::{Device, Options};

use super::build::{Builder, Packing};
use crate::test_folder::TestFolder;

/// A scene whose camera is on the +z axis of the file (-y of the scene), so that [`QUAD`](super::build::QUAD) fills the
/// image. The environment is white.
const SCENE: &str = r#"
image = { width = 6, height = 6 }
camera = { type = "orthographic", position = [0, -10, 0], look_at = [0, 0, 0], height = 2 }
[render]
integrator = "path"
pixel_samples = { pattern = "grid", count = 1 }
[environment]
color = [1, 1, 1]
[[shapes]]
type = "gltf"
"#;

/// A triangle of the scene in file coordinates.
#[derive(Clone, Debug)]
pub struct Triangle {
    pub corners: [DVec3; 3],
    /// Zero if the mesh has no normals.
    pub normals: [DVec3; 3],
    /// In the convention of glTF: v increases downward.
    pub uvs: [DVec2; 3],
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// True if the transform mirrors the triangle, so that its winding is clockwise.
    pub mirrored: bool,
}

impl Triangle {
    /// Returns the geometric normal, which points to the front side.
    pub fn geometric_normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a).normalize();
        if self.mirrored { -normal } else { normal }
    }
}

/// Converts scene coordinates to file coordinates, where +y is up.
pub fn to_file(p: DVec3) -> DVec3 {
    DVec3::new(p.x, p.z, -p.y)
}

/// Loads [`SCENE`] with a shape that refers to this glTF file; `keys` are additional keys of the shape.
pub fn load_scene(file: &Path, keys: &str) -> Scene {
    try_load_scene(file, keys).unwrap_or_else(|error| panic!("{error}"))
}

/// Like [`load_scene`], but returns the error message instead of a panic.
pub fn try_load_scene(file: &Path, keys: &str) -> Result<Scene, String> {
    let scene_folder = file.parent().expect("a folder");
    let name = file.file_name().expect("a name").to_string_lossy();
    let text = format!("{SCENE}file = \"{name}\"\n{keys}\n");
    let path = scene_folder.join("scene.toml");
    std::fs::write(&path, text).expect("a file");
    Scene::load(&path).map_err(|error| error.to_string())
}

/// Writes the glTF file and loads [`SCENE`] with a shape that refers to the file.
pub fn scene(builder: &Builder, name: &str) -> Scene {
    let folder = TestFolder::with_file("a", "");
    load_scene(&builder.write(folder.folder(), name, Packing::Binary), "")
}

/// Like [`scene`], with additional keys of the shape.
pub fn scene_with_keys(builder: &Builder, name: &str, keys: &str) -> Scene {
    let folder = TestFolder::with_file("a", "");
    load_scene(&builder.write(folder.folder(), name, Packing::Binary), keys)
}

/// Returns the error message for an invalid file or invalid keys.
pub fn rejection(builder: &Builder, keys: &str) -> String {
    let folder = TestFolder::with_file("a", "");
    let file = builder.write_invalid(folder.folder(), "invalid", Packing::Binary);
    match try_load_scene(&file, keys) {
        Ok(_) => panic!("the file was not rejected"),
        Err(message) => message,
    }
}

/// Returns all triangles in the order of shapes and meshes.
pub fn triangles(scene: &Scene) -> Vec<Triangle> {
    let mut found = Vec::new();
    for shape in &scene.shapes {
        let Geometry::Mesh {
            mesh,
            to_world,
            materials,
        } = &shape.geometry
        else {
            continue;
        };
        let normal_matrix = to_world.matrix3.inverse().transpose();
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let vertices = triangle.map(|vertex| vertex as usize);
            let group = mesh.group_of.get(i).map_or(0, |group| *group as usize);
            found.push(Triangle {
                corners: vertices
                    .map(|v| to_file(to_world.transform_point3(mesh.center + mesh.positions[v].as_dvec3()))),
                normals: vertices.map(|v| {
                    let normal = mesh.normals.get(v).map_or(DVec3::ZERO, |normal| normal.as_dvec3());
                    to_file((normal_matrix * normal).normalize_or_zero())
                }),
                uvs: vertices.map(|v| {
                    let uv = mesh.uvs.get(v).map_or(DVec2::ZERO, |uv| uv.as_dvec2());
                    DVec2::new(uv.x, 1.0 - uv.y)
                }),
                material: materials[group],
                mirrored: to_world.matrix3.determinant() < 0.0,
            });
        }
    }
    found
}

pub fn corners(scene: &Scene) -> Vec<[DVec3; 3]> {
    triangles(scene).iter().map(|triangle| triangle.corners).collect()
}

#[track_caller]
pub fn assert_corners(scene: &Scene, expected: &[[[f64; 3]; 3]]) {
    let corners = corners(scene);
    assert_eq!(corners.len(), expected.len(), "triangles: {corners:?}");
    for (found, expected) in corners.iter().flatten().zip(expected.as_flattened()) {
        let expected = DVec3::from_array(*expected);
        assert!(
            found.distance(expected) < 1e-5,
            "{found} must be {expected}; corners: {corners:?}"
        );
    }
}

/// Returns the material of the first triangle.
pub fn material(scene: &Scene) -> &Material {
    let triangles = triangles(scene);
    &scene.materials[triangles.first().expect("a triangle").material]
}

/// Returns the BSDF of the first triangle.
pub fn principled(scene: &Scene) -> &Principled {
    match &material(scene).reflection {
        Reflection::Principled(principled) => principled,
        other => panic!("{other:?} is not principled"),
    }
}

/// Returns a value that must be untextured.
#[track_caller]
pub fn plain(value: Value) -> f64 {
    match value {
        Value::Plain(value) => value,
        other => panic!("{other:?} is not plain"),
    }
}

/// Returns a color that must be untextured.
#[track_caller]
pub fn plain_color(color: Color) -> [f64; 3] {
    match color {
        Color::Plain(color) => color.to_array(),
        other => panic!("{other:?} is not plain"),
    }
}

/// Asserts that values differ by at most 1e-6, relative to values above 1.
#[track_caller]
pub fn assert_near<const N: usize>(found: [f64; N], expected: [f64; N]) {
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-6 * b.abs().max(1.0);
    assert!(
        found.iter().zip(&expected).all(is_near),
        "{found:?} is not {expected:?}"
    );
}

/// Renders on the CPU and returns the pixels in row-major order, top row first.
pub fn pixels(scene: &Scene) -> Vec<[f32; 3]> {
    let options = Options {
        device: Device::Cpu,
        ..Options::default()
    };
    wgray::render(scene, &options).expect("an image").pixels().colors
}

/// Asserts that all pixels have this color, within 1e-5.
#[track_caller]
pub fn assert_all(scene: &Scene, expected: [f64; 3]) {
    let pixels = pixels(scene);
    for (i, pixel) in pixels.iter().enumerate() {
        let is_near = (0..3).all(|k| (f64::from(pixel[k]) - expected[k]).abs() < 1e-5 * expected[k].max(1.0));
        assert!(is_near, "pixel {i} is {pixel:?}, not {expected:?}");
    }
}
