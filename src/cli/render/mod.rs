//! `wgray render`: a scene file to a picture, or to several.

mod args;
mod frames;
mod plan;
mod said;
mod work;

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context as _;
use tracing::info;
use wgray::device::DeviceInfo;
use wgray::error::RenderError;
use wgray::job::{Keeper, Nowhere};
use wgray::scene::{Scene, is_gltf};

use self::frames::Frame;
use self::plan::Plan;
use self::said::Said;
use self::work::Took;
use super::log::{self, Level};
use super::outputs::Outputs;
use super::signal::Stop;
use super::stats::Stats;
use super::{Interrupted, Usage, facts_of, plain, progress, signal};

pub use args::Args;
pub use args::parse_size;

pub fn run(args: Args, start: Instant) -> anyhow::Result<ExitCode> {
    if args.verbose {
        log::speak();
    }
    if let Some(threads) = args.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        pool.build_global().context("threads")?; // before anything else is done in parallel
    }
    let frames = args.frames();
    let outputs: Vec<Outputs> = (frames.iter().map(|frame| args.outputs(*frame))).collect::<anyhow::Result<_>>()?;
    let said = Said::new(args.quiet);
    let mut scene = read(&args, &said)?;
    let fps = args.fps(&scene)?;
    check(&args, &scene, frames.iter().zip(&outputs))?;
    info!(seconds = start.elapsed().as_secs_f64(), "scene read");
    let (mut stop, mut start, mut skipped) = (None, start, 0);
    for (frame, outputs) in frames.iter().zip(outputs) {
        if args.skip_existing && outputs.are_there() {
            skipped += 1;
            continue;
        }
        if let Some((number, fps)) = frame.number.zip(fps) {
            let mut overrides = args.overrides();
            overrides.gltf.time = Some(f64::from(number) / fps);
            let moment = super::load(&args.scene, &overrides)?;
            let before = std::mem::replace(&mut scene, moment);
            if args.options.is_framed(&scene) {
                // Of the file at rest: it stands still, and a frame by itself is the same as in a run.
                (scene.camera, scene.camera_path) = (before.camera, before.camera_path);
            }
        }
        if let Some(number) = frame.number {
            scene.camera = scene.camera_at(number.into()).map_err(|error| plain(error.into()))?;
        }
        let plan = Plan::resolve(&args, &scene, &said, *frame, start)?;
        outputs.check_size(plan.region())?;
        picture(&plan, outputs, &mut stop, start)?;
        start = Instant::now();
    }
    if skipped > 0 {
        let count = frames.len();
        said.once(
            Level::Note,
            &format!("{skipped} of {count} left out, as their files are there"),
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Reads the scene, and tells what is odd about it.
fn read(args: &Args, said: &Said) -> anyhow::Result<Scene> {
    let (path, overrides) = (&args.scene, args.overrides());
    let scene = progress::named(args.shown_progress(), "reading the scene", || {
        super::load(path, &overrides)
    })?;
    let still = match is_gltf(path) {
        true => "it has no animation: all frames are the same",
        false => "it has no camera.path: all frames are the same",
    };
    let moves = scene.camera_path.is_some() || args.fps(&scene)?.is_some();
    let still = (args.frames.is_some() && !moves).then_some(still);
    for note in scene.notes.iter().map(String::as_str).chain(still) {
        said.once(Level::Warning, &format!("{}: {note}", path.display()));
    }
    Ok(scene)
}

/// Looks at all frames before the first is rendered: no output may be an input, and every camera must have a view.
fn check<'a>(args: &Args, scene: &Scene, frames: impl Iterator<Item = (&'a Frame, &'a Outputs)>) -> anyhow::Result<()> {
    let inputs = [std::slice::from_ref(&args.scene), &scene.files].concat();
    let mut files = BTreeMap::new();
    for (frame, outputs) in frames {
        let checkpoint = args.checkpoint(*frame)?;
        outputs.check(&inputs, checkpoint.as_deref())?;
        let kept = checkpoint.as_deref().map(|path| (path.to_string_lossy(), path));
        let kept = kept.iter().map(|(name, path)| ("--checkpoint", &**name, *path));
        for (option, name, path) in outputs.files().chain(kept) {
            if let Some(other) = files.insert(path.to_owned(), frame.number) {
                let [this, other] = [frame.number, other].map(Option::unwrap_or_default);
                let rule = format!("{option}: {name}: frames {other} and {this} have this name; choose another one");
                return Err(Usage(rule).into());
            }
        }
        if let Some(number) = frame.number {
            scene.camera_at(number.into()).map_err(|error| plain(error.into()))?;
        }
    }
    Ok(())
}

/// Renders one picture, or a part of one. Signals are heeded from the first one on, and end all.
fn picture(plan: &Plan, outputs: Outputs, stop: &mut Option<Stop>, start: Instant) -> anyhow::Result<()> {
    let before = stop.clone();
    let mut checkpoint = plan.open_checkpoint(before.as_ref())?;
    let mut nowhere = Nowhere;
    let keeper: &mut dyn Keeper = match &mut checkpoint {
        Some(checkpoint) => checkpoint,
        None => &mut nowhere,
    };
    let names: Vec<String> = outputs.files().map(|(_, name, _)| name.to_owned()).collect();
    let outputs = outputs.begin().map_err(RenderError::Output)?;
    let stop = match stop {
        Some(stop) => stop,
        None => stop.insert(signal::stop().context("signal handler")?),
    };
    if let Some(signal) = stop.signal() {
        return Err(Interrupted(signal).into());
    }
    let mut renderer = plan.renderer(stop).map_err(|error| interrupted(error, stop))?;
    let setup = start.elapsed().as_secs_f64();
    info!(seconds = setup, "ready");
    let took = work::write(plan, &mut renderer, outputs.places, keeper, stop);
    let took = took.map_err(|error| interrupted(error.into(), stop));
    if let (Err(error), Some(path)) = (&took, &plan.checkpoint) {
        let path = path.display();
        if error.is::<Interrupted>() {
            plan.said.again(
                Level::Note,
                &format!("{path} has what was rendered; --resume goes on from it"),
            );
        }
    }
    let took = took?;
    let total = start.elapsed().as_secs_f64();
    info!(render = took.time.as_secs_f64(), seconds = total, "picture written");
    let (least, all) = (took.least_samples, plan.scene.pixel_samples);
    if least < all {
        plan.said.again(
            Level::Note,
            &format!("the time was up: each pixel has {least} of {all} samples, or more"),
        );
    }
    let stats = stats(plan, renderer.info(), &took, setup, total);
    if log::is_json() && !plan.said.is_quiet() {
        let stats = serde_json::to_value(&stats)?;
        let facts = facts_of([("files", names.into()), ("stats", stats)]);
        log::tell(Level::Info, "render done", facts);
    }
    if let Some(file) = outputs.stats {
        stats.write(file).map_err(RenderError::Output)?;
    }
    Ok(())
}

/// An error, or the signal that is the reason of it.
fn interrupted(error: anyhow::Error, stop: &Stop) -> anyhow::Error {
    match (error.downcast_ref(), stop.signal()) {
        (Some(RenderError::Cancelled), Some(signal)) => Interrupted(signal).into(),
        _ => error,
    }
}

fn stats(plan: &Plan, device: &DeviceInfo, took: &Took, setup: f64, total: f64) -> Stats {
    let (region, scene) = (plan.region(), &plan.scene);
    let render = took.time.as_secs_f64();
    let rays_now = took.camera_rays as f64 * took.share_rendered;
    Stats {
        frame: plan.frame.number,
        device: device.name.clone(),
        driver: device.driver.clone(),
        backend: device.interface.clone(),
        width: region.width(),
        height: region.height(),
        pixel_samples: scene.pixel_samples,
        least_samples: took.least_samples,
        light_samples: scene.light_samples(),
        setup_s: setup,
        render_s: render,
        total_s: total,
        camera_rays: took.camera_rays,
        share_rendered: took.share_rendered,
        shadow_rays: None,
        nominal_mrays_per_s: Stats::nominal(rays_now, scene.light_samples(), render),
    }
}
