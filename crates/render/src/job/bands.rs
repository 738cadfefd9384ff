//! Rendering of an image in bands of rows: one after the other, or all together in passes.

use std::collections::VecDeque;
use std::time::Duration;

use super::piece::{CheckpointStore, FilmPiece, StoredPiece};
use super::steps::{Order, SampleProgress, Steps};
use super::{DISPATCH_DURATION, WorkSplit, bands};
use crate::backend::Backend;
use crate::clock::Instant;
use crate::error::RenderError;
use wgray_image::Region;
use wgray_image::memory::fallible;
use wgray_trace::film::{Film, FilmLayout};

/// Action after a dispatch, as decided by the caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Continue with the next dispatch.
    Continue,
    /// The time limit has passed: joint rendering of all bands ends as soon as every pixel has a sample. Rendering band
    /// by band continues.
    TimeIsUp,
    /// Cancel the render.
    Cancel,
}

impl From<bool> for Flow {
    fn from(is_continued: bool) -> Flow {
        if is_continued { Flow::Continue } else { Flow::Cancel }
    }
}

/// Callback after each dispatch. It receives the region of the band and the finished fraction of all samples, 0 to 1.
pub type Watch<'a> = dyn FnMut(&mut dyn Backend, Region, f64) -> Result<Flow, RenderError> + 'a;

/// Renders the bands of a region, from top to bottom. The measured speed determines the size of dispatches. Pieces from
/// a checkpoint are not rendered again.
pub struct Bands<S> {
    store: S,
    bands: VecDeque<Band>,
    samples: u32,
    /// True once joint rendering has ended, because all samples are complete or the time is up; `None` if bands are
    /// rendered one after the other.
    joint_rendering_ended: Option<bool>,
    /// Samples per pixel at the end of the current pass, if the bands are rendered in passes ([`Bands::in_passes`]).
    pass_end: Option<u32>,
    pass_ends: PassEnds,
    /// True to keep the films of the last complete pass ([`Bands::output_last_pass`]).
    keeps_last_pass: bool,
    steps: Steps,
    /// Samples over all pixels of the finished bands, as if none had ended early.
    finished_samples: f64,
    /// Samples over all pixels that were requested of the finished bands until they ended.
    requested_rays: f64,
    /// Samples over all pixels of the region.
    total_samples: f64,
    /// End and duration of the last checkpoint.
    last_checkpoint: (Instant, Duration),
    /// Number of samples over all pixels that were rendered, not loaded from a checkpoint.
    rendered_samples: f64,
}

/// A rendered band.
pub struct FinishedBand {
    /// The film of the band.
    pub film: Film,
    /// Minimum number of samples of a pixel.
    pub min_samples: u32,
    /// Number of samples requested per pixel so far; with adaptive sampling, the maximum.
    pub requested_samples: u32,
    /// Number of camera rays.
    pub camera_rays: u64,
}

impl FinishedBand {
    fn of(piece: FilmPiece) -> FinishedBand {
        let requested_rays = piece.requested_rays();
        let requested_samples = piece.reached.pass.start;
        let film = piece.film.part(piece.region);
        let (camera_rays, min_samples) = match film.film_layout().adaptive {
            true => (
                film.sample_counts().map(u64::from).sum(),
                film.sample_counts().min().unwrap_or(0),
            ),
            false => (requested_rays, requested_samples),
        };
        FinishedBand {
            film,
            min_samples,
            requested_samples,
            camera_rays,
        }
    }
}

struct Band {
    region: Region,
    state: State,
    /// The piece after the last complete pass, if the current pass has changed the piece.
    last_pass: Option<FilmPiece>,
}

#[expect(clippy::large_enum_variant, reason = "few bands exist, and most are in memory")]
enum State {
    New,
    Stored(StoredPiece),
    InMemory(FilmPiece),
}

#[derive(PartialEq, Eq)]
enum Outcome {
    Done,
    TimeIsUp,
}

/// Rule for the end of a pass.
#[derive(Clone, Copy)]
pub enum PassEnds {
    /// After about this duration, and at every power of two.
    After(Duration),
    /// At the number of samples per pixel that the function returns for the number at the start.
    At(fn(u32) -> u32),
}

/// Target duration of a pass, at the end of which the films are copied.
const PASS_DURATION: Duration = Duration::from_secs(1);

