//! A small glTF model: a box, and a smaller box on top that rises in an animation, is gold in a variant, and is absent
//! from the second scene. Two cameras are optional.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

#[derive(Clone, Debug)]
pub struct Model {
    /// Base color of the large box.
    pub color: [f64; 3],
    pub has_cameras: bool,
    pub animated: bool,
}

impl Default for Model {
    fn default() -> Model {
        Model {
            color: [0.7, 0.3, 0.2],
            has_cameras: false,
            animated: true,
        }
    }
}

/// Returns a corner of the box (-1, 0, -0.5) to (1, 1, 0.5), +y up.
fn corner(i: usize) -> [f32; 3] {
    let side = |axis: usize, low: f32, high: f32| if i >> axis & 1 == 0 { low } else { high };
    [side(0, -1.0, 1.0), side(1, 0.0, 1.0), side(2, -0.5, 0.5)]
}

const TRIANGLES: [u16; 36] = [
    0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6,
];

impl Model {
    /// Returns the buffer: positions, indices, two key times, two translations.
    fn bytes() -> Vec<u8> {
        let positions = (0..8).flat_map(corner).flat_map(f32::to_le_bytes);
        let indices = TRIANGLES.into_iter().flat_map(u16::to_le_bytes);
        let keys = [0.0_f32, 1.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0]
            .into_iter()
            .flat_map(f32::to_le_bytes);
        positions.chain(indices).chain(keys).collect()
    }

    fn json(&self) -> Value {
        let [r, g, b] = self.color;
        let material = |name: &str, color: [f64; 3], metallic: f64| {
            let [r, g, b] = color;
            json!({ "name": name, "pbrMetallicRoughness":
                { "baseColorFactor": [r, g, b, 1], "metallicFactor": metallic, "roughnessFactor": 0.5 } })
        };
        let primitive =
            |material: usize| json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": material });
        let mut small = primitive(1);
        small["extensions"] = json!({ "KHR_materials_variants": { "mappings": [{ "material": 2, "variants": [0] }] } });
        let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        let accessor = |view: usize, component: u32, count: usize, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        let mut positions = accessor(0, 5126, 8, "VEC3");
        (positions["min"], positions["max"]) = (json!(corner(0)), json!(corner(7)));
        let mut times = accessor(2, 5126, 2, "SCALAR");
        (times["min"], times["max"]) = (json!([0.0]), json!([1.0]));
        let mut json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "name": "all", "nodes": [0, 1] }, { "name": "one", "nodes": [0] }],
            "nodes": [{ "mesh": 0 }, { "name": "small", "mesh": 1, "translation": [0, 1, 0], "scale": [0.4, 0.4, 0.4] }],
            "meshes": [{ "primitives": [primitive(0)] }, { "primitives": [small] }],
            "materials": [
                material("clay", [r, g, b], 0.0), material("blue", [0.1, 0.2, 0.8], 0.0), material("gold", [0.9, 0.7, 0.2], 1.0),
            ],
            "extensionsUsed": ["KHR_materials_variants"],
            "extensions": { "KHR_materials_variants": { "variants": [{ "name": "golden" }] } },
            "accessors": [positions, accessor(1, 5123, 36, "SCALAR"), times, accessor(3, 5126, 2, "VEC3")],
            "bufferViews": [view(0, 96), view(96, 72), view(168, 8), view(176, 24)],
        });
        if self.animated {
            json["animations"] = json!([{
                "name": "rise",
                "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
                "samplers": [{ "input": 2, "output": 3 }],
            }]);
        }
        if self.has_cameras {
            let side = 0.5_f64.sqrt();
            let camera_nodes = json!([
                { "name": "front camera", "camera": 0, "translation": [0, 1, 6] },
                { "name": "side camera", "camera": 1, "translation": [6, 1, 0], "rotation": [0, side, 0, side] },
            ]);
            let nodes = json["nodes"].as_array_mut().expect("a list");
            nodes.extend(camera_nodes.as_array().into_iter().flatten().cloned());
            json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
            json["cameras"] = json!([
                { "type": "perspective", "perspective": { "yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1 } },
                { "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } },
            ]);
        }
        json
    }

    pub fn glb(&self) -> Vec<u8> {
        let bytes = Model::bytes();
        let mut json = self.json();
        json["buffers"] = json!([{ "byteLength": bytes.len() }]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let word = |count: usize| (count as u32).to_le_bytes();
        let header = [&b"glTF"[..], &word(2), &word(12 + 8 + text.len() + 8 + bytes.len())].concat();
        [
            &header,
            &word(text.len())[..],
            b"JSON",
            &text,
            &word(bytes.len()),
            b"BIN\0",
            &bytes,
        ]
        .concat()
    }

    /// Writes a .gltf file and its buffer `NAME.bin`.
    pub fn write_gltf(&self, folder: &Path, name: &str) {
        let bytes = Model::bytes();
        let mut json = self.json();
        json["buffers"] = json!([{ "byteLength": bytes.len(), "uri": format!("{name}.bin") }]);
        fs::write(folder.join(format!("{name}.bin")), bytes).expect("a file");
        fs::write(folder.join(format!("{name}.gltf")), json.to_string()).expect("a file");
    }

    pub fn write_glb(&self, folder: &Path, name: &str) {
        fs::write(folder.join(name), self.glb()).expect("a file");
    }
}
