//! From a scene to a picture in memory.

use std::ops::ControlFlow;

use tracing::warn;

use crate::device::DeviceInfo;
use crate::error::{Error, RenderError};
use crate::image::{Aov, AovSource, Layout};
use crate::options::Options;
use crate::picture::Picture;
use crate::renderer::{FaultHandler, Recovery, Renderer};
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::film::{Film, Form};
use wgray_render::job::{self, Bands, Cut, Flow, NoCheckpoint, Order};
use wgray_render::records::{FirstHit, Packed};
use wgray_scene::Scene;

/// Renders a scene. The picture is kept in memory, in 16 bytes a pixel; in 80 more where it has alpha, or layers that are means
/// over the samples.
///
/// With [`Device::Auto`](crate::Device::Auto), the CPU renders if no adapter exists, or if the scene or image does not fit into its memory. With any
/// device, it renders if the driver ends long loops early and a single sample needs longer ones. A lost device is opened again a few times, and
/// the render continues from the last finished part; if that fails, [`Device::Auto`](crate::Device::Auto) continues on the CPU. Warnings by
/// `tracing` give the reason; [`Picture::device`] returns the device that rendered last. wgpu panics at some losses: the panic is caught, but a
/// panic hook observes it, and a program built with `panic = "abort"` ends. Mesa's drivers print a line on standard error if the environment has no `XDG_RUNTIME_DIR`.
///
/// # Errors
///
/// Options that do not fit the scene, no such device, and what its driver refuses.
pub fn render(scene: &Scene, options: &Options) -> Result<Picture, Error> {
    let packed = options.pack(scene);
    let mut prepared = Prepared::new(scene, &packed, options)?;
    let region = prepared.layout.region;
    let mut film = empty(region, packed.form())?;
    let (cut, most) = (Cut::of(packed.form()), prepared.renderer.largest_film());
    let mut no_checkpoint = NoCheckpoint;
    let mut bands = Bands::new(
        region,
        packed.sampling.pixel_samples,
        &cut,
        Order::Rows,
        most,
        &mut no_checkpoint,
    );
    let progress = prepared.renderer.progress();
    let mut next = || {
        prepared
            .renderer
            .work(|backend, _| bands.render_next(backend, &mut |_, _, _| Ok(Flow::GoOn), &mut || progress.made()))
    };
    while let Some(band) = next()? {
        put(&mut film, &band.film);
    }
    Ok(prepared.picture(film))
}

/// Renders a scene, and shows the picture as it grows: `watch` is called some ten times a second or more, sees the picture
/// as it is then, and says whether to go on. All pixels get a few samples before any gets more, but that a picture too
/// large for one film of the device grows part by part, from the top. The result has the bits of [`render`].
///
/// # Errors
///
/// The errors of [`render`] and of `watch`, and [`RenderError::Cancelled`] if `watch` breaks off.
pub fn render_growing(
    scene: &Scene,
    options: &Options,
    watch: &mut dyn FnMut(&mut Growing) -> Result<ControlFlow<()>, Error>,
) -> Result<Picture, Error> {
    let packed = options.pack(scene);
    let mut prepared = Prepared::new(scene, &packed, options)?;
    let Prepared { renderer, hits, layout } = &mut prepared;
    let (cut, order) = (Cut::of(packed.form()), Order::Pixels);
    let most = renderer.largest_film();
    let mut no_checkpoint = NoCheckpoint;
    let mut bands = Bands::new(
        layout.region,
        packed.sampling.pixel_samples,
        &cut,
        order,
        most,
        &mut no_checkpoint,
    );
    let progress = renderer.progress();
    let mut whole = empty(layout.region, packed.form())?;
    let mut failed = None;
    let mut render_next = || {
        renderer.work(|backend, device| {
            let mut look = |backend: &mut dyn Backend, band: Region, share: f64| {
                let mut growing = Growing {
                    share,
                    backend,
                    device,
                    band,
                    whole: &mut whole,
                    hits,
                    layout,
                };
                match watch(&mut growing) {
                    Ok(flow) => Ok(flow.is_continue().into()),
                    // What befalls the device while the picture is copied from it is a fault like any other.
                    Err(Error::Render(error @ (RenderError::Lost { .. } | RenderError::OutOfMemory { .. }))) => {
                        Err(error)
                    }
                    Err(error) => {
                        failed = Some(error);
                        Ok(Flow::Cancel)
                    }
                }
            };
            let band = bands.render_next(backend, &mut look, &mut || progress.made())?;
            Ok(band.map(|band| put(&mut whole, &band.film)))
        })
    };
    let rendered = loop {
        match render_next() {
            Ok(Some(())) => {}
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    match failed {
        Some(error) => Err(error),
        None => {
            rendered?;
            Ok(prepared.picture(whole))
        }
    }
}

/// A picture that is being rendered.
pub struct Growing<'a> {
    share: f64,
    backend: &'a mut dyn Backend,
    device: &'a DeviceInfo,
    band: Region,
    whole: &'a mut Film,
    hits: &'a [FirstHit],
    layout: &'a Layout,
}

impl Growing<'_> {
    /// The share of the work that is done, from 0 to 1.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// The picture as it is now, copied from the device. Pixels without a sample so far are black.
    ///
    /// # Errors
    ///
    /// What the device's driver refuses or loses.
    pub fn picture(&mut self) -> Result<Picture, Error> {
        put(self.whole, &self.backend.film()?.part(self.band));
        Ok(Picture {
            film: self.whole.clone(),
            hits: self.hits.to_vec(),
            layout: self.layout.clone(),
            device: self.device.clone(),
        })
    }
}

