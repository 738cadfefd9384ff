//! The rendering of one picture, or of a part of one, into its files.

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
use crate::cli::outputs::Places;
use crate::cli::progress::Progress;
use crate::cli::signal::Stop;

/// What a render took.
#[derive(Default)]
pub struct RenderTotals {
    /// The time without writing.
    pub time: Duration,
    /// Rays from the camera in the picture, and the share of them that were not found in a checkpoint.
    pub camera_rays: u64,
    pub fraction_rendered: f64,
    /// Pixels that are no finite numbers.
    strange: usize,
    /// The fewest samples of a pixel.
    pub min_samples: u32,
}

/// Renders band by band into files.
pub fn write(
    plan: &Plan,
    renderer: &mut Renderer,
    places: Places,
    store: &mut dyn CheckpointStore,
    stop: &Stop,
) -> Result<RenderTotals, RenderError> {
    let middle_depth = renderer.work(|backend, _| middle_depth(&plan.scene, &plan.options.aovs, backend))?;
    let layout = plan.layout(middle_depth);
    let mut took = RenderTotals::default();
    let name = places.name().unwrap_or_default().to_owned();
    let metadata = plan.told.on(renderer.info(), plan.pictures.reproducible);
    let mut fill = |sink: &mut Sink| render(plan, renderer, store, stop, &mut took, sink);
    match places {
        Places::Pictures(targets) => {
            let options = plan.pictures.save_options(metadata);
            let saved = image::save(targets, &layout, &options, &mut fill)?;
            plan.pictures
                .warn(&saved, &mut |line| plan.log.log(Level::Warning, line));
        }
        Places::Part(file) => write_part(plan, &layout, file, &mut fill)?,
    }
    if took.strange > 0 {
        let count = took.strange;
        plan.log.log(
            Level::Warning,
            &format!("{name}: {count} pixels are not finite numbers"),
        );
    }
    Ok(took)
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
    let header = PartHeader::of(tile, layout, plan.told.lasting());
    job::write_part(file, &plan.identity(), &header, fill)
}

/// Renders band by band into a sink.
fn render(
    plan: &Plan,
    renderer: &mut Renderer,
    store: &mut dyn CheckpointStore,
    stop: &Stop,
    took: &mut RenderTotals,
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
    let mut watch = |_: &mut dyn Backend, _: Region, share: f64| {
        let now = Instant::now();
        let of_time = plan.deadline.map_or(0.0, |end| {
            let all = end.saturating_duration_since(begin).as_secs_f64();
            (now.duration_since(begin).as_secs_f64() / all).min(1.0)
        });
        progress.update(share.max(of_time));
        Ok(match plan.deadline {
            _ if stop.signal().is_some() => Flow::Cancel,
            Some(end) if now >= end => Flow::TimeIsUp,
            _ => Flow::GoOn,
        })
    };
    took.min_samples = samples;
    loop {
        let start = Instant::now();
        let made = renderer.progress();
        let next = renderer.work(|backend, _| bands.render_next(backend, &mut watch, &mut || made.made()));
        took.time += start.elapsed();
        let Some(band) = next? else {
            took.fraction_rendered = bands.fraction_rendered();
            return Ok(());
        };
        let film = band.film;
        took.min_samples = took.min_samples.min(band.min_samples);
        took.camera_rays += band.camera_rays;
        let colors = film.means();
        took.strange += colors
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
