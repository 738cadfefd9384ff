//! Renders one image, or a part of one, into its files.

use std::time::{Duration, Instant};

use wgray::backend::Backend;
use wgray::device::Renderer;
use wgray::error::RenderError;
use wgray::film::Region;
use wgray::image::{self, Band, Layout, Pending, Sink};
use wgray::job::{self, Bands, CheckpointStore, Cut, Flow, Order, PartHeader};
use wgray::render::{middle_depth, needs_first_hits};

use super::plan::Plan;
use crate::cli::log::Level;
use crate::cli::outputs::Files;
use crate::cli::progress::Progress;
use crate::cli::signal::Stop;

/// Times and counts of a render.
#[derive(Default)]
pub struct RenderTotals {
    /// Time spent on rendering, excluding the writing of files.
    pub time: Duration,
    /// Camera rays of the image, and the fraction of them that was rendered instead of read from a checkpoint.
    pub camera_rays: u64,
    pub fraction_rendered: f64,
    /// Number of pixels with non-finite values.
    invalid_pixels: usize,
    /// Minimum samples per pixel.
    pub min_samples: u32,
    /// Requested samples per pixel; fewer than the scene's if the time limit was reached.
    pub requested_samples: u32,
}

/// Renders into files, band by band.
pub fn write(
    plan: &Plan,
    renderer: &mut Renderer,
    files: Files,
    store: &mut dyn CheckpointStore,
    stop: &Stop,
) -> Result<RenderTotals, RenderError> {
    let middle_depth = renderer.work(|backend, _| middle_depth(&plan.scene, &plan.options.aovs, backend))?;
    let layout = plan.layout(middle_depth);
    let mut totals = RenderTotals::default();
    let name = files.name().unwrap_or_default().to_owned();
    let metadata = plan.metadata.on(renderer.info(), plan.pictures.reproducible);
    let mut fill = |sink: &mut Sink| render(plan, renderer, store, stop, &mut totals, sink);
    match files {
        Files::Pictures(targets) => {
            let options = plan.pictures.save_options(metadata);
            let saved = image::save(targets, &layout, &options, &mut fill)?;
            plan.pictures
                .warn(&saved, &mut |line| plan.log.log(Level::Warning, line));
        }
        Files::Part(file) => write_part(plan, &layout, file, &mut fill)?,
    }
    if totals.invalid_pixels > 0 {
        let count = totals.invalid_pixels;
        plan.log.log(
            Level::Warning,
            &format!("{name}: {count} pixels are not finite (NaN or infinity)"),
        );
    }
    Ok(totals)
}

fn write_part(
    plan: &Plan,
    layout: &Layout,
    file: Pending,
    fill: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let Some((tile, _)) = plan.tile else {
        return Ok(());
    };
    let header = PartHeader::of(tile, layout, plan.metadata.lasting());
    job::write_part(file, &plan.identity(), &header, fill)
}

/// Renders into a sink, band by band.
fn render(
    plan: &Plan,
    renderer: &mut Renderer,
    store: &mut dyn CheckpointStore,
    stop: &Stop,
    totals: &mut RenderTotals,
    sink: &mut Sink,
) -> Result<(), RenderError> {
    let mut progress = Progress::new(plan.progress, plan.frame.label(), plan.frame.number);
    let (scene, samples) = (&plan.scene, plan.scene.pixel_samples);
    let (cut, most) = (Cut::of(scene.form()), renderer.largest_film());
    let order = match plan.deadline {
        Some(_) => Order::Pixels,
        None => Order::Rows,
    };
    let mut bands = Bands::new(plan.region(), samples, &cut, order, most, store);
    if plan.deadline.is_some() {
        bands = bands.as_a_whole(scene.form())?;
    }
    let begin = Instant::now();
    let mut watch = |_: &mut dyn Backend, _: Region, fraction: f64| {
        let now = Instant::now();
        let of_time = plan.deadline.map_or(0.0, |end| {
            let all = end.saturating_duration_since(begin).as_secs_f64();
            (now.duration_since(begin).as_secs_f64() / all).min(1.0)
        });
        progress.update(fraction.max(of_time));
        Ok(match plan.deadline {
            _ if stop.signal().is_some() => Flow::Cancel,
            Some(end) if now >= end => Flow::TimeIsUp,
            _ => Flow::GoOn,
        })
    };
    (totals.min_samples, totals.requested_samples) = (samples, samples);
    loop {
        let start = Instant::now();
        let made = renderer.progress();
        let next = renderer.work(|backend, _| bands.render_next(backend, &mut watch, &mut || made.made()));
        totals.time += start.elapsed();
        let Some(band) = next? else {
            totals.fraction_rendered = bands.fraction_rendered();
            return Ok(());
        };
        let film = band.film;
        totals.min_samples = totals.min_samples.min(band.min_samples);
        totals.requested_samples = totals.requested_samples.min(band.requested_samples);
        totals.camera_rays += band.camera_rays;
        let colors = film.means();
        totals.invalid_pixels += colors
            .filter(|color| !color.iter().all(|value| value.is_finite()))
            .count();
        let hits = match needs_first_hits(scene, &plan.options.aovs) {
            true => renderer.work(|backend, _| job::first_hits(backend, film.region))?,
            false => Vec::new(),
        };
        sink(Band {
            film: &film,
            hits: &hits,
        })?;
    }
}
