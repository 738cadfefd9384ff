//! Renders an image, or a part of an image, and writes the files.

use std::time::{Duration, Instant};

use crate::error::RenderError;
use crate::image::{self, Band, Layout, Pending, Sink};
use crate::render::{middle_depth, needs_first_hits};
use crate::renderer::Renderer;
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::denoise;
use wgray_render::job::{self, Bands, CheckpointStore, FinishedBand, Flow, Order, PartHeader, PassEnds, WorkSplit};
use wgray_render::noise::{self, Noise, NoiseMeter};
use wgray_trace::film::Film;
use wgray_trace::records::FirstHit;

use super::plan::Plan;
use super::preview::Previews;
use crate::cli::log::Level;
use crate::cli::outputs::Files;
use crate::cli::progress::Progress;
use crate::cli::signal::Stop;

#[derive(Default)]
pub struct RenderTotals {
    /// Render time, excluding the time to write files.
    pub time: Duration,
    /// Number of camera rays of the image.
    pub camera_rays: u64,
    /// Fraction of the camera rays that this run traced; the samples of the other rays come from a checkpoint.
    pub fraction_rendered: f64,
    /// Number of pixels with non-finite values.
    invalid_pixels: usize,
    /// Minimum samples per pixel.
    pub min_samples: u32,
    /// Requested samples per pixel: fewer than in the scene if the time limit was reached or the image is partial.
    pub requested_samples: u32,
    /// The noise of the image, if it has a limit.
    pub noise: Option<Noise>,
    /// True if the noise ended the render.
    pub is_converged: bool,
    /// After a signal, the files that contain the last complete pass.
    pub partial: Vec<String>,
}

impl RenderTotals {
    fn new(samples: u32) -> RenderTotals {
        RenderTotals {
            min_samples: samples,
            requested_samples: samples,
            ..RenderTotals::default()
        }
    }
}

/// Renders an image or a part, and writes the files band by band.
pub fn write(
    plan: &Plan,
    renderer: &mut Renderer,
    files: Files,
    store: &mut dyn CheckpointStore,
    stop: &Stop,
    mut previews: Option<Previews>,
) -> Result<RenderTotals, RenderError> {
    let middle_depth = renderer.work(|backend, _| middle_depth(&plan.scene, &plan.options.aovs, backend))?;
    let layout = plan.layout(middle_depth);
    let mut totals = RenderTotals::new(plan.samples);
    let name = files.name().unwrap_or_default().to_owned();
    let mut watcher = Watcher::new(plan, stop);
    let mut bands = bands(plan, renderer.largest_film(), store, previews.is_some())?;
    let (mut metadata, device) = (plan.metadata.clone(), renderer.info().clone());
    // The metadata, with which a file begins, contain the noise of the complete image.
    let passes = match plan.noise {
        Some(_) => {
            let passes = render_passes(
                plan,
                renderer,
                &mut bands,
                &mut watcher,
                &mut totals,
                previews.take(),
                &layout,
            );
            if let Some(noise) = &totals.noise {
                metadata.add_noise(noise, (bands.completed_samples(), plan.samples));
            }
            passes
        }
        None => Ok(()),
    };
    let mut render_to = |sink: &mut Sink| {
        if previews.is_some() {
            let previews = previews.take();
            render_passes(plan, renderer, &mut bands, &mut watcher, &mut totals, previews, &layout)?;
        }
        if !plan.denoises() || plan.tile.is_some() {
            return render_bands(plan, renderer, &mut bands, &mut watcher, &mut totals, sink);
        }
        let film_layout = plan.scene.film_layout();
        let (film, hits) = denoise::collect(layout.region, film_layout, &mut |sink| {
            render_bands(plan, renderer, &mut bands, &mut watcher, &mut totals, sink)
        })?;
        let start = Instant::now();
        write_denoised(renderer, (film, hits), sink)?;
        totals.time += start.elapsed();
        Ok(())
    };
    let written = passes.and_then(|()| match files {
        Files::Images(targets) => {
            let metadata = metadata.with_device(&device, plan.picture_options.reproducible);
            let options = plan.picture_options.save_options(metadata);
            let report = image::save(targets, &layout, &options, &mut render_to)?;
            (plan.picture_options).warn(&report, &mut |line| plan.log.log(Level::Warning, line));
            Ok(())
        }
        Files::Part(file) => write_part(plan, &layout, file, &mut render_to),
    });
    match written {
        Err(RenderError::Cancelled) if !totals.partial.is_empty() => {} // `save_pass` has written the partial images
        written => written?,
    }
    drop(watcher);
    if totals.invalid_pixels > 0 {
        let count = totals.invalid_pixels;
        plan.log.log(
            Level::Warning,
            &format!("{name}: number of pixels that are not finite (NaN or infinity): {count}"),
        );
    }
    Ok(totals)
}

fn write_part(
    plan: &Plan,
    layout: &Layout,
    file: Pending,
    render_to: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let Some((tile, _)) = plan.tile else {
        return Ok(());
    };
    let header = PartHeader::of(tile, layout, plan.metadata.without_device());
    job::write_part(file, &plan.identity(), &header, render_to)
}