/// Minimum number of rows of a shortened band, without and with adaptive sampling. Adaptive sampling adds two or four
/// rows of neighbors.
const MIN_ROWS: [u32; 2] = [16, 64];

impl<S: CheckpointStore> Bands<S> {
    /// Splits a region into bands. Pieces of the store, which must lie in the region, become bands.
    pub fn new(region: Region, samples: u32, split: &WorkSplit, order: Order, largest_film: u64, store: S) -> Bands<S> {
        let mut queue = VecDeque::new();
        let mut y = region.y0;
        let add_new = |queue: &mut VecDeque<Band>, y0: u32, y1: u32| {
            let rows = Region { y0, y1, ..region };
            let new_bands = bands(rows, split, largest_film).map(|region| Band::new(region, State::New));
            queue.extend(new_bands);
        };
        for piece in store.pieces() {
            if piece.film.pixels() > largest_film && !piece.reached.pass.is_empty() {
                continue; // from another backend, which supports larger films
            }
            add_new(&mut queue, y, piece.region.y0);
            y = piece.region.y1;
            queue.push_back(Band::new(piece.region, State::Stored(piece)));
        }
        add_new(&mut queue, y, region.y1);
        Bands {
            store,
            bands: queue,
            samples,
            joint_rendering_ended: None,
            pass_end: None,
            pass_ends: PassEnds::After(PASS_DURATION),
            keeps_last_pass: false,
            steps: Steps::new(split, DISPATCH_DURATION, order),
            finished_samples: 0.0,
            requested_rays: 0.0,
            total_samples: region.pixels() as f64 * f64::from(samples),
            last_checkpoint: (Instant::now(), Duration::ZERO),
            rendered_samples: 0.0,
        }
    }

    /// Renders all bands together, with all films in memory: every pixel gets a few samples before any pixel gets more.
    ///
    /// # Errors
    ///
    /// [`RenderError::Memory`] if the films do not fit.
    pub fn as_a_whole(mut self, film_layout: FilmLayout) -> Result<Bands<S>, RenderError> {
        check_memory(self.pixels().saturating_mul(film_layout.bytes() as u64))?;
        self.joint_rendering_ended = Some(false);
        Ok(self)
    }

    /// Like [`Bands::as_a_whole`], for [`Bands::next_pass`]: also keeps the films of the last complete pass.
    ///
    /// # Errors
    ///
    /// [`RenderError::Memory`] if the films do not fit.
    pub fn in_passes(self, film_layout: FilmLayout) -> Result<Bands<S>, RenderError> {
        check_memory(self.pixels().saturating_mul(2 * film_layout.bytes() as u64))?;
        let mut bands = self.as_a_whole(film_layout)?;
        bands.pass_end = Some(0);
        bands.keeps_last_pass = true;
        Ok(bands)
    }

    /// Like [`Bands::as_a_whole`], for [`Bands::next_pass`] with another rule for the ends of passes.
    ///
    /// # Errors
    ///
    /// [`RenderError::Memory`] if the films do not fit.
    pub fn in_passes_to(self, pass_ends: PassEnds, film_layout: FilmLayout) -> Result<Bands<S>, RenderError> {
        let mut bands = self.as_a_whole(film_layout)?;
        bands.pass_end = Some(0);
        bands.pass_ends = pass_ends;
        Ok(bands)
    }

    /// Adds samples per pixel to a render in passes, even if its previous samples are complete.
    pub fn add_samples(&mut self, count: u32) {
        self.total_samples *= f64::from(self.samples + count) / f64::from(self.samples);
        self.samples += count;
        if self.pass_end.is_some() {
            self.joint_rendering_ended = Some(false);
        }
    }

    /// Returns the requested samples per pixel; with adaptive sampling a maximum.
    pub fn requested_samples(&self) -> u32 {
        self.samples
    }

    /// Passes copies of the films in memory to `output`, from top to bottom, with all samples rendered so far.
    pub fn films(&self, output: &mut dyn FnMut(Film)) {
        for band in &self.bands {
            if let State::InMemory(piece) = &band.state {
                output(piece.film.clone().part(piece.region));
            }
        }
    }

