//! Renders an image, or a part of an image, and writes the files.

use std::time::{Duration, Instant};

use crate::error::RenderError;
use crate::image::{self, Band, Layout, Pending, Sink};
use crate::render::{middle_depth, needs_first_hits};
use crate::renderer::Renderer;
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::denoise;
use wgray_render::film::Film;
use wgray_render::job::{self, Bands, CheckpointStore, FinishedBand, Flow, Order, PartHeader, WorkSplit};
use wgray_render::records::FirstHit;

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
    let mut totals = RenderTotals::new(plan.scene.sampling.pixel_samples);
    let name = files.name().unwrap_or_default().to_owned();
    let metadata = plan
        .metadata
        .with_device(renderer.info(), plan.picture_options.reproducible);
    let mut render_to = |sink: &mut Sink| {
        let mut previews = previews.as_mut().map(|previews| (previews, &layout));
        match plan.denoises() && plan.tile.is_none() {
            true => {
                let (film, hits) = denoise::collect(layout.region, plan.scene.film_layout(), &mut |sink| {
                    let previews = previews.as_mut().map(|(previews, layout)| (&mut **previews, *layout));
                    render(plan, renderer, store, stop, &mut totals, previews, sink)
                })?;
                let start = Instant::now();
                write_denoised(renderer, (film, hits), sink)?;
                totals.time += start.elapsed();
                Ok(())
            }
            false => render(plan, renderer, store, stop, &mut totals, previews, sink),
        }
    };
    match files {
        Files::Images(targets) => {
            let options = plan.picture_options.save_options(metadata);
            match image::save(targets, &layout, &options, &mut render_to) {
                Err(RenderError::Cancelled) if !totals.partial.is_empty() => {} // these files have been written
                saved => (plan.picture_options).warn(&saved?, &mut |line| plan.log.log(Level::Warning, line)),
            }
        }
        Files::Part(file) => write_part(plan, &layout, file, &mut render_to)?,
    }
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

/// Renders all bands, and passes each finished band to a sink.
fn render(
    plan: &Plan,
    renderer: &mut Renderer,
    store: &mut dyn CheckpointStore,
    stop: &Stop,
    totals: &mut RenderTotals,
    previews: Option<(&mut Previews, &Layout)>,
    sink: &mut Sink,
) -> Result<(), RenderError> {
    let mut progress = Progress::new(plan.progress, plan.frame.label(), plan.frame.number);
    let (scene, samples) = (&plan.scene, plan.scene.sampling.pixel_samples);
    let (split, largest_film) = (WorkSplit::of(scene.film_layout()), renderer.largest_film());
    let order = match plan.deadline.is_some() || previews.is_some() {
        true => Order::Pixels,
        false => Order::Rows,
    };
    let mut bands = Bands::new(plan.region(), samples, &split, order, largest_film, store);
    if previews.is_some() {
        bands = bands.in_passes(scene.film_layout())?;
    } else if plan.deadline.is_some() {
        bands = bands.as_a_whole(scene.film_layout())?;
    }
    let begin = Instant::now();
    let mut watch = |_: &mut dyn Backend, _: Region, fraction: f64| {
        let now = Instant::now();
        let time_fraction = plan.deadline.map_or(0.0, |end| {
            let limit = end.saturating_duration_since(begin).as_secs_f64();
            (now.duration_since(begin).as_secs_f64() / limit).min(1.0)
        });
        progress.update(fraction.max(time_fraction));
        Ok(match plan.deadline {
            _ if stop.signal().is_some() => Flow::Cancel,
            Some(end) if now >= end => Flow::TimeIsUp,
            _ => Flow::Continue,
        })
    };
    if let Some((previews, layout)) = previews {
        loop {
            let start = Instant::now();
            let counter = renderer.progress_counter();
            let pass = renderer.work(|backend, _| bands.next_pass(backend, &mut watch, &mut || counter.increment()));
            totals.time += start.elapsed();
            match pass {
                Ok(Some(count)) if count < samples => {
                    if previews.is_due(count) {
                        save_pass(plan, renderer, &mut bands, previews, layout)?;
                    }
                }
                Ok(_) => break,
                Err(RenderError::Cancelled) if plan.checkpoint.is_none() => {
                    if bands.completed_samples() == 0 {
                        let note = "some pixels have no complete sample yet, so no image was written";
                        plan.log.log(Level::Note, note);
                    } else if let Some(partial) = save_pass(plan, renderer, &mut bands, previews, layout)? {
                        let time = totals.time;
                        *totals = RenderTotals { time, ..partial };
                    }
                    return Err(RenderError::Cancelled);
                }
                Err(error) => return Err(error),
            }
        }
    }
    loop {
        let start = Instant::now();
        let counter = renderer.progress_counter();
        let next = renderer.work(|backend, _| bands.render_next(backend, &mut watch, &mut || counter.increment()));
        totals.time += start.elapsed();
        let Some(band) = next? else {
            totals.fraction_rendered = bands.fraction_rendered();
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
    renderer.work(|backend, _| backend.denoise(&mut film))?;
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
    let (samples, all) = (bands.completed_samples(), plan.scene.sampling.pixel_samples);
    let metadata = (plan.metadata).partial(renderer.info(), plan.picture_options.reproducible, (samples, all));
    let options = plan.picture_options.save_options(metadata);
    let mut totals = RenderTotals {
        fraction_rendered: 1.0,
        ..RenderTotals::new(all)
    };
    let targets = previews.start(samples, plan.log).map_err(RenderError::Output);
    let saved = targets.and_then(|targets| {
        let files = targets.iter().flat_map(|target| &target.files);
        totals.partial = files.map(|file| file.name().to_owned()).collect();
        if !targets.is_empty() {
            image::save(targets, layout, &options, &mut |sink| {
                if !plan.denoises() {
                    return bands.last_pass(&mut |band| write_band(plan, renderer, band, &mut totals, sink));
                }
                let parts = denoise::collect(layout.region, plan.scene.film_layout(), &mut |sink| {
                    bands.last_pass(&mut |band| write_band(plan, renderer, band, &mut totals, sink))
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
