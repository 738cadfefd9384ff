//! The twins over threads.

use std::ops::Range;

use glam::{UVec2, Vec4};
use rayon::prelude::*;

use super::adaptive::moments_with;
use super::integrator::{is_done, pixel_corners, pixel_first_hit, pixel_radiance};
use crate::error::RenderError;
use crate::film::{Film, Region};
use crate::job::Backend;
use crate::pack::{FirstHit, Packed};

/// A scene on the CPU.
pub struct Cpu<'a> {
    scene: &'a Packed,
    film: Film,
}

impl<'a> Cpu<'a> {
    /// A renderer of a scene, on the current pool of threads.
    pub fn new(scene: &'a Packed) -> Cpu<'a> {
        Cpu {
            scene,
            film: Film::new(Region::whole(0, 0)),
        }
    }

    /// A renderer that goes on with a film.
    pub fn resume(scene: &'a Packed, film: Film) -> Cpu<'a> {
        Cpu { scene, film }
    }
}

/// Pixels of a row that one thread takes at a time.
const RUN: usize = 32;

impl Backend for Cpu<'_> {
    fn begin(&mut self, region: Region) -> Result<(), RenderError> {
        self.film = match self.scene.adaptive {
            true => Film::adaptive(region),
            false => Film::new(region),
        };
        Ok(())
    }

    fn render(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        let scene = self.scene;
        let Film { region, sums, moments } = &mut self.film;
        let sums = runs(*region, sums, tile);
        if scene.adaptive {
            let both = sums.into_par_iter().zip(runs(*region, moments, tile));
            both.for_each(|((first, sums), (_, moments))| {
                for ((x, sum), moments) in (first.x..).zip(sums).zip(moments) {
                    adaptive(scene, UVec2::new(x, first.y), samples.clone(), sum, moments);
                }
            });
        } else {
            sums.into_par_iter().for_each(|(first, sums)| {
                for (x, sum) in (first.x..).zip(sums) {
                    for sample in samples.clone() {
                        *sum += pixel_radiance(scene, UVec2::new(x, first.y), sample);
                    }
                }
            });
        }
        Ok(())
    }

    fn film(&mut self) -> Result<Film, RenderError> {
        Ok(std::mem::replace(&mut self.film, Film::new(Region::whole(0, 0))))
    }

    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        let rows = (region.y0..region.y1).into_par_iter();
        let pixels = rows.flat_map_iter(|y| (region.x0..region.x1).map(move |x| UVec2::new(x, y)));
        Ok(pixels.map(|pixel| pixel_first_hit(self.scene, pixel)).collect())
    }

    fn samples_of_all(&self) -> u32 {
        self.scene.specialization.pixel_samples
    }

    fn largest_film(&self) -> u64 {
        u64::MAX
    }
}

/// The records of a tile's pixels, of a film's region, in pieces of a row, each with its first pixel.
fn runs(region: Region, records: &mut [Vec4], tile: Region) -> Vec<(UVec2, &mut [Vec4])> {
    let rows = records.chunks_mut(region.width() as usize).enumerate();
    let rows = rows.skip((tile.y0 - region.y0) as usize).take(tile.height() as usize);
    let columns = (tile.x0 - region.x0) as usize..(tile.x1 - region.x0) as usize;
    rows.flat_map(|(y, row)| {
        let runs = row[columns.clone()].chunks_mut(RUN).enumerate();
        runs.map(move |(i, run)| (UVec2::new(tile.x0 + (i * RUN) as u32, region.y0 + y as u32), run))
    })
    .collect()
}

/// What `shaders/kernels/adaptive.wgsl` does to a pixel.
fn adaptive(scene: &Packed, pixel: UVec2, samples: Range<u32>, sum: &mut Vec4, moments: &mut Vec4) {
    if samples.start == 0 && samples.end > 0 {
        *moments = pixel_corners(scene, pixel);
    }
    for sample in samples {
        if is_done(scene, *sum, *moments, sample) {
            break;
        }
        let value = pixel_radiance(scene, pixel, sample);
        *moments = moments_with(*moments, *sum, value);
        *sum += value;
    }
}
