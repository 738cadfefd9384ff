//! Rendering of an image in bands of rows: one after the other, or all together in passes.

use std::collections::VecDeque;
use std::time::Duration;

use web_time::Instant;

use super::piece::{CheckpointStore, FilmPiece, StoredPiece};
use super::steps::{Order, SampleProgress, Steps};
use super::{DISPATCH_DURATION, WorkSplit, bands};
use crate::backend::Backend;
use crate::error::RenderError;
use crate::film::{Film, FilmLayout};
use wgray_image::Region;
use wgray_image::memory::fallible;

/// Action after a dispatch, as decided by the caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Continue with the next dispatch.
    Continue,
    /// Stop a render of all bands together once every pixel has a sample; otherwise continue.
    TimeIsUp,
    /// Cancel the work.
    Cancel,
}

impl From<bool> for Flow {
    fn from(is_extensible: bool) -> Flow {
        if is_extensible { Flow::Continue } else { Flow::Cancel }
    }
}

/// Callback after each dispatch, with the region of the band and the done fraction of all work, 0 to 1.
pub type Watch<'a> = dyn FnMut(&mut dyn Backend, Region, f64) -> Result<Flow, RenderError> + 'a;

/// Renders the bands of a region, from top to bottom. The measured speed determines the size of dispatches. Pieces from
/// a checkpoint are not rendered again.
pub struct Bands<'a> {
    store: &'a mut dyn CheckpointStore,
    bands: VecDeque<Band>,
    samples: u32,
    /// Completion of bands rendered together; `None` if they are rendered one after the other.
    whole: Option<bool>,
    /// Samples at the end of the current pass, if the bands are rendered in passes ([`Bands::in_passes`]).
    pass: Option<u32>,
    steps: Steps,
    /// Samples over all pixels, in finished bands and in total.
    done: f64,
    total: f64,
    /// Time and duration of the last checkpoint.
    kept: (Instant, Duration),
    /// Samples over all pixels that were rendered, not loaded.
    rendered: f64,
}

/// A rendered band.
pub struct FinishedBand {
    /// Pixels of the band.
    pub film: Film,
    /// Minimum number of samples of a pixel.
    pub min_samples: u32,
    /// Samples requested per pixel so far; with adaptive sampling a maximum.
    pub requested_samples: u32,
    /// Number of camera rays.
    pub camera_rays: u64,
}

impl FinishedBand {
    fn of(piece: FilmPiece) -> FinishedBand {
        let FilmPiece { region, reached, film } = piece;
        let film = film.part(region);
        let SampleProgress { pass, next: [x, y] } = reached;
        let (rows, columns) = (
            u64::from(y.saturating_sub(region.y0)),
            u64::from(x.saturating_sub(region.x0)),
        );
        let ahead = (rows * u64::from(region.width()) + columns).min(region.pixels());
        let (camera_rays, min_samples) = match film.film_layout().adaptive {
            true => (
                film.sample_counts().map(u64::from).sum(),
                film.sample_counts().min().unwrap_or(0),
            ),
            false => (
                region.pixels() * u64::from(pass.start) + ahead * pass.len() as u64,
                pass.start,
            ),
        };
        FinishedBand {
            film,
            min_samples,
            requested_samples: pass.start,
            camera_rays,
        }
    }
}

struct Band {
    region: Region,
    state: State,
    /// The piece after the last whole pass, if the current pass has changed it.
    passed: Option<FilmPiece>,
}

enum State {
    New,
    Stored(StoredPiece),
    Here(FilmPiece),
}

#[derive(PartialEq, Eq)]
enum End {
    Done,
    TimeIsUp,
}

/// Target duration between copies of a film.
const PASS: Duration = Duration::from_secs(1);

/// Minimum rows of a shortened band, without and with adaptive sampling, which adds two rows of neighbors.
const MIN_ROWS: [u32; 2] = [16, 64];

