//! The library as a WebAssembly module without files and threads: renders a scene from bytes on the CPU.
//!
//! `render.test.mjs` calls the module in Node and compares the pixels with `pixels.f32`. The test below compares the
//! pixels of a native build with the same file.

use std::mem::ManuallyDrop;

use wgray::scene::{LoadOptions, MemoryFiles, SceneFormat};
use wgray::{Device, Error, Options, Scene};

/// Returns the linear RGB values of a scene's pixels in row-major order, top row first.
fn pixels(scene: &str) -> Result<Vec<f32>, Error> {
    let files = MemoryFiles::new()
        .with("meshes/knot.obj", &include_bytes!("../../scenes/meshes/knot.obj")[..])
        .with(
            "textures/grid.png",
            &include_bytes!("../../scenes/textures/grid.png")[..],
        );
    let options = LoadOptions::new().with_source(files);
    let scene = Scene::from_slice(scene.as_bytes(), SceneFormat::Toml, &options)?;
    let options = Options {
        device: Device::Cpu,
        ..Options::default()
    };
    let picture = wgray::render(&scene, &options)?;
    Ok(picture.pixels().colors.into_iter().flatten().collect())
}

/// Allocates `len` bytes for the text of a scene and returns their address.
#[unsafe(no_mangle)]
pub extern "C" fn allocate(len: usize) -> *mut u8 {
    ManuallyDrop::new(vec![0; len]).as_mut_ptr()
}

/// Renders the scene whose text was written to the result of [`allocate`]. Returns the address of the number of values,
/// followed by the values.
///
/// # Safety
///
/// `text` is the result of `allocate(len)`.
///
/// # Panics
///
/// If the text is not a valid scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn render(text: *mut u8, len: usize) -> *const u32 {
    // SAFETY: the caller passes the result of `allocate(len)`.
    let text = unsafe { Vec::from_raw_parts(text, len, len) };
    let pixels = pixels(str::from_utf8(&text).expect("UTF-8")).expect("a valid scene");
    let mut result = vec![pixels.len() as u32];
    result.extend(pixels.into_iter().map(f32::to_bits));
    ManuallyDrop::new(result).as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the pixels with `pixels.f32`. If `WGRAY_TEST_RECORD` is set, writes this file first.
    #[test]
    fn a_native_build_renders_the_recorded_pixels() {
        let bytes: Vec<u8> = pixels(include_str!("scene.toml"))
            .unwrap()
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .collect();
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/pixels.f32");
        if std::env::var_os("WGRAY_TEST_RECORD").is_some() {
            std::fs::write(file, &bytes).unwrap();
        }
        assert_eq!(bytes.len(), 8 * 8 * 3 * 4);
        assert!(bytes == std::fs::read(file).unwrap(), "the pixels differ from {file}");
    }
}