    /// Returns the samples of every pixel; `None` if some pixels have more than others. Requires uniform sampling.
    pub fn uniform_samples(&self) -> Option<u32> {
        let samples = |band: &Band| match band.reached() {
            None => Some(0),
            Some(reached) if reached.next == [band.region.x0, band.region.y0] => Some(reached.pass.start),
            Some(_) => None, // within a pass
        };
        let mut counts = self.bands.iter().map(samples);
        let first = counts.next()??;
        counts.all(|count| count == Some(first)).then_some(first)
    }

    /// Passes the films of all bands to `visit`, from top to bottom. Requires uniform sampling.
    ///
    /// # Errors
    ///
    /// A piece of the store cannot be loaded.
    pub fn visit_films(&mut self, visit: &mut dyn FnMut(&Film)) -> Result<(), RenderError> {
        for band in &mut self.bands {
            if let State::Stored(stored) = &band.state {
                band.state = State::InMemory(self.store.load(stored.number)?);
            }
            if let State::InMemory(piece) = &band.state {
                visit(&piece.film);
            }
        }
        Ok(())
    }

    /// Ends a render in passes after a complete pass: [`Bands::render_next`] returns the bands with the samples so far.
    /// Stores the bands.
    pub fn end_passes(&mut self) {
        let samples = self.completed_samples();
        self.total_samples *= f64::from(samples) / f64::from(self.samples);
        self.samples = samples;
        self.joint_rendering_ended = Some(true);
        self.keep_others(usize::MAX);
        self.store.sync();
    }

    /// Returns the finished fraction of the samples, not counting incomplete passes: 0 to 1.
    pub fn fraction(&self) -> f64 {
        let totals = self.bands.iter().map(|band| band.sample_total(self.samples));
        match self.total_samples > 0.0 {
            true => ((self.finished_samples + totals.sum::<f64>()) / self.total_samples).min(1.0),
            false => 1.0,
        }
    }

    fn pixels(&self) -> u64 {
        self.bands.iter().map(|band| band.region.pixels()).sum()
    }

    /// Renders and returns the next band; `None` after the last band. After an error, the next call resumes the band
    /// from its last checkpoint, possibly on another backend. Calls `on_progress` after each copy of a film from the
    /// backend.
    ///
    /// # Errors
    ///
    /// Errors of the backend and of `watch`. [`RenderError::Cancelled`] if `watch` cancels; the band is stored first.
    pub fn render_next(
        &mut self,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        on_progress: &mut dyn FnMut(),
    ) -> Result<Option<FinishedBand>, RenderError> {
        if self.joint_rendering_ended == Some(false) {
            self.render_together(backend, watch, on_progress)?;
            self.joint_rendering_ended = Some(true);
        }
        if self.bands.is_empty() {
            return Ok(None);
        }
        if self.joint_rendering_ended.is_none() {
            self.make_first_small(backend);
            self.render_band(0, self.samples, backend, watch, on_progress)?;
        }
        let Some(band) = self.bands.pop_front() else {
            return Ok(None);
        };
        self.finished_samples += band.region.pixels() as f64 * f64::from(self.samples);
        let piece = match band.state {
            State::InMemory(piece) => piece,
            State::Stored(stored) => self.store.load(stored.number)?,
            State::New => return Err(RenderError::NoFilm), // not possible: `render_band` has created a piece
        };
        self.requested_rays += piece.requested_rays() as f64;
        Ok(Some(FinishedBand::of(piece)))
    }

    /// Renders another pass over all bands, adding one or more samples per pixel. Returns the number of samples of
    /// every pixel; `None` if all samples are complete or the time is up, after which [`Bands::render_next`] returns
    /// the bands. After an error the pass can be continued, and [`Bands::output_last_pass`] returns the previous pass.
    ///
    /// # Errors
    ///
    /// The errors of [`Bands::render_next`].
    pub fn next_pass(
        &mut self,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        on_progress: &mut dyn FnMut(),
    ) -> Result<Option<u32>, RenderError> {
        let samples = self.completed_samples();
        if self.pass_end.is_none() || self.joint_rendering_ended != Some(false) || samples >= self.samples {
            return Ok(None);
        }
        let end = match self.pass_end {
            Some(end) if end > samples => end, // continues a pass that failed
            _ => self.end_of_pass(samples),
        };
        self.pass_end = Some(end);
        if self.render_all(end, backend, watch, on_progress)? == Outcome::TimeIsUp {
            self.joint_rendering_ended = Some(true);
        }
        for band in &mut self.bands {
            band.last_pass = None;
        }
        Ok((self.joint_rendering_ended == Some(false)).then(|| self.completed_samples()))
    }

