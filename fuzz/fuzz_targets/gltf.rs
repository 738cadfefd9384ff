//! Reads arbitrary bytes as a glTF file, .gltf or .glb.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::Scene;
use wgray_fuzz::{file, render, small_model};

fuzz_target!(|bytes: &[u8]| {
    if let Ok(scene) = Scene::load_with(file("a.gltf", bytes), &small_model()) {
        render(&scene);
    }
});
