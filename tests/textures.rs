//! Textures, their filters, ray differentials, mirrors and glass: against closed forms, finite differences and f64, and
//! on the GPU against the CPU.

mod agreement;
mod bad_input;
mod differentials;
mod filters;
mod generated;
mod normal_maps;
mod patterns;
mod specular;

use std::path::Path;

use wgray::cpu::Cpu;
use wgray::film::Region;
use wgray::job::{self, Backend, Cut};
use wgray::pack::{Packed, pack};
use wgray::scene::{Assets, Description};

/// A scene from its text; images are beside `folder`.
pub fn scene(text: &str, folder: &Path) -> Packed {
    let description = Description::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    pack(
        &description
            .validate_with(&Assets::beside(folder))
            .unwrap_or_else(|problem| panic!("{problem}\n{text}")),
    )
}

/// The mean radiance of every pixel, row by row.
pub fn picture(backend: &mut dyn Backend, scene: &Packed, cut: &Cut) -> Vec<[f32; 3]> {
    let region = Region::whole(scene.camera.width, scene.camera.height);
    let mut pixels = Vec::new();
    let mut output = |film: wgray::film::Film| {
        pixels.extend(film.means());
        Ok(())
    };
    job::render(backend, region, scene.pixel_samples, cut, &mut |_| true, &mut output).unwrap();
    pixels
}

pub fn cpu_picture(scene: &Packed) -> Vec<[f32; 3]> {
    picture(&mut Cpu::new(scene), scene, &Cut::default())
}

/// Numbers in [0, 1), the same in every run.
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Numbers {
        Numbers(seed)
    }

    /// SplitMix64: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Writes an image of 8 bits.
pub fn write_png(path: &Path, width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 3]) {
    image::RgbImage::from_fn(width, height, |x, y| image::Rgb(texel(x, y)))
        .save(path)
        .unwrap();
}

/// Writes an image of floats.
pub fn write_exr(path: &Path, width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) {
    image::Rgb32FImage::from_fn(width, height, |x, y| image::Rgb(texel(x, y)))
        .save(path)
        .unwrap();
}
