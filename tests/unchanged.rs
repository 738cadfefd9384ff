//! Pictures have the bits that they had: checksums of the linear pictures of all scenes, kept in `tests/unchanged.txt`. A
//! change that is to alter no picture is held to it; one that is to alter pictures says so by new lines there, which
//! `WGRAY_TEST_RECORD=1` writes. That the pictures are right is for other tests to show.

use std::collections::BTreeSet;
use std::fs;

use bytemuck::cast_slice;
use wgray::film::Film;
use wgray::pack::{FirstHit, Packed};

use crate::pictures::{Way, first_hits, reference};
use crate::render::{small_scenes, variations};
use crate::sources;

const KEPT: &str = "tests/unchanged.txt";

/// The normal, depth, texture coordinates, shape and material: what lines of the file are of.
fn old_words(hit: &FirstHit) -> [u32; 8] {
    let [x, y, z] = hit.normal.to_array().map(f32::to_bits);
    let [u, v] = hit.uv.to_array().map(f32::to_bits);
    [x, y, z, hit.depth.to_bits(), u, v, hit.shape, hit.material]
}

/// Checksums of the CPU's film of a scene, and of its first hits.
fn line(name: &str, packed: &Packed) -> String {
    let Film { sums, moments, .. } = reference(packed);
    let film = crc32fast::hash(cast_slice(&[sums, moments].concat()));
    let hits = crc32fast::hash(cast_slice(
        &first_hits(packed, Way::Cpu).iter().map(old_words).collect::<Vec<_>>(),
    ));
    format!("{film:08x} {hits:08x} {name}\n")
}

#[test]
fn pictures_have_the_bits_that_they_had() {
    let scenes = small_scenes().into_iter().chain(variations());
    let found: String = scenes.map(|(name, packed)| line(&name, &packed)).collect();
    let path = sources::path(KEPT);
    if std::env::var_os("WGRAY_TEST_RECORD").is_some_and(|value| value == "1") {
        fs::write(&path, &found).expect("the file of checksums");
    }
    let kept = fs::read_to_string(&path).expect("the file of checksums");
    let films: BTreeSet<&str> = kept.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(
        films.len(),
        kept.lines().count(),
        "a checksum that does not tell two scenes apart"
    );
    let changed: Vec<&str> = found.lines().filter(|line| !kept.lines().any(|k| k == *line)).collect();
    assert!(
        changed.is_empty(),
        "pictures that are not those of {KEPT} (film, first hits, scene): {changed:#?}"
    );
    assert_eq!(
        found.lines().count(),
        kept.lines().count(),
        "{KEPT} has scenes that are gone"
    );
}