/// What is there before the first sample.
struct Prepared<'a> {
    renderer: Renderer<'a>,
    hits: Vec<FirstHit>,
    layout: Layout,
}

impl<'a> Prepared<'a> {
    fn new(scene: &Scene, packed: &'a Packed, options: &Options) -> Result<Prepared<'a>, Error> {
        let region = options.region(scene).map_err(Error::Option)?;
        let on_fault = FaultHandler {
            tell: Box::new(|why, remedy| match remedy {
                Recovery::Reopen => warn!("{why}; re-opening it"),
                Recovery::Cpu => warn!("rendering on the CPU: {why}"),
            }),
            stopped: Box::new(|| false), // the pauses are short
        };
        let mut renderer = Renderer::new(packed, options, on_fault)?;
        let hits = match needs_first_hits(packed, &options.aovs) {
            true => renderer.work(|backend, _| job::first_hits(backend, region))?,
            false => Vec::new(),
        };
        let mut aovs: Vec<Aov> = Vec::new();
        for aov in &options.aovs {
            if !aovs.contains(aov) {
                aovs.push(*aov);
            }
        }
        let layout = Layout {
            picture: (scene.width, scene.height),
            region,
            aovs,
            alpha: packed.has_alpha(),
            middle_depth: renderer.work(|backend, _| middle_depth(packed, &options.aovs, backend))?,
            max_samples: packed.sampling.pixel_samples,
            view: scene.view,
        };
        Ok(Prepared { renderer, hits, layout })
    }

    fn picture(self, film: Film) -> Picture {
        Picture {
            film,
            hits: self.hits,
            layout: self.layout,
            device: self.renderer.info().clone(),
        }
    }
}

fn empty(region: Region, form: Form) -> Result<Film, RenderError> {
    job::there_is_memory(region.pixels().saturating_mul(form.bytes() as u64))?;
    Ok(Film::of(region, form))
}

/// Puts whole rows of a film into it.
fn put(whole: &mut Film, band: &Film) {
    let start = (band.region.y0 - whole.region.y0) as usize * whole.region.width() as usize;
    for (to, from) in whole.lists_mut().zip(band.lists()) {
        // Some lists are empty, as the film's form is.
        if let Some(to) = to.get_mut(start..start + from.len()) {
            to.copy_from_slice(from);
        }
    }
}

/// Whether any of these layers of a scene is of the first hits.
pub fn needs_first_hits(scene: &Packed, aovs: &[Aov]) -> bool {
    let mut sources = aovs.iter().map(|aov| aov.source(scene.integrator));
    sources.any(|source| source == AovSource::FirstHit)
}

/// The depth that looks half bright in a PNG: that in the middle of the whole picture, or 1 where nothing is.
///
/// # Errors
///
/// What the device's driver refuses or loses.
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
