//! Tests of documents: valid, unusual and malicious files.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::file_system::FileSystem;
use crate::gltf::document::Document;
use crate::gltf::made::{container, json_of, read};

fn error_of(json: &Value) -> String {
    match read(json.to_string().into_bytes()) {
        Ok(_) => "valid".to_owned(),
        Err(fault) => fault.of(Path::new("a")).to_string(),
    }
}

fn small() -> (Value, Vec<u8>) {
    let mut binary: Vec<u8> = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    binary.extend([0, 0, 1, 0, 2, 0, 1, 2]);
    binary.extend([0x89, b'P', b'N', b'G']);
    let views = json!([
        { "buffer": 0, "byteLength": 36 },
        { "buffer": 0, "byteOffset": 36, "byteLength": 8 },
        { "buffer": 0, "byteOffset": 44, "byteLength": 4 },
    ]);
    let accessors = json!([
        { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
        { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" },
        {
            "componentType": 5126, "count": 3, "type": "VEC3",
            "sparse": {
                "count": 2,
                "indices": { "bufferView": 1, "byteOffset": 6, "componentType": 5121 },
                "values": { "bufferView": 0 },
            },
        },
    ]);
    let mut json = json_of(&binary, views, accessors);
    json["images"] = json!([{ "bufferView": 2, "mimeType": "image/png" }, { "uri": "data:image/png;base64,iVBORw==" }]);
    json["textures"] = json!([{ "source": 0 }, { "extensions": { "EXT_texture_webp": { "source": 1 } } }]);
    json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 } } }]);
    json["meshes"] =
        json!([{ "primitives": [{ "attributes": { "POSITION": 0, "_ID": 0 }, "indices": 1, "material": 0 }] }]);
    json["nodes"] = json!([{ "mesh": 0, "translation": [1.0, 2, -0.5] }]);
    json["scenes"] = json!([{ "nodes": [0] }]);
    json["scene"] = json!(0);
    (json, binary)
}

/// Reads all data, with an index beyond the end of each list. Returns the number of values that were read. A
/// read that fails must return an error, not panic.
fn count_reads(document: &Document) -> usize {
    let mut count = 0;
    for i in 0..document.json.accessors.len() + 1 {
        count += usize::from(document.components(i).is_ok());
        count += document.vectors::<1>(i).map_or(0, |all| all.len());
        count += document.vectors::<3>(i).map_or(0, |all| all.len());
        count += document.indices(i).map_or(0, |all| all.len());
    }
    for i in 0..document.json.buffer_views.len() + 1 {
        count += document.view(i).map_or(0, |bytes| bytes.len());
    }
    for i in 0..document.json.textures.len() + 1 {
        count += usize::from(document.image_of(i).is_ok());
    }
    for i in 0..document.json.images.len() + 1 {
        count += document
            .image_bytes(i)
            .map_or(0, |read| read.map_or(0, |bytes| bytes.len()));
    }
    count
}

#[test]
fn glb_files_are_self_contained() {
    let (json, binary) = small();
    let document = read(container(&json, &binary)).unwrap();
    assert_eq!(document.vectors::<3>(0).unwrap()[1], [1.0, 0.0, 0.0]);
    assert_eq!(document.indices(1).unwrap(), [0, 1, 2]);
    assert_eq!(document.vectors::<3>(2).unwrap()[2], [1.0, 0.0, 0.0]);
    for image in [0, 1] {
        assert_eq!(*document.image_bytes(image).unwrap().unwrap(), *b"\x89PNG");
    }
    assert_eq!([0, 1].map(|texture| document.image_of(texture).unwrap()), [0, 1]);
    assert_eq!(document.notes, [""; 0]);
    assert_eq!(document.json.nodes[0].translation, Some([1.0, 2.0, -0.5]));
}

