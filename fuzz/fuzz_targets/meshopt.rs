//! Decodes compressed glTF buffer views: streams of a reference encoder with some bytes changed, or arbitrary bytes.
#![no_main]

use std::sync::OnceLock;

use base64::Engine as _;
use libfuzzer_sys::fuzz_target;
use serde_json::json;
use wgray::Scene;
use wgray_fuzz::{Choices, container, file, small_model};

const STREAMS: &str = include_str!("../../crates/scene/src/gltf/meshopt/streams.txt");

/// Mode, filter, stride, count and bytes.
fn streams() -> &'static [(&'static str, &'static str, u64, u64, Vec<u8>)] {
    static ALL: OnceLock<Vec<(&str, &str, u64, u64, Vec<u8>)>> = OnceLock::new();
    ALL.get_or_init(|| {
        let stream = |line: &'static str| {
            let [_, mode, filter, stride, count, bytes, _] = line.split(' ').collect::<Vec<_>>()[..] else {
                panic!("{line}");
            };
            let bytes = base64::engine::general_purpose::STANDARD.decode(bytes).expect("base64");
            let [stride, count] = [stride, count].map(|number| number.parse().expect("a number"));
            (mode, filter, stride, count, bytes)
        };
        STREAMS.lines().map(stream).collect()
    })
}

fuzz_target!(|bytes: &[u8]| {
    let mut choices = Choices(bytes);
    let all = streams();
    let (mode, filter, mut stride, mut count, mut stream) = all[choices.below(all.len())].clone();
    match choices.below(4) {
        0 => stream = choices.0.to_vec(),
        1 => stride = 1 + choices.below(256) as u64,
        2 => count = choices.below(1 << 16) as u64,
        _ => {}
    }
    let last = stream.len().saturating_sub(1);
    while choices.are_left() && !stream.is_empty() {
        let at = choices.below(last + 1);
        stream[at] = choices.byte();
    }
    // The view contains the positions or the indices of triangles.
    let kind = if mode == "ATTRIBUTES" { "VEC3" } else { "SCALAR" };
    let component = if mode == "ATTRIBUTES" { 5126 } else { 5125 };
    let attributes = if mode == "ATTRIBUTES" {
        json!({ "POSITION": 0 })
    } else {
        json!({ "POSITION": 1 })
    };
    let json = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["EXT_meshopt_compression"],
        "buffers": [{ "byteLength": stream.len() }],
        "bufferViews": [{
            "buffer": 0, "byteLength": stride * count,
            "extensions": { "EXT_meshopt_compression": {
                "buffer": 0, "byteLength": stream.len(), "byteStride": stride, "count": count, "mode": mode, "filter": filter,
            } },
        }],
        "accessors": [
            { "bufferView": 0, "componentType": component, "type": kind, "count": (stride * count / 12).clamp(1, 999) },
            { "componentType": 5126, "type": "VEC3", "count": 999 },
        ],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": 0 }, { "attributes": attributes }] }],
    });
    let _ = Scene::load_with(file("a.glb", &container(&json, &stream)), &small_model());
});