    /// Returns the samples per pixel that were requested up to the end of the last complete pass. With adaptive sampling,
    /// pixels may have fewer.
    pub fn completed_samples(&self) -> u32 {
        let samples = |band: &Band| match &band.last_pass {
            Some(piece) => piece.reached.pass.start,
            None => band.samples(self.samples),
        };
        self.bands.iter().map(samples).min().unwrap_or(self.samples)
    }

    /// Calls `output` with a copy of each band, from top to bottom, in its state after the last complete pass.
    ///
    /// # Errors
    ///
    /// Errors of `output`, and of a store that cannot load a piece.
    pub fn output_last_pass(
        &mut self,
        output: &mut dyn FnMut(FinishedBand) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        for band in &self.bands {
            let piece = match (&band.last_pass, &band.state) {
                (Some(piece), _) | (None, State::InMemory(piece)) => piece.clone(),
                (None, State::Stored(stored)) => self.store.load(stored.number)?,
                (None, State::New) => return Err(RenderError::NoFilm),
            };
            output(FinishedBand::of(piece))?;
        }
        Ok(())
    }

    /// Returns the samples per pixel at the end of a pass that starts with `samples`. A pass is long enough to amortize
    /// the copies of films.
    fn end_of_pass(&self, samples: u32) -> u32 {
        let end = match (self.pass_ends, self.bands.len()) {
            (PassEnds::At(end), _) => end(samples),
            (PassEnds::After(duration), 1) => {
                let speed = self.steps.speed().unwrap_or(0.0);
                timed_end(samples, (speed * duration.as_secs_f64() / self.pixels() as f64) as u32)
            }
            (PassEnds::After(_), _) => timed_end(samples, samples / 4),
        };
        end.min(self.samples)
    }

    /// Returns the fraction of the samples of finished bands that were rendered, not loaded: 0 to 1.
    pub fn fraction_rendered(&self) -> f64 {
        if self.requested_rays > 0.0 {
            (self.rendered_samples / self.requested_rays).min(1.0)
        } else {
            0.0
        }
    }

    fn render_together(
        &mut self,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        on_progress: &mut dyn FnMut(),
    ) -> Result<(), RenderError> {
        let mut target = match self.bands.len() {
            1 => self.samples,
            _ => 1,
        };
        loop {
            if self.render_all(target, backend, watch, on_progress)? == Outcome::TimeIsUp || target >= self.samples {
                return Ok(());
            }
            // Each round copies all films. Later rounds therefore add a quarter of the samples rendered so far.
            target = (target + (target / 4).max(1)).min(self.samples);
        }
    }

    /// Renders until all pixels have `target` samples, or the time is up.
    fn render_all(
        &mut self,
        target: u32,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        on_progress: &mut dyn FnMut(),
    ) -> Result<Outcome, RenderError> {
        for i in 0..self.bands.len() {
            let is_in_memory = matches!(self.bands[i].state, State::InMemory(_));
            if is_in_memory && self.bands[i].samples(self.samples) >= target {
                continue;
            }
            if self.render_band(i, target, backend, watch, on_progress)? == Outcome::TimeIsUp {
                return Ok(Outcome::TimeIsUp);
            }
        }
        Ok(Outcome::Done)
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
        let min_rows = MIN_ROWS[usize::from(backend.unskippable_samples() < self.samples)];
        let samples_per_row = f64::from(region.width()) * f64::from(self.samples);
        let samples_per_piece = self.steps.speed().unwrap_or(0.0) * self.store.interval().as_secs_f64();
        let rows = ((samples_per_piece / samples_per_row) as u32).max(min_rows);
        if rows < region.height() {
            let (first_row, remainder) = (
                region.y0,
                Region {
                    y0: region.y0 + rows,
                    ..*region
                },
            );
            region.y1 = first_row + rows;
            self.bands.insert(1, Band::new(remainder, State::New));
        }
    }

    fn render_band(
        &mut self,
        i: usize,
        target: u32,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        on_progress: &mut dyn FnMut(),
    ) -> Result<Outcome, RenderError> {
        let result = self.try_render_band(i, target, backend, watch, on_progress);
        if result.is_err() {
            self.steps.failed();
        }
        result
    }

