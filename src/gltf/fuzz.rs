//! Files with everything in them, changed at random: what is read of them is sound, or there is a message.

use std::collections::BTreeSet;
use std::io::Cursor;

use image::{ImageFormat, Rgba, RgbaImage};
use serde_json::{Value, json};

use super::{Choice, Imported, import};
use crate::gltf::made::container;
use crate::scene::Selection;

/// A file that has what the importer looks at, and its bytes.
fn everything() -> (Value, Vec<u8>) {
    let mut binary = Vec::new();
    let mut views = Vec::new();
    let mut accessors = Vec::new();
    let mut view = |bytes: Vec<u8>| {
        views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
        binary.extend(bytes);
        binary.resize(binary.len().next_multiple_of(4), 0);
        views.len() - 1
    };
    let floats = |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let mut accessor = |bytes: Vec<u8>, component: u32, kind: &str, count: usize, normalized: bool| {
        let view = view(bytes);
        accessors.push(json!({
            "bufferView": view, "componentType": component, "type": kind, "count": count, "normalized": normalized
        }));
        accessors.len() - 1
    };
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.5];
    let positions = accessor(floats(&corners), 5126, "VEC3", 4, false);
    let normals = accessor(floats(&[0.0, 0.0, 1.0].repeat(4)), 5126, "VEC3", 4, false);
    let tangents = accessor(floats(&[1.0, 0.0, 0.0, -1.0].repeat(4)), 5126, "VEC4", 4, false);
    let uvs = accessor(
        floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
        5126,
        "VEC2",
        4,
        false,
    );
    let colors = accessor((0..16).map(|i| i * 16).collect(), 5121, "VEC4", 4, true);
    let indices = accessor(vec![0, 1, 2, 2, 1, 3], 5121, "SCALAR", 6, false);
    let joints = accessor([0, 1, 0, 0].repeat(4), 5121, "VEC4", 4, false);
    let weights = accessor(floats(&[0.75, 0.25, 0.0, 0.0].repeat(4)), 5126, "VEC4", 4, false);
    let moves = accessor(floats(&[0.0, 0.0, 0.5].repeat(4)), 5126, "VEC3", 4, false);
    let times = accessor(floats(&[0.0, 1.0, 2.0]), 5126, "SCALAR", 3, false);
    let ways = accessor(
        floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0]),
        5126,
        "VEC3",
        3,
        false,
    );
    let turns = accessor(
        floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8, 0.0, 1.0, 0.0, 0.0]),
        5126,
        "VEC4",
        3,
        false,
    );
    let shares = accessor(
        floats(&[0.0, 1.0, 0.5, 0.0, 0.25, 1.0, 0.0, 0.0, 1.0]),
        5126,
        "SCALAR",
        9,
        false,
    );
    let bind = accessor(
        floats(&[1.0, 0.0, 0.0, 0.0, 0.0].repeat(7)[..32]),
        5126,
        "MAT4",
        2,
        false,
    );
    let mut png = Cursor::new(Vec::new());
    let image = RgbaImage::from_fn(2, 2, |x, y| Rgba([x as u8 * 255, y as u8 * 255, 128, 200]));
    image.write_to(&mut png, ImageFormat::Png).unwrap();
    let image = view(png.into_inner());
    let sparse = json!({
        "componentType": 5126, "type": "VEC3", "count": 4,
        "sparse": { "count": 2, "indices": { "bufferView": 5, "componentType": 5121, "byteOffset": 1 }, "values": { "bufferView": 0 } },
    });
    accessors.push(sparse);
    let sparse = accessors.len() - 1;
    let slot = |set: usize| {
        json!({
            "index": 0, "texCoord": set,
            "extensions": { "KHR_texture_transform": { "offset": [0.5, 0.25], "rotation": 0.3, "scale": [2, -1] } },
        })
    };
    let json = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_texture_transform"],
        "extensions": {
            "KHR_lights_punctual": { "lights": [
                { "type": "point", "color": [1, 0.5, 0.25], "intensity": 10 },
                { "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.7 } },
                { "type": "directional" },
            ] },
            "KHR_materials_variants": { "variants": [{ "name": "a" }, { "name": "b" }] },
        },
        "scene": 0,
        "scenes": [{ "nodes": [0, 4, 7] }, { "nodes": [5] }],
        "nodes": [
            { "children": [1, 2], "rotation": [0, 0.6, 0, 0.8], "scale": [1, -2, 1] },
            { "mesh": 0, "translation": [1, 2, 3], "weights": [0.5, 0.25] },
            { "mesh": 1, "skin": 0, "children": [3] },
            { "translation": [0, 1, 0] },
            { "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": {
                "attributes": { "TRANSLATION": ways, "ROTATION": turns, "SCALE": ways } } } },
            { "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "camera": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1],
              "extensions": { "KHR_lights_punctual": { "light": 1 } } },
            { "children": [5, 6], "extensions": { "KHR_lights_punctual": { "light": 2 } } },
        ],
        "cameras": [
            { "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1, "aspectRatio": 1.5 } },
            { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1, "znear": 0.1, "zfar": 10 } },
        ],
        "skins": [{ "joints": [0, 3], "inverseBindMatrices": bind }],
        "animations": [{
            "name": "all",
            "samplers": [
                { "input": times, "output": ways },
                { "input": times, "output": turns, "interpolation": "STEP" },
                { "input": times, "output": shares, "interpolation": "CUBICSPLINE" },
            ],
            "channels": [
                { "sampler": 0, "target": { "node": 0, "path": "translation" } },
                { "sampler": 1, "target": { "node": 3, "path": "rotation" } },
                { "sampler": 0, "target": { "node": 3, "path": "scale" } },
                { "sampler": 2, "target": { "node": 1, "path": "weights" } },
            ],
        }],
        "meshes": [
            { "weights": [0.1, 0.2], "primitives": [
                {
                    "attributes": { "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors },
                    "indices": indices, "material": 0,
                    "targets": [{ "POSITION": moves, "NORMAL": moves }, { "POSITION": sparse }],
                    "extensions": { "KHR_materials_variants": {
                        "mappings": [{ "material": 1, "variants": [1] }, { "material": 2, "variants": [0] }] } },
                },
                { "attributes": { "POSITION": positions }, "mode": 5 },
                { "attributes": { "POSITION": positions }, "mode": 1 },
            ] },
            { "primitives": [
                {
                    "attributes": {
                        "POSITION": positions, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": uvs, "TEXCOORD_1": uvs,
                        "JOINTS_0": joints, "WEIGHTS_0": weights,
                    },
                    "indices": indices, "material": 1,
                },
                { "attributes": { "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs }, "mode": 6, "material": 2 },
            ] },
        ],
        "materials": [
            {
                "name": "a", "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": true,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [1, 0.5, 0.25, 0.9], "baseColorTexture": slot(0), "metallicRoughnessTexture": slot(0),
                    "metallicFactor": 0.5, "roughnessFactor": 0.7,
                },
                "normalTexture": { "index": 0, "scale": 0.5 }, "occlusionTexture": { "index": 0 },
                "emissiveTexture": slot(0), "emissiveFactor": [0.5, 0.5, 0.5],
                "extensions": {
                    "KHR_materials_emissive_strength": { "emissiveStrength": 3 },
                    "KHR_materials_ior": { "ior": 1.4 },
                    "KHR_materials_transmission": { "transmissionFactor": 0.5, "transmissionTexture": slot(0) },
                    "KHR_materials_volume": {
                        "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.5, 0.6, 0.7] },
                    "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [1, 2, 3], "specularTexture": slot(0) },
                },
            },
            {
                "name": "a", "alphaMode": "BLEND",
                "normalTexture": slot(1),
                "extensions": {
                    "KHR_materials_clearcoat": {
                        "clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.5, "clearcoatNormalTexture": slot(0) },
                    "KHR_materials_sheen": { "sheenColorFactor": [1, 1, 1], "sheenColorTexture": slot(1), "sheenRoughnessFactor": 0.5 },
                    "KHR_materials_anisotropy": {
                        "anisotropyStrength": 0.5, "anisotropyRotation": 1, "anisotropyTexture": slot(0) },
                },
            },
            { "extensions": { "KHR_materials_unlit": {} }, "pbrMetallicRoughness": { "baseColorTexture": slot(0) } },
        ],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }],
        "images": [{ "bufferView": image, "mimeType": "image/png" }],
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": views,
        "accessors": accessors,
    });
    (json, binary)
}

