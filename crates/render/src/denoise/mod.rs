//! The denoiser: a weighted mean of the pixels around each pixel. A pixel has a large weight if the patches around both
//! pixels differ no more than their noise explains, and if albedo, normal and depth are similar. The method is
//! non-local means with features of Rousselle, Manzi and Zwicker, "Robust Denoising using Feature and Color
//! Information", Computer Graphics Forum 32(7), 2013. Colors are divided by the albedo first, so that textures remain.
//!
//! [`denoise`] has the bits of `shaders/kernels/denoise.wgsl`.

mod bright;
mod coverage;
mod filter;
mod guides;
#[cfg(test)]
mod tests;
mod window;

use glam::Vec3;

use crate::error::RenderError;
use crate::job::check_memory;
use crate::output::Sink;
use guides::GUIDE_BYTES;
pub use guides::Guides;
use wgray_image::Region;
use wgray_trace::film::{Film, FilmLayout};
use wgray_trace::records::FirstHit;

/// Returns the denoised colors of a film with noise estimates, in row-major order, top row first. Without layers, only
/// colors guide the denoiser. Pixels that are not finite, or without samples, keep their color.
pub fn denoise(film: &Film) -> Vec<Vec3> {
    if film.sums.is_empty() {
        return Vec::new();
    }
    let guides = Guides::of(film);
    guides.colors(film, &filter::filter(&guides))
}

/// Returns the bytes of memory for a film and for the denoiser.
pub fn memory(region: Region, film_layout: FilmLayout) -> u64 {
    region.pixels().saturating_mul(film_layout.bytes() as u64 + GUIDE_BYTES)
}

/// Joins the bands that `render` produces, since the denoiser needs the whole film. Also returns the first hits.
///
/// # Errors
///
/// Errors of `render`; [`RenderError::Memory`] if the film does not fit into memory.
pub fn collect(
    region: Region,
    film_layout: FilmLayout,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(Film, Vec<FirstHit>), RenderError> {
    check_memory(memory(region, film_layout))?;
    let mut film = Film::of(region, film_layout);
    let mut hits = Vec::new();
    render(&mut |band| {
        film.copy_rows(band.film);
        hits.extend_from_slice(band.hits);
        Ok(())
    })?;
    Ok((film, hits))
}
