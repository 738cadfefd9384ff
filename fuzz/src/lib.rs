//! Shared code of the fuzz targets: decisions derived from the input bytes, temporary files for readers that need a
//! path, and a small render.

#[path = "../../crates/scene/src/gltf/changed.rs"]
mod changed;
#[path = "../../crates/scene/src/gltf/everything.rs"]
mod everything;

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use tempfile::TempDir;
use wgray::scene::EnvironmentDescription;
use wgray::{Device, Options, Overrides, Scene};

pub use changed::changed;
pub use everything::everything;

/// The unused input bytes, from which choices are derived. Once all bytes are used, every further byte is 0.
pub struct Choices<'a>(pub &'a [u8]);

impl Choices<'_> {
    /// Returns the next byte.
    pub fn byte(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    /// Returns the next four bytes as a little-endian word.
    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    /// Returns a number below `count`, or 0 if `count` is 0.
    pub fn below(&mut self, count: usize) -> usize {
        let needs_two_bytes = count > 256;
        let number = u16::from_le_bytes([self.byte(), if needs_two_bytes { self.byte() } else { 0 }]);
        usize::from(number) % count.max(1)
    }

    /// Returns true if unused bytes are left.
    pub fn are_left(&self) -> bool {
        !self.0.is_empty()
    }
}

/// Writes a file to a temporary folder of the process and returns its path.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for files"));
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("a file");
    path
}

/// Returns overrides for a small, fast render.
pub fn small() -> Overrides {
    Overrides {
        size: Some((3, 2)),
        pixel_samples: Some(1),
        light_samples: Some(1),
        ..Overrides::default()
    }
}

/// Returns the overrides of [`small`] for models. The environment is constant, because computing the tables of the studio environment
/// would dominate the time.
pub fn small_model() -> Overrides {
    Overrides {
        environment: Some(EnvironmentDescription::new([0.5, 0.5, 0.5])),
        ..small()
    }
}

/// Renders a scene on the CPU; panics on an error.
pub fn render(scene: &Scene) {
    let options = Options {
        device: Device::Cpu,
        ..Options::default()
    };
    wgray::render(scene, &options).expect("a valid scene renders");
}

/// Builds a .glb file from a JSON document and a buffer.
pub fn container(json: &serde_json::Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut file = b"glTF".to_vec();
    let mut words = |words: &[u32], bytes: &[u8]| {
        file.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        file.extend(bytes);
    };
    let (json, bin) = (0x4E4F_534A, 0x004E_4942);
    words(&[2, (12 + 8 + text.len() + 8 + binary.len()) as u32], &[]);
    words(&[text.len() as u32, json], &text);
    words(&[binary.len() as u32, bin], &binary);
    file
}
