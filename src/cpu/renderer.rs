//! The twins over threads.

use std::ops::Range;

use glam::{UVec2, Vec4};
use rayon::prelude::*;

use super::adaptive::{look_with, moments_with, samples_wanted, whole_look};
use super::geometry::pixel_first_hit;
use super::pixel::pixel_radiance;
use crate::backend::{Backend, Rules, Started};
use crate::error::RenderError;
use crate::film::{Film, Region};
use crate::pack::{FirstHit, Packed};

/// A scene on the CPU. A call does its work in [`Backend::poll`] or [`Backend::wait`], on the current pool of threads.
pub struct Cpu<'a> {
    scene: &'a Packed,
    rules: Rules,
    film: Option<(Film, Started)>,
    /// The call that was submitted.
    pending: Option<(Region, Range<u32>)>,
}

impl<'a> Cpu<'a> {
    /// A renderer of a scene.
    pub fn new(scene: &'a Packed) -> Cpu<'a> {
        Cpu {
            scene,
            rules: Rules::of(scene),
            film: None,
            pending: None,
        }
    }

    /// The film, not copied.
    pub fn into_film(self) -> Option<Film> {
        self.film.map(|(film, _)| film)
    }

    fn idle(&self) -> Result<(), RenderError> {
        match self.pending {
            Some(_) => Err(RenderError::Pending),
            None => Ok(()),
        }
    }
}

/// Pixels of a row that one thread takes at a time.
const RUN: usize = 32;

impl Backend for Cpu<'_> {
    fn begin(&mut self, region: Region) -> Result<(), RenderError> {
        self.idle()?;
        let started = self.rules.begin(region)?;
        self.film = Some((self.rules.empty_film(region), started));
        Ok(())
    }

    fn resume(&mut self, film: Film) -> Result<(), RenderError> {
        self.idle()?;
        let started = self.rules.resume(&film)?;
        self.film = Some((film, started));
        Ok(())
    }

    fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        self.idle()?;
        let (_, started) = self.film.as_mut().ok_or(RenderError::NoFilm)?;
        if self.rules.call(started, tile, &samples)? {
            self.pending = Some((tile, samples));
        }
        Ok(())
    }

    fn poll(&mut self) -> Result<bool, RenderError> {
        if let (Some((tile, mut samples)), Some((film, _))) = (self.pending.take(), &mut self.film) {
            while !samples.is_empty() {
                let end = self.rules.end_of_part(&samples);
                add_samples(self.scene, film, tile, samples.start..end);
                samples.start = end;
            }
        }
        Ok(true)
    }

    fn wait(&mut self) -> Result<(), RenderError> {
        self.poll().map(|_| ())
    }

    fn film(&mut self) -> Result<Film, RenderError> {
        self.idle()?;
        let (film, _) = self.film.as_ref().ok_or(RenderError::NoFilm)?;
        Ok(film.clone())
    }

    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        self.idle()?;
        self.rules.in_picture(region)?;
        let rows = (region.y0..region.y1).into_par_iter();
        let pixels = rows.flat_map_iter(|y| (region.x0..region.x1).map(move |x| UVec2::new(x, y)));
        Ok(pixels.map(|pixel| pixel_first_hit(self.scene, pixel)).collect())
    }

    fn samples_of_all(&self) -> u32 {
        self.rules.samples_of_all()
    }

    fn around(&self, region: Region) -> Region {
        self.rules.around(region)
    }

    fn largest_film(&self) -> u64 {
        u64::MAX
    }
}

/// Adds samples to a tile of a film: either first ones or further ones, where that makes a difference.
fn add_samples(scene: &Packed, film: &mut Film, tile: Region, samples: Range<u32>) {
    let Film {
        region,
        sums,
        moments,
        looks,
    } = film;
    let region = *region;
    let sums = runs(region, sums, tile);
    if !scene.adaptive {
        sums.into_par_iter().for_each(|(first, sums)| {
            for (x, sum) in (first.x..).zip(sums) {
                for sample in samples.clone() {
                    *sum += pixel_radiance(scene, UVec2::new(x, first.y), sample);
                }
            }
        });
        return;
    }
    let both = sums.into_par_iter().zip(runs(region, moments, tile));
    if samples.start < scene.specialization.first_look {
        let all = both.zip(runs(region, looks, tile));
        all.for_each(|(((first, sums), (_, moments)), (_, looks))| {
            for (((x, sum), moments), look) in (first.x..).zip(sums).zip(moments).zip(looks) {
                first_look(scene, UVec2::new(x, first.y), samples.clone(), sum, moments, look);
            }
        });
    } else {
        both.for_each(|((first, sums), (_, moments))| {
            for ((x, sum), moments) in (first.x..).zip(sums).zip(moments) {
                let pixel = UVec2::new(x, first.y);
                let looks = looks_around(looks, region, pixel);
                further_samples(scene, pixel, samples.clone(), sum, moments, looks);
            }
        });
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

/// What `shaders/kernels/adaptive.wgsl` does to a pixel at first.
fn first_look(scene: &Packed, pixel: UVec2, samples: Range<u32>, sum: &mut Vec4, moments: &mut Vec4, look: &mut Vec4) {
    for sample in samples {
        let value = pixel_radiance(scene, pixel, sample);
        *look = look_with(*look, *sum, value);
        *moments = moments_with(*moments, *sum, value);
        *sum += value;
    }
    *look = whole_look(*look, *sum, *moments);
}

/// What it does to a pixel later on.
fn further_samples(scene: &Packed, pixel: UVec2, samples: Range<u32>, sum: &mut Vec4, moments: &mut Vec4, looks: Vec4) {
    let s = &scene.specialization;
    let end = samples_wanted(looks, s.first_look, f32::from_bits(s.squared_error), samples.end);
    for sample in samples.start..end {
        let value = pixel_radiance(scene, pixel, sample);
        *moments = moments_with(*moments, *sum, value);
        *sum += value;
    }
}

fn looks_around(looks: &[Vec4], region: Region, pixel: UVec2) -> Vec4 {
    let (x, y) = (pixel.x - region.x0, pixel.y - region.y0);
    let width = region.width() as usize;
    let index = y as usize * width + x as usize;
    let mut sum = Vec4::ZERO;
    if y > 0 {
        sum += looks[index - width];
    }
    if x > 0 {
        sum += looks[index - 1];
    }
    if x + 1 < region.width() {
        sum += looks[index + 1];
    }
    if y + 1 < region.height() {
        sum += looks[index + width];
    }
    sum
}
