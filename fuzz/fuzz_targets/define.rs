//! Applies arbitrary `--define KEY=VALUE` texts to a scene.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::Scene;
use wgray::scene::Define;
use wgray_fuzz::small;

const SCENE: &str = include_str!("../../scenes/materials.toml");

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let define = text.lines().take(4).map(|line| line.parse::<Define>());
    let Ok(define) = define.collect::<Result<Vec<Define>, _>>() else {
        return;
    };
    let mut overrides = small();
    overrides.define = define;
    let _ = Scene::parse_with(SCENE, "a.toml", &overrides);
});
