//! `wgray render`: a scene file to a picture, or to several.

mod args;
mod once_log;
mod plan;
mod trial;
mod work;

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context as _;
use tracing::info;
use wgray::device::DeviceInfo;
use wgray::error::RenderError;
use wgray::film::Region;
use wgray::job::{CheckpointStore, NoCheckpoint};
use wgray::scene::{Problem, Scene, is_gltf};

use self::once_log::OnceLog;
use self::plan::Plan;
use self::work::RenderTotals;
use super::frames::Frame;
use super::log::{self, Level};
use super::outputs::Outputs;
use super::signal::{Signals, Stop};
use super::stats::Stats;
use super::{Interrupted, Usage, facts_of, plain, progress};

pub use args::{Args, parse_duration, parse_size};
pub use trial::Trial;

pub fn run(args: Args, start: Instant) -> anyhow::Result<ExitCode> {
    let mut signals = Signals::unheeded(args.requeue_exit).context("signal handler")?;
    let mut job = Job::new(&args)?;
    info!(seconds = start.elapsed().as_secs_f64(), "scene read");
    let (mut start, mut skipped) = (start, 0);
    let count = job.frames.len();
    for (frame, outputs) in std::mem::take(&mut job.frames) {
        let is_there = args.skip_existing && outputs.are_there();
        if is_there && outputs.part().is_none() {
            skipped += 1;
            continue;
        }
        job.go_to(frame)?;
        let plan = Plan::resolve(&args, &job.scene, &job.log, frame, start)?;
        outputs.check_size(plan.region())?;
        if let Some(part) = outputs.part().filter(|_| is_there) {
            if plan.is_done(part) {
                skipped += 1;
                continue;
            }
            let name = part.display();
            let told = format!("{name} is of another scene or other options, and is rendered anew");
            job.log.log(Level::Note, &told);
        }
        picture(&plan, outputs, &mut signals, start)?;
        start = Instant::now();
    }
    if skipped > 0 {
        let told = format!("{skipped} of {count} left out, as their files are there");
        job.log.log_once(Level::Note, &told);
    }
    Ok(ExitCode::SUCCESS)
}

/// What the options ask for, looked at as a whole.
pub struct Job<'a> {
    args: &'a Args,
    pub log: OnceLog,
    /// The scene, at the frame that was gone to.
    pub scene: Scene,
    fps: Option<f64>,
    /// The frames to render, and where each goes to.
    pub frames: Vec<(Frame, Outputs)>,
}

impl<'a> Job<'a> {
    /// Reads the scene, and looks at all frames.
    pub fn new(args: &'a Args) -> anyhow::Result<Job<'a>> {
        if args.verbose {
            log::speak();
        }
        if let Some(threads) = args.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
            pool.build_global().context("threads")?; // before anything else is done in parallel
        }
        if args.shown_progress() == progress::Mode::Openjd && log::is_json() {
            let rule = "openjd is lines of text, and --log-format json leaves none";
            return Err(Usage(format!("--progress: {rule}")).into());
        }
        let frames = args.frames().into_iter();
        let frames = frames.map(|frame| Ok((frame, args.outputs(frame)?)));
        let frames: Vec<(Frame, Outputs)> = frames.collect::<anyhow::Result<_>>()?;
        let log = OnceLog::new(args.quiet);
        let scene = read(args, &log)?;
        let fps = args.fps(&scene)?;
        check(args, &scene, frames.iter().map(|(frame, outputs)| (frame, outputs)))?;
        Ok(Job {
            args,
            log,
            scene,
            fps,
            frames,
        })
    }

    /// The pixels of a picture that the options ask for.
    pub fn region(&self) -> Result<Region, Problem> {
        self.args.rendering().region(&self.scene)
    }

    /// Makes the scene what it is at a frame.
    pub fn go_to(&mut self, frame: Frame) -> anyhow::Result<()> {
        if let Some((number, fps)) = frame.number.zip(self.fps) {
            let mut overrides = self.args.overrides();
            overrides.gltf.time = Some(f64::from(number) / fps);
            let moment = super::load(&self.args.scene, &overrides)?;
            let before = std::mem::replace(&mut self.scene, moment);
            if self.args.options.is_framed(&self.scene) {
                // Of the file at rest: it stands still, and a frame by itself is the same as in a run.
                (self.scene.camera, self.scene.camera_path) = (before.camera, before.camera_path);
            }
        }
        if let Some(number) = frame.number {
            let camera = self.scene.camera_at(number.into());
            self.scene.camera = camera.map_err(|error| plain(error.into()))?;
        }
        Ok(())
    }
}

/// Reads the scene, and tells what is odd about it.
fn read(args: &Args, log: &OnceLog) -> anyhow::Result<Scene> {
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
        log.log_once(Level::Warning, &format!("{}: {note}", path.display()));
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
fn picture(plan: &Plan, outputs: Outputs, signals: &mut Signals, start: Instant) -> anyhow::Result<()> {
    let before = signals.heeded().cloned();
    let mut checkpoint = plan.open_checkpoint(before.as_ref())?;
    let mut no_checkpoint = NoCheckpoint;
    let store: &mut dyn CheckpointStore = match &mut checkpoint {
        Some(checkpoint) => checkpoint,
        None => &mut no_checkpoint,
    };
    let names: Vec<String> = outputs.files().map(|(_, name, _)| name.to_owned()).collect();
    let outputs = outputs.begin().map_err(RenderError::Output)?;
    let stop = signals.heed().context("signal handler")?;
    if let Some(signal) = stop.signal() {
        return Err(Interrupted(signal).into());
    }
    let mut renderer = plan.renderer(stop).map_err(|error| interrupted(error, stop))?;
    let setup = start.elapsed().as_secs_f64();
    info!(seconds = setup, "ready");
    let took = work::write(plan, &mut renderer, outputs.places, store, stop);
    let took = took.map_err(|error| interrupted(error.into(), stop));
    if let (Err(error), Some(kept)) = (&took, &checkpoint) {
        let path = kept.name().display();
        if error.is::<Interrupted>() {
            plan.log.log(
                Level::Note,
                &format!("{path} has what was rendered; --resume goes on from it"),
            );
        }
    }
    let took = took?;
    let total = start.elapsed().as_secs_f64();
    if !log::is_json() {
        info!(render = took.time.as_secs_f64(), seconds = total, "picture written"); // else its figures tell it
    }
    let (least, all) = (took.min_samples, plan.scene.pixel_samples);
    if least < all {
        plan.log.log(
            Level::Note,
            &format!("the time was up: each pixel has {least} of {all} samples, or more"),
        );
    }
    let stats = stats(plan, renderer.info(), &took, setup, total);
    if log::is_json() && !plan.log.is_quiet() {
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

fn stats(plan: &Plan, device: &DeviceInfo, took: &RenderTotals, setup: f64, total: f64) -> Stats {
    let (region, scene) = (plan.region(), &plan.scene);
    let render = took.time.as_secs_f64();
    let rays_now = took.camera_rays as f64 * took.fraction_rendered;
    Stats {
        frame: plan.frame.number,
        device: device.name.clone(),
        driver: device.driver.clone(),
        backend: device.interface.clone(),
        width: region.width(),
        height: region.height(),
        pixel_samples: scene.pixel_samples,
        min_samples: took.min_samples,
        light_samples: scene.light_samples(),
        setup_s: setup,
        render_s: render,
        total_s: total,
        camera_rays: took.camera_rays,
        fraction_rendered: took.fraction_rendered,
        shadow_rays: None,
        nominal_mrays_per_s: Stats::nominal(rays_now, scene.light_samples(), render),
    }
}