/// Random numbers: Marsaglia, "Xorshift RNGs", 2003, of 64 bits, the higher half of each.
struct Random(u64);

impl Random {
    fn word(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u32
    }

    fn below(&mut self, count: usize) -> usize {
        self.word() as usize % count
    }
}

/// All ways to values of a JSON.
fn ways(value: &Value, way: &mut String, all: &mut Vec<String>) {
    all.push(way.clone());
    let length = way.len();
    let mut inner = |key: &str, value: &Value| {
        way.push('/');
        way.push_str(key);
        ways(value, way, all);
        way.truncate(length);
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| inner(key, value)),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .for_each(|(i, value)| inner(&i.to_string(), value)),
        _ => {}
    }
}

fn changed(json: &mut Value, random: &mut Random) {
    let mut all = Vec::new();
    ways(json, &mut String::new(), &mut all);
    let other = json.pointer(&all[random.below(all.len())]).cloned();
    let way = &all[1 + random.below(all.len() - 1)];
    let (outer, key) = way.rsplit_once('/').unwrap_or_default();
    let strange = [
        json!(0),
        json!(1),
        json!(2),
        json!(3),
        json!(-1),
        json!(7),
        json!(1000),
        json!(u32::MAX),
        json!(1u64 << 32),
        json!(u64::MAX),
        json!(0.5),
        json!(-0.25),
        json!(3e38),
        json!(-3e38),
        json!(1e-45),
        json!(1e39),
        json!(4_194_304),
        json!(5126),
        json!(5121),
        json!(5123),
        json!(5125),
        json!(null),
        json!(true),
        json!(""),
        json!("x"),
        json!("SCALAR"),
        json!("VEC4"),
        json!([]),
        json!({}),
        json!([0]),
        json!([1e38, 1e38, 1e38]),
        json!([0, 0, 0]),
        json!([0, 0, 0, 0]),
    ];
    let kind = random.below(10);
    if kind < 2 {
        match json.pointer_mut(outer) {
            Some(Value::Object(map)) => drop(map.remove(key)),
            Some(Value::Array(list)) if kind == 0 => drop(list.pop()),
            Some(Value::Array(list)) => list.extend(list.last().cloned()),
            _ => {}
        }
    } else if let Some(value) = json.pointer_mut(way) {
        *value = match (kind, other) {
            (2, Some(other)) => other,
            // Numbers become numbers, most of the time.
            (3..7, _) if value.is_number() => strange[random.below(21)].clone(),
            _ => strange[random.below(strange.len())].clone(),
        };
    }
}

