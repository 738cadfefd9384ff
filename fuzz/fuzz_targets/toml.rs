//! Parses arbitrary text as a scene file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::Scene;
use wgray_fuzz::small;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = Scene::parse(text, "a.toml");
        let _ = Scene::parse_with(text, "a.toml", &small());
    }
});
