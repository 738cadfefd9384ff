//! Loads and renders a glTF file with all features after random changes to its JSON values and to words of its buffer.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::Scene;
use wgray_fuzz::{Choices, changed, container, everything, file, render, small_model};

fuzz_target!(|bytes: &[u8]| {
    let mut choices = Choices(bytes);
    let (mut json, mut binary) = everything();
    let animated = choices.below(2) == 1;
    for _ in 0..choices.below(4) {
        changed(&mut json, &mut |count| choices.below(count));
    }
    let words = binary.len() / 4;
    while choices.are_left() {
        let offset = choices.below(words) * 4;
        let special = [f32::NAN, f32::INFINITY, -3e38, 1e-40, 1e9, 0.0].map(f32::to_bits);
        let word = match choices.below(8) {
            i @ 0..6 => special[i],
            _ => choices.word(),
        };
        binary[offset..offset + 4].copy_from_slice(&word.to_le_bytes());
    }
    let mut overrides = small_model();
    if animated {
        overrides.gltf.time = Some(0.7);
        overrides.gltf.variant = Some(wgray::scene::Selection::Number(1));
    }
    if let Ok(scene) = Scene::load_with(file("a.glb", &container(&json, &binary)), &overrides) {
        render(&scene);
    }
});
