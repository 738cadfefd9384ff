//! Rendering step by step, with an image at any time.

use std::sync::Arc;
use std::time::Duration;

use wgray_render::backend::Backend;
use wgray_render::denoise::denoise;
use wgray_render::job::{Bands, Flow, NoCheckpoint, Order, PassEnds, WorkSplit};
use wgray_render::noise::{Noise, NoiseMeter, is_decision};
use wgray_scene::Problem;
use wgray_trace::film::{Film, FilmLayout};

use crate::cancel::CancelToken;
use crate::error::{Error, RenderError};
use crate::image::Aov;
use crate::picture::Picture;
use crate::render::{ImageSetup, empty, render_span};
use crate::renderer::{FaultHandler, OpenScene, Renderer, warnings};
use wgray_image::Region;

/// Target duration of a step.
const STEP_DURATION: Duration = Duration::from_millis(250);

/// Maximum number of samples per pixel.
pub(crate) const MAX_SAMPLES: u32 = 65_536;

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// Samples remain.
    Running,
    /// All samples are rendered.
    Finished,
    /// The noise is below the limit of [`ProgressiveRender::run_until_noise`].
    Converged,
    /// The token was cancelled. The samples of the incomplete step are kept, and the next step continues it.
    Cancelled,
}

/// A render that is continued step by step; [`Session::start`](crate::Session::start) returns it.
///
/// The final image has the bits of [`Session::render`](crate::Session::render), even if steps were cancelled.
///
/// ```
/// use wgray::{CancelToken, Context, Options, Scene, Session, Status};
///
/// # fn main() -> Result<(), wgray::Error> {
/// # let smaller = wgray::Overrides { size: Some((16, 16)), ..Default::default() };
/// # let scene = Scene::load_with("scenes/turntable.toml", &smaller)?;
/// let cancel = CancelToken::new(); // `cancel.clone().cancel()` on another thread ends the loop
/// let mut session = Session::new(&Context::new(), scene);
/// let mut render = session.start(&Options::default(), &cancel)?;
/// while render.step(&cancel)? == Status::Running {
///     println!("{} samples per pixel", render.samples());
///     let preview = render.snapshot();
///     # assert_eq!(preview.width(), 16);
/// }
/// let image = render.finish();
/// # assert_eq!(image.width(), 16);
/// # Ok(())
/// # }
/// ```
pub struct ProgressiveRender<'s> {
    open: &'s mut OpenScene,
    bands: Bands<NoCheckpoint>,
    setup: ImageSetup,
    film_layout: FilmLayout,
}

