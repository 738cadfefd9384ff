//! Parses arbitrary text as a scene in JSON.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::Scene;
use wgray_fuzz::{render, small};

fuzz_target!(|bytes: &[u8]| {
    if let Ok(text) = std::str::from_utf8(bytes)
        && let Ok(scene) = Scene::parse_with(text, "a.json", &small())
    {
        render(&scene);
    }
});
