//! Tests of small files that request much memory or time, and of extreme numbers: imports must succeed or fail quickly
//! and in little memory.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::{ImportOptions, Imported, import};
use crate::file_system::FileSystem;
use crate::gltf::made::container;

fn read(json: &Value, binary: &[u8]) -> Result<Imported, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, container(json, binary)).unwrap();
    let result = import(
        &path,
        folder.path(),
        &FileSystem::Disk,
        &ImportOptions::default(),
        &mut BTreeSet::new(),
    );
    result.map_err(|error| error.to_string().replace(&format!("{}: ", path.display()), ""))
}

/// Returns a triangle. Accessor 0 contains positions, 1 texture coordinates, 2 normals, and 3 zeros.
fn triangle(corners: [f32; 9], uvs: [f32; 6]) -> (Value, Vec<u8>) {
    let normals = [0.0, 0.0, 1.0].repeat(3);
    let values = corners.iter().chain(&uvs).chain(&normals);
    let binary: Vec<u8> = values.flat_map(|x| x.to_le_bytes()).collect();
    let accessor =
        |view: usize, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": 3, "type": kind });
    let json = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 24 },
            { "buffer": 0, "byteOffset": 60, "byteLength": 36 },
        ],
        "accessors": [
            accessor(0, "VEC3"), accessor(1, "VEC2"), accessor(2, "VEC3"),
            { "componentType": 5126, "count": 100_000, "type": "VEC2" },
        ],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
    });
    (json, binary)
}

const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
const UVS: [f32; 6] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];

#[test]
fn morph_weights_are_not_copied_for_each_node() {
    // If each node had a copy of the weights, the copies would take 40 GB.
    let (mut json, binary) = triangle(CORNERS, UVS);
    json["meshes"][0]["weights"] = json!(vec![0; 1_000_000]);
    json["nodes"] = json!(vec![json!({ "mesh": 0 }); 10_000]);
    let imported = read(&json, &binary).unwrap();
    assert_eq!((imported.meshes.len(), imported.instances.len()), (1, 10_000));
}

#[test]
fn attributes_of_other_counts_are_rejected_with_their_key() {
    let (mut json, binary) = triangle(CORNERS, UVS);
    json["accessors"][3]["type"] = json!("VEC3");
    json["accessors"][3]["count"] = json!(4);
    let rule = "count 4 must equal 3, the count of POSITION";
    let mut attribute = json.clone();
    attribute["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(3);
    assert_eq!(
        read(&attribute, &binary).unwrap_err(),
        format!("meshes[0].primitives[0].attributes.NORMAL: {rule}")
    );
    json["meshes"][0]["weights"] = json!([1, 1]);
    json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }, { "POSITION": 0, "NORMAL": 3 }]);
    assert_eq!(
        read(&json, &binary).unwrap_err(),
        format!("meshes[0].primitives[0].targets[1].NORMAL: {rule}")
    );
}

#[test]
fn unused_texture_coordinate_sets_take_no_memory() {
    // The texture coordinates of all sets would take 8 GB.
    let (mut json, binary) = triangle(CORNERS, UVS);
    json["accessors"][3]["type"] = json!("VEC3");
    json["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "componentType": 5126, "count": 100_000, "type": "VEC2" }));
    json["meshes"][0]["primitives"][0]["attributes"] = json!({ "POSITION": 3 });
    for set in 0..10_000 {
        json["meshes"][0]["primitives"][0]["attributes"][format!("TEXCOORD_{set}")] = json!(4);
    }
    assert_eq!(read(&json, &binary).unwrap_err(), "scene: has no triangles");
}

#[test]
fn equal_material_names_are_made_unique_quickly() {
    let count = 20_000;
    let (mut json, binary) = triangle(CORNERS, UVS);
    json["materials"] = json!(vec![json!({ "name": "a".repeat(500) }); count]);
    let primitive = |i: usize| json!({ "attributes": { "POSITION": 0 }, "material": i });
    json["meshes"][0]["primitives"] = (0..count).map(primitive).collect();
    let imported = read(&json, &binary).unwrap();
    let names: BTreeSet<&str> = imported.materials.iter().map(|material| &*material.name).collect();
    assert_eq!(names.len(), count);
    assert!(names.contains(&*format!("{} ({count})", "a".repeat(200))));
}

#[test]
fn deep_hierarchies_are_imported_and_notes_are_limited() {
    let count = 100_000;
    let (mut json, binary) = triangle(CORNERS, UVS);
    json["nodes"] = (0..count).map(|i| json!({ "children": [i + 1], "mesh": 0 })).collect();
    json["nodes"].as_array_mut().unwrap().push(json!({}));
    assert_eq!(read(&json, &binary).unwrap().instances.len(), count);
    json["nodes"] = json!([{ "mesh": 0 }]);
    let camera = json!({ "camera": 0, "scale": [0, 0, 0] });
    json["nodes"].as_array_mut().unwrap().extend(vec![camera; 1000]);
    json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }]);
    let imported = read(&json, &binary).unwrap();
    assert!(imported.cameras.is_empty());
    assert_eq!(imported.notes.len(), 201);
    assert_eq!(
        imported.notes[0],
        "nodes[1]: the camera is skipped because the node has zero scale"
    );
}

#[test]
fn non_finite_and_too_large_coordinates_are_reported() {
    for k in 0..9 {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.1e9] {
            let mut corners = CORNERS;
            corners[k] = x;
            let (json, binary) = triangle(corners, UVS);
            let message = read(&json, &binary).unwrap_err();
            let damage = "meshes[0].primitives[0].attributes.POSITION: 1 triangle has a vertex with a coordinate";
            assert!(
                message.starts_with("scene: has no triangles") && message.contains(damage),
                "{message}"
            );
        }
    }
    assert!(read(&triangle(CORNERS, UVS).0, &triangle(CORNERS, UVS).1).is_ok());
}

#[test]
fn tangents_are_finite_for_extreme_values() {
    for size in [1e-38, 1e-20, 1.0, 9e8] {
        for scale in [0.0, 1e-45, 1e-38, 1.0, 1e19, 3e38, -3e38, f32::NAN, f32::INFINITY] {
            let (mut json, binary) = triangle(CORNERS.map(|x| x * size), UVS.map(|x| x * scale));
            json["materials"] = json!([{ "normalTexture": { "index": 0 } }]);
            json["textures"] = json!([{ "source": 0 }]);
            json["images"] = json!([{ "bufferView": 0 }]);
            json["meshes"][0]["primitives"] =
                json!([{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "NORMAL": 2 }, "material": 0 }]);
            let Ok(imported) = read(&json, &binary) else { continue };
            let tangents = &imported.meshes[0].tangents;
            assert!(tangents.iter().all(|tangent| tangent.is_finite()), "{size} {scale}");
            assert!(imported.meshes[0].uvs.iter().all(|uv| uv.is_finite()));
        }
    }
}