/// Returns the bands of the image or part, which are rendered together if the render may end early.
fn bands<'a>(
    plan: &Plan,
    largest_film: u64,
    store: &'a mut dyn CheckpointStore,
    has_previews: bool,
) -> Result<Bands<&'a mut dyn CheckpointStore>, RenderError> {
    let film_layout = plan.scene.film_layout();
    let split = WorkSplit::of(film_layout);
    let has_deadline = plan.deadline.is_some();
    let order = match has_deadline || has_previews {
        true => Order::Pixels,
        false => Order::Rows,
    };
    let bands = Bands::new(plan.region(), plan.samples, &split, order, largest_film, store);
    match plan.noise {
        _ if has_previews => bands.in_passes(film_layout),
        Some(_) if has_deadline => bands.in_passes_to(PassEnds::After(PASS_DURATION), film_layout),
        Some(_) => bands.in_passes_to(PassEnds::At(noise::next_decision), film_layout),
        None if has_deadline => bands.as_a_whole(film_layout),
        None => Ok(bands),
    }
}

/// Target duration of a pass with a noise limit and a time limit.
const PASS_DURATION: Duration = Duration::from_secs(1);

/// Shows the progress, and ends a render after a signal or at the deadline.
struct Watcher<'a> {
    plan: &'a Plan<'a>,
    stop: &'a Stop,
    /// `None` after the render.
    progress: Option<Progress>,
    begin: Instant,
    /// Estimated fraction of the maximum samples that the render needs.
    expected_fraction: f64,
}