#[test]
fn other_files_are_read_and_listed() {
    let temp_folder = tempfile::tempdir().unwrap();
    let folder = temp_folder.path().join("model");
    fs::create_dir(&folder).unwrap();
    let (mut json, binary) = small();
    fs::write(folder.join("the data.bin"), &binary).unwrap();
    fs::write(folder.join("a.png"), b"image").unwrap();
    fs::write(temp_folder.path().join("out.png"), b"secret").unwrap();
    json["buffers"][0]["uri"] = json!("the%20data.bin");
    json["images"] = json!([
        { "uri": "a.png" }, { "uri": "none.png" }, { "uri": "../out.png" }, { "name": "nothing" },
        { "extensions": { "X_image": {} } },
    ]);
    let path = folder.join("small.txt"); // glTF is detected by content, not by name
    fs::write(&path, json.to_string()).unwrap();
    let mut files = BTreeSet::new();
    let document = Document::open(&path, &folder, &FileSystem::Disk, &mut files).unwrap();
    assert_eq!(document.indices(1).unwrap(), [0, 1, 2]);
    assert_eq!(*document.image_bytes(0).unwrap().unwrap(), *b"image");
    let error_of = |image: usize| {
        let text = document.image_bytes(image).unwrap_err().to_string();
        text.strip_prefix(&format!("{}: ", path.display())).unwrap().to_owned()
    };
    let missing = document.image_bytes(1).unwrap().unwrap_err();
    assert!(
        missing.starts_with("images[1].uri: \"none.png\" cannot be read"),
        "{missing}"
    );
    assert!(
        error_of(2).starts_with("images[2].uri: \"../out.png\" must not leave the folder"),
        "{}",
        error_of(2)
    );
    assert_eq!(error_of(3), "images[3]: has neither a uri nor a bufferView");
    assert_eq!(
        error_of(4),
        "images[4]: \"X_image\" is not supported, but contains the only data; export the file without this extension"
    );
    assert_eq!(error_of(5), "images: 5 is out of range; number of images: 5");
    let names: Vec<_> = files.iter().filter_map(|path| path.file_name()?.to_str()).collect();
    assert_eq!(names.len(), 3);
    for name in ["the data.bin", "a.png", "small.txt"] {
        assert!(names.contains(&name), "{names:?}");
    }
    // A wider asset root admits more files.
    let document = Document::open(&path, temp_folder.path(), &FileSystem::Disk, &mut BTreeSet::new()).unwrap();
    assert_eq!(*document.image_bytes(2).unwrap().unwrap(), *b"secret");
    // Too short, missing, and unreferenced buffers.
    fs::write(folder.join("the data.bin"), &binary[..47]).unwrap();
    let open_error = |json: &Value| {
        fs::write(&path, json.to_string()).unwrap();
        Document::open(&path, &folder, &FileSystem::Disk, &mut BTreeSet::new())
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    assert!(
        open_error(&json).ends_with("buffers[0].byteLength: 48 must be at most 47, the size of the data"),
        "{}",
        open_error(&json)
    );
    fs::remove_file(folder.join("the data.bin")).unwrap();
    assert!(open_error(&json).contains("buffers[0].uri: \"the%20data.bin\" cannot be read"));
    json["bufferViews"] = json!([]);
    json["accessors"] = json!([]);
    json["meshes"] = json!([]);
    json["nodes"] = json!([{}]);
    fs::write(&path, json.to_string()).unwrap();
    assert!(Document::open(&path, &folder, &FileSystem::Disk, &mut BTreeSet::new()).is_ok());
    assert!(matches!(
        Document::open(&folder, &folder, &FileSystem::Disk, &mut BTreeSet::new())
            .map(|_| ())
            .unwrap_err(),
        crate::gltf::error::GltfError::Read { .. }
    ));
}

#[test]
fn buffers_may_be_data_uris() {
    let (mut json, _) = small();
    json["buffers"] = json!([{ "byteLength": 3, "uri": "data:application/octet-stream;base64,AAEC" }]);
    json["bufferViews"] =
        json!([{ "buffer": 0, "byteLength": 3 }, { "buffer": 0, "byteLength": 3 }, { "buffer": 0, "byteLength": 3 }]);
    let document = read(json.to_string().into_bytes()).unwrap();
    assert_eq!(document.view(0).unwrap(), [0, 1, 2]);
    assert_eq!(document.json.buffers[0].uri, None);
    json["buffers"][0]["byteLength"] = json!(4);
    assert_eq!(
        error_of(&json),
        "a: buffers[0].byteLength: 4 must be at most 3, the size of the data"
    );
    json["buffers"][0]["uri"] = json!("data:;base64,A");
    assert!(error_of(&json).starts_with("a: buffers[0].uri: the data URI must be base64"));
    json["buffers"] = json!([{ "byteLength": 3 }]);
    assert_eq!(
        error_of(&json),
        "a: buffers[0]: has no uri, but buffer views refer to it"
    );
    json["buffers"] = json!([{ "byteLength": 4 }, { "byteLength": 4 }]);
    assert!(read(container(&json, b"1234")).is_ok());
    json["bufferViews"][1]["buffer"] = json!(1);
    let fault = read(container(&json, b"1234")).map(|_| ()).unwrap_err();
    assert_eq!(fault.message, "has no uri, but buffer views refer to it");
}

#[test]
fn files_that_are_not_gltf_are_rejected() {
    let outcome = |text: &str| match read(text.as_bytes().to_vec()) {
        Ok(_) => "valid".to_owned(),
        Err(fault) => fault.of(Path::new("a")).to_string(),
    };
    assert_eq!(outcome("\u{feff}{\"asset\":{\"version\":\"2.0\"}}  \n\0\0"), "valid");
    assert_eq!(outcome(""), "a: the file is empty");
    assert_eq!(outcome("{\n  x"), "a:2:3: key must be a string");
    assert_eq!(outcome("[]"), "a:1:1: the JSON must be an object");
    assert_eq!(outcome("{}"), "a: asset: must be an object with the version");
    assert_eq!(outcome("{\"asset\":{}}"), "a: asset.version: is required");
    for (version, rule) in [
        (
            "\"1.0\"",
            "a: asset.version: \"1.0\" is not supported; convert the file to glTF 2.0",
        ),
        (
            "\"2\"",
            "a: asset.version: \"2\" is not supported; convert the file to glTF 2.0",
        ),
        (
            "2.0",
            "a: asset.version: 2.0 is not supported; convert the file to glTF 2.0",
        ),
        ("\"2.1\"", "valid"),
        ("\"2.0\",\"minVersion\":\"2.0\"", "valid"),
        (
            "\"2.1\",\"minVersion\":\"2.1\"",
            "a: asset.minVersion: \"2.1\" must be at most \"2.0\", the supported version",
        ),
    ] {
        assert_eq!(outcome(&format!("{{\"asset\":{{\"version\":{version}}}}}")), rule);
    }
    let message_of = |bytes: &[u8]| read(bytes.to_vec()).map(|_| ()).unwrap_err().message;
    assert_eq!(
        message_of(b"{\"asset\":{\"version\":\"2.0\xff\"}}"),
        "invalid unicode code point"
    );
    // Deep and wide JSON.
    let deep = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{}1{}}}",
        "[".repeat(1 << 20),
        "]".repeat(1 << 20)
    );
    assert!(
        outcome(&deep).ends_with("at most 127 levels deep"),
        "{}",
        outcome(&deep)
    );
    let deep = format!("{{\"a\":{}", "[{\"a\":".repeat(1 << 16));
    assert!(
        outcome(&deep).ends_with("at most 127 levels deep"),
        "{}",
        outcome(&deep)
    );
    let wide = format!("{{\"nodes\":[{}{{}}]}}", "{},".repeat(3 << 20));
    assert_eq!(
        outcome(&wide),
        "a: the JSON has 3145730 objects; it must have at most 2097152"
    );
    let wide = format!("{{\"a\":[{}0]}}", "0,".repeat(33 << 20));
    assert_eq!(
        outcome(&wide),
        "a: the JSON has 34603009 values; it must have at most 33554432"
    );
}

