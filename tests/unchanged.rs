//! Image regression test: checksums of the linear images of all scenes and of `tests/unchanged` against
//! `tests/unchanged.txt`. After an intended change, `WGRAY_TEST_RECORD=1` updates it. Other tests verify correctness.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use bytemuck::cast_slice;
use wgray::scene::{Description, GltfChoice, Integrator, Overrides, Scene};
use wgray_render::film::Film;
use wgray_render::pack::pack;
use wgray_render::records::{FirstHit, Packed};

use crate::pictures::{RenderMode, first_hits, reference};
use crate::random_scenes::any_scene;
use crate::render::{small_scenes, variations};
use crate::sources;

const KEPT: &str = "tests/unchanged.txt";
/// Features that the project's scenes lack. Those named `random` were generated and use [`any_scene::folder`].
const FOLDER: &str = "tests/unchanged";

/// Returns normal, depth, texture coordinates, shape and material.
fn old_words(hit: &FirstHit) -> [u32; 8] {
    let [x, y, z] = hit.normal.to_array().map(f32::to_bits);
    let [u, v] = hit.uv.to_array().map(f32::to_bits);
    [x, y, z, hit.depth.to_bits(), u, v, hit.shape, hit.material]
}

/// Loads [`FOLDER`]. Every other path-traced scene has layers.
fn special_scenes() -> Vec<(String, Packed)> {
    let entries = fs::read_dir(sources::path(FOLDER)).expect("the folder");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let packed = |(i, path): (usize, PathBuf)| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.extension().is_some_and(|ending| ending == "glb") {
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
        match i.is_multiple_of(2) && description.integrator() == Integrator::Path {
            true => (name, packed.with_layers()),
            false => (name, packed),
        }
    };
    paths.into_iter().enumerate().map(packed).collect()
}

/// Returns the checksums of the CPU's film and first hits.
fn line(name: &str, packed: &Packed) -> String {
    let Film {
        sums, moments, layers, ..
    } = reference(packed);
    let layers = layers.concat();
    let film = crc32fast::hash(cast_slice(&[sums, moments, layers].concat()));
    let hits = crc32fast::hash(cast_slice(
        &first_hits(packed, RenderMode::Cpu)
            .iter()
            .map(old_words)
            .collect::<Vec<_>>(),
    ));
    format!("{film:08x} {hits:08x} {name}\n")
}

#[test]
fn images_have_the_recorded_checksums() {
    let scenes = small_scenes().into_iter().chain(variations()).chain(special_scenes());
    let found: String = scenes.map(|(name, packed)| line(&name, &packed)).collect();
    let path = sources::path(KEPT);
    if std::env::var_os("WGRAY_TEST_RECORD").is_some_and(|value| value == "1") {
        fs::write(&path, &found).expect("the file of checksums");
    }
    let kept = fs::read_to_string(&path).expect("the file of checksums");
    let films: BTreeSet<&str> = kept.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(films.len(), kept.lines().count(), "two scenes have one checksum");
    let changed: Vec<&str> = found.lines().filter(|line| !kept.lines().any(|k| k == *line)).collect();
    assert!(
        changed.is_empty(),
        "images that differ from {KEPT} (film, first hits, scene): {changed:#?}"
    );
    assert_eq!(
        found.lines().count(),
        kept.lines().count(),
        "{KEPT} has scenes that no longer exist"
    );
}
