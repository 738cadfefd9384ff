//! The library as a WebAssembly module without files and threads: renders a scene from bytes on the CPU.
//!
//! `render.test.mjs` calls the module in Node and compares the pixels with `pixels.f32`. The test below compares the
//! pixels of a native build with the same file.

use std::cell::RefCell;
use std::mem::ManuallyDrop;
use std::pin::Pin;
use std::task::{Context as TaskContext, Poll, Waker};

use wgray::scene::{LoadOptions, MemoryFiles, SceneFormat};
use wgray::{CancelToken, Context, Device, Error, Options, Picture, Scene, Session};

fn load(scene: &str) -> Result<Scene, Error> {
    let files = MemoryFiles::new()
        .with("meshes/knot.obj", &include_bytes!("../../scenes/meshes/knot.obj")[..])
        .with(
            "textures/grid.png",
            &include_bytes!("../../scenes/textures/grid.png")[..],
        );
    let options = LoadOptions::new().with_source(files);
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
    let mut result = vec![pixels.len() as u32];
    result.extend(pixels.into_iter().map(f32::to_bits));
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