#[test]
fn indices_and_enumerations_are_validated() {
    let (valid, binary) = small();
    let read_with = |key: &str, value: Value| {
        let mut json = valid.clone();
        *json.pointer_mut(key).unwrap_or_else(|| panic!("{key}")) = value;
        match read(container(&json, &binary)) {
            Ok(document) => format!("valid {}", count_reads(&document) > 0),
            Err(fault) => fault.of(Path::new("a")).to_string(),
        }
    };
    assert_eq!(read_with("/scene", json!(0)), "valid true");
    for (key, location) in [
        ("/accessors/0/bufferView", "accessors[0].bufferView"),
        (
            "/accessors/2/sparse/indices/bufferView",
            "accessors[2].sparse.indices.bufferView",
        ),
        (
            "/accessors/2/sparse/values/bufferView",
            "accessors[2].sparse.values.bufferView",
        ),
        ("/bufferViews/1/buffer", "bufferViews[1].buffer"),
        ("/images/0/bufferView", "images[0].bufferView"),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            "meshes[0].primitives[0].attributes",
        ),
        (
            "/meshes/0/primitives/0/attributes/_ID",
            "meshes[0].primitives[0].attributes",
        ),
        ("/meshes/0/primitives/0/indices", "meshes[0].primitives[0].indices"),
        ("/meshes/0/primitives/0/material", "meshes[0].primitives[0].material"),
        (
            "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
            "materials[0].pbrMetallicRoughness.baseColorTexture.index",
        ),
        ("/nodes/0/mesh", "nodes[0].mesh"),
        ("/scenes/0/nodes/0", "scenes[0].nodes[0]"),
        ("/scene", "scene"),
        ("/textures/0/source", "textures[0].source"),
    ] {
        let error = read_with(key, json!(99));
        assert!(error.starts_with(&format!("a: {location}")), "{key}: {error}");
        // 64-bit values must not be truncated, and other types must be errors.
        for value in [
            json!(1u64 << 32),
            json!(-1),
            json!(0.5),
            json!("0"),
            json!({}),
            json!([]),
        ] {
            let error = read_with(key, value.clone());
            assert!(error.starts_with("a: "), "{key}: {value}: {error}");
        }
        // Some exporters write integers as floats.
        if key != "/textures/0/source" {
            let as_float = valid.pointer(key).unwrap().as_f64().unwrap();
            assert_eq!(read_with(key, json!(as_float)), "valid true", "{key}");
        }
    }
    for (key, location) in [
        ("/accessors/0/componentType", "accessors[0].componentType"),
        ("/accessors/0/type", "accessors[0].type"),
    ] {
        for value in [json!(5124), json!("VEC5"), json!(5126u64 + (1 << 32))] {
            let error = read_with(key, value.clone());
            assert!(error.starts_with(&format!("a: {location}")), "{key}: {value}: {error}");
        }
    }
    assert!(read_with("/nodes/0/translation/0", json!(1e39)).starts_with("a: nodes[0].translation[0]: 1e39 exceeds"));
    assert_eq!(read_with("/accessors/0/min", json!("none")), "valid true");
    assert_eq!(read_with("/meshes/0/primitives/0/attributes", json!({})), "valid true");
}