impl<'a> Watcher<'a> {
    fn new(plan: &'a Plan<'a>, stop: &'a Stop) -> Watcher<'a> {
        Watcher {
            plan,
            stop,
            progress: Some(Progress::new(plan.progress, plan.frame.label(), plan.frame.number)),
            begin: Instant::now(),
            expected_fraction: 1.0,
        }
    }

    /// `fraction` is the finished fraction of the maximum samples.
    fn watch(&mut self, fraction: f64) -> Flow {
        let (now, deadline) = (Instant::now(), self.plan.deadline);
        let time_fraction = deadline.map_or(0.0, |end| {
            let limit = end.saturating_duration_since(self.begin).as_secs_f64();
            (now.duration_since(self.begin).as_secs_f64() / limit).min(1.0)
        });
        let fraction = (fraction / self.expected_fraction).min(1.0);
        if let Some(progress) = &mut self.progress {
            progress.update(fraction.max(time_fraction));
        }
        match deadline {
            _ if self.stop.signal().is_some() => Flow::Cancel,
            Some(end) if now >= end => Flow::TimeIsUp,
            _ => Flow::Continue,
        }
    }

    /// Updates the estimate of the remaining work.
    fn set_noise(&mut self, samples: u32, noise: f64, limit: f64) {
        let expected = noise::estimated_samples(samples, noise, limit) / f64::from(self.plan.samples);
        self.expected_fraction = expected.min(1.0);
        if let Some(progress) = &mut self.progress {
            progress.set_noise(noise);
        }
    }
}

/// Renders passes over all bands until all samples are complete, the noise is below its limit or the time is up.
fn render_passes(
    plan: &Plan,
    renderer: &mut Renderer,
    bands: &mut Bands<&mut dyn CheckpointStore>,
    watcher: &mut Watcher,
    totals: &mut RenderTotals,
    mut previews: Option<Previews>,
    layout: &Layout,
) -> Result<(), RenderError> {
    loop {
        // Also before the first pass: a resumed checkpoint may have a sample count at which the noise decides.
        let decision = bands.uniform_samples().filter(|samples| noise::is_decision(*samples));
        if let (Some(limit), Some(samples)) = (plan.noise, decision) {
            let noise = measured_noise(plan, bands)?;
            watcher.set_noise(samples, noise.percentile_95, limit);
            if noise.percentile_95 < limit {
                totals.noise = Some(noise);
                totals.is_converged = true;
                bands.end_passes();
                return Ok(());
            }
        }
        let start = Instant::now();
        let counter = renderer.progress_counter();
        let mut watch = |_: &mut dyn Backend, _: Region, fraction: f64| Ok(watcher.watch(fraction));
        let pass = renderer.work(|backend, _| bands.next_pass(backend, &mut watch, &mut || counter.increment()));
        totals.time += start.elapsed();
        match (pass, &mut previews) {
            (Ok(Some(count)), _) if count >= plan.samples => break,
            (Ok(Some(count)), Some(previews)) if previews.is_due(count) => {
                save_pass(plan, renderer, bands, previews, layout)?;
            }
            (Ok(Some(_)), _) => {}
            (Ok(None), _) => break,
            (Err(RenderError::Cancelled), Some(previews)) if plan.checkpoint.is_none() => {
                if bands.completed_samples() == 0 {
                    let note = "some pixels have no complete sample yet, so no image was written";
                    plan.log.log(Level::Note, note);
                } else if let Some(partial) = save_pass(plan, renderer, bands, previews, layout)? {
                    let time = totals.time;
                    *totals = RenderTotals { time, ..partial };
                }
                return Err(RenderError::Cancelled);
            }
            (Err(error), _) => return Err(error),
        }
    }
    if plan.noise.is_some() {
        totals.noise = Some(measured_noise(plan, bands)?);
    }
    Ok(())
}

/// Returns the noise of the image so far.
fn measured_noise(plan: &Plan, bands: &mut Bands<&mut dyn CheckpointStore>) -> Result<Noise, RenderError> {
    let mut meter = NoiseMeter::new(plan.view.exposure);
    bands.visit_films(&mut |film| meter.add(film))?;
    Ok(meter.noise())
}

/// Renders all bands, unless passes have rendered them, and passes each finished band to a sink.
fn render_bands(
    plan: &Plan,
    renderer: &mut Renderer,
    bands: &mut Bands<&mut dyn CheckpointStore>,
    watcher: &mut Watcher,
    totals: &mut RenderTotals,
    sink: &mut Sink,
) -> Result<(), RenderError> {
    loop {
        let mut watch = |_: &mut dyn Backend, _: Region, fraction: f64| Ok(watcher.watch(fraction));
        let start = Instant::now();
        let counter = renderer.progress_counter();
        let next = renderer.work(|backend, _| bands.render_next(backend, &mut watch, &mut || counter.increment()));
        totals.time += start.elapsed();
        let Some(band) = next? else {
            totals.fraction_rendered = bands.fraction_rendered();
            watcher.progress = None; // removes the bar
            return Ok(());
        };
        write_band(plan, renderer, band, totals, sink)?;
    }
}

/// Denoises a film, and passes it to a sink.
fn write_denoised(
    renderer: &mut Renderer,
    (mut film, hits): (Film, Vec<FirstHit>),
    sink: &mut Sink,
) -> Result<(), RenderError> {
    renderer.denoise(&mut film)?;
    sink(Band {
        film: &film,
        hits: &hits,
    })
}

/// Passes a band to a sink and adds its counts to the totals.
fn write_band(
    plan: &Plan,
    renderer: &mut Renderer,
    band: FinishedBand,
    totals: &mut RenderTotals,
    sink: &mut Sink,
) -> Result<(), RenderError> {
    let film = band.film;
    totals.min_samples = totals.min_samples.min(band.min_samples);
    totals.requested_samples = totals.requested_samples.min(band.requested_samples);
    totals.camera_rays += band.camera_rays;
    let colors = film.means();
    totals.invalid_pixels += colors
        .filter(|color| !color.iter().all(|value| value.is_finite()))
        .count();
    let hits = match needs_first_hits(&plan.scene, &plan.options.aovs) {
        true => renderer.work(|backend, _| job::first_hits(backend, film.region))?,
        false => Vec::new(),
    };
    sink(Band {
        film: &film,
        hits: &hits,
    })
}

/// Writes the last complete pass to the images, except to files that already have more samples. Returns `None` if no
/// file is written. A failure to write is only a warning, because writing the complete image may still succeed.
fn save_pass(
    plan: &Plan,
    renderer: &mut Renderer,
    bands: &mut Bands<&mut dyn CheckpointStore>,
    previews: &mut Previews,
    layout: &Layout,
) -> Result<Option<RenderTotals>, RenderError> {
    let (samples, all) = (bands.completed_samples(), plan.samples);
    let mut totals = RenderTotals {
        fraction_rendered: 1.0,
        ..RenderTotals::new(all)
    };
    let targets = previews.start(samples, plan.log).map_err(RenderError::Output);
    let saved = targets.and_then(|targets| {
        let mut metadata = plan.metadata.clone();
        if plan.noise.is_some() && !targets.is_empty() {
            let mut meter = NoiseMeter::new(plan.view.exposure);
            bands.output_last_pass(&mut |band| {
                meter.add(&band.film);
                Ok(())
            })?;
            let noise = meter.noise();
            metadata.add_noise(&noise, (samples, all));
            totals.noise = Some(noise);
        }
        let metadata = metadata.partial(renderer.info(), plan.picture_options.reproducible, (samples, all));
        let options = plan.picture_options.save_options(metadata);
        let files = targets.iter().flat_map(|target| &target.files);
        totals.partial = files.map(|file| file.name().to_owned()).collect();
        if !targets.is_empty() {
            image::save(targets, layout, &options, &mut |sink| {
                if !plan.denoises() {
                    return bands.output_last_pass(&mut |band| write_band(plan, renderer, band, &mut totals, sink));
                }
                let parts = denoise::collect(layout.region, plan.scene.film_layout(), &mut |sink| {
                    bands.output_last_pass(&mut |band| write_band(plan, renderer, band, &mut totals, sink))
                })?;
                write_denoised(renderer, parts, sink)
            })?;
        }
        Ok(())
    });
    previews.record_write();
    match saved {
        Ok(()) => Ok(Some(totals).filter(|totals| !totals.partial.is_empty())),
        Err(error @ (RenderError::Output(_) | RenderError::Memory(_))) => {
            plan.log
                .log_once(Level::Warning, &format!("{error}; the preview is not written"));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}
