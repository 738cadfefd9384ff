//! The bands of a picture, one after the other, or all of them little by little.

use std::collections::VecDeque;
use std::time::Duration;

use web_time::Instant;

use super::piece::{CheckpointStore, Piece, StoredPiece};
use super::steps::{Order, Reached, Steps};
use super::{CALL, Cut, bands};
use crate::backend::Backend;
use crate::error::RenderError;
use crate::film::{Film, Form};
use wgray_image::Region;
use wgray_image::memory::fallible;

/// What follows a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// The next call.
    GoOn,
    /// Of a picture that grows as a whole, nothing more; of another one, the next call. Every pixel gets a sample all the same.
    TimeIsUp,
    /// Nothing more: the work is cancelled.
    Cancel,
}

impl From<bool> for Flow {
    /// Whether to go on.
    fn from(goes_on: bool) -> Flow {
        if goes_on { Flow::GoOn } else { Flow::Cancel }
    }
}

/// What is told of a band that is being rendered, and of the share of all bands' work that is done, from 0 to 1. Returns
/// what follows.
pub type Watch<'a> = dyn FnMut(&mut dyn Backend, Region, f64) -> Result<Flow, RenderError> + 'a;

/// The bands of a region, rendered from the top at the pace that was learnt so far. What is kept of them is not rendered
/// again.
pub struct Bands<'a> {
    store: &'a mut dyn CheckpointStore,
    bands: VecDeque<Band>,
    samples: u32,
    /// Whether all bands grow together, and whether they have done so.
    whole: Option<bool>,
    /// The samples at the end of the current pass over all bands, if whole passes are kept.
    pass: Option<u32>,
    steps: Steps,
    /// Samples of pixels, in the bands that were handed out and in all.
    done: f64,
    total: f64,
    /// When a piece was kept last, and how long that took.
    kept: (Instant, Duration),
    /// The samples of pixels that were rendered, and not read.
    rendered: f64,
}

/// A band that is handed out.
pub struct Finished {
    /// Its pixels.
    pub film: Film,
    /// The fewest samples of a pixel.
    pub min_samples: u32,
    /// The samples that each pixel was to have by now: under adaptive sampling the maximum of one.
    pub requested_samples: u32,
    /// Rays from the camera that they have got.
    pub camera_rays: u64,
}

impl Finished {
    fn of(piece: Piece) -> Finished {
        let Piece { region, reached, film } = piece;
        let film = film.part(region);
        let Reached { pass, next: [x, y] } = reached;
        let (rows, columns) = (
            u64::from(y.saturating_sub(region.y0)),
            u64::from(x.saturating_sub(region.x0)),
        );
        let ahead = (rows * u64::from(region.width()) + columns).min(region.pixels());
        let (camera_rays, min_samples) = match film.form().adaptive {
            true => (
                film.sample_counts().map(u64::from).sum(),
                film.sample_counts().min().unwrap_or(0),
            ),
            false => (
                region.pixels() * u64::from(pass.start) + ahead * pass.len() as u64,
                pass.start,
            ),
        };
        Finished {
            film,
            min_samples,
            requested_samples: pass.start,
            camera_rays,
        }
    }
}

/// Some rows, and how far they are.
struct Band {
    region: Region,
    state: State,
    /// The piece after the last whole pass over all bands, if the current pass has changed it.
    passed: Option<Piece>,
}

enum State {
    /// Nothing is rendered.
    New,
    /// The store has what is rendered.
    Stored(StoredPiece),
    /// This is rendered.
    Here(Piece),
}

/// Why the work on a band ended.
#[derive(PartialEq, Eq)]
enum End {
    Done,
    TimeIsUp,
}

/// Duration of a pass over a film on the device. After it the film is copied.
const PASS: Duration = Duration::from_secs(1);

/// The fewest rows of a band that is made small: under adaptive sampling each has two more for its neighbours.
const LEAST_ROWS: [u32; 2] = [16, 64];

impl<'a> Bands<'a> {
    /// The bands of a region, as far as a store has them. A region without pixels has none. The store's pieces lie in the region.
    pub fn new(
        region: Region,
        samples: u32,
        cut: &Cut,
        order: Order,
        largest_film: u64,
        store: &'a mut dyn CheckpointStore,
    ) -> Bands<'a> {
        let mut all = VecDeque::new();
        let mut y = region.y0;
        let add_new = |all: &mut VecDeque<Band>, y0: u32, y1: u32| {
            let rows = Region { y0, y1, ..region };
            let new = bands(rows, cut, largest_film).map(|region| Band::new(region, State::New));
            all.extend(new);
        };
        for piece in store.pieces() {
            if piece.film.pixels() > largest_film && !piece.reached.pass.is_empty() {
                continue; // another backend had room for it
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
            steps: Steps::new(cut, CALL, order),
            done: 0.0,
            total: region.pixels() as f64 * f64::from(samples),
            kept: (Instant::now(), Duration::ZERO),
            rendered: 0.0,
        }
    }

