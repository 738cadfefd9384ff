//! Textures, filters, ray differentials, mirrors and glass, compared with closed forms, finite differences and f64
//! references, and between GPU and CPU.

mod agreement;
mod bad_input;
mod damage;
mod differentials;
mod filters;
mod generated;
mod gray;
mod normal_maps;
mod procedural;
mod specular;

use std::path::Path;

use wgray::scene::{Assets, Description};
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use crate::pictures::reference;

/// Parses and packs a scene. Paths of images are relative to `folder`.
pub fn scene(text: &str, folder: &Path) -> Packed {
    let description = Description::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    pack(
        &description
            .validate_with(&Assets::beside(folder))
            .unwrap_or_else(|problem| panic!("{problem}\n{text}")),
    )
}

/// Returns the mean radiance of every pixel in row-major order.
pub fn cpu_picture(scene: &Packed) -> Vec<[f32; 3]> {
    reference(scene).means().collect()
}

/// Writes an 8-bit RGB image.
pub fn write_png(path: &Path, width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 3]) {
    image::RgbImage::from_fn(width, height, |x, y| image::Rgb(texel(x, y)))
        .save(path)
        .unwrap();
}

/// Writes an image of 32-bit floats.
pub fn write_exr(path: &Path, width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) {
    image::Rgb32FImage::from_fn(width, height, |x, y| image::Rgb(texel(x, y)))
        .save(path)
        .unwrap();
}
