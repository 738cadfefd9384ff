//! What the fuzz targets share: choices out of bytes, files for readers that take a path, and one sample of a picture.

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

/// Choices that bytes make; where there are no more of them it is always the first.
pub struct Choices<'a>(pub &'a [u8]);

impl Choices<'_> {
    /// A byte.
    pub fn byte(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    /// A word.
    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    /// One of so many.
    pub fn below(&mut self, count: usize) -> usize {
        let wide = count > 256;
        let number = u16::from_le_bytes([self.byte(), if wide { self.byte() } else { 0 }]);
        usize::from(number) % count.max(1)
    }

    /// Whether bytes are left.
    pub fn are_left(&self) -> bool {
        !self.0.is_empty()
    }
}

/// The path of a file with these bytes, in a folder of the process's own.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for files"));
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("a file");
    path
}

/// What makes a picture small.
pub fn small() -> Overrides {
    Overrides {
        size: Some((3, 2)),
        pixel_samples: Some(1),
        light_samples: Some(1),
        ..Overrides::default()
    }
}

/// The same for models, before a colour: the tables of the studio take longer than all else.
pub fn small_model() -> Overrides {
    Overrides {
        environment: Some(EnvironmentDescription::new([0.5, 0.5, 0.5])),
        ..small()
    }
}

/// Renders a scene on the CPU. Whatever passed the checks has a picture.
pub fn render(scene: &Scene) {
    let options = Options {
        device: Device::Cpu,
        ..Options::default()
    };
    wgray::render(scene, &options).expect("a picture");
}

/// A container of a JSON and bytes.
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
