//! The project's scenes, small: every file of `scenes/`, whatever it is called.

use std::fs;

use wgray::scene::{Assets, Description};
use wgray_render::pack::pack;
use wgray_render::records::Packed;

use crate::sources;

/// What every file of `scenes/` says, by its name.
pub fn descriptions() -> Vec<(String, Description)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(sources::path("scenes")).expect("the scenes") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "toml") {
            let name = path.file_name().expect("a file").to_string_lossy().into_owned();
            let text = fs::read_to_string(&path).expect("a scene");
            found.push((name.clone(), Description::parse(&text, &name).expect("a sound scene")));
        }
    }
    assert!(found.len() >= 4, "the scenes were not found");
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

/// One scene of the project.
pub fn scene(name: &str) -> Description {
    descriptions()
        .into_iter()
        .find(|(file, _)| file == name)
        .unwrap_or_else(|| panic!("no scene is called {name}"))
        .1
}

/// A scene from its text.
pub fn parse(text: &str) -> Packed {
    packed(&Description::parse(text, "test").unwrap_or_else(|error| panic!("{error}")))
}

/// A description as the backends read it.
pub fn packed(description: &Description) -> Packed {
    let beside = Assets::beside(&sources::path("scenes"));
    pack(
        &description
            .validate_with(&beside)
            .unwrap_or_else(|problem| panic!("{problem}")),
    )
}

/// The scenes as they are.
pub fn all() -> Vec<(String, Packed)> {
    descriptions()
        .iter()
        .map(|(name, description)| (name.clone(), packed(description)))
        .collect()
}