impl<'s> ProgressiveRender<'s> {
    pub(crate) fn new(open: &'s mut OpenScene, setup: ImageSetup) -> Result<ProgressiveRender<'s>, Error> {
        let packed = Arc::clone(open.scene());
        let film_layout = packed.film_layout();
        let split = WorkSplit::of(film_layout);
        let largest_film = Renderer::new(open, warnings()).largest_film();
        let bands = Bands::new(
            setup.layout.region,
            packed.sampling.pixel_samples,
            &split,
            Order::Pixels,
            largest_film,
            NoCheckpoint,
        );
        // `snapshot` cannot return an error, so an allocation here tests that the memory for its film exists.
        drop(empty(setup.layout.region, film_layout)?);
        Ok(ProgressiveRender {
            open,
            bands: bands.in_passes_to(PassEnds::After(STEP_DURATION), film_layout)?,
            setup,
            film_layout,
        })
    }

    /// Renders at least one sample of every pixel, and more samples if a step would otherwise take less than about a
    /// quarter of a second.
    ///
    /// # Errors
    ///
    /// The errors of [`render`](crate::render()). The samples of complete steps are kept, and the step can be repeated.
    pub fn step(&mut self, cancel: &CancelToken) -> Result<Status, Error> {
        self.step_while(cancel, &|| true)
    }

    /// Renders a part of a step that takes about this time.
    #[cfg(target_family = "wasm")]
    pub(crate) fn step_for(&mut self, duration: Duration, cancel: &CancelToken) -> Result<Status, Error> {
        let start = wgray_render::clock::Instant::now();
        self.step_while(cancel, &|| start.elapsed() < duration)
    }

    /// Renders a step, or the part of it that is complete when `has_time` returns false. The next call continues it.
    fn step_while(&mut self, cancel: &CancelToken, has_time: &dyn Fn() -> bool) -> Result<Status, Error> {
        if cancel.is_cancelled() {
            return Ok(Status::Cancelled);
        }
        let counter = self.open.progress_counter();
        let on_fault = FaultHandler {
            is_stopped: Box::new(|| cancel.is_cancelled()),
            ..warnings()
        };
        let mut renderer = Renderer::new(self.open, on_fault);
        let _span = render_span(&renderer);
        let mut watch = |_: &mut dyn Backend, _: Region, _: f64| -> Result<Flow, RenderError> {
            Ok((!cancel.is_cancelled() && has_time()).into())
        };
        let bands = &mut self.bands;
        let rendered = renderer.work(|backend, _| bands.next_pass(backend, &mut watch, &mut || counter.increment()));
        match rendered {
            Ok(Some(samples)) if samples < bands.requested_samples() => Ok(Status::Running),
            Ok(_) => Ok(Status::Finished),
            Err(RenderError::Cancelled) if cancel.is_cancelled() => Ok(Status::Cancelled),
            Err(RenderError::Cancelled) => Ok(Status::Running), // out of time
            Err(error) => Err(error.into()),
        }
    }

    /// Renders all remaining samples.
    ///
    /// # Errors
    ///
    /// The errors of [`ProgressiveRender::step`].
    pub fn run(&mut self, cancel: &CancelToken) -> Result<Status, Error> {
        loop {
            match self.step(cancel)? {
                Status::Running => {}
                status => return Ok(status),
            }
        }
    }

    /// Renders until the noise of the image, [`Noise::percentile_95`], is below a limit, or until all samples are
    /// rendered. Decides after 16, 32, 64, ... samples per pixel, so that the image does not depend on timing.
    ///
    /// # Errors
    ///
    /// The errors of [`ProgressiveRender::step`]. [`Options::noise`](crate::Options::noise) is not set, the limit is not
    /// above 0, or the scene uses adaptive sampling, whose pixels have different numbers of samples.
    pub fn run_until_noise(&mut self, limit: f64, cancel: &CancelToken) -> Result<Status, Error> {
        let rule = match self.film_layout {
            FilmLayout { adaptive: true, .. } => "cannot be combined with adaptive sampling",
            FilmLayout { noise: false, .. } => "needs Options::noise",
            _ if limit > 0.0 => "",
            _ => "must be greater than 0",
        };
        if !rule.is_empty() {
            return Err(Error::Option(Problem::of("noise", format!("{limit} {rule}"))));
        }
        let mut status = Status::Running;
        loop {
            let is_decision = self.bands.uniform_samples().is_some_and(is_decision);
            if is_decision && self.noise().is_some_and(|noise| noise.percentile_95 < limit) {
                return Ok(Status::Converged);
            }
            if status != Status::Running {
                return Ok(status);
            }
            status = self.step(cancel)?;
        }
    }

    /// Returns the noise of the image so far, infinite for pixels with fewer than two samples; `None` unless
    /// [`Options::noise`](crate::Options::noise) is set.
    pub fn noise(&self) -> Option<Noise> {
        let mut meter = NoiseMeter::new(self.setup.layout.view.exposure);
        self.bands.films(&mut |film| meter.add(&film));
        meter.complete(self.setup.layout.region.pixels());
        self.film_layout.noise.then(|| meter.noise())
    }

    /// Returns the number of samples that every pixel has. With adaptive sampling, pixels that needed no more samples
    /// have fewer. After a cancellation, some pixels may have more.
    pub fn samples(&self) -> u32 {
        self.bands.completed_samples()
    }

    /// Returns the finished fraction of the samples, 0 to 1.
    pub fn fraction(&self) -> f64 {
        self.bands.fraction()
    }

    /// Requests more samples per pixel than the scene, at any time before or after the scene's samples are finished.
    /// The total is at most 65,536. The image does not depend on when samples are added and in which portions, but
    /// differs slightly from the image of a scene with the larger number: patterns are repeated with another seed, and
    /// textures keep their level of detail.
    ///
    /// # Errors
    ///
    /// The total is too large, or the scene uses adaptive sampling, whose error determines the number of samples.
    pub fn add_samples(&mut self, count: u32) -> Result<(), Error> {
        let total = u64::from(self.bands.requested_samples()) + u64::from(count);
        let rule = match total {
            _ if self.film_layout.adaptive => {
                "cannot be added with adaptive sampling; lower render.adaptive.error instead".to_owned()
            }
            total if total > u64::from(MAX_SAMPLES) => format!("{total} in total must be at most {MAX_SAMPLES}"),
            _ => {
                self.bands.add_samples(count);
                self.setup.layout.max_samples = self.bands.requested_samples();
                return Ok(());
            }
        };
        Err(Error::Option(Problem::of("samples", rule)))
    }

    /// Returns the image with the samples rendered so far. Pixels without samples are black.
    pub fn snapshot(&self) -> Picture {
        let mut film = Film::of(self.setup.layout.region, self.film_layout);
        self.copy_to(&mut film);
        Picture {
            film,
            hits: self.setup.hits.clone(),
            layout: self.setup.layout.clone(),
            device: self.open.info().clone(),
        }
    }

    /// Like [`ProgressiveRender::snapshot`], but reuses the memory of another image of the same size with the same
    /// layers.
    pub fn snapshot_into(&self, picture: &mut Picture) {
        let layout = &self.setup.layout;
        if picture.film.region != layout.region || picture.film.film_layout() != self.film_layout {
            *picture = self.snapshot();
            return;
        }
        for list in picture.film.lists_mut() {
            list.fill(Default::default());
        }
        picture.film.denoised.clear();
        self.copy_to(&mut picture.film);
        picture.hits.clone_from(&self.setup.hits);
        picture.layout.clone_from(layout);
        picture.device.clone_from(self.open.info());
    }

    fn copy_to(&self, film: &mut Film) {
        self.bands.films(&mut |band| film.copy_rows(&band));
        if self.setup.layout.aovs.contains(&Aov::Denoised) {
            film.denoised = denoise(film);
        }
    }

    /// Ends the render, and returns the image with the samples rendered so far.
    pub fn finish(self) -> Picture {
        self.snapshot()
    }
}
