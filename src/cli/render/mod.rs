//! `wgray render`: renders a scene to one or several images.

mod args;
mod once_log;
mod plan;
mod preview;
mod work;

use crate::scene::Note;
use std::collections::BTreeMap;
use std::io;
use std::process::ExitCode;
use std::time::Instant;

use crate::device::DeviceInfo;
use crate::error::RenderError;
use crate::scene::{Scene, is_model};
use crate::session::Session;
use anyhow::Context as _;
use tracing::info;
use wgray_render::job::{CheckpointStore, NoCheckpoint};

use self::once_log::OnceLog;
use self::plan::Plan;
use self::preview::Previews;
use self::work::RenderTotals;
use super::frames::Frame;
use super::log::{self, Level};
use super::numbers::significant;
use super::outputs::Outputs;
use super::signal::{Signals, Stop};
use super::stats::Stats;
use super::{Interrupted, Usage, cli_error, facts_of, located, progress};

pub use args::{Args, parse_size};

pub fn run(args: Args, start: Instant) -> anyhow::Result<ExitCode> {
    let mut signals = Signals::immediate(args.requeue_exit).context("signal handler")?;
    let mut job = Job::new(&args)?;
    info!(seconds = start.elapsed().as_secs_f64(), "scene read");
    let (mut start, mut skipped) = (start, 0);
    let count = job.frames.len();
    for (i, (frame, outputs)) in std::mem::take(&mut job.frames).into_iter().enumerate() {
        let exists = args.skip_existing && outputs.exist();
        if exists && outputs.part().is_none() {
            skipped += 1;
            continue;
        }
        job.select_frame(frame)?;
        let plan = Plan::resolve(&args, &mut job.session, &job.log, frame, start)?;
        job.session.set_workload(plan.workload(count - i));
        outputs.check_size(plan.region())?;
        if let Some(part) = outputs.part().filter(|_| exists) {
            if plan.is_done(part) {
                skipped += 1;
                continue;
            }
            let file = outputs.files().find(|(_, _, path)| *path == part);
            let name = file.map_or(part.to_string_lossy(), |(_, name, _)| name.into());
            let message =
                format!("{name}: is damaged, or belongs to another scene or other options; rendering it again");
            job.log.log(Level::Note, &message);
        }
        render_image(&plan, &mut job.session, outputs, &mut signals, start)?;
        start = Instant::now();
    }
    if skipped > 0 {
        let message = format!("skipped {skipped} of {count}: the output files exist");
        job.log.log_once(Level::Note, &message);
    }
    Ok(ExitCode::SUCCESS)
}

struct Job<'a> {
    args: &'a Args,
    log: OnceLog,
    session: Session,
    fps: Option<f64>,
    /// The frames to render, with their destinations.
    frames: Vec<(Frame, Outputs)>,
}