    /// The same bands, but all pixels of all of them get a few samples before any gets more. They are in memory together, in
    /// films of this form.
    ///
    /// # Errors
    ///
    /// [`RenderError::Memory`] where there is no room for them.
    pub fn as_a_whole(mut self, form: Form) -> Result<Bands<'a>, RenderError> {
        there_is_memory(self.pixels().saturating_mul(form.bytes() as u64))?;
        self.whole = Some(false);
        Ok(self)
    }

    /// Like [`Bands::as_a_whole`], for [`Bands::next_pass`]: the films of the last whole pass are kept while the next pass is
    /// rendered.
    ///
    /// # Errors
    ///
    /// [`RenderError::Memory`] if the films do not fit.
    pub fn in_passes(self, form: Form) -> Result<Bands<'a>, RenderError> {
        there_is_memory(self.pixels().saturating_mul(2 * form.bytes() as u64))?;
        let mut bands = self.as_a_whole(form)?;
        bands.pass = Some(0);
        Ok(bands)
    }

    fn pixels(&self) -> u64 {
        self.bands.iter().map(|band| band.region.pixels()).sum()
    }

    /// Renders the next band and hands it out; `None` once all are. After an error it is the same band again, from where it was
    /// kept last, which another backend may render. `made` is told whenever the work has come further for good.
    ///
    /// # Errors
    ///
    /// The errors of the backend and of `watch`, and [`RenderError::Cancelled`] if `watch` says not to go on; the band is
    /// kept then.
    pub fn render_next(
        &mut self,
        backend: &mut dyn Backend,
        watch: &mut Watch,
        made: &mut dyn FnMut(),
    ) -> Result<Option<Finished>, RenderError> {
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
            State::Here(piece) => Ok(Some(Finished::of(piece))),
            State::Stored(kept) => Ok(Some(Finished::of(self.store.load(kept.number)?))),
            State::New => Err(RenderError::NoFilm), // the work has made a piece of it
        }
    }

    /// Renders one more pass over all bands, of one or several samples per pixel, and returns how many samples every pixel
    /// has. Returns `None` once they have all samples or the time is up; then [`Bands::render_next`] hands the bands out.
    /// After an error the pass can be continued, and [`Bands::last_pass`] has the pass before it.
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

    /// Returns the samples that every pixel had after the last whole pass, 0 if there was none.
    pub fn passed_samples(&self) -> u32 {
        let samples = |band: &Band| match &band.passed {
            Some(piece) => piece.reached.pass.start,
            None => band.samples(self.samples),
        };
        self.bands.iter().map(samples).min().unwrap_or(self.samples)
    }

    /// Hands out copies of all bands after the last whole pass, from the top.
    ///
    /// # Errors
    ///
    /// The errors of `output`, and of a store that cannot load a piece.
    pub fn last_pass(
        &mut self,
        output: &mut dyn FnMut(Finished) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        for band in &self.bands {
            let piece = match (&band.passed, &band.state) {
                (Some(piece), _) | (None, State::Here(piece)) => piece.clone(),
                (None, State::Stored(kept)) => self.store.load(kept.number)?,
                (None, State::New) => return Err(RenderError::NoFilm),
            };
            output(Finished::of(piece))?;
        }
        Ok(())
    }

    /// Returns the samples at the end of the pass that follows `have` samples. A pass is long enough to make the cost of copying
    /// films small. Every power of two is the end of a pass.
    fn end_of_pass(&self, have: u32) -> u32 {
        let count = match self.bands.len() {
            1 => (self.steps.speed().unwrap_or(0.0) * PASS.as_secs_f64() / self.pixels() as f64) as u32,
            _ => have / 4,
        };
        let power = (have + 1).next_power_of_two();
        have.saturating_add(count.max(1)).min(power).min(self.samples)
    }

    /// The share of the samples of all bands handed out that were rendered, and not found where they were kept: 0 to 1.
    pub fn fraction_rendered(&self) -> f64 {
        if self.done > 0.0 {
            (self.rendered / self.done).min(1.0)
        } else {
            0.0
        }
    }

    /// Gives all bands their samples, some at a time, until they have them or the time is up.
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
            // The films are copied to and fro for every round: a fourth more, when there are many.
            until = (until + (until / 4).max(1)).min(self.samples);
        }
    }

    /// Renders all bands until their pixels have so many samples, or the time is up.
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

    /// Cuts the first band so that it takes about as long as a piece should.
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
        let least = LEAST_ROWS[usize::from(backend.samples_of_all() < self.samples)];
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

    /// Renders a band until all of its pixels have so many samples.
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
                self.steps.go_on(backend, region, self.samples, &piece.reached);
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
                Flow::GoOn | Flow::TimeIsUp => None,
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
        // Keeping should take no more than a tenth of the time.
        let (last, took) = self.kept;
        last.elapsed() >= self.store.interval().max(9 * took)
    }

    /// Takes what the backend has of a band, and keeps it where it is finished, or it is time to.
    fn take(&mut self, i: usize, backend: &mut dyn Backend, at_the_end: bool) -> Result<(), RenderError> {
        let start = Instant::now();
        let region = self.bands[i].region;
        let reached = self.steps.reached().clone();
        let is_finished = reached.pass.start >= self.samples;
        let film = backend.film()?;
        let piece = Piece {
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

    /// Keeps the other bands of a picture that grows as a whole, as far as they have grown since they were kept.
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

    fn reached(&self) -> Option<&Reached> {
        match &self.state {
            State::New => None,
            State::Stored(kept) => Some(&kept.reached),
            State::Here(piece) => Some(&piece.reached),
        }
    }

    /// The samples that all of its pixels have, of so many.
    fn samples(&self, all: u32) -> u32 {
        self.reached().map_or(0, |reached| reached.pass.start.min(all))
    }

    /// The samples of its pixels, of so many each; those of a pass that is under way do not count.
    fn work(&self, all: u32) -> f64 {
        self.region.pixels() as f64 * f64::from(self.samples(all))
    }
}

/// Checks that so many bytes can be allocated, by an allocation that is freed at once: a failure is an error here, and would
/// end the program later.
///
/// # Errors
///
/// [`RenderError::Memory`] if not.
pub fn there_is_memory(bytes: u64) -> Result<(), RenderError> {
    match usize::try_from(bytes).is_ok_and(|bytes| fallible(|| Vec::<u8>::new().try_reserve_exact(bytes)).is_ok()) {
        true => Ok(()),
        false => Err(RenderError::Memory(bytes)),
    }
}
