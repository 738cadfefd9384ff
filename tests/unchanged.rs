//! Image regression test: compares checksums of the linear images of all scenes and of `tests/unchanged` with
//! `tests/unchanged.txt`. After an intended change, `WGRAY_TEST_RECORD=1` updates the file. Other tests verify
//! that the images are correct.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use bytemuck::cast_slice;
use wgray::scene::{Description, GltfChoice, Integrator, Overrides, Scene};
use wgray_render::pack::pack;
use wgray_trace::film::Film;
use wgray_trace::records::{FirstHit, Packed};

use crate::pictures::{RenderMode, first_hits, reference};
use crate::random_scenes::any_scene;
use crate::render::{small_scenes, variations};
use crate::sources;

const CHECKSUMS: &str = "tests/unchanged.txt";
/// Scenes with features that the project's scenes lack. Scenes whose names start with `random` were generated, and use
/// files in [`any_scene::folder`].
const FOLDER: &str = "tests/unchanged";

/// Returns the bits of the normal, depth, texture coordinates, shape and material of a hit.
fn hit_words(hit: &FirstHit) -> [u32; 8] {
    let [x, y, z] = hit.normal.to_array().map(f32::to_bits);
    let [u, v] = hit.uv.to_array().map(f32::to_bits);
    [x, y, z, hit.depth.to_bits(), u, v, hit.shape, hit.material]
}

/// Loads the scenes of [`FOLDER`]. Path-traced scenes with an even index have layers.
fn special_scenes() -> Vec<(String, Packed)> {
    let entries = fs::read_dir(sources::path(FOLDER)).expect("the folder");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let packed = |(index, path): (usize, PathBuf)| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.extension().is_some_and(|extension| extension == "glb") {
            let overrides = Overrides {
                size: Some((24, 16)),
                pixel_samples: Some(4),
                gltf: GltfChoice {
                    time: name.starts_with("animated").then_some(0.4),
                    ..GltfChoice::default()
                },
                ..Overrides::default()
            };
            let scene = Scene::load_with(&path, &overrides).unwrap_or_else(|error| panic!("{error}"));
            return (name, pack(&scene));
        }
        let text = fs::read_to_string(&path).expect("a scene");
        let description = Description::parse(&text, &name).unwrap_or_else(|error| panic!("{error}"));
        let packed = any_scene::packed(&description);
        match index.is_multiple_of(2) && description.integrator() == Integrator::Path {
            true => (name, packed.with_layers()),
            false => (name, packed),
        }
    };
    paths.into_iter().enumerate().map(packed).collect()
}

/// Returns a line with the checksums of the film and the first hits on the CPU.
fn checksum_line(name: &str, packed: &Packed) -> String {
    let Film {
        sums, moments, layers, ..
    } = reference(packed);
    let layers = layers.concat();
    let film = crc32fast::hash(cast_slice(&[sums, moments, layers].concat()));
    let hits = crc32fast::hash(cast_slice(
        &first_hits(packed, RenderMode::Cpu)
            .iter()
            .map(hit_words)
            .collect::<Vec<_>>(),
    ));
    format!("{film:08x} {hits:08x} {name}\n")
}

#[test]
fn images_have_the_recorded_checksums() {
    let scenes = small_scenes().into_iter().chain(variations()).chain(special_scenes());
    let found: String = scenes.map(|(name, packed)| checksum_line(&name, &packed)).collect();
    let path = sources::path(CHECKSUMS);
    if std::env::var_os("WGRAY_TEST_RECORD").is_some_and(|value| value == "1") {
        fs::write(&path, &found).expect("the checksum file");
    }
    let recorded = fs::read_to_string(&path).expect("the checksum file");
    let film_checksums: BTreeSet<&str> = recorded.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(
        film_checksums.len(),
        recorded.lines().count(),
        "two scenes have the same film checksum"
    );
    let changed: Vec<&str> = found
        .lines()
        .filter(|line| !recorded.lines().any(|recorded_line| recorded_line == *line))
        .collect();
    assert!(
        changed.is_empty(),
        "images that differ from {CHECKSUMS} (film, first hits, scene): {changed:#?}"
    );
    assert_eq!(
        found.lines().count(),
        recorded.lines().count(),
        "{CHECKSUMS} lists scenes that no longer exist"
    );
}
