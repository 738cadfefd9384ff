//! The integrator `path`: BSDF tests, scenes with closed-form radiance, and equal means of all sampling strategies.

mod alpha;
mod ends;
mod energy;
mod environment;
mod environment_files;
mod forms;
mod hidden;
mod lights;
mod many_lights;
mod materials;
mod principled;
mod spots;
mod strategies;

use wgray_trace::records::Packed;

use crate::scenes;

/// Returns a path-traced scene of 16 x 16 pixels with `samples` samples each; `text` is the rest of the scene file.
pub fn scene(samples: u32, depth: u32, text: &str) -> Packed {
    scenes::parse(&format!(
        "image = {{ width = 16, height = 16 }}\n{text}\n\
         [render]\nintegrator = 'path'\nmax_depth = {depth}\npixel_samples = {{ count = {samples} }}\n"
    ))
}

/// Returns the mean of the pixels of a film, per channel.
pub fn mean(film: &wgray_trace::film::Film) -> [f64; 3] {
    let count = film.sums.len() as f64;
    let sum = film.means().fold([0.0; 3], |sum: [f64; 3], mean| {
        [0, 1, 2].map(|i| sum[i] + f64::from(mean[i]))
    });
    sum.map(|x| x / count)
}
