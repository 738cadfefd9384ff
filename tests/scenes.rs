//! The project's scenes: all files of `scenes/`.

use std::fs;

use wgray::scene::{Assets, Description};
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use crate::sources;

/// Returns all descriptions by file name.
pub fn descriptions() -> Vec<(String, Description)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(sources::path("scenes")).expect("the scenes") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "toml") {
            let name = path.file_name().expect("a file").to_string_lossy().into_owned();
            let text = fs::read_to_string(&path).expect("a scene");
            found.push((name.clone(), Description::parse(&text, &name).expect("a valid scene")));
        }
    }
    assert!(found.len() >= 4, "the scenes were not found");
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

pub fn scene(name: &str) -> Description {
    descriptions()
        .into_iter()
        .find(|(file, _)| file == name)
        .unwrap_or_else(|| panic!("no scene is named {name}"))
        .1
}

pub fn parse(text: &str) -> Packed {
    packed(&Description::parse(text, "test").unwrap_or_else(|error| panic!("{error}")))
}

/// Validates and packs a scene.
pub fn packed(description: &Description) -> Packed {
    let assets = Assets::beside(&sources::path("scenes"));
    pack(
        &description
            .validate_with(&assets)
            .unwrap_or_else(|problem| panic!("{problem}")),
    )
}

/// Returns all scenes at full size.
pub fn all() -> Vec<(String, Packed)> {
    descriptions()
        .iter()
        .map(|(name, description)| (name.clone(), packed(description)))
        .collect()
}
