//! Parses, writes, re-parses, validates and renders scene files after random changes to their values.
#![no_main]

use libfuzzer_sys::fuzz_target;
use serde_json::Value;
use wgray::Description;
use wgray::scene::Assets;
use wgray::{Overrides, Scene};
use wgray_fuzz::{Choices, changed, render, small};

const SCENES: [&str; 12] = [
    include_str!("../../scenes/balls-checker.toml"),
    include_str!("../../scenes/cornell-path.toml"),
    include_str!("../../scenes/cornell.toml"),
    include_str!("../../scenes/ellipsoids.toml"),
    include_str!("../../scenes/ground-grid.toml"),
    include_str!("../../scenes/lens.toml"),
    include_str!("../../scenes/lights.toml"),
    include_str!("../../scenes/materials.toml"),
    include_str!("../../scenes/mirror-glass.toml"),
    include_str!("../../scenes/orthographic.toml"),
    include_str!("../../scenes/panorama.toml"),
    include_str!("../../scenes/turntable.toml"),
];

fuzz_target!(|bytes: &[u8]| {
    let mut choices = Choices(bytes);
    let text = SCENES[choices.below(SCENES.len())];
    let mut file: Value = toml::from_str(text).expect("a scene");
    while choices.are_left() {
        changed(&mut file, &mut |count| choices.below(count));
    }
    // TOML cannot represent all values.
    let Ok(text) = toml::to_string(&file) else { return };
    let Ok(description) = Description::parse(&text, "a.toml") else {
        return;
    };
    let written = description.to_toml().expect("a description converts to TOML");
    let read_back = Description::parse(&written, "a.toml").expect("written TOML is valid");
    assert_eq!(read_back.to_toml().ok(), Some(written));
    let _ = description.validate_with(&Assets::default());
    let overrides = Overrides {
        pixel_pattern: Some(wgray::scene::Pattern::Random),
        frame: (choices.byte() % 2 == 1).then_some(2.5),
        ..small()
    };
    if let Ok(scene) = Scene::parse_with(&text, "a.toml", &overrides) {
        render(&scene);
    }
});
