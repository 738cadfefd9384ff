//! The schedule of work, above both backends: bands that fit memory, dispatches that end in time, progress and
//! cancelling. Sums go on from the film's own values, so that every cut gives the same picture.

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::backend::Backend;
use crate::error::RenderError;
use crate::film::{Film, Form, Region};
use crate::pack::FirstHit;

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
    /// Bands of 64 MiB, of 192 MiB under adaptive sampling.
    fn default() -> Cut {
        Cut {
            band_pixels: 4 << 20,
            samples_per_call: None,
            rows_per_call: None,
        }
    }
}

impl Cut {
    /// [`Cut::default`], and with layers so few pixels that a band is no larger than one under adaptive sampling.
    pub fn of(form: Form) -> Cut {
        const LISTS: u64 = 3;
        let cut = Cut::default();
        Cut {
            band_pixels: cut.band_pixels * LISTS / LISTS.max(form.lists() as u64),
            ..cut
        }
    }
}

/// The bands that a region is rendered in, from the top: whole rows, as many as a film has room for. A region without
/// pixels has none.
pub fn bands(region: Region, cut: &Cut, largest_film: u64) -> impl Iterator<Item = Region> + use<> {
    let [width, height] = [region.width(), region.height()].map(|n| u64::from(n.max(1)));
    let rows = (cut.band_pixels.min(largest_film) / width).clamp(1, height) as u32;
    let end = if region.is_empty() { region.y0 } else { region.y1 };
    (region.y0..end).step_by(rows as usize).map(move |y0| Region {
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
    let mut bands = Bands::new(region, samples, cut, Order::Rows, backend.largest_film());
    while let Some(film) = bands.render_next(backend, &mut |_, _, share| Ok(progress(share)))? {
        output(film)?;
    }
    Ok(())
}

/// What is told of a band that is being rendered, and of the share of all bands' work that is done, from 0 to 1. Returns
/// whether to go on.
pub type Watch<'a> = dyn FnMut(&mut dyn Backend, Region, f64) -> Result<bool, RenderError> + 'a;

/// The bands of a region, rendered one after the other from the top, at the pace that was learnt so far.
pub struct Bands {
    bands: std::vec::IntoIter<Region>,
    samples: u32,
    steps: Steps,
    /// Samples of pixels, in the bands that are finished and in all.
    done: f64,
    total: f64,
}

impl Bands {
    /// The bands of a region, none of them rendered yet. A region without pixels has none.
    pub fn new(region: Region, samples: u32, cut: &Cut, order: Order, largest_film: u64) -> Bands {
        let all: Vec<Region> = bands(region, cut, largest_film).collect();
        Bands {
            bands: all.into_iter(),
            samples,
            steps: Steps::new(cut, CALL, order),
            done: 0.0,
            total: region.pixels() as f64 * f64::from(samples),
        }
    }

    /// Renders the next band; `None` once all are rendered. After an error it is the same band again, which another backend
    /// may render.
    ///
    /// # Errors
    ///
    /// The errors of the backend and of `watch`, and [`RenderError::Cancelled`] if `watch` says not to go on.
    pub fn render_next(&mut self, backend: &mut dyn Backend, watch: &mut Watch) -> Result<Option<Film>, RenderError> {
        let Some(&band) = self.bands.as_slice().first() else {
            return Ok(None);
        };
        let film = self.render_band(band, backend, watch);
        match &film {
            Ok(_) => {
                self.bands.next();
                self.done += band.pixels() as f64 * f64::from(self.samples);
            }
            Err(_) => self.steps.forget_pace(), // another backend may be slower
        }
        film.map(Some)
    }

    fn render_band(&mut self, band: Region, backend: &mut dyn Backend, watch: &mut Watch) -> Result<Film, RenderError> {
        self.steps.start(backend, band, self.samples);
        backend.begin(self.steps.film)?;
        let mut done = self.done;
        while let Some(work) = self.steps.step(backend)? {
            done += work;
            if !watch(backend, band, done / self.total)? {
                return Err(RenderError::Cancelled);
            }
        }
        Ok(backend.film()?.part(band))
    }
}

/// What comes first in a film. The picture is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// A row's samples, as many as fit a call of a few rows: a kernel that adds more samples at once is faster.
    Rows,
    /// All pixels: each gets a few samples before any gets more, for a picture that is looked at meanwhile.
    Pixels,
}

/// The fewest rows of a call where a pixel's samples come first: two rows of workgroups on a GPU.
const ROWS: u32 = 16;

/// The calls that render a film, one after the other.
#[derive(Clone, Debug)]
pub struct Steps {
    cut: Cut,
    order: Order,
    pace: Pace,
    region: Region,
    /// The region, and the pixels around it that get the samples of all.
    film: Region,
    samples: u32,
    /// How many samples all pixels get.
    of_all: u32,
    /// The samples that are being added.
    pass: Range<u32>,
    /// The first row that does not have them.
    y: u32,
    /// The call that is under way.
    call: Option<Call>,
}

/// A call that was submitted.
#[derive(Clone, Copy, Debug)]
struct Call {
    tile: Region,
    samples: u32,
    start: Instant,
}

impl Steps {
    /// No work yet. A call aims to take `call`.
    pub fn new(cut: &Cut, call: Duration, order: Order) -> Steps {
        Steps {
            cut: *cut,
            order,
            pace: Pace {
                call,
                speed: None,
                speed_of_all: 0.0,
            },
            region: Region::whole(0, 0),
            film: Region::whole(0, 0),
            samples: 0,
            of_all: 0,
            pass: 0..0,
            y: 0,
            call: None,
        }
    }

    /// Starts a film of a region, at the pace learnt so far.
    pub fn start(&mut self, backend: &dyn Backend, region: Region, samples: u32) {
        self.region = region;
        self.samples = samples;
        self.of_all = backend.samples_of_all().min(samples);
        self.film = if self.of_all < samples {
            backend.around(region)
        } else {
            region
        };
        self.call = None;
        self.pace.start_film();
        self.begin_pass(0);
    }

    /// Forgets the pace: other work comes.
    pub fn forget_pace(&mut self) {
        self.pace.speed = None;
    }

    /// Makes the next call, and returns how many samples of pixels it was; `None` once the film has them all.
    pub fn step(&mut self, backend: &mut dyn Backend) -> Result<Option<f64>, RenderError> {
        if !self.submit(backend)? {
            return Ok(None);
        }
        backend.wait()?;
        Ok(self.end_call())
    }

    /// Submits the next call and does not wait for it; [`Steps::poll`] tells when it has ended. Returns whether there is one.
    pub fn submit(&mut self, backend: &mut dyn Backend) -> Result<bool, RenderError> {
        if self.is_done() {
            return Ok(false);
        }
        let samples = self.pass.len() as u32;
        let region = self.region_of_pass();
        let rows = (self.cut.rows_per_call).unwrap_or_else(|| self.pace.rows(region, samples));
        let tile = Region {
            y0: self.y,
            y1: self.y + rows.min(region.y1 - self.y),
            ..region
        };
        let start = Instant::now();
        backend.submit(tile, self.pass.clone())?;
        self.call = Some(Call { tile, samples, start });
        Ok(true)
    }

    /// How many samples of pixels the submitted call was, if it has ended; `None` if it has not, or if there is none.
    pub fn poll(&mut self, backend: &mut dyn Backend) -> Result<Option<f64>, RenderError> {
        Ok(if backend.poll()? { self.end_call() } else { None })
    }

    fn end_call(&mut self) -> Option<f64> {
        let Call { tile, samples, start } = self.call.take()?;
        let work = tile.pixels() as f64 * f64::from(samples);
        self.pace.took(work, start.elapsed(), self.pass.end <= self.of_all);
        self.y = tile.y1;
        if self.y >= self.region_of_pass().y1 {
            self.begin_pass(self.pass.end);
        }
        Some(tile.within(self.region).pixels() as f64 * f64::from(samples))
    }

    /// The pixels that the pass is for.
    fn region_of_pass(&self) -> Region {
        if self.pass.start < self.of_all {
            self.film
        } else {
            self.region
        }
    }

    /// Whether every pixel has all its samples.
    pub fn is_done(&self) -> bool {
        self.pass.is_empty()
    }

    /// The samples that every pixel has.
    pub fn samples(&self) -> u32 {
        self.pass.start
    }

    /// The samples that the pixels of a row have.
    pub fn samples_of_row(&self, y: u32) -> u32 {
        if y < self.y { self.pass.end } else { self.pass.start }
    }

    /// Samples of pixels per second, once a call has been made.
    pub fn speed(&self) -> Option<f64> {
        self.pace.speed
    }

    fn begin_pass(&mut self, first: u32) {
        let rows = match self.order {
            Order::Rows => self.region.height().min(ROWS),
            Order::Pixels => self.region.height(),
        };
        let count = self
            .cut
            .samples_per_call
            .unwrap_or_else(|| self.pace.samples(self.region, rows));
        let end = if first < self.of_all { self.of_all } else { self.samples };
        self.pass = first..first + count.min(end - first);
        self.y = self.region_of_pass().y0;
    }
}

/// How fast work goes, learnt from the calls so far.
#[derive(Clone, Debug)]
struct Pace {
    /// How long a call should take.
    call: Duration,
    /// Samples of pixels per second.
    speed: Option<f64>,
    /// Samples of pixels per second, where no pixel leaves samples out.
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

    /// No pixel of a new film leaves samples out at first.
    fn start_film(&mut self) {
        self.speed = self.speed.map(|speed| speed.min(self.speed_of_all));
    }

    /// Pixel samples that fit a call.
    fn work(&self) -> f64 {
        self.speed
            .map_or(Self::FIRST_CALL, |speed| speed * self.call.as_secs_f64())
    }

    fn samples(&self, band: Region, rows: u32) -> u32 {
        (self.work() / (f64::from(band.width()) * f64::from(rows))).max(1.0) as u32
    }

    fn rows(&self, band: Region, samples: u32) -> u32 {
        (self.work() / (f64::from(band.width()) * f64::from(samples))).max(1.0) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Notes what it is asked for.
    struct Notes(Vec<(Region, Range<u32>)>);

    impl Backend for Notes {
        fn begin(&mut self, _: Region) -> Result<(), RenderError> {
            Ok(())
        }

        fn resume(&mut self, _: Film) -> Result<(), RenderError> {
            Ok(())
        }

        fn poll(&mut self) -> Result<bool, RenderError> {
            Ok(true)
        }

        fn wait(&mut self) -> Result<(), RenderError> {
            Ok(())
        }

        fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
            self.0.push((tile, samples));
            Ok(())
        }

        fn film(&mut self) -> Result<Film, RenderError> {
            Err(RenderError::Cancelled)
        }

        fn first_hits(&mut self, _: Region) -> Result<Vec<FirstHit>, RenderError> {
            Ok(Vec::new())
        }

        fn largest_film(&self) -> u64 {
            u64::MAX
        }

        fn samples_of_all(&self) -> u32 {
            u32::MAX
        }

        fn around(&self, region: Region) -> Region {
            region
        }
    }

    #[test]
    fn rows_get_all_samples_first_or_all_pixels_some() {
        for (order, first) in [(Order::Rows, 0..16), (Order::Pixels, 0..4)] {
            let (mut notes, region) = (Notes(Vec::new()), Region::whole(64, 64));
            let mut steps = Steps::new(&Cut::default(), CALL, order);
            steps.start(&notes, region, 16);
            while steps.step(&mut notes).unwrap().is_some() {}
            assert_eq!(notes.0[0].1, first, "{order:?}");
            // every sample of every pixel once, those of a pixel in their order
            let mut samples = [0; 64];
            for (tile, range) in notes.0 {
                assert_eq!((tile.x0, tile.x1), (0, 64));
                for done in &mut samples[tile.y0 as usize..tile.y1 as usize] {
                    assert_eq!(*done, range.start);
                    *done = range.end;
                }
            }
            assert_eq!(samples, [16; 64], "{order:?}");
        }
    }

    /// Notes what it is asked for; four samples of a pixel decide on those of its neighbours.
    #[derive(Default)]
    struct Looks {
        film: Option<Region>,
        calls: Vec<(Region, Range<u32>)>,
    }

    impl Backend for Looks {
        fn begin(&mut self, region: Region) -> Result<(), RenderError> {
            self.film = Some(region);
            Ok(())
        }

        fn resume(&mut self, _: Film) -> Result<(), RenderError> {
            Ok(())
        }

        fn poll(&mut self) -> Result<bool, RenderError> {
            Ok(true)
        }

        fn wait(&mut self) -> Result<(), RenderError> {
            Ok(())
        }

        fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
            self.calls.push((tile, samples));
            Ok(())
        }

        fn film(&mut self) -> Result<Film, RenderError> {
            self.film.map(Film::adaptive).ok_or(RenderError::Cancelled)
        }

        fn first_hits(&mut self, _: Region) -> Result<Vec<FirstHit>, RenderError> {
            Ok(Vec::new())
        }

        fn largest_film(&self) -> u64 {
            u64::MAX
        }

        fn samples_of_all(&self) -> u32 {
            4
        }

        fn around(&self, region: Region) -> Region {
            region.with_neighbors().within(Region::whole(64, 64))
        }
    }

    #[test]
    fn a_region_and_its_neighbours_get_first_looks_before_any_pixel_gets_more() {
        let (region, film) = (
            Region {
                x0: 5,
                y0: 10,
                x1: 64,
                y1: 64,
            },
            Region {
                x0: 4,
                y0: 9,
                x1: 64,
                y1: 64,
            },
        );
        for samples_per_call in [None, Some(3)] {
            let cut = Cut {
                samples_per_call,
                ..Cut::default()
            };
            let (mut backend, mut done, mut outputs) = (Looks::default(), 0.0, Vec::new());
            let mut progress = |share| {
                done = share;
                true
            };
            let mut output = |film: Film| {
                outputs.push((film.region, film.sums.len(), film.moments.len()));
                Ok(())
            };
            render(&mut backend, region, 16, &cut, &mut progress, &mut output).unwrap();
            assert_eq!((backend.film, outputs.len()), (Some(film), 1));
            assert_eq!(outputs[0], (region, region.pixels() as usize, region.pixels() as usize));
            let further = backend
                .calls
                .iter()
                .position(|(_, samples)| samples.start >= 4)
                .unwrap();
            let work = |calls: &[(Region, Range<u32>)], part: Region, samples: Range<u32>| {
                for (tile, range) in calls {
                    assert_eq!((tile.x0, tile.x1), (part.x0, part.x1));
                    assert!(range.start >= samples.start && range.end <= samples.end);
                    assert_eq!(*tile, tile.within(part));
                }
                let pixels = calls.iter().map(|(tile, range)| tile.pixels() * range.len() as u64);
                assert_eq!(pixels.sum::<u64>(), part.pixels() * samples.len() as u64);
            };
            work(&backend.calls[..further], film, 0..4);
            work(&backend.calls[further..], region, 4..16);
            assert!((done - 1.0).abs() < 1e-12, "{done}");
        }
    }
}