#[test]
fn common_exporter_errors_are_repaired() {
    let read_with = |key: &str, value: Value| {
        let mut json = json!({ "asset": { "version": "2.0" }, "nodes": [{}] });
        json[key] = value;
        read(json.to_string().into_bytes()).map_err(|fault| fault.of(Path::new("a")).to_string())
    };
    assert_eq!(
        read_with("scenes", json!([{ "name": "empty" }]))
            .unwrap()
            .json
            .scenes
            .len(),
        1
    );
    let channel = |node: Value, path: &str| json!({ "sampler": 0, "target": { "node": node, "path": path } });
    let animation = |channels: Value| json!([{ "channels": channels, "samplers": [{ "input": 0, "output": 0 }] }]);
    let mut json = json!({
        "asset": { "version": "2.0" }, "nodes": [{}],
        "accessors": [{ "componentType": 5126, "count": 1, "type": "SCALAR" }],
    });
    json["animations"] = animation(json!([
        channel(json!(0), "translation"),
        channel(Value::Null, "translation"),
        channel(json!(0), "pointer"),
    ]));
    let document = read(json.to_string().into_bytes()).unwrap();
    assert_eq!(document.json.animations[0].channels.len(), 1);
    assert_eq!(
        document.notes,
        ["animations: 2 channels with targets other than nodes are ignored"]
    );
    json["animations"] = animation(json!([channel(json!(1), "translation")]));
    assert!(error_of(&json).starts_with("a: animations[0].channels[0].target.node: 1 is out of range"));
    let read_camera = |camera: Value| read_with("cameras", json!([camera])).map(|_| ());
    assert!(read_camera(json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } })).is_ok());
    assert_eq!(
        read_camera(json!({ "type": "orthographic", "perspective": { "yfov": 1, "znear": 0.1 } })).unwrap_err(),
        "a: cameras[0].orthographic: is required by the type of the camera"
    );
    assert!(read_camera(json!({ "type": "fisheye", "perspective": { "yfov": 1, "znear": 0.1 } })).is_err());
    assert!(read_with("extras", json!({ "a": [1e300] })).is_ok());
}

