//! The sequence of dispatches that render a film.

use std::ops::Range;
use std::time::Duration;

use super::WorkSplit;
use super::pace::Pace;
use crate::backend::Backend;
use crate::clock::Instant;
use crate::error::RenderError;
use wgray_image::Region;

/// Order of a film's samples, which does not change the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Many samples of a few rows at a time: kernels are faster if they add many samples per pixel.
    Rows,
    /// A few samples of all pixels at a time, for progressive display.
    Pixels,
}

/// Minimum number of rows of a dispatch with [`Order::Rows`]: two rows of workgroups on a GPU.
const MIN_DISPATCH_ROWS: u32 = 16;

/// Number of samples that the pixels of a film have so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleProgress {
    /// Samples in progress; all earlier samples are complete. Empty when all samples are complete.
    pub pass: Range<u32>,
    /// Column and row of the first pixel that lacks the samples of `pass`.
    pub next: [u32; 2],
}

/// Computes the dispatches of a film, one after the other, from the samples rendered so far and the measured speed.
#[derive(Clone, Debug)]
pub struct Steps {
    split: WorkSplit,
    order: Order,
    pace: Pace,
    region: Region,
    /// The region, and neighbors that need pilot samples.
    film: Region,
    samples: u32,
    unskippable_samples: u32,
    target: u32,
    reached: SampleProgress,
    dispatch: Option<Dispatch>,
}

#[derive(Clone, Copy, Debug)]
struct Dispatch {
    tile: Region,
    samples: u32,
    start: Instant,
}

impl Dispatch {
    fn work(&self) -> f64 {
        self.tile.pixels() as f64 * f64::from(self.samples)
    }
}

impl Steps {
    /// Creates an empty sequence of dispatches with a target duration.
    pub fn new(split: &WorkSplit, dispatch_duration: Duration, order: Order) -> Steps {
        Steps {
            split: *split,
            order,
            pace: Pace::new(dispatch_duration),
            region: Region::whole(0, 0),
            film: Region::whole(0, 0),
            samples: 0,
            unskippable_samples: 0,
            target: 0,
            reached: SampleProgress {
                pass: 0..0,
                next: [0; 2],
            },
            dispatch: None,
        }
    }

    /// Starts a film of a region; [`Steps::film`] returns the region of the film. Keeps the measured speed.
    pub fn start(&mut self, backend: &dyn Backend, region: Region, samples: u32) {
        self.region = region;
        self.samples = samples;
        self.target = samples;
        self.unskippable_samples = backend.unskippable_samples().min(samples);
        self.film = film_of(backend, region, samples);
        self.dispatch = None;
        self.pace.start_film();
        self.begin_pass(0);
    }

    /// Continues a film from earlier progress, possibly on another backend.
    pub fn resume(&mut self, backend: &dyn Backend, region: Region, samples: u32, reached: &SampleProgress) {
        self.start(backend, region, samples);
        self.reached = reached.clone();
        self.next_pass_if_ended();
    }

    /// Stops when all pixels have this number of samples, and the pass in progress is complete.
    pub fn stop_at(&mut self, samples: u32) {
        self.target = samples.min(self.samples);
        let SampleProgress { pass, next } = &self.reached;
        if *next == [self.region_of_pass().x0, self.region_of_pass().y0] {
            self.begin_pass(pass.start);
        }
    }

    /// Returns the region of the film.
    pub fn film(&self) -> Region {
        self.film
    }

    /// Returns the samples that the film's pixels have so far; valid between dispatches.
    pub fn reached(&self) -> &SampleProgress {
        &self.reached
    }

    /// Discards the measured speed, when the work or the backend changes.
    pub fn forget_pace(&mut self) {
        self.pace.forget();
    }

    /// Drops a failed dispatch and makes the next dispatches smaller.
    pub fn failed(&mut self) {
        self.pace.forget();
        if let Some(dispatch) = self.dispatch.take() {
            self.pace.failed(dispatch.work());
        }
    }

    /// Runs the next dispatch, and returns its number of samples over all pixels; `None` if the film is complete.
    pub fn step(&mut self, backend: &mut dyn Backend) -> Result<Option<f64>, RenderError> {
        if !self.submit(backend)? {
            return Ok(None);
        }
        backend.wait()?;
        Ok(self.end_dispatch())
    }

