//! A valid file of every format. The tests mutate these files.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use glam::DVec3;
use image::{DynamicImage, ImageFormat, Rgb, Rgb32FImage, Rgba, RgbaImage};
use serde_json::{Value, json};

use super::everything::everything;
use crate::sources::path as project_path;

pub type Serializer = fn(&Value) -> Option<Vec<u8>>;

/// A file format with a valid file.
pub struct Format {
    /// Extension of the file name.
    pub extension: &'static str,
    /// A valid file.
    pub bytes: Vec<u8>,
    /// The file as a tree of values and the serializer of such trees, if the format has one.
    pub values: Option<(Value, Serializer)>,
    /// Permitted exit codes for a mutated file, in addition to 0.
    pub codes: &'static [i32],
    pub command: ReadCommand,
}

/// Command that reads the file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum ReadCommand {
    /// `wgray render` of the file.
    Scene,
    /// `wgray render` of a scene that consists of [`SCENE_START`] and this text, in which `FILE` stands for the file.
    Named(&'static str),
    /// `wgray render` of a scene as for `Named`, then `wgray diff` of the file.
    Picture(&'static str),
    /// `wgray render --resume` with the file as its checkpoint.
    Checkpoint,
    /// `wgray merge` of the file.
    Part,
}

/// Keys that a scene needs in addition to shapes and materials.
pub const SCENE_START: &str = "
image = { width = 8, height = 6 }
camera = { position = [0, -4, 1], look_at = [0, 0, 0], fov = 50 }
render = { integrator = 'path', pixel_samples = { pattern = 'random', count = 1 } }
lights = [{ type = 'point', position = [1, -4, 3], color = [9, 9, 9] }]
";
pub const TEXTURE: &str = "
[textures.t]
type = 'image'
file = 'FILE'
[materials.m]
type = 'diffuse'
color = { texture = 't' }
[[shapes]]
type = 'sphere'
material = 'm'
center = [0, 0, 0]
radius = 1
";
const ENVIRONMENT: &str = "
[environment]
file = 'FILE'
[materials.m]
type = 'diffuse'
color = [1, 1, 1]
[[shapes]]
type = 'sphere'
material = 'm'
center = [0, 0, 0]
radius = 1
";
const MESH: &str = "
[materials.m]
type = 'diffuse'
color = [1, 1, 1]
[[shapes]]
type = 'mesh'
file = 'FILE'
material = 'm'
";
const LIBRARY: &str = "
[[shapes]]
type = 'mesh'
file = 'named.obj'
";

const OBJ: &str = "mtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0\nv 0 1 0.5\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n# a comment\n\
    usemtl a\nf 1/1/1 2/2/1 3/3/1\nf 2//1 4//1 3//1\ng other\nf -4 -3 -2 -1 \\\n 1\n";
const MTL: &str = "newmtl a\nKd 0.5 0.4 0.3\nKs 0.1 0.1 0.1\nNs 20\nd 0.9\nNi 1.4\nillum 2\nmap_Kd -s 2 2 1 t.png\nnewmtl b\nKe 1 1 1\nTr 0.5\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nfacet normal 0 0 1\n\
    outer loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
const COURSE: &str = r#"{
  "spp": 1, "max_depth": 2, "image_resolution": [8, 6],
  "cam_config": { "position": [0, 1, 4], "look_at": [0, 0, 0], "ref_up": [0, 1, 0], "vertical_fov": 40, "focal_length": 1 },
  "light_config": { "position": [0, 4, 0], "size": [1, 1], "radiance": [5, 5, 5] },
  "materials": [{ "name": "grey", "type": "diffuse", "color": [0.5, 0.5, 0.5] }],
  "objects": [{ "obj_file_path": "named.obj", "material_name": "grey", "translate": [0, 0, 0], "scale": 1, "has_bvh": false }]
}"#;

