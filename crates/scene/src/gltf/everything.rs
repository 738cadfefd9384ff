//! A glTF file with most of the features that the importer supports, for tests and fuzz targets.

use std::io::Cursor;

use image::{ImageFormat, Rgba, RgbaImage};
use serde_json::{Value, json};

/// Returns the JSON and the binary chunk.
pub fn everything() -> (Value, Vec<u8>) {
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
    let displacements = accessor(floats(&[0.0, 0.0, 0.5].repeat(4)), 5126, "VEC3", 4, false);
    let times = accessor(floats(&[0.0, 1.0, 2.0]), 5126, "SCALAR", 3, false);
    let translations = accessor(
        floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0]),
        5126,
        "VEC3",
        3,
        false,
    );
    let rotations = accessor(
        floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8, 0.0, 1.0, 0.0, 0.0]),
        5126,
        "VEC4",
        3,
        false,
    );
    let weight_keys = accessor(
        floats(&[0.0, 1.0, 0.5, 0.0, 0.25, 1.0, 0.0, 0.0, 1.0]),
        5126,
        "SCALAR",
        9,
        false,
    );
    let inverse_bind = accessor(
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
                "attributes": { "TRANSLATION": translations, "ROTATION": rotations, "SCALE": translations } } } },
            { "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "camera": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1],
              "extensions": { "KHR_lights_punctual": { "light": 1 } } },
            { "children": [5, 6], "extensions": { "KHR_lights_punctual": { "light": 2 } } },
        ],
        "cameras": [
            { "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1, "aspectRatio": 1.5 } },
            { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1, "znear": 0.1, "zfar": 10 } },
        ],
        "skins": [{ "joints": [0, 3], "inverseBindMatrices": inverse_bind }],
        "animations": [{
            "name": "all",
            "samplers": [
                { "input": times, "output": translations },
                { "input": times, "output": rotations, "interpolation": "STEP" },
                { "input": times, "output": weight_keys, "interpolation": "CUBICSPLINE" },
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
                    "targets": [{ "POSITION": displacements, "NORMAL": displacements }, { "POSITION": sparse }],
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
