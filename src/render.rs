//! Rendering of a scene to an image in memory.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::context::Context;
use crate::device::DeviceInfo;
use crate::device_cost::Workload;
use crate::error::{Error, RenderError};
use crate::image::{Aov, AovSource, Layout};
use crate::options::Options;
use crate::picture::Picture;
use crate::renderer::{OpenScene, Renderer, warnings};
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::denoise::{self, denoise};
use wgray_render::job::{self, Bands, Flow, NoCheckpoint, Order, WorkSplit};
use wgray_scene::Scene;
use wgray_trace::film::{Film, FilmLayout};
use wgray_trace::records::{FirstHit, Packed};

/// Renders a scene. The image takes 16 bytes of memory per pixel, 80 more if it has alpha or layers that are averaged
/// over samples, 32 or 64 more with noise estimates, without or with such layers, and 64 more with layers of first hits,
/// such as depth. The denoiser temporarily takes 144 more.
///
/// With [`Device::Auto`](crate::Device::Auto), the CPU renders if no adapter exists, if the CPU is faster than the
/// adapter for this scene, or if the scene or image does not fit into the adapter's memory. With any device, the CPU
/// renders if the driver truncates long loops and a single sample exceeds the limit. After a device is lost, a
/// few attempts are made to re-open it. Then the render resumes from its finished samples; if re-opening fails,
/// [`Device::Auto`](crate::Device::Auto) resumes on the CPU. `tracing` warnings report the reason, and
/// [`Picture::device`] returns the device that rendered last.
///
/// wgpu panics at some device losses. Such a panic is caught, but panic hooks observe it, and `panic = "abort"` aborts
/// the program. Mesa's drivers print a line on standard error if the environment has no `XDG_RUNTIME_DIR`.
///
/// # Errors
///
/// The options do not fit the scene, the device does not exist, or its driver reports an error.
pub fn render(scene: &Scene, options: &Options) -> Result<Picture, Error> {
    let mut open = open(scene, options)?;
    render_with(Renderer::new(&mut open, warnings()), scene, options)
}

/// Opens a device for a single render.
fn open(scene: &Scene, options: &Options) -> Result<OpenScene, Error> {
    options.region(scene).map_err(Error::Option)?;
    let packed = Arc::new(options.pack(scene));
    let workload = Workload::new(&packed, options, 1);
    OpenScene::new(&Context::new(), packed, options, workload, &mut warnings())
}

pub(crate) fn render_with(renderer: Renderer, scene: &Scene, options: &Options) -> Result<Picture, Error> {
    let _span = render_span(&renderer);
    let packed = Arc::clone(renderer.scene());
    let mut setup = RenderSetup::new(scene, renderer, options)?;
    let region = setup.layout.region;
    let mut film = empty(region, packed.film_layout())?;
    let (split, largest_film) = (WorkSplit::of(packed.film_layout()), setup.renderer.largest_film());
    let mut no_checkpoint = NoCheckpoint;
    let mut bands = Bands::new(
        region,
        packed.sampling.pixel_samples,
        &split,
        Order::Rows,
        largest_film,
        &mut no_checkpoint,
    );
    let counter = setup.renderer.progress_counter();
    let mut next = || {
        setup.renderer.work(|backend, _| {
            bands.render_next(backend, &mut |_, _, _| Ok(Flow::Continue), &mut || counter.increment())
        })
    };
    while let Some(band) = next()? {
        film.copy_rows(&band.film);
    }
    setup.picture(film)
}

pub(crate) fn render_span(renderer: &Renderer) -> tracing::span::EnteredSpan {
    tracing::debug_span!("render", device = renderer.info().name).entered()
}