impl<'a> Bands<'a> {
    /// Splits a region into bands, and takes over a store's pieces, which must lie in it.
    pub fn new(
        region: Region,
        samples: u32,
        split: &WorkSplit,
        order: Order,
        largest_film: u64,
        store: &'a mut dyn CheckpointStore,
    ) -> Bands<'a> {
        let mut all = VecDeque::new();
        let mut y = region.y0;
        let add_new = |all: &mut VecDeque<Band>, y0: u32, y1: u32| {
            let rows = Region { y0, y1, ..region };
            let new = bands(rows, split, largest_film).map(|region| Band::new(region, State::New));
            all.extend(new);
        };
        for piece in store.pieces() {
            if piece.film.pixels() > largest_film && !piece.reached.pass.is_empty() {
                continue; // from another backend, which supports larger films
            }
            add_new(&mut all, y, piece.region.y0);
            y = piece.region.y1;
            all.push_back(Band::new(piece.region, State::Stored(piece)));
        }
        add_new(&mut all, y, region.y1);
        Bands {
            store,
            bands: all,
            samples,
            whole: None,
            pass: None,
            steps: Steps::new(split, DISPATCH_DURATION, order),
            done: 0.0,
            total: region.pixels() as f64 * f64::from(samples),
            kept: (Instant::now(), Duration::ZERO),
            rendered: 0.0,
        }
    }

    /// Renders all bands together, with all films in memory: every pixel gets a few samples before any gets more.
    ///
    /// # Errors
    ///
    /// [`RenderError::Memory`] if the films do not fit.
    pub fn as_a_whole(mut self, film_layout: FilmLayout) -> Result<Bands<'a>, RenderError> {
        check_memory(self.pixels().saturating_mul(film_layout.bytes() as u64))?;
        self.whole = Some(false);
        Ok(self)
    }

    /// Like [`Bands::as_a_whole`], for [`Bands::next_pass`]: also keeps the films of the last whole pass.
    ///
    /// # Errors
    ///
    /// [`RenderError::Memory`] if the films do not fit.
    pub fn in_passes(self, film_layout: FilmLayout) -> Result<Bands<'a>, RenderError> {
        check_memory(self.pixels().saturating_mul(2 * film_layout.bytes() as u64))?;
        let mut bands = self.as_a_whole(film_layout)?;
        bands.pass = Some(0);
        Ok(bands)
    }

    fn pixels(&self) -> u64 {
        self.bands.iter().map(|band| band.region.pixels()).sum()
    }

    /// Renders and returns the next band; `None` after the last band. After an error, the next call resumes the band
    /// from its last checkpoint, possibly on another backend. Calls `made` whenever progress is stored.
    ///
    /// # Errors
    ///
    /// Errors of the backend and of `watch`. [`RenderError::Cancelled`] if `watch` cancels; the band is stored first.
    pub fn render_next(
        &mut self,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        made: &mut dyn FnMut(),
    ) -> Result<Option<FinishedBand>, RenderError> {
        if self.whole == Some(false) {
            self.grow(backend, watch, made)?;
            self.whole = Some(true);
        }
        if self.bands.is_empty() {
            return Ok(None);
        }
        if self.whole.is_none() {
            self.make_first_small(backend);
            self.work(0, self.samples, backend, watch, made)?;
        }
        let Some(band) = self.bands.pop_front() else {
            return Ok(None);
        };
        self.done += band.region.pixels() as f64 * f64::from(self.samples);
        match band.state {
            State::Here(piece) => Ok(Some(FinishedBand::of(piece))),
            State::Stored(kept) => Ok(Some(FinishedBand::of(self.store.load(kept.number)?))),
            State::New => Err(RenderError::NoFilm), // not possible: `work` has created a piece
        }
    }

    /// Renders another pass over all bands, adding one or more samples per pixel. Returns the number of samples of
    /// every pixel; `None` if all samples are complete or the time is up, after which [`Bands::render_next`] returns
    /// the bands. After an error the pass can be continued, and [`Bands::last_pass`] returns the previous pass.
    ///
    /// # Errors
    ///
    /// The errors of [`Bands::render_next`].
    pub fn next_pass(
        &mut self,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        made: &mut dyn FnMut(),
    ) -> Result<Option<u32>, RenderError> {
        let have = self.passed_samples();
        if self.pass.is_none() || self.whole != Some(false) || have >= self.samples {
            return Ok(None);
        }
        let until = match self.pass {
            Some(until) if until > have => until, // a pass that failed
            _ => self.end_of_pass(have),
        };
        self.pass = Some(until);
        if self.work_on_all(until, backend, watch, made)? == End::TimeIsUp {
            self.whole = Some(true);
            return Ok(None);
        }
        for band in &mut self.bands {
            band.passed = None;
        }
        Ok(Some(self.passed_samples()))
    }

    /// Returns the samples of every pixel after the last whole pass.
    pub fn passed_samples(&self) -> u32 {
        let samples = |band: &Band| match &band.passed {
            Some(piece) => piece.reached.pass.start,
            None => band.samples(self.samples),
        };
        self.bands.iter().map(samples).min().unwrap_or(self.samples)
    }

    /// Passes copies of all bands, as of the last complete pass, to `output`, from top to bottom.
    ///
    /// # Errors
    ///
    /// Errors of `output`, and of a store that cannot load a piece.
    pub fn last_pass(
        &mut self,
        output: &mut dyn FnMut(FinishedBand) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        for band in &self.bands {
            let piece = match (&band.passed, &band.state) {
                (Some(piece), _) | (None, State::Here(piece)) => piece.clone(),
                (None, State::Stored(kept)) => self.store.load(kept.number)?,
                (None, State::New) => return Err(RenderError::NoFilm),
            };
            output(FinishedBand::of(piece))?;
        }
        Ok(())
    }

    /// Returns the samples at the end of the pass after `have`, long enough to amortize copies. Every power of two ends
    /// a pass.
    fn end_of_pass(&self, have: u32) -> u32 {
        let count = match self.bands.len() {
            1 => (self.steps.speed().unwrap_or(0.0) * PASS.as_secs_f64() / self.pixels() as f64) as u32,
            _ => have / 4,
        };
        let power = (have + 1).next_power_of_two();
        have.saturating_add(count.max(1)).min(power).min(self.samples)
    }

    /// Returns the rendered (not loaded) fraction of the samples in finished bands: 0 to 1.
    pub fn fraction_rendered(&self) -> f64 {
        if self.done > 0.0 {
            (self.rendered / self.done).min(1.0)
        } else {
            0.0
        }
    }

    fn grow(
        &mut self,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        made: &mut dyn FnMut(),
    ) -> Result<(), RenderError> {
        let mut until = match self.bands.len() {
            1 => self.samples,
            _ => 1,
        };
        loop {
            if self.work_on_all(until, backend, watch, made)? == End::TimeIsUp || until >= self.samples {
                return Ok(());
            }
            // A round copies all films: with many samples a round adds a quarter.
            until = (until + (until / 4).max(1)).min(self.samples);
        }
    }

    /// Renders until all pixels have `until` samples, or the time is up.
    fn work_on_all(
        &mut self,
        until: u32,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        made: &mut dyn FnMut(),
    ) -> Result<End, RenderError> {
        for i in 0..self.bands.len() {
            let is_here = matches!(self.bands[i].state, State::Here(_));
            if is_here && self.bands[i].samples(self.samples) >= until {
                continue;
            }
            if self.work(i, until, backend, watch, made)? == End::TimeIsUp {
                return Ok(End::TimeIsUp);
            }
        }
        Ok(End::Done)
    }

    /// Shortens the first band to about one checkpoint interval.
    fn make_first_small(&mut self, backend: &dyn Backend) {
        let Some(Band {
            region,
            state: State::New,
            ..
        }) = self.bands.front_mut()
        else {
            return;
        };
        if !self.store.small_pieces() {
            return;
        }
        let least = MIN_ROWS[usize::from(backend.samples_of_all() < self.samples)];
        let of_a_row = f64::from(region.width()) * f64::from(self.samples);
        let of_a_piece = self.steps.speed().unwrap_or(0.0) * self.store.interval().as_secs_f64();
        let rows = ((of_a_piece / of_a_row) as u32).max(least);
        if rows < region.height() {
            let (first, rest) = (
                region.y0,
                Region {
                    y0: region.y0 + rows,
                    ..*region
                },
            );
            region.y1 = first + rows;
            self.bands.insert(1, Band::new(rest, State::New));
        }
    }

    fn work(
        &mut self,
        i: usize,
        until: u32,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        made: &mut dyn FnMut(),
    ) -> Result<End, RenderError> {
        let result = self.try_to_work(i, until, backend, watch, made);
        if result.is_err() {
            self.steps.failed();
        }
        result
    }

    fn try_to_work(
        &mut self,
        i: usize,
        until: u32,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        made: &mut dyn FnMut(),
    ) -> Result<End, RenderError> {
        if let State::Stored(kept) = &self.bands[i].state {
            let piece = self.store.load(kept.number)?;
            self.bands[i].state = State::Here(piece);
        }
        let region = self.bands[i].region;
        if self.bands[i].samples(self.samples) >= until {
            return Ok(End::Done);
        }
        match &self.bands[i].state {
            State::Here(piece) => {
                self.steps.resume(backend, region, self.samples, &piece.reached);
                backend.resume(piece.film.clone())?;
            }
            _ => {
                self.steps.start(backend, region, self.samples);
                backend.begin(self.steps.film())?;
            }
        }
        self.steps.stop_at(until);
        let others_have_one = (0..self.bands.len()).all(|k| k == i || self.bands[k].samples(self.samples) > 0);
        let mut done = self.done + self.bands.iter().map(|band| band.work(self.samples)).sum::<f64>();
        while let Some(work) = self.steps.step(backend)? {
            done += work;
            self.rendered += work;
            let end = match watch(backend, region, done / self.total)? {
                Flow::Cancel => Some(Err(RenderError::Cancelled)),
                Flow::TimeIsUp if self.whole.is_some() && others_have_one && self.steps.samples() > 0 => {
                    Some(Ok(End::TimeIsUp))
                }
                Flow::Continue | Flow::TimeIsUp => None,
            };
            if end.is_some() || self.is_time_to_keep() {
                self.take(i, backend, end.is_some())?;
                made();
            }
            if let Some(end) = end {
                return end;
            }
        }
        self.take(i, backend, false)?;
        made();
        Ok(End::Done)
    }

    fn is_time_to_keep(&self) -> bool {
        // Checkpoints take at most a tenth of the time.
        let (last, took) = self.kept;
        last.elapsed() >= self.store.interval().max(9 * took)
    }

    /// Copies a band from the backend, and stores it if it is complete or a checkpoint is due.
    fn take(&mut self, i: usize, backend: &mut dyn Backend, at_the_end: bool) -> Result<(), RenderError> {
        let start = Instant::now();
        let region = self.bands[i].region;
        let reached = self.steps.reached().clone();
        let is_finished = reached.pass.start >= self.samples;
        let film = backend.film()?;
        let piece = FilmPiece {
            region,
            reached,
            film: if is_finished { film.part(region) } else { film },
        };
        let is_time = at_the_end || self.is_time_to_keep();
        if is_finished || is_time {
            self.store.keep(&piece);
        }
        let band = &mut self.bands[i];
        let before = std::mem::replace(&mut band.state, State::Here(piece));
        if let (State::Here(before), Some(_)) = (before, self.pass) {
            band.passed.get_or_insert(before);
        }
        if is_time {
            if self.whole.is_some() {
                self.keep_others(i);
            }
            self.store.sync();
            self.kept = (Instant::now(), start.elapsed());
        }
        Ok(())
    }

    /// Stores the other changed bands in memory.
    fn keep_others(&mut self, i: usize) {
        let kept = self.store.pieces();
        for (k, band) in self.bands.iter().enumerate() {
            let State::Here(piece) = &band.state else { continue };
            let is_kept = |kept: &StoredPiece| kept.region == piece.region && kept.reached == piece.reached;
            if k != i && !kept.iter().any(is_kept) {
                self.store.keep(piece);
            }
        }
    }
}

impl Band {
    fn new(region: Region, state: State) -> Band {
        Band {
            region,
            state,
            passed: None,
        }
    }

    fn reached(&self) -> Option<&SampleProgress> {
        match &self.state {
            State::New => None,
            State::Stored(kept) => Some(&kept.reached),
            State::Here(piece) => Some(&piece.reached),
        }
    }

    fn samples(&self, all: u32) -> u32 {
        self.reached().map_or(0, |reached| reached.pass.start.min(all))
    }

    /// Samples over all pixels, not counting an incomplete pass.
    fn work(&self, all: u32) -> f64 {
        self.region.pixels() as f64 * f64::from(self.samples(all))
    }
}

/// Checks that memory is available, by an allocation that is freed at once. A later failure would abort the program.
///
/// # Errors
///
/// [`RenderError::Memory`] if the memory is not available.
pub fn check_memory(bytes: u64) -> Result<(), RenderError> {
    match usize::try_from(bytes).is_ok_and(|bytes| fallible(|| Vec::<u8>::new().try_reserve_exact(bytes)).is_ok()) {
        true => Ok(()),
        false => Err(RenderError::Memory(bytes)),
    }
}
