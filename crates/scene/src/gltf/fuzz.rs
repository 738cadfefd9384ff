//! Random mutation of glTF files: an import must return an error or satisfy the invariants of `check`.

use std::collections::BTreeSet;

use super::changed::changed;
use super::everything::everything;
use super::{ImportOptions, Imported, import};
use crate::Selection;
use crate::file_system::FileSystem;
use crate::gltf::made::container;

/// The upper half of a 64-bit xorshift generator (Marsaglia, "Xorshift RNGs", 2003).
struct Random(u64);

impl Random {
    fn word(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u32
    }

    fn below(&mut self, count: usize) -> usize {
        self.word() as usize % count
    }
}

fn check(imported: &Imported) {
    let is_zero_scale_note = |note: &String| note.ends_with("their scale is zero");
    assert!(!imported.instances.is_empty() || imported.notes.iter().any(is_zero_scale_note));
    for mesh in &imported.meshes {
        let count = mesh.positions.len();
        assert!(mesh.center.is_finite() && mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.triangles.iter().flatten().all(|vertex| (*vertex as usize) < count));
        let fits = |length: usize| length == 0 || length == count;
        assert!(
            fits(mesh.normals.len()) && fits(mesh.uvs.len()) && fits(mesh.colors.len()) && fits(mesh.tangents.len())
        );
        assert!(mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-3));
        let mut sets = std::iter::once(&mesh.uvs).chain(&mesh.more_uvs);
        assert!(sets.all(|uvs| fits(uvs.len()) && uvs.iter().all(|uv| uv.is_finite())));
        let is_in_range = |x: &f32| (0.0..=1.0).contains(x);
        assert!(mesh.colors.iter().all(|color| color.to_array().iter().all(is_in_range)));
        assert!(
            mesh.tangents
                .iter()
                .all(|tangent| tangent.is_finite() && tangent.length() < 1.5)
        );
    }
    for instance in &imported.instances {
        assert!(instance.to_world.is_finite() && instance.mesh < imported.meshes.len());
        assert!(
            instance
                .materials
                .iter()
                .all(|material| *material < imported.materials.len())
        );
    }
}

/// Imports the file with several options; returns the number of successful imports.
fn read(bytes: &[u8], path: &std::path::Path) -> usize {
    std::fs::write(path, bytes).unwrap();
    let root = path.parent().unwrap();
    let defaults = ImportOptions {
        scene: None,
        time: None,
        animation: None,
        variant: None,
    };
    let all_options = ImportOptions {
        time: Some(0.7),
        animation: Some(Selection::Number(0)),
        variant: Some(Selection::Number(1)),
        scene: None,
    };
    let option_sets = [defaults, all_options];
    let imported = option_sets
        .iter()
        .filter_map(|options| import(path, root, &FileSystem::Disk, options, &mut BTreeSet::new()).ok());
    imported.inspect(check).count()
}

#[test]
fn mutated_files_are_imported_or_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let (json, binary) = everything();
    assert_eq!(read(&container(&json, &binary), &path), 2);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut accepted, mut rejected, mut scenes) = (0, 0, 0);
    let rounds = std::env::var("WGRAY_TEST_ROUNDS")
        .ok()
        .and_then(|rounds| rounds.parse().ok())
        .unwrap_or(1500);
    for round in 0..rounds {
        let (mut json, mut binary) = (json.clone(), binary.clone());
        for _ in 0..random.below(3) {
            changed(&mut json, &mut |count| random.below(count));
        }
        for _ in 0..random.below(3) {
            let offset = random.below(binary.len() / 4) * 4;
            let words = [f32::NAN, f32::INFINITY, -3e38, 1e-40, 1e9, 0.0].map(f32::to_bits);
            let word = match random.below(8) {
                i @ 0..6 => words[i],
                _ => random.word(),
            };
            binary[offset..offset + 4].copy_from_slice(&word.to_le_bytes());
        }
        match read(&container(&json, &binary), &path) {
            0 => rejected += 1,
            _ => accepted += 1,
        }
        if round % 8 == 0 {
            scenes += usize::from(crate::Scene::load(&path).is_ok());
        }
    }
    assert!(
        accepted * 5 > rounds && rejected * 10 > rounds && scenes * 50 > rounds,
        "accepted: {accepted}, rejected: {rejected}, loaded scenes: {scenes}"
    );
}