impl<'a> Job<'a> {
    fn new(args: &'a Args) -> anyhow::Result<Job<'a>> {
        if args.verbose {
            log::print_events();
        }
        if args.progress_mode() == progress::Mode::Openjd && log::is_json() {
            let rule = "openjd cannot be combined with --log-format json";
            return Err(Usage(format!("--progress: {rule}")).into());
        }
        let frames = args.frames().into_iter();
        let frames = frames.map(|frame| Ok((frame, args.outputs(frame)?)));
        let frames: Vec<(Frame, Outputs)> = frames.collect::<anyhow::Result<_>>()?;
        let log = OnceLog::new(args.quiet);
        let scene = read(args, &log)?;
        let fps = args.fps(&scene)?;
        check(args, &scene, frames.iter().map(|(frame, outputs)| (frame, outputs)))?;
        let jpeg = frames.iter().find_map(|(_, outputs)| outputs.without_alpha());
        if let (true, Some(name)) = (scene.render.alpha, jpeg) {
            let note =
                format!("{name}: JPEG has no alpha; the transparent background is black (use .png, .webp or .exr)");
            log.log_once(Level::Warning, &note);
        }
        Ok(Job {
            args,
            log,
            session: Session::new(&crate::Context::new(), scene),
            fps,
            frames,
        })
    }

    fn select_frame(&mut self, frame: Frame) -> anyhow::Result<()> {
        if let Some((number, fps)) = frame.number.zip(self.fps) {
            let mut overrides = self.args.overrides();
            overrides.gltf.time = Some(f64::from(number) / fps);
            let mut scene = super::load(&self.args.scene, &overrides)?;
            let before = self.session.scene();
            scene.keep_ground(before);
            if self.args.options.is_framed(&scene) {
                // The automatic camera frames the unanimated model, so that the camera is the same in all frames.
                (scene.camera, scene.camera_path) = (before.camera, before.camera_path.clone());
            }
            self.session.set_scene(scene);
        }
        if let Some(number) = frame.number {
            let camera = self.session.scene().camera_at(number.into());
            let camera = camera.map_err(|error| cli_error(error.into()))?;
            self.session.set_camera(camera).map_err(cli_error)?;
        }
        Ok(())
    }
}

/// Reads the scene and prints its warnings.
fn read(args: &Args, log: &OnceLog) -> anyhow::Result<Scene> {
    let (path, overrides) = (&args.scene, args.overrides());
    let scene = progress::with_spinner(args.progress_mode(), "reading the scene", || {
        super::load(path, &overrides)
    })?;
    let rule = match is_model(path) {
        true => "no animation: all frames are equal",
        false => "no camera.path: all frames are equal",
    };
    let is_animated = scene.camera_path.is_some() || args.fps(&scene)?.is_some();
    let warning = (args.frames.is_some() && !is_animated).then_some(rule);
    let warnings = scene
        .visibility_warnings()
        .into_iter()
        .chain(warning.map(str::to_owned));
    for note in scene.notes.iter().cloned().chain(warnings.map(Note::from)) {
        log.log_once(Level::Warning, &located(path, &note));
    }
    Ok(scene)
}

/// Checks all frames before rendering: outputs must not be inputs, and cameras must be valid.
fn check<'a>(args: &Args, scene: &Scene, frames: impl Iterator<Item = (&'a Frame, &'a Outputs)>) -> anyhow::Result<()> {
    let inputs = [std::slice::from_ref(&args.scene), &scene.files].concat();
    let mut files = BTreeMap::new();
    for (frame, outputs) in frames {
        let checkpoint = args.checkpoint(*frame)?;
        outputs.check(&inputs, checkpoint.as_deref())?;
        if args.preview {
            outputs.check_preview()?;
        }
        let checkpoint = checkpoint.as_deref().map(|path| (path.to_string_lossy(), path));
        let checkpoint = checkpoint.iter().map(|(name, path)| ("--checkpoint", &**name, *path));
        for (option, name, path) in outputs.files().chain(checkpoint) {
            if let Some(other) = files.insert(path.to_owned(), frame.number) {
                let [number, other] = [frame.number, other].map(Option::unwrap_or_default);
                let rule = format!(
                    "{option}: {name}: frames {other} and {number} would be written to this file; add # to the name"
                );
                return Err(Usage(rule).into());
            }
        }
        if let Some(number) = frame.number {
            scene
                .camera_at(number.into())
                .map_err(|error| cli_error(error.into()))?;
        }
    }
    Ok(())
}

