//! The library as a WebAssembly module without files and threads: renders a scene from bytes on the CPU.
//!
//! `render.test.mjs` calls the module in Node and compares the pixels with `pixels.f32`. The test below compares the
//! pixels of a native build with the same file.

use std::cell::RefCell;
use std::io::Cursor;
use std::mem::ManuallyDrop;
use std::path::Path;
use std::pin::Pin;
use std::task::{Context as TaskContext, Poll, Waker};

use wgray::image::{Format, SaveOptions, read_exr};
use wgray::scene::{LoadOptions, MemoryFiles, SceneFormat};
use wgray::{CancelToken, Context, Device, Error, Options, Picture, Scene, Session};

const SCENE: &str = include_str!("scene.toml");

fn files() -> MemoryFiles {
    MemoryFiles::new()
        .with("meshes/knot.obj", &include_bytes!("../../scenes/meshes/knot.obj")[..])
        .with(
            "textures/grid.png",
            &include_bytes!("../../scenes/textures/grid.png")[..],
        )
}

fn load(scene: &str) -> Result<Scene, Error> {
    let options = LoadOptions::new().with_source(files());
    Ok(Scene::from_slice(scene.as_bytes(), SceneFormat::Toml, &options)?)
}

fn options() -> Options {
    Options {
        device: Device::Cpu,
        ..Options::default()
    }
}

/// Returns the linear RGB values of the pixels in row-major order, top row first.
fn values(picture: &Picture) -> Vec<f32> {
    picture.pixels().colors.into_iter().flatten().collect()
}

fn pixels(scene: &str) -> Result<Vec<f32>, Error> {
    Ok(values(&wgray::render(&load(scene)?, &options())?))
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
    result(pixels)
}

/// Returns the address of the number of values, followed by the values.
fn result(pixels: Vec<f32>) -> *const u32 {
    words(pixels.into_iter().map(f32::to_bits))
}

/// Returns the address of the number of words, followed by the words.
fn words(words: impl ExactSizeIterator<Item = u32>) -> *const u32 {
    let mut result = vec![words.len() as u32];
    result.extend(words);
    ManuallyDrop::new(result).as_ptr()
}

type Render = Pin<Box<dyn Future<Output = Result<Picture, Error>>>>;

thread_local! {
    static RENDER: RefCell<Option<Render>> = const { RefCell::new(None) };
}

/// Starts to render the scene like [`render`], for [`poll_render`].
///
/// # Safety
///
/// `text` is the result of `allocate(len)`.
///
/// # Panics
///
/// If the text is not a valid scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn start_render(text: *mut u8, len: usize) {
    // SAFETY: the caller passes the result of `allocate(len)`.
    let text = unsafe { Vec::from_raw_parts(text, len, len) };
    let scene = load(str::from_utf8(&text).expect("UTF-8")).expect("a valid scene");
    let session = Box::leak(Box::new(Session::new(&Context::new(), scene)));
    let render = session.render_async(&options(), &CancelToken::new());
    RENDER.set(Some(Box::pin(render)));
}

/// Continues the render. Returns 0 until it is finished, then the result of [`render`].
///
/// # Panics
///
/// If no render was started, or if it fails.
#[unsafe(no_mangle)]
pub extern "C" fn poll_render() -> *const u32 {
    RENDER.with_borrow_mut(|render| {
        let render = render.as_mut().expect("a render was started");
        match render.as_mut().poll(&mut TaskContext::from_waker(Waker::noop())) {
            Poll::Ready(picture) => result(values(&picture.expect("the render succeeds"))),
            Poll::Pending => std::ptr::null(),
        }
    })
}

/// Returns the address of the messages for formats that need the cargo feature `formats`, one per line: the number of
/// words, followed by the text, padded with spaces.
///
/// # Panics
///
/// If a format is accepted.
#[unsafe(no_mangle)]
pub extern "C" fn errors_without_formats() -> *const u32 {
    let picture = wgray::render(&load(SCENE).expect("a valid scene"), &options()).expect("an image");
    let mut errors = Vec::new();
    for format in [Format::Exr, Format::WebP] {
        let saved = picture.write_to(Cursor::new(Vec::new()), format, &SaveOptions::default());
        errors.push(saved.expect_err("an error").to_string());
    }
    errors.push(read_exr(Path::new("a.exr")).expect_err("an error").to_string());
    let text = SCENE.replace("grid.png", "a.image");
    for bytes in [
        &b"\x76\x2f\x31\x01"[..],
        b"RIFF\0\0\0\0WEBP",
        b"\xabKTX 20\xbb\r\n\x1a\n",
    ] {
        let options = LoadOptions::new().with_source(files().with("textures/a.image", bytes));
        let scene = Scene::from_slice(text.as_bytes(), SceneFormat::Toml, &options);
        errors.push(scene.expect_err("an error").to_string());
    }
    let mut text = errors.join("\n").into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    words(
        text.chunks_exact(4)
            .map(|word| u32::from_le_bytes(word.try_into().expect("four bytes"))),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the pixels with `pixels.f32`. If `WGRAY_TEST_RECORD` is set, writes this file first.
    #[test]
    fn a_native_build_renders_the_recorded_pixels() {
        let bytes: Vec<u8> = pixels(SCENE).unwrap().into_iter().flat_map(f32::to_le_bytes).collect();
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/pixels.f32");
        if std::env::var_os("WGRAY_TEST_RECORD").is_some() {
            std::fs::write(file, &bytes).unwrap();
        }
        assert_eq!(bytes.len(), 8 * 8 * 3 * 4);
        assert!(bytes == std::fs::read(file).unwrap(), "the pixels differ from {file}");
    }
}