fn ply() -> Vec<u8> {
    let header = "ply\nformat binary_little_endian 1.0\ncomment a\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n\
        property uchar flags\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    for corner in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [1.0, 1.0, 0.0f32]] {
        bytes.extend(corner.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([200, 100, 50]);
    }
    for face in [[0, 1, 2], [1, 3, 2i32]] {
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|i| i.to_le_bytes()));
        bytes.push(7);
    }
    bytes
}

fn image(format: ImageFormat) -> Vec<u8> {
    let bytes = RgbaImage::from_fn(16, 8, |x, y| {
        Rgba([x as u8 * 16, y as u8 * 30, (x * y) as u8, 255 - x as u8])
    });
    let floats = Rgb32FImage::from_fn(16, 8, |x, y| Rgb([x as f32 / 8.0, y as f32, (x * y) as f32 / 3.0]));
    let image = match format {
        ImageFormat::OpenExr | ImageFormat::Hdr => DynamicImage::ImageRgb32F(floats),
        ImageFormat::Jpeg => DynamicImage::ImageRgb8(DynamicImage::ImageRgba8(bytes).into_rgb8()),
        _ => DynamicImage::ImageRgba8(bytes),
    };
    let mut file = Cursor::new(Vec::new());
    image.write_to(&mut file, format).unwrap();
    file.into_inner()
}

fn model() -> (Value, Vec<u8>) {
    let (json, binary) = everything();
    let file = container(&json, &binary);
    (json, file)
}

/// Returns a .glb file.
pub fn container(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut file = b"glTF".to_vec();
    let mut append = |words: &[usize], bytes: &[u8]| {
        file.extend(words.iter().flat_map(|word| (*word as u32).to_le_bytes()));
        file.extend(bytes);
    };
    append(&[2, 12 + 8 + text.len() + 8 + binary.len()], &[]);
    append(&[text.len(), 0x4E4F_534A], &text);
    append(&[binary.len(), 0x004E_4942], &binary);
    file
}

/// Returns a .gltf file with its buffer in a data URI.
fn to_gltf(json: &Value) -> Option<Vec<u8>> {
    let (_, binary) = everything();
    let mut json = json.clone();
    let encoded: String = binary.iter().map(|byte| format!("%{byte:02x}")).collect();
    let buffer = json.get_mut("buffers")?.get_mut(0)?.as_object_mut()?;
    buffer.insert("uri".to_owned(), json!(format!("data:,{encoded}")));
    Some(json.to_string().into_bytes())
}

fn to_glb(json: &Value) -> Option<Vec<u8>> {
    Some(container(json, &everything().1))
}

fn to_toml(values: &Value) -> Option<Vec<u8>> {
    toml::to_string(values).ok().map(String::into_bytes)
}

fn to_json(values: &Value) -> Option<Vec<u8>> {
    Some(values.to_string().into_bytes())
}

/// Writes the files that the seed files reference.
pub fn write_referenced_files(folder: &Path) {
    fs::write(folder.join("named.obj"), OBJ).unwrap();
    fs::write(folder.join("a.mtl"), MTL).unwrap();
    fs::write(folder.join("t.png"), image(ImageFormat::Png)).unwrap();
    fs::write(folder.join("plain.toml"), SCENE).unwrap();
}

/// The scene of the checkpoint and the part.
const SCENE: &str = "
image = { width = 8, height = 6 }
camera = { position = [0, -4, 1], look_at = [0, 0, 0], fov = 50 }
lights = [{ type = 'point', position = [1, -4, 3], color = [9, 9, 9] }]
render = { pixel_samples = { pattern = 'random', count = 1 } }
[materials.m]
type = 'phong'
color = [1, 1, 1]
shininess = 5
[[shapes]]
type = 'sphere'
material = 'm'
center = [0, 0, 0]
radius = 1
";

/// Names of scenes that reference no other files.
pub const SCENES: [&str; 5] = ["materials", "cornell", "lens", "lights", "turntable"];

