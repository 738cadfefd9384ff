//! Builder of small glTF files.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

/// Component types with their codes (glTF 2.0, 3.6.2.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Component {
    I8 = 5120,
    U8 = 5121,
    I16 = 5122,
    U16 = 5123,
    U32 = 5125,
    F32 = 5126,
}

impl Component {
    pub fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// Returns the stored value that represents 1 in a normalized accessor.
    pub fn one(self) -> f64 {
        match self {
            Component::I8 => 127.0,
            Component::U8 => 255.0,
            Component::I16 => 32767.0,
            Component::U16 => 65535.0,
            Component::U32 | Component::F32 => 1.0,
        }
    }

    fn write_value(self, value: f64, bytes: &mut Vec<u8>) {
        match self {
            Component::I8 => bytes.extend((value as i8).to_le_bytes()),
            Component::U8 => bytes.extend((value as u8).to_le_bytes()),
            Component::I16 => bytes.extend((value as i16).to_le_bytes()),
            Component::U16 => bytes.extend((value as u16).to_le_bytes()),
            Component::U32 => bytes.extend((value as u32).to_le_bytes()),
            Component::F32 => bytes.extend((value as f32).to_le_bytes()),
        }
    }
}

/// Location of the buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Packing {
    /// In the .glb file.
    Binary,
    /// In a file with a space in its name, which the URI encodes as `%20`.
    Beside,
    /// In a data URI.
    Embedded,
}

impl Packing {
    pub const ALL: [Packing; 3] = [Packing::Binary, Packing::Beside, Packing::Embedded];
}

/// A glTF file under construction.
#[derive(Clone)]
pub struct Builder {
    root: Map<String, Value>,
    bytes: Vec<u8>,
}