/// Renders a scene progressively. `watch` is called about ten times per second or more often with the current image,
/// and returns whether to continue. All pixels get a few samples before any pixel gets more. If the image is too large
/// for one film of the device, this is true for each band of the image, from top to bottom. The result is bit-identical
/// to the result of [`render`].
///
/// # Errors
///
/// The errors of [`render`] and of `watch`, and [`RenderError::Cancelled`] if `watch` returns [`ControlFlow::Break`].
pub fn render_progressive(
    scene: &Scene,
    options: &Options,
    watch: &mut dyn FnMut(&mut Progressive) -> Result<ControlFlow<()>, Error>,
) -> Result<Picture, Error> {
    let mut open = open(scene, options)?;
    render_progressive_with(Renderer::new(&mut open, warnings()), scene, options, watch)
}

pub(crate) fn render_progressive_with(
    renderer: Renderer,
    scene: &Scene,
    options: &Options,
    watch: &mut dyn FnMut(&mut Progressive) -> Result<ControlFlow<()>, Error>,
) -> Result<Picture, Error> {
    let packed = Arc::clone(renderer.scene());
    let mut setup = RenderSetup::new(scene, renderer, options)?;
    let _span = render_span(&setup.renderer);
    let RenderSetup { renderer, hits, layout } = &mut setup;
    let (split, order) = (WorkSplit::of(packed.film_layout()), Order::Pixels);
    let largest_film = renderer.largest_film();
    let mut no_checkpoint = NoCheckpoint;
    let mut bands = Bands::new(
        layout.region,
        packed.sampling.pixel_samples,
        &split,
        order,
        largest_film,
        &mut no_checkpoint,
    );
    let counter = renderer.progress_counter();
    let mut full_film = empty(layout.region, packed.film_layout())?;
    let mut watch_error = None;
    let mut render_next = || {
        renderer.work(|backend, device| {
            let mut report_progress = |backend: &mut dyn Backend, band: Region, fraction: f64| {
                let mut progress = Progressive {
                    copy_failed: false,
                    fraction,
                    backend,
                    device,
                    band,
                    full_film: &mut full_film,
                    hits,
                    layout,
                };
                match watch(&mut progress) {
                    Ok(flow) => Ok(flow.is_continue().into()),
                    // Failures while the image is copied are handled like failures of the render.
                    Err(Error::Render(error @ (RenderError::Lost { .. } | RenderError::OutOfMemory { .. })))
                        if progress.copy_failed =>
                    {
                        Err(error)
                    }
                    Err(error) => {
                        watch_error = Some(error);
                        Ok(Flow::Cancel)
                    }
                }
            };
            let band = bands.render_next(backend, &mut report_progress, &mut || counter.increment())?;
            Ok(band.map(|band| full_film.copy_rows(&band.film)))
        })
    };
    let rendered = loop {
        match render_next() {
            Ok(Some(())) => {}
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    match watch_error {
        Some(error) => Err(error),
        None => {
            rendered?;
            setup.picture(full_film)
        }
    }
}

/// An image that is being rendered.
pub struct Progressive<'a> {
    /// True after the image could not be copied from the device.
    copy_failed: bool,
    fraction: f64,
    backend: &'a mut dyn Backend,
    device: &'a DeviceInfo,
    band: Region,
    full_film: &'a mut Film,
    hits: &'a [FirstHit],
    layout: &'a Layout,
}

impl Progressive<'_> {
    /// Returns the fraction of the work that is done, 0 to 1.
    pub fn share(&self) -> f64 {
        self.fraction
    }

    /// Returns the current image, copied from the device. Pixels without samples are black.
    ///
    /// # Errors
    ///
    /// The device is lost, or its driver reports an error.
    pub fn picture(&mut self) -> Result<Picture, Error> {
        let film = self.backend.film().inspect_err(|_| self.copy_failed = true)?;
        self.full_film.copy_rows(&film.part(self.band));
        let mut film = self.full_film.clone();
        if self.layout.aovs.contains(&Aov::Denoised) {
            film.denoised = denoise(&film);
        }
        Ok(Picture {
            film,
            hits: self.hits.to_vec(),
            layout: self.layout.clone(),
            device: self.device.clone(),
        })
    }
}

struct RenderSetup<'a> {
    renderer: Renderer<'a>,
    hits: Vec<FirstHit>,
    layout: Layout,
}