#[test]
fn unsupported_extensions_are_rejected_or_reported_by_name() {
    let read_with = |required: &[&str], used: &[&str]| {
        let json = json!({ "asset": { "version": "2.0" }, "extensionsRequired": required, "extensionsUsed": used });
        read(json.to_string().into_bytes())
            .map(|document| document.notes)
            .map_err(|fault| fault.of(Path::new("a")).to_string())
    };
    let supported = [
        "KHR_materials_sheen",
        "KHR_mesh_quantization",
        "EXT_texture_webp",
        "KHR_texture_basisu",
    ];
    assert_eq!(read_with(&supported, &supported).unwrap(), [""; 0]);
    for (name, command) in [
        ("KHR_draco_mesh_compression", "gltf-transform copy"),
        ("EXT_texture_avif", "export the file without this extension"),
    ] {
        let message = read_with(&["KHR_mesh_quantization", name], &[]).unwrap_err();
        let start = format!("a: extensionsRequired[1]: \"{name}\" is required but not supported; ");
        assert!(message.starts_with(&start) && message.contains(command), "{message}");
    }
    assert_eq!(
        read_with(&[], &["X_a", "KHR_materials_sheen", "X_a"]).unwrap(),
        ["the extension \"X_a\" is not supported and is ignored"]
    );
    let names: Vec<String> = (0..1000).map(|i| format!("X_{i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    assert_eq!(read_with(&[], &names).unwrap().len(), 21);
    // A mesh whose data is only present in an extension.
    let (mut json, binary) = small();
    let draco = json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    json["meshes"][0]["primitives"][0]["extensions"] = draco;
    assert!(read(container(&json, &binary)).is_ok()); // the accessors have buffer views
    json["accessors"][1].as_object_mut().unwrap().remove("bufferView");
    let fault = read(container(&json, &binary)).map(|_| ()).unwrap_err();
    assert_eq!(
        fault.of(Path::new("a")).to_string(),
        "a: meshes[0].primitives[0]: \"KHR_draco_mesh_compression\" is not supported, but contains the only data; \
         export without Draco compression, or run gltf-transform copy IN.glb OUT.glb"
    );
}

#[test]
fn textures_without_an_image_are_rejected() {
    let (mut json, binary) = small();
    json["textures"] = json!([
        {},
        { "extensions": { "EXT_texture_avif": { "source": 0 } } },
        { "source": 1, "extensions": { "EXT_texture_avif": { "source": 0 } } },
        { "source": 0, "extensions": { "EXT_texture_webp": { "source": 2 } } },
        { "source": 0, "extensions": { "EXT_texture_webp": { "source": -1 } } },
        { "source": 0, "extensions": { "EXT_texture_webp": {} } },
        { "source": 0, "extensions": { "EXT_texture_webp": { "source": 0 }, "KHR_texture_basisu": { "source": 1 } } },
        { "source": 0, "extensions": { "KHR_texture_basisu": { "source": 2 } } },
    ]);
    let document = read(container(&json, &binary)).unwrap();
    let error_of = |texture: usize| match document.image_of(texture) {
        Ok(image) => image.to_string(),
        Err(error) => error.to_string().replace("/none/a.gltf: ", ""),
    };
    assert_eq!(error_of(0), "textures[0]: has no source");
    assert_eq!(
        error_of(1),
        "textures[1]: \"EXT_texture_avif\" is not supported, but contains the only data; export the file without this extension"
    );
    assert_eq!(error_of(2), "1");
    for (texture, extension) in [
        (3, "EXT_texture_webp"),
        (4, "EXT_texture_webp"),
        (7, "KHR_texture_basisu"),
    ] {
        let key = format!("textures[{texture}].extensions.{extension}.source");
        assert_eq!(
            error_of(texture),
            format!("{key}: must be the index of an image; number of images: 2")
        );
    }
    assert_eq!(error_of(5), "0");
    let image = if cfg!(feature = "formats") { "1" } else { "0" };
    assert_eq!(error_of(6), image);
    assert_eq!(error_of(8), "textures: 8 is out of range; number of textures: 8");
}

#[test]
fn truncated_files_do_not_panic() {
    let (json, binary) = small();
    let bytes = container(&json, &binary);
    assert!(count_reads(&read(bytes.clone()).unwrap()) > 20);
    for length in 0..bytes.len() {
        assert!(read(bytes[..length].to_vec()).is_err(), "{length}");
    }
    let text = json.to_string().into_bytes();
    for length in 0..text.len() {
        assert!(read(text[..length].to_vec()).is_err(), "{length}");
    }
}

#[test]
fn changed_bytes_do_not_panic() {
    let (json, binary) = small();
    let bytes = container(&json, &binary);
    let (mut accepted, mut rejected) = (0, 0);
    for position in 0..bytes.len() {
        for byte in [
            0,
            b'0',
            b'9',
            b'-',
            b'"',
            b'}',
            b',',
            0x7f,
            0xff,
            bytes[position] ^ 1,
            bytes[position] ^ 0x80,
        ] {
            let mut bytes = bytes.clone();
            bytes[position] = byte;
            match read(bytes) {
                Ok(document) => {
                    count_reads(&document);
                    accepted += 1;
                }
                Err(_) => rejected += 1,
            }
        }
    }
    // Both outcomes must be frequent.
    assert!(
        accepted > 1000 && rejected > 1000,
        "accepted: {accepted}, rejected: {rejected}"
    );
}

#[test]
fn a_million_accessors_are_read() {
    let accessors =
        "{\"bufferView\":0,\"componentType\":5126,\"count\":4294967295,\"type\":\"VEC3\"},".repeat(1_000_000);
    let text = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"buffers\":[{{\"byteLength\":1,\"uri\":\"data:,a\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":1}}],\"accessors\":[{}]}}",
        accessors.trim_end_matches(',')
    );
    let document = read(text.into_bytes()).unwrap();
    assert_eq!(document.json.accessors.len(), 1_000_000);
    assert!(document.vectors::<3>(999_999).is_err());
}