/// What everything behind the importer relies on.
fn check(imported: &Imported) {
    assert!(!imported.instances.is_empty());
    for mesh in &imported.meshes {
        let count = mesh.positions.len();
        assert!(mesh.center.is_finite() && mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.triangles.iter().flatten().all(|vertex| (*vertex as usize) < count));
        let fits = |length: usize| length == 0 || length == count;
        assert!(
            fits(mesh.normals.len()) && fits(mesh.uvs.len()) && fits(mesh.colors.len()) && fits(mesh.tangents.len())
        );
        assert!(mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-3));
        let mut sets = std::iter::once(&mesh.uvs).chain(&mesh.more_uvs);
        assert!(sets.all(|uvs| fits(uvs.len()) && uvs.iter().all(|uv| uv.is_finite())));
        let inside = |x: &f32| (0.0..=1.0).contains(x);
        assert!(mesh.colors.iter().all(|color| color.to_array().iter().all(inside)));
        assert!(
            mesh.tangents
                .iter()
                .all(|tangent| tangent.is_finite() && tangent.length() < 1.5)
        );
    }
    for placed in &imported.instances {
        assert!(placed.to_world.is_finite() && placed.mesh < imported.meshes.len());
        assert!(
            placed
                .materials
                .iter()
                .all(|material| *material < imported.materials.len())
        );
    }
}

/// Reads a file in each way; how often there was something.
fn read(bytes: &[u8], path: &std::path::Path) -> usize {
    std::fs::write(path, bytes).unwrap();
    let root = path.parent().unwrap();
    let none = Choice {
        scene: None,
        time: None,
        animation: None,
        variant: None,
    };
    let all = Choice {
        time: Some(0.7),
        animation: Some(Selection::Number(0)),
        variant: Some(Selection::Number(1)),
        scene: None,
    };
    let choices = [none, all];
    let read = choices
        .iter()
        .filter_map(|choice| import(path, root, choice, &mut BTreeSet::new()).ok());
    read.inspect(check).count()
}

#[test]
fn changed_files_are_read_or_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let (json, binary) = everything();
    assert_eq!(read(&container(&json, &binary), &path), 2);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut good, mut bad, mut scenes) = (0, 0, 0);
    let rounds = std::env::var("WGRAY_TEST_ROUNDS")
        .ok()
        .and_then(|rounds| rounds.parse().ok())
        .unwrap_or(1500);
    for round in 0..rounds {
        let (mut json, mut binary) = (json.clone(), binary.clone());
        for _ in 0..random.below(3) {
            changed(&mut json, &mut random);
        }
        for _ in 0..random.below(3) {
            let at = random.below(binary.len() / 4) * 4;
            let words = [f32::NAN, f32::INFINITY, -3e38, 1e-40, 1e9, 0.0].map(f32::to_bits);
            let word = match random.below(8) {
                i @ 0..6 => words[i],
                _ => random.word(),
            };
            binary[at..at + 4].copy_from_slice(&word.to_le_bytes());
        }
        match read(&container(&json, &binary), &path) {
            0 => bad += 1,
            _ => good += 1,
        }
        // The whole way to a scene, at times.
        if round % 8 == 0 {
            scenes += usize::from(crate::Scene::load(&path).is_ok());
        }
    }
    // All happen often.
    assert!(
        good * 5 > rounds && bad * 10 > rounds && scenes * 50 > rounds,
        "{good} {bad} {scenes}"
    );
}