/// The parts of an image that do not depend on its samples.
pub(crate) struct ImageSetup {
    /// First hits; empty if no layer needs them.
    pub hits: Vec<FirstHit>,
    pub layout: Layout,
}

impl ImageSetup {
    pub(crate) fn new(scene: &Scene, renderer: &mut Renderer, options: &Options) -> Result<ImageSetup, Error> {
        let packed = &Arc::clone(renderer.scene());
        let region = options.region(scene).map_err(Error::Option)?;
        let needs_hits = needs_first_hits(packed, &options.aovs);
        let denoises = options.aovs.contains(&Aov::Denoised);
        check_image_memory(region, packed.film_layout(), needs_hits, denoises)?;
        let hits = match needs_hits {
            true => renderer.work(|backend, _| job::first_hits(backend, region))?,
            false => Vec::new(),
        };
        let layout = Layout {
            picture: (scene.width, scene.height),
            region,
            aovs: options.layers(scene),
            alpha: packed.has_alpha(),
            middle_depth: renderer.work(|backend, _| middle_depth(packed, &options.aovs, backend))?,
            max_samples: packed.sampling.pixel_samples,
            view: scene.view,
        };
        Ok(ImageSetup { hits, layout })
    }
}

impl<'a> RenderSetup<'a> {
    fn new(scene: &Scene, mut renderer: Renderer<'a>, options: &Options) -> Result<RenderSetup<'a>, Error> {
        let ImageSetup { hits, layout } = ImageSetup::new(scene, &mut renderer, options)?;
        Ok(RenderSetup { renderer, hits, layout })
    }

    fn picture(mut self, mut film: Film) -> Result<Picture, Error> {
        if self.layout.aovs.contains(&Aov::Denoised) {
            self.renderer.denoise(&mut film)?;
        }
        Ok(Picture {
            film,
            hits: self.hits,
            layout: self.layout,
            device: self.renderer.info().clone(),
        })
    }
}

/// Tests that an image fits into the memory: its film, first hits and the memory of the denoiser.
fn check_image_memory(
    region: Region,
    film_layout: FilmLayout,
    has_hits: bool,
    denoises: bool,
) -> Result<(), RenderError> {
    let hit_bytes = if has_hits { size_of::<FirstHit>() as u64 } else { 0 };
    let film_bytes = match denoises {
        true => denoise::memory(region, film_layout),
        false => region.pixels().saturating_mul(film_layout.bytes() as u64),
    };
    job::check_memory(film_bytes.saturating_add(region.pixels().saturating_mul(hit_bytes)))
}

/// Returns a film without samples, if it fits into the memory.
pub(crate) fn empty(region: Region, film_layout: FilmLayout) -> Result<Film, RenderError> {
    job::check_memory(region.pixels().saturating_mul(film_layout.bytes() as u64))?;
    Ok(Film::of(region, film_layout))
}

/// Returns true if any of `aovs` is derived from the first hits.
pub fn needs_first_hits(scene: &Packed, aovs: &[Aov]) -> bool {
    let mut sources = aovs.iter().map(|aov| aov.source(scene.integrator));
    sources.any(|source| source == AovSource::FirstHit)
}

/// Returns the depth that a PNG maps to half brightness: the depth at the image center, or 1 if nothing is hit there.
///
/// # Errors
///
/// The device is lost, or its driver reports an error.
pub fn middle_depth(scene: &Packed, aovs: &[Aov], backend: &mut dyn Backend) -> Result<f32, RenderError> {
    if !aovs.contains(&Aov::Depth) {
        return Ok(1.0);
    }
    let (x0, y0) = (scene.camera.width / 2, scene.camera.height / 2);
    let middle = Region {
        x0,
        y0,
        x1: x0 + 1,
        y1: y0 + 1,
    };
    let hits = backend.first_hits(middle)?;
    Ok(hits
        .first()
        .map(|hit| hit.depth)
        .filter(|depth| *depth > 0.0)
        .unwrap_or(1.0))
}