    fn try_render_band(
        &mut self,
        i: usize,
        target: u32,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        on_progress: &mut dyn FnMut(),
    ) -> Result<Outcome, RenderError> {
        if let State::Stored(stored) = &self.bands[i].state {
            let piece = self.store.load(stored.number)?;
            self.bands[i].state = State::InMemory(piece);
        }
        let region = self.bands[i].region;
        if self.bands[i].samples(self.samples) >= target {
            return Ok(Outcome::Done);
        }
        match &self.bands[i].state {
            State::InMemory(piece) => {
                self.steps.resume(backend, region, self.samples, &piece.reached);
                backend.resume(piece.film.clone())?;
            }
            _ => {
                self.steps.start(backend, region, self.samples);
                backend.begin(self.steps.film())?;
            }
        }
        self.steps.stop_at(target);
        let others_have_samples = (0..self.bands.len()).all(|k| k == i || self.bands[k].samples(self.samples) > 0);
        let complete_passes = self.bands.iter().map(|band| band.sample_total(self.samples));
        let mut finished_samples = self.finished_samples + complete_passes.sum::<f64>();
        while let Some(samples) = self.steps.step(backend)? {
            finished_samples += samples;
            self.rendered_samples += samples;
            let end = match watch(backend, region, finished_samples / self.total_samples)? {
                Flow::Cancel => Some(Err(RenderError::Cancelled)),
                Flow::TimeIsUp
                    if self.joint_rendering_ended.is_some() && others_have_samples && self.steps.samples() > 0 =>
                {
                    Some(Ok(Outcome::TimeIsUp))
                }
                Flow::Continue | Flow::TimeIsUp => None,
            };
            if end.is_some() || self.is_checkpoint_due() {
                self.copy_band(i, backend, end.is_some())?;
                on_progress();
            }
            if let Some(end) = end {
                return end;
            }
        }
        self.copy_band(i, backend, false)?;
        on_progress();
        Ok(Outcome::Done)
    }

    fn is_checkpoint_due(&self) -> bool {
        // Limits checkpoints to a tenth of the time.
        let (time, duration) = self.last_checkpoint;
        time.elapsed() >= self.store.interval().max(9 * duration)
    }

    /// Copies a band from the backend, and stores it if it is complete or a checkpoint is due.
    fn copy_band(&mut self, i: usize, backend: &mut dyn Backend, is_stopped: bool) -> Result<(), RenderError> {
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
        let is_due = is_stopped || self.is_checkpoint_due();
        if is_finished || is_due {
            self.store.keep(&piece);
        }
        let band = &mut self.bands[i];
        let previous = std::mem::replace(&mut band.state, State::InMemory(piece));
        if let (State::InMemory(previous), true) = (previous, self.keeps_last_pass) {
            band.last_pass.get_or_insert(previous);
        }
        if is_due {
            if self.joint_rendering_ended.is_some() {
                self.keep_others(i);
            }
            self.store.sync();
            self.last_checkpoint = (Instant::now(), start.elapsed());
        }
        Ok(())
    }

    /// Stores the bands in memory that have changed, except band `i`, if it exists.
    fn keep_others(&mut self, i: usize) {
        let stored = self.store.pieces();
        for (k, band) in self.bands.iter().enumerate() {
            let State::InMemory(piece) = &band.state else { continue };
            let is_same = |stored: &StoredPiece| stored.region == piece.region && stored.reached == piece.reached;
            if k != i && !stored.iter().any(is_same) {
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
            last_pass: None,
        }
    }

    fn reached(&self) -> Option<&SampleProgress> {
        match &self.state {
            State::New => None,
            State::Stored(stored) => Some(&stored.reached),
            State::InMemory(piece) => Some(&piece.reached),
        }
    }

    fn samples(&self, max: u32) -> u32 {
        self.reached().map_or(0, |reached| reached.pass.start.min(max))
    }

    /// Returns the number of samples over all pixels, not counting an incomplete pass.
    fn sample_total(&self, max: u32) -> f64 {
        self.region.pixels() as f64 * f64::from(self.samples(max))
    }
}

/// Returns the end of a pass of `count` samples, or the next power of two.
fn timed_end(samples: u32, count: u32) -> u32 {
    let power = (samples + 1).next_power_of_two();
    samples.saturating_add(count.max(1)).min(power)
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