/// Two triangles from (-1, -1, 0) to (1, 1, 0), facing +z.
pub const QUAD: [[f64; 3]; 4] = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
/// Texture coordinates of [`QUAD`], for an upright image.
pub const QUAD_UVS: [[f64; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
pub const QUAD_INDICES: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// Returns the numbers of columns and rows of an accessor type.
fn shape(accessor_type: &str) -> (usize, usize) {
    match accessor_type {
        "SCALAR" => (1, 1),
        "VEC2" => (1, 2),
        "VEC3" => (1, 3),
        "VEC4" => (1, 4),
        "MAT2" => (2, 2),
        "MAT3" => (3, 3),
        "MAT4" => (4, 4),
        other => panic!("{other} is not an accessor type"),
    }
}

impl Builder {
    /// Returns an empty file.
    pub fn new() -> Builder {
        let mut root = Map::new();
        root.insert("asset".into(), json!({ "version": "2.0" }));
        Builder {
            root,
            bytes: Vec::new(),
        }
    }

    /// Appends a value to a top-level list such as `"nodes"`. Returns the index of the value.
    pub fn add(&mut self, list: &str, value: Value) -> usize {
        let list = self.root.entry(list).or_insert_with(|| json!([]));
        let list = list.as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    }

    pub fn set(&mut self, key: &str, value: Value) {
        self.root.insert(key.into(), value);
    }

    pub fn get(&mut self, key: &str) -> &mut Value {
        self.root
            .get_mut(key)
            .unwrap_or_else(|| panic!("the file has no {key}"))
    }

    pub fn uses(&mut self, extension: &str) {
        let names = self.root.entry("extensionsUsed").or_insert_with(|| json!([]));
        let names = names.as_array_mut().expect("a list");
        if !names.contains(&json!(extension)) {
            names.push(json!(extension));
        }
    }

    /// Adds to `extensionsUsed` and `extensionsRequired`.
    pub fn requires(&mut self, extension: &str) {
        self.uses(extension);
        self.add("extensionsRequired", json!(extension));
    }

    /// Appends the bytes to the buffer, aligned to 4 bytes. Returns the index of their buffer view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.bytes.extend(bytes);
        self.add("bufferViews", view)
    }

    /// Encodes elements, each aligned to `align` bytes. Columns of matrices start at multiples of 4 bytes.
    pub fn elements(accessor_type: &str, component: Component, values: &[f64], align: usize) -> Vec<u8> {
        let (columns, rows) = shape(accessor_type);
        let mut bytes = Vec::new();
        for element in values.chunks(columns * rows) {
            bytes.resize(bytes.len().next_multiple_of(align), 0);
            for column in element.chunks(rows) {
                if columns > 1 {
                    bytes.resize(bytes.len().next_multiple_of(4), 0);
                }
                column
                    .iter()
                    .for_each(|value| component.write_value(*value, &mut bytes));
            }
        }
        bytes.resize(bytes.len().next_multiple_of(align), 0);
        bytes
    }

    /// Adds an accessor of tightly packed values, which are the stored numbers, not normalized. Returns its index.
    pub fn accessor(&mut self, accessor_type: &str, component: Component, values: &[f64]) -> usize {
        let (columns, rows) = shape(accessor_type);
        let bytes = Builder::elements(accessor_type, component, values, 1);
        let view = self.view(&bytes);
        let count = values.len() / (columns * rows);
        self.add(
            "accessors",
            json!({ "bufferView": view, "componentType": component as u32, "count": count, "type": accessor_type }),
        )
    }

    /// Adds a vertex attribute with `min` and `max`, 4-byte aligned. Returns the index of its accessor.
    pub fn attribute<const N: usize>(&mut self, component: Component, normalized: bool, values: &[[f64; N]]) -> usize {
        let accessor_type = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        let stored = |value: f64| match (component, normalized) {
            (Component::F32, _) => f64::from(value as f32),
            (_, false) => value,
            (_, true) => (value * component.one()).round(),
        };
        let flat: Vec<f64> = values.iter().flatten().map(|value| stored(*value)).collect();
        let bytes = Builder::elements(accessor_type, component, &flat, 4);
        let view = self.view(&bytes);
        let size = component.size() * N;
        self.get("bufferViews")[view]["target"] = json!(34962);
        if !size.is_multiple_of(4) {
            self.get("bufferViews")[view]["byteStride"] = json!(size.next_multiple_of(4));
        }
        let bound = |is_min: bool| -> Vec<Value> {
            let component_values = |k: usize| flat.iter().skip(k).step_by(N).copied();
            (0..N)
                .map(|k| match is_min {
                    true => component_values(k).fold(f64::INFINITY, f64::min),
                    false => component_values(k).fold(f64::NEG_INFINITY, f64::max),
                })
                .map(|value| {
                    if component == Component::F32 {
                        json!(value)
                    } else {
                        json!(value as i64)
                    }
                })
                .collect()
        };
        let mut accessor = json!({
            "bufferView": view, "componentType": component as u32, "count": values.len(), "type": accessor_type,
            "min": bound(true), "max": bound(false),
        });
        if normalized && component != Component::F32 {
            accessor["normalized"] = json!(true);
        }
        self.add("accessors", accessor)
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f64; N]]) -> usize {
        self.attribute(Component::F32, false, values)
    }

    /// Adds floats that are not a vertex attribute, such as animation keys. Returns the index of their accessor.
    pub fn samples<const N: usize>(&mut self, values: &[[f64; N]]) -> usize {
        let index = self.floats(values);
        let view = self.get("accessors")[index]["bufferView"].as_u64().expect("a view") as usize;
        let view = self.get("bufferViews")[view].as_object_mut().expect("a view");
        view.remove("target");
        view.remove("byteStride");
        index
    }

    pub fn indices(&mut self, values: &[u32]) -> usize {
        self.indices_of(Component::U32, values)
    }

    /// Adds indices. Returns the index of their accessor.
    pub fn indices_of(&mut self, component: Component, values: &[u32]) -> usize {
        let values: Vec<f64> = values.iter().map(|index| f64::from(*index)).collect();
        let index = self.accessor("SCALAR", component, &values);
        let view = self.get("accessors")[index]["bufferView"].as_u64().expect("a view") as usize;
        self.get("bufferViews")[view]["target"] = json!(34963);
        index
    }

    /// Adds the attributes of [`QUAD`] and returns them.
    pub fn quad_attributes(&mut self) -> Value {
        let position = self.floats(&QUAD);
        let normal = self.floats(&[[0.0, 0.0, 1.0]; 4]);
        let uv = self.floats(&QUAD_UVS);
        json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv })
    }

    /// Adds a mesh with these attributes and the indices of [`QUAD`]. Returns its index.
    pub fn quad_with(&mut self, attributes: Value, material: Option<usize>) -> usize {
        let indices = self.indices(&QUAD_INDICES);
        let mut primitive = json!({ "attributes": attributes, "indices": indices });
        if let Some(material) = material {
            primitive["material"] = json!(material);
        }
        self.add("meshes", json!({ "primitives": [primitive] }))
    }

    /// Adds a mesh of [`QUAD`]. Returns its index.
    pub fn quad(&mut self, material: Option<usize>) -> usize {
        let attributes = self.quad_attributes();
        self.quad_with(attributes, material)
    }

    /// Adds a root node, and a scene if the file has none. Returns the node's index.
    pub fn root_node(&mut self, node: Value) -> usize {
        let node = self.add("nodes", node);
        if !self.root.contains_key("scenes") {
            self.add("scenes", json!({ "nodes": [] }));
            self.set("scene", json!(0));
        }
        let nodes = self.get("scenes")[0]["nodes"].as_array_mut().expect("a list");
        nodes.push(json!(node));
        node
    }

    /// Adds an image whose bytes are in the buffer. Returns the index of the image.
    pub fn image(&mut self, bytes: &[u8], mime_type: &str) -> usize {
        let view = self.view(bytes);
        self.add("images", json!({ "bufferView": view, "mimeType": mime_type }))
    }

    /// Adds a texture with nearest filtering. Returns its index.
    pub fn texture(&mut self, width: u32, texels: &[[u8; 4]]) -> usize {
        let image = self.image(&png(width, texels), "image/png");
        let sampler = self.add("samplers", json!({ "magFilter": 9728, "minFilter": 9728 }));
        self.add("textures", json!({ "source": image, "sampler": sampler }))
    }

    /// Adds a texture of one color. Returns its index.
    pub fn constant_texture(&mut self, texel: [u8; 4]) -> usize {
        self.texture(2, &[texel; 4])
    }

    /// Adds an unlit material, whose pixels equal its base color. Returns its index.
    pub fn unlit(&mut self, mut pbr: Value) -> usize {
        self.uses("KHR_materials_unlit");
        let map = pbr.as_object_mut().expect("a table");
        map.entry("metallicFactor").or_insert(json!(0.0));
        map.entry("roughnessFactor").or_insert(json!(0.9));
        self.add(
            "materials",
            json!({ "pbrMetallicRoughness": pbr, "extensions": { "KHR_materials_unlit": {} } }),
        )
    }

    /// Returns the JSON of the file; `uri` is the URI of the buffer.
    fn json(&self, uri: Option<String>) -> Vec<u8> {
        let mut root = self.root.clone();
        if !self.bytes.is_empty() {
            let mut buffer = json!({ "byteLength": self.bytes.len() });
            if let Some(uri) = uri {
                buffer["uri"] = json!(uri);
            }
            root.insert("buffers".into(), json!([buffer]));
        }
        serde_json::to_vec_pretty(&Value::Object(root)).expect("JSON")
    }

    /// Returns the bytes of a .glb file (glTF 2.0, 4.4).
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json(None);
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = self.bytes.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let mut chunks = Vec::new();
        for (kind, bytes) in [(b"JSON", &json), (b"BIN\0", &binary)] {
            if !bytes.is_empty() {
                chunks.extend((bytes.len() as u32).to_le_bytes());
                chunks.extend(kind);
                chunks.extend(bytes);
            }
        }
        let mut file = b"glTF".to_vec();
        file.extend(2_u32.to_le_bytes());
        file.extend((12 + chunks.len() as u32).to_le_bytes());
        file.extend(chunks);
        file
    }

    /// Writes `NAME.glb` or `NAME.gltf`. If `WGRAY_TEST_GLTF` is set, also writes a copy to this folder for
    /// `scripts/check-gltf`.
    pub fn write(&self, folder: &Path, name: &str, packing: Packing) -> PathBuf {
        if let Some(copy_folder) = std::env::var_os("WGRAY_TEST_GLTF") {
            self.write_into(Path::new(&copy_folder), name, packing);
        }
        self.write_into(folder, name, packing)
    }

    /// Writes an invalid file like [`Builder::write`], but no copy, because the Khronos validator would reject it.
    pub fn write_invalid(&self, folder: &Path, name: &str, packing: Packing) -> PathBuf {
        self.write_into(folder, name, packing)
    }

    fn write_into(&self, folder: &Path, name: &str, packing: Packing) -> PathBuf {
        let (extension, bytes) = match packing {
            Packing::Binary => ("glb", self.glb()),
            Packing::Beside => {
                fs::write(folder.join(format!("{name} data.bin")), &self.bytes).expect("a file");
                ("gltf", self.json(Some(format!("{name}%20data.bin"))))
            }
            Packing::Embedded => {
                let data = format!("data:application/octet-stream;base64,{}", base64(&self.bytes));
                ("gltf", self.json(Some(data)))
            }
        };
        let path = folder.join(format!("{name}.{extension}"));
        fs::write(&path, bytes).expect("a file");
        path
    }
}

/// Returns a PNG file of 8-bit RGBA texels in row-major order, top row first.
pub fn png(width: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, texels.len() as u32 / width);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(texels.as_flattened()).expect("texels");
    writer.finish().expect("a complete PNG");
    bytes
}

/// Encodes bytes as Base64 (RFC 4648, section 4).
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().fold(0, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - chunk.len()));
        for k in 0..4 {
            match k <= chunk.len() {
                true => text.push(char::from(DIGITS[(bits >> (18 - 6 * k)) as usize & 63])),
                false => text.push('='),
            }
        }
    }
    text
}

#[test]
fn base64_matches_the_rfc() {
    let pairs = [
        ("", ""),
        ("f", "Zg=="),
        ("fo", "Zm8="),
        ("foo", "Zm9v"),
        ("foobar", "Zm9vYmFy"),
    ];
    for (bytes, text) in pairs {
        assert_eq!(base64(bytes.as_bytes()), text);
    }
}

#[test]
fn columns_of_matrices_start_at_multiples_of_four_bytes() {
    // Columns of 3 bytes are padded to 4 (glTF 2.0, 3.6.2.4).
    let matrix = Builder::elements("MAT3", Component::U8, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], 4);
    assert_eq!(matrix, [1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0]);
}