    /// Submits the next dispatch, for [`Steps::poll`]. Returns false if the film is complete.
    pub fn submit(&mut self, backend: &mut dyn Backend) -> Result<bool, RenderError> {
        if self.is_done() {
            return Ok(false);
        }
        let pass = self.reached.pass.clone();
        let dispatch = Dispatch {
            tile: self.next_tile(),
            samples: pass.len() as u32,
            start: Instant::now(),
        };
        self.dispatch = Some(dispatch);
        backend.submit(dispatch.tile, pass)?;
        Ok(true)
    }

    fn next_tile(&self) -> Region {
        let region = self.region_of_pass();
        let width = u64::from(region.width().max(1));
        let [x, y] = self.reached.next;
        let pixels = (self.pace.work() / f64::from(self.reached.pass.len() as u32)).max(1.0) as u64;
        let pixels = (self.split.rows_per_dispatch).map_or(pixels, |rows| u64::from(rows.max(1)) * width);
        if x == region.x0 && pixels >= width {
            let rows = (pixels / width).min(u64::from(region.y1 - y)) as u32;
            return Region {
                y0: y,
                y1: y + rows,
                ..region
            };
        }
        let columns = pixels.min(u64::from(region.x1 - x)) as u32;
        Region {
            x0: x,
            y0: y,
            x1: x + columns,
            y1: y + 1,
        }
    }

    /// Returns the number of samples over all pixels of the submitted dispatch; `None` until the dispatch has ended.
    pub fn poll(&mut self, backend: &mut dyn Backend) -> Result<Option<f64>, RenderError> {
        Ok(if backend.poll()? { self.end_dispatch() } else { None })
    }

    fn end_dispatch(&mut self) -> Option<f64> {
        let dispatch = self.dispatch.take()?;
        let Dispatch { tile, samples, start } = dispatch;
        let is_full = self.reached.pass.end <= self.unskippable_samples;
        self.pace.record(dispatch.work(), start.elapsed(), is_full);
        let region = self.region_of_pass();
        self.reached.next = match tile.x1 < region.x1 {
            true => [tile.x1, tile.y0],
            false => [region.x0, tile.y1],
        };
        self.next_pass_if_ended();
        Some(tile.within(self.region).pixels() as f64 * f64::from(samples))
    }

    fn next_pass_if_ended(&mut self) {
        if self.reached.next[1] >= self.region_of_pass().y1 {
            self.begin_pass(self.reached.pass.end);
        }
    }

    fn region_of_pass(&self) -> Region {
        if self.reached.pass.start < self.unskippable_samples {
            self.film
        } else {
            self.region
        }
    }

    /// Returns true if every pixel has all samples, or the number set by [`Steps::stop_at`].
    pub fn is_done(&self) -> bool {
        self.reached.pass.is_empty()
    }

    /// Returns the number of samples that every pixel has.
    pub fn samples(&self) -> u32 {
        self.reached.pass.start
    }

    /// Returns the number of samples that every pixel of a row has.
    pub fn samples_of_row(&self, y: u32) -> u32 {
        let SampleProgress { pass, next } = &self.reached;
        if y < next[1] { pass.end } else { pass.start }
    }

    /// Returns the samples per second over all pixels, after the first dispatch.
    pub fn speed(&self) -> Option<f64> {
        self.pace.speed()
    }

    fn begin_pass(&mut self, first: u32) {
        let rows = match self.order {
            Order::Rows => self.region.height().min(MIN_DISPATCH_ROWS),
            Order::Pixels => self.region.height(),
        };
        let pixels = f64::from(self.region.width()) * f64::from(rows);
        let count = (self.split.samples_per_dispatch).unwrap_or_else(|| (self.pace.work() / pixels).max(1.0) as u32);
        let end = if first < self.unskippable_samples {
            self.unskippable_samples
        } else {
            self.samples
        };
        let remainder = end.min(self.target).saturating_sub(first);
        // Dispatches of about the same size, instead of a small one at the end.
        let count = remainder.div_ceil(remainder.div_ceil(count).max(1));
        self.reached.pass = first..first + count;
        let region = self.region_of_pass();
        self.reached.next = [region.x0, region.y0];
    }
}

/// Returns the pixels of the film of a region: with adaptive sampling, the region and its neighbors.
pub(super) fn film_of(backend: &dyn Backend, region: Region, samples: u32) -> Region {
    match backend.unskippable_samples() < samples {
        true => backend.around(region),
        false => region,
    }
}
