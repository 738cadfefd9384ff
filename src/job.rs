//! The schedule of work, above both backends: bands that fit memory, dispatches that end in time, progress and
//! cancelling. Sums go on from the film's own values, so that every cut gives the same picture.

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::error::RenderError;
use crate::film::{Film, Region};
use crate::pack::FirstHit;

/// What renders: a scene on a device. It has one film at a time.
pub trait Backend {
    /// Starts an empty film of a region of the picture.
    fn begin(&mut self, region: Region) -> Result<(), RenderError>;
    /// Adds a range of samples to the pixels of a tile of the film, and returns when this is done.
    fn render(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError>;
    /// The film as it is now.
    fn film(&mut self) -> Result<Film, RenderError>;
    /// What the rays through the centres of a region's pixels meet first, row by row from the top.
    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError>;
    /// The largest film that it can have, in pixels.
    fn largest_film(&self) -> u64;
    /// How many samples all pixels get; further ones are left out where they are not needed.
    fn samples_of_all(&self) -> u32 {
        u32::MAX
    }
}

/// How long one call of [`Backend::render`] aims to take: long enough to hide what a call costs, short enough for
/// watchdogs, progress and cancelling.
const CALL: Duration = Duration::from_millis(60);

/// How work is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// The largest film, in pixels.
    pub band_pixels: u64,
    /// The samples of one call, if not as many as time allows.
    pub samples_per_call: Option<u32>,
    /// The rows of one call, if not as many as time allows.
    pub rows_per_call: Option<u32>,
}

impl Default for Cut {
    /// Bands of 64 MiB.
    fn default() -> Cut {
        Cut {
            band_pixels: 4 << 20,
            samples_per_call: None,
            rows_per_call: None,
        }
    }
}

/// The bands that a region is rendered in, from the top: whole rows, as many as a film has room for.
pub fn bands(region: Region, cut: &Cut, largest_film: u64) -> impl Iterator<Item = Region> + use<> {
    let pixels = cut.band_pixels.min(largest_film);
    let rows = (pixels / u64::from(region.width())).clamp(1, u64::from(region.height())) as u32;
    (region.y0..region.y1).step_by(rows as usize).map(move |y0| Region {
        y0,
        y1: region.y1.min(y0 + rows),
        ..region
    })
}

/// What the rays through the centres of a region's pixels meet first, row by row from the top; in calls of bounded size.
pub fn first_hits(backend: &mut dyn Backend, region: Region) -> Result<Vec<FirstHit>, RenderError> {
    const CALL_PIXELS: u64 = 1 << 18;
    let cut = Cut {
        band_pixels: CALL_PIXELS,
        ..Cut::default()
    };
    let mut hits = Vec::new();
    for strip in bands(region, &cut, backend.largest_film()) {
        hits.extend(backend.first_hits(strip)?);
    }
    Ok(hits)
}

/// Renders a region band by band, from the top, and hands each finished band to `output`. `progress` is told the share
/// of the work that is done, from 0 to 1, and returns whether to go on.
pub fn render(
    backend: &mut dyn Backend,
    region: Region,
    samples: u32,
    cut: &Cut,
    progress: &mut dyn FnMut(f64) -> bool,
    output: &mut dyn FnMut(Film) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let total = region.pixels() as f64 * f64::from(samples);
    let mut pace = Pace::default();
    let mut done = 0.0;
    for band in bands(region, cut, backend.largest_film()) {
        backend.begin(band)?;
        let mut first = 0;
        while first < samples {
            let count = cut
                .samples_per_call
                .unwrap_or_else(|| pace.samples(band))
                .min(samples - first);
            let mut y = band.y0;
            while y < band.y1 {
                let rows = cut
                    .rows_per_call
                    .unwrap_or_else(|| pace.rows(band, count))
                    .min(band.y1 - y);
                let tile = Region {
                    y0: y,
                    y1: y + rows,
                    ..band
                };
                let start = Instant::now();
                backend.render(tile, first..first + count)?;
                let work = tile.pixels() as f64 * f64::from(count);
                let of_all = first + count <= backend.samples_of_all();
                pace.took(work, start.elapsed(), of_all);
                done += work;
                if !progress(done / total) {
                    return Err(RenderError::Cancelled);
                }
                y += rows;
            }
            first += count;
        }
        output(backend.film()?)?;
    }
    Ok(())
}

/// How fast work goes, learnt from the calls so far.
#[derive(Default)]
struct Pace {
    /// Samples of pixels per second.
    speed: Option<f64>,
    /// The same where no pixel leaves samples out.
    speed_of_all: f64,
}

impl Pace {
    /// A first call is small enough for the slowest device and scene.
    const FIRST_CALL: f64 = 16384.0;
    /// How much faster work may seem where pixels leave samples out: the next tile may have none that does.
    const MOST_LEFT_OUT: f64 = 8.0;

    fn took(&mut self, work: f64, time: Duration, of_all: bool) {
        let speed = work / time.as_secs_f64().max(1e-6);
        let speed = self.speed.map_or(speed, |known| speed.min(2.0 * known));
        if of_all {
            self.speed_of_all = speed;
        }
        self.speed = Some(speed.min(Self::MOST_LEFT_OUT * self.speed_of_all));
    }

    /// Pixel samples that fit a call.
    fn work(&self) -> f64 {
        self.speed.map_or(Self::FIRST_CALL, |speed| speed * CALL.as_secs_f64())
    }

    fn samples(&self, band: Region) -> u32 {
        (self.work() / band.pixels() as f64).max(1.0) as u32
    }

    fn rows(&self, band: Region, samples: u32) -> u32 {
        (self.work() / (f64::from(band.width()) * f64::from(samples))).max(1.0) as u32
    }
}