/// Renders an image or a part. During and after the first render, signals are deferred: they end the command after
/// cleanup.
fn render_image(
    plan: &Plan,
    session: &mut Session,
    outputs: Outputs,
    signals: &mut Signals,
    start: Instant,
) -> anyhow::Result<()> {
    let deferred = signals.deferred().cloned();
    let mut checkpoint = plan.open_checkpoint(deferred.as_ref())?;
    let mut no_checkpoint = NoCheckpoint;
    let store: &mut dyn CheckpointStore = match &mut checkpoint {
        Some(checkpoint) => checkpoint,
        None => &mut no_checkpoint,
    };
    let files: Vec<String> = outputs.files().map(|(_, name, _)| name.to_owned()).collect();
    let image_names = outputs.image_names();
    let previews = match plan.preview {
        true => Some(Previews::new(outputs.rewritable().map_err(RenderError::Output)?)),
        false => None,
    };
    let outputs = outputs.open().map_err(RenderError::Output)?;
    let stop = signals.defer().context("signal handler")?;
    if let Some(signal) = stop.signal() {
        return Err(Interrupted(signal).into());
    }
    let mut renderer = plan.renderer(session, stop).map_err(|error| interrupted(error, stop))?;
    let setup = start.elapsed().as_secs_f64();
    info!(seconds = setup, "ready");
    let totals = work::write(plan, &mut renderer, outputs.files, store, stop, previews);
    let totals = totals.map_err(|error| interrupted(error.into(), stop));
    if totals.as_ref().is_err_and(|error| error.is::<Interrupted>()) {
        let note = match &checkpoint {
            Some(checkpoint) => {
                let name = checkpoint.name().display();
                match checkpoint.is_current() {
                    true => format!("progress is saved in {name}; --resume continues"),
                    false => {
                        format!("the latest progress is not saved in {name}; --resume continues what was saved before")
                    }
                }
            }
            None if plan.preview => "the samples taken so far were not written".to_owned(),
            None => "no image was written; --preview saves the image so far, --checkpoint FILE saves the progress"
                .to_owned(),
        };
        plan.log.log(Level::Note, &note);
    }
    let totals = totals?;
    let total = start.elapsed().as_secs_f64();
    let stats = stats(plan, renderer.info(), &totals, setup, total);
    let (requested, all) = (totals.requested_samples, plan.samples);
    let (image_names, files, message) = match totals.partial.is_empty() {
        true => (image_names, files, "render done"),
        false => (totals.partial.clone(), totals.partial.clone(), "render interrupted"),
    };
    let is_below = stats.noise.zip(plan.noise).is_some_and(|(noise, limit)| noise < limit);
    if stats.partial {
        let note = format!("interrupted: the image has {requested} of {all} samples per pixel");
        plan.log.log(Level::Note, &note);
    } else if requested < all && !totals.is_converged {
        let note = format!("time limit reached: every pixel has at least {requested} of {all} samples");
        plan.log.log(Level::Note, &note);
    } else if let (Some(noise), Some(limit), false) = (stats.noise, plan.noise, is_below) {
        let note = format!(
            "the noise, {}, is not below {limit} after the maximum of {all} samples per pixel",
            significant(noise)
        );
        plan.log.log(Level::Note, &note);
    }
    match log::is_json() {
        true => {
            let facts = facts_of([("files", files.into()), ("stats", serde_json::to_value(&stats)?)]);
            plan.log.log_with(Level::Info, message, facts);
        }
        false => plan.log.log(Level::Info, &summary(&image_names, &stats, requested)),
    }
    if let Some(file) = outputs.stats {
        match stats.write(file) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {} // the reader of the statistics has ended
            result => result.map_err(RenderError::Output)?,
        }
    }
    match stop.signal().filter(|_| !totals.partial.is_empty()) {
        Some(signal) => Err(Interrupted(signal).into()),
        None => Ok(()),
    }
}

/// Returns the summary of a written image: `box.png: 1024 x 1024, 64 spp, 12.3 s`.
fn summary(image_names: &[String], stats: &Stats, requested: u32) -> String {
    let samples = match stats.min_samples {
        min if min < requested => format!("{min}-{requested}"), // adaptive sampling
        _ => requested.to_string(),
    };
    let noise = stats.noise.zip(stats.noise_median).map(|(percentile, median)| {
        let [percentile, median] = [percentile, median].map(significant);
        format!("noise {percentile} (median {median}), ")
    });
    let (width, height) = (stats.width, stats.height);
    format!(
        "{}: {width} x {height}, {samples} spp, {}{:.1} s",
        image_names.join(", "),
        noise.unwrap_or_default(),
        stats.total_s
    )
}

/// Returns the signal as the error if the signal caused the error.
fn interrupted(error: anyhow::Error, stop: &Stop) -> anyhow::Error {
    match (error.downcast_ref(), stop.signal()) {
        (Some(RenderError::Cancelled), Some(signal)) => Interrupted(signal).into(),
        _ => error,
    }
}

fn stats(plan: &Plan, device: &DeviceInfo, totals: &RenderTotals, setup: f64, total: f64) -> Stats {
    let (region, scene) = (plan.region(), &plan.scene);
    let render = totals.time.as_secs_f64();
    let rendered_rays = totals.camera_rays as f64 * totals.fraction_rendered;
    Stats {
        frame: plan.frame.number,
        device: device.name.clone(),
        driver: device.driver.clone(),
        backend: device.interface.clone(),
        width: region.width(),
        height: region.height(),
        pixel_samples: plan.samples,
        min_samples: totals.min_samples,
        former_min_samples: totals.min_samples,
        noise: totals.noise.map(|noise| noise.percentile_95),
        noise_median: totals.noise.map(|noise| noise.median),
        partial: !totals.partial.is_empty(),
        light_samples: scene.light_samples(),
        setup_s: setup,
        render_s: render,
        total_s: total,
        camera_rays: totals.camera_rays,
        fraction_rendered: totals.fraction_rendered,
        former_fraction_rendered: totals.fraction_rendered,
        shadow_rays: None,
        nominal_mrays_per_s: Stats::nominal(rendered_rays, scene.light_samples(), render),
    }
}
