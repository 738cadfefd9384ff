//! The denoiser: a weighted mean of the pixels around each pixel. A pixel has a large weight if the patches around both
//! pixels differ no more than their noise explains, and if albedo, normal and depth are similar. The method is
//! non-local means with features of Rousselle, Manzi and Zwicker, "Robust Denoising using Feature and Color
//! Information", Computer Graphics Forum 32(7), 2013. Colors are divided by the albedo first, so that textures remain.
//!
//! [`denoise`] has the bits of `shaders/kernels/denoise.wgsl`.

mod filter;
mod guides;

use glam::Vec3;

use crate::film::Film;
pub use guides::Guides;

/// Returns the denoised colors of a film with noise estimates, in row-major order, top row first. Without layers, only
/// colors guide the denoiser. Pixels that are not finite, or without samples, keep their color.
pub fn denoise(film: &Film) -> Vec<Vec3> {
    let guides = Guides::of(film);
    guides.colors(film, &filter::filter(&guides))
}