/// Returns all formats.
pub fn all_formats(folder: &Path) -> Vec<Format> {
    write_referenced_files(folder);
    let (json, glb) = model();
    let run_and_read = |arguments: &[&str], file: &str| {
        let result = super::run(folder, arguments);
        assert_eq!(result.code, 0, "{}", result.output);
        fs::read(folder.join(file)).unwrap()
    };
    let render = ["render", "plain.toml", "--device", "cpu", "--threads", "2"];
    let checkpoint = run_and_read(
        &[&render[..], &["--checkpoint", "made.checkpoint", "-o", "made.png"]].concat(),
        "made.checkpoint",
    );
    let part = run_and_read(
        &[
            &render[..],
            &["--tile", "1/1", "--aov", "normal,depth", "-o", "made.part"],
        ]
        .concat(),
        "made.part",
    );
    let course: Value = serde_json::from_str(COURSE).unwrap();
    let new_format = |extension, bytes: Vec<u8>, command| Format {
        extension,
        bytes,
        values: None,
        codes: &[3],
        command,
    };
    let image_format = |extension, encoding, text| Format {
        // `wgray diff` exits with 1 for an unreadable file, 5 for different images and 7 for images that are too large.
        codes: &[1, 3, 5, 7],
        ..new_format(extension, image(encoding), ReadCommand::Picture(text))
    };
    let scenes = SCENES.map(|name| {
        let text = fs::read_to_string(project_path(&format!("scenes/{name}.toml"))).unwrap();
        Format {
            values: Some((toml::from_str(&text).unwrap(), to_toml)),
            ..new_format("toml", text.into_bytes(), ReadCommand::Scene)
        }
    });
    let other_formats = vec![
        Format {
            values: Some((course, to_json)),
            ..new_format("json", COURSE.into(), ReadCommand::Scene)
        },
        Format {
            values: Some((json.clone(), to_gltf)),
            ..new_format("gltf", to_gltf(&json).unwrap(), ReadCommand::Scene)
        },
        Format {
            values: Some((json, to_glb)),
            ..new_format("glb", glb, ReadCommand::Scene)
        },
        new_format("obj", OBJ.into(), ReadCommand::Named(MESH)),
        new_format("mtl", MTL.into(), ReadCommand::Named(LIBRARY)),
        new_format("ply", ply(), ReadCommand::Named(MESH)),
        new_format("stl", STL.into(), ReadCommand::Named(MESH)),
        image_format("png", ImageFormat::Png, TEXTURE),
        image_format("jpg", ImageFormat::Jpeg, TEXTURE),
        image_format("webp", ImageFormat::WebP, TEXTURE),
        new_format("ktx2", ktx2("etc1s-5x7-alpha-levels"), ReadCommand::Named(TEXTURE)),
        new_format("ktx2", ktx2("zstandard-48x20"), ReadCommand::Named(TEXTURE)),
        image_format("exr", ImageFormat::OpenExr, ENVIRONMENT),
        image_format("hdr", ImageFormat::Hdr, ENVIRONMENT),
        Format {
            codes: &[2],
            ..new_format("checkpoint", checkpoint, ReadCommand::Checkpoint)
        },
        Format {
            codes: &[1],
            ..new_format("part", part, ReadCommand::Part)
        },
    ];
    scenes.into_iter().chain(other_formats).collect()
}

/// Reads a KTX2 file that `tests/textures/ktx2.mjs` wrote.
pub fn ktx2(name: &str) -> Vec<u8> {
    fs::read(project_path(&format!("tests/textures/ktx2/{name}.ktx2"))).unwrap()
}

/// Returns the JSON and the buffer of a glTF file with one triangle.
pub fn triangle() -> (Value, Vec<u8>) {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let numbers = corners.iter().flat_map(|corner| corner.to_array());
    let binary: Vec<u8> = numbers.flat_map(|x| (x as f32).to_le_bytes()).collect();
    let json = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": [{ "buffer": 0, "byteLength": binary.len() }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
    });
    (json, binary)
}
