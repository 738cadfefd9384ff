//! `wgray farm`: writes the files with which a render farm renders a scene. Each task renders a part of an image, as `wgray render
//! --tile` does; further tasks join the parts. The tasks get the options of this command.

mod given;
mod openjd;
mod slurm;
pub mod text;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{fs, io};

use crate::error::RenderError;
use crate::image::{Output, Pending};
use clap::Subcommand;
use clap::builder::NonEmptyStringValueParser;
use wgray_render::job::Tile;

use self::given::{Given, Rendering};
use self::text::{plain, word};
use super::frames::Frames;
use super::log::{self, Level};
use super::numbers::whole;
use super::outputs::keep_inputs;
use super::render::{Job, Trial, parse_duration};
use super::{Usage, ended, option};

/// The engine that runs the tasks.
#[derive(Debug, Subcommand)]
pub enum Engine {
    /// Write a template for Open Job Description (jobtemplate-2023-09)
    Openjd(Box<Args>),
    /// Write batch scripts for Slurm, and a script that submits them
    Slurm(Box<Args>),
}

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
#[command(allow_negative_numbers = true)] // report negative numbers as out of range
#[group(id = "farm")] // the default id is that of the flattened options of wgray render
pub struct Args {
    #[command(flatten)]
    rendering: Rendering,

    #[command(flatten)]
    own: Own,
}

/// Options specific to `wgray farm`.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Farm")]
struct Own {
    /// Write the template (openjd) or the folder (slurm) PATH [default: SCENE.openjd.yaml, SCENE.farm]
    #[arg(long, value_name = "PATH")]
    to: Option<PathBuf>,

    /// Split each image into N parts [default: estimated from --task-time by a short test render]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=u32::MAX))]
    tiles: Option<u32>,

    /// Set the target duration of a task on a machine like this one: 90s, 1.5m, 2h
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "10m", conflicts_with = "tiles")]
    task_time: Duration,

    /// Set the time limit of a task, 2m or more [default: 4 times the estimated duration, at least 10m]
    #[arg(long, value_name = "TIME", value_parser = parse_limit)]
    limit: Option<Duration>,

    /// Set the name or path of wgray on the machines of the farm
    #[arg(long, value_name = "NAME", default_value = "wgray", value_parser = NonEmptyStringValueParser::new())]
    program: String,

    /// Overwrite existing files
    #[arg(long)]
    overwrite: bool,
}

fn parse_limit(text: &str) -> Result<Duration, String> {
    let limit = parse_duration(text)?;
    let rule = "must be 2m or more: tasks are signaled a minute before it, to write a checkpoint";
    (limit >= MIN_LIMIT).then_some(limit).ok_or(rule.to_owned())
}

const MIN_LIMIT: Duration = Duration::from_secs(120);
/// Default time limit of tasks: this multiple of the estimated duration, but at least the minimum.
const LIMIT_FACTOR: u32 = 4;
const MIN_DEFAULT_LIMIT: Duration = Duration::from_secs(600);

impl Engine {
    /// Returns the number of threads of the CPU and software Vulkan; `None` for all.
    pub fn threads(&self) -> Option<u16> {
        self.args().rendering.args.threads
    }

    fn args(&self) -> &Args {
        match self {
            Engine::Openjd(args) | Engine::Slurm(args) => args,
        }
    }
}

/// The contents of the files. No string contains control characters.
struct Work {
    /// Base folder of relative paths.
    folder: String,
    /// Folder for parts and checkpoints.
    place: String,
    scene: String,
    /// Display name of the scene.
    name: String,
    outputs: Vec<String>,
    program: String,
    tiles: u32,
    frames: Option<Frames>,
    /// Options of `wgray render` and `wgray merge`, quoted for the shell.
    render: Vec<String>,
    merge: Vec<String>,
    limit: Option<Duration>,
    /// Lines that report the estimate.
    trial: Vec<String>,
}

/// A file to write.
struct File {
    path: PathBuf,
    text: String,
    is_program: bool,
}

/// Writes the files for an engine.
pub fn run(engine: &Engine, start: Instant) -> anyhow::Result<ExitCode> {
    let args = engine.args();
    let (own, rendering) = (&args.own, &args.rendering);
    if let Some(option) = &rendering.refused {
        return Err(Usage(format!(
            "{option}: cannot be used with wgray farm, which sets it for each task"
        ))
        .into());
    }
    let outputs = &rendering.args.pictures.output;
    if outputs.is_empty() {
        return Err(Usage("--output: is required: -o NAME.exr".to_owned()).into());
    }
    let is_stream =
        |output: &&PathBuf| output.as_os_str() == "-" || Output::find(output).is_ok_and(|output| !output.is_file());
    if let Some(output) = outputs.iter().find(is_stream) {
        let rule = "must be a file that the machines of the farm can write";
        return Err(Usage(format!("--output: {}: {rule}", output.display())).into());
    }
    let stem = plain("SCENE", rendering.args.scene.file_stem().unwrap_or("scene".as_ref()))?;
    let to = match (engine, &own.to) {
        (_, Some(to)) => to.clone(),
        (Engine::Openjd(_), None) => format!("{stem}.openjd.yaml").into(),
        (Engine::Slurm(_), None) => format!("{stem}.farm").into(),
    };
    let place = match engine {
        Engine::Openjd(_) => format!("{stem}.farm"),
        Engine::Slurm(_) => plain("--to", to.as_os_str())?,
    };
    let mut work = work(args, place)?;
    // Checked before the test render, which takes seconds.
    let files = match engine {
        Engine::Openjd(_) => openjd::files(&work, &to)?,
        Engine::Slurm(_) => slurm::files(&work, &to),
    };
    let mut job = Job::new(&rendering.args)?;
    let inputs = [std::slice::from_ref(&rendering.args.scene), &job.scene.files].concat();
    if matches!(engine, Engine::Openjd(_)) || to.exists() {
        check(&files, &inputs, own.overwrite)?;
    }
    size(&mut work, own, &mut job, start)?;
    let files = match engine {
        Engine::Openjd(_) => openjd::files(&work, &to)?,
        Engine::Slurm(_) => slurm::files(&work, &to),
    };
    if let Engine::Slurm(_) = engine {
        fs::create_dir_all(&to).map_err(|error| not_written(&to, &error))?;
    }
    for file in &files {
        write(file)?;
    }
    let mut lines = work.trial.clone();
    let (tasks, images) = (work.tasks(), work.images());
    let of = |count: u64| {
        if count == 1 {
            "1 task".to_owned()
        } else {
            format!("{count} tasks")
        }
    };
    lines.push(format!(
        "{}: {} to render, {} to join the parts.",
        work.what(),
        of(tasks),
        of(images)
    ));
    lines.push(match engine {
        Engine::Openjd(_) => openjd::next(&work, &to),
        Engine::Slurm(_) => slurm::next(&to),
    });
    let text = lines.join("\n") + "\n";
    Ok(ended(io::stdout().lock().write_all(text.as_bytes()), ExitCode::SUCCESS))
}

/// Collects the contents that are known before the scene is read, with a single part per image.
fn work(args: &Args, place: String) -> anyhow::Result<Work> {
    let (
        own,
        Rendering {
            args, render, merge, ..
        },
    ) = (&args.own, &args.rendering);
    let words = |options: &[Given]| -> Result<Vec<String>, Usage> {
        let quoted = |(name, value): &Given| match value {
            None => Ok(word(name)),
            Some(value) => Ok(word(&format!("{name}={}", plain(name, value)?))),
        };
        options.iter().map(quoted).collect()
    };
    let name = args.scene.file_name().unwrap_or(args.scene.as_os_str());
    let outputs = args
        .pictures
        .output
        .iter()
        .map(|output| plain("--output", output.as_os_str()));
    let folder = std::env::current_dir().map_err(|error| not_written(Path::new("."), &error))?;
    Ok(Work {
        folder: plain("the current folder", folder.as_os_str())?,
        place,
        scene: plain("SCENE", args.scene.as_os_str())?,
        name: plain("SCENE", name)?,
        outputs: outputs.collect::<Result<_, _>>()?,
        program: plain("--program", own.program.as_ref())?,
        tiles: 1,
        frames: args.frames.clone().or(args.turntable.map(Frames::first)),
        render: words(render)?,
        merge: words(merge)?,
        limit: own.limit,
        trial: Vec::new(),
    })
}

/// Determines the number of parts per image, by a test render unless --tiles is given.
fn size(work: &mut Work, own: &Own, job: &mut Job, start: Instant) -> anyhow::Result<()> {
    let frame = match work.frames.as_ref().and_then(Frames::middle) {
        None => super::frames::Frame::one(None),
        Some(number) => super::frames::Frame::one(Some(number)),
    };
    let region = job.region().map_err(|problem| option(&problem))?;
    for (_, outputs) in &job.frames {
        outputs.check_size(region)?;
    }
    let rows = region.height();
    if let Some(tiles) = own.tiles {
        if (Tile { number: 1, of: tiles }).rows(region).is_none() {
            return Err(Usage(format!(
                "--tiles: {tiles}: must be at most {rows}, the number of rows of the image"
            ))
            .into());
        }
        work.tiles = tiles;
        return Ok(());
    }
    let trial = Trial::of(job, frame, start)?;
    let (fixed, all) = (trial.fixed.as_secs_f64(), own.task_time.as_secs_f64());
    let rendering = (all - fixed).max(fixed); // startup takes at most half of a task
    work.tiles = (trial.rendering / rendering).ceil().clamp(1.0, f64::from(rows)) as u32;
    let of_a_task = trial.rendering / f64::from(work.tiles);
    let surely = Duration::from_secs_f64(((fixed + of_a_task) * f64::from(LIMIT_FACTOR)).min(1e9));
    work.limit = work.limit.or(Some(surely.max(MIN_DEFAULT_LIMIT)));
    work.trial.push(format!(
        "A task takes about {}: {} of startup and {} of rendering. The slowest rows take {:.1} times the mean.",
        seconds(fixed + of_a_task),
        seconds(fixed),
        seconds(of_a_task),
        trial.unevenness,
    ));
    let of = frame
        .number
        .map(|number| format!(" of frame {number}"))
        .unwrap_or_default();
    let device: String = trial
        .device
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    work.trial.push(format!(
        "Estimated by a test render{of} on {device}; a whole image takes {}.",
        seconds(fixed + trial.rendering)
    ));
    let (of, begins) = (seconds(all), seconds(fixed));
    let warning = if trial.rendering > rendering * f64::from(rows) {
        Some(format!("a single row takes longer than {of}"))
    } else if all < 2.0 * fixed && work.tiles == 1 {
        Some(format!(
            "startup takes {begins}, more than half of {of}; the image is a single task"
        ))
    } else if all < 2.0 * fixed {
        Some(format!(
            "startup takes {begins}, more than half of {of}; tasks are lengthened so that it takes at most half"
        ))
    } else {
        None
    };
    if let Some(warning) = warning {
        log::say(Level::Warning, &format!("--task-time: {warning}"));
    }
    Ok(())
}

impl Work {
    fn images(&self) -> u64 {
        self.frames.as_ref().map_or(1, Frames::count) as u64
    }

    fn tasks(&self) -> u64 {
        self.images() * u64::from(self.tiles)
    }

    /// Describes the images that the job renders.
    fn what(&self) -> String {
        match self.tiles {
            1 => format!("{} of {}", self.count_of_images(), self.name),
            tiles => format!("{} of {} in {tiles} parts", self.count_of_images(), self.name),
        }
    }

    fn count_of_images(&self) -> String {
        match &self.frames {
            None => "One image".to_owned(),
            Some(frames) if frames.count() == 1 => "One frame".to_owned(),
            Some(frames) => format!("{} frames", frames.count()),
        }
    }

    /// Returns the header lines of a file.
    fn head(&self, what: &str) -> Vec<String> {
        let mut lines = vec![
            what.to_owned(),
            concat!("Written by wgray farm, version ", env!("CARGO_PKG_VERSION"), ".").to_owned(),
        ];
        lines.extend(self.trial.iter().cloned());
        lines
    }
}

/// Formats a duration.
fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.1 => format!("{:.0} ms", s * 1e3),
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} minutes", s / 60.0),
        s => format!("{:.1} hours", s / 3600.0),
    }
}

/// Formats lines as comments.
fn comments(lines: &[String]) -> String {
    lines.iter().map(|line| format!("# {line}\n")).collect()
}

/// Formats a command as several lines.
fn command(indent: &str, words: &[String]) -> String {
    words.join(&format!(" \\\n{indent}    "))
}

/// Rejects existing files, which may be scripts changed by hand or unrelated to farms.
fn check(files: &[File], inputs: &[PathBuf], overwrite: bool) -> anyhow::Result<()> {
    for File { path, .. } in files {
        let output = Output::find(path).map_err(RenderError::Output)?;
        keep_inputs("--to", &output, inputs, "choose another name")?;
        let name = path.display();
        if !output.is_file() {
            return Err(Usage(format!("--to: {name}: must be a regular file or a new name")).into());
        }
        if !overwrite && fs::symlink_metadata(path).is_ok() {
            let rule = "already exists; pass --overwrite to replace it, or choose another name with --to";
            return Err(Usage(format!("--to: {name}: {rule}")).into());
        }
    }
    Ok(())
}

fn write(file: &File) -> Result<(), RenderError> {
    let output = Output::find(&file.path).map_err(RenderError::Output)?;
    let mut pending = Pending::start(output).map_err(RenderError::Output)?;
    let written = pending.write_all(file.text.as_bytes());
    written.and_then(|()| pending.finish()).map_err(RenderError::Output)?;
    #[cfg(unix)]
    if file.is_program {
        use std::os::unix::fs::PermissionsExt as _;
        let data = fs::metadata(&file.path).map_err(|error| not_written(&file.path, &error))?;
        let mut permissions = data.permissions();
        permissions.set_mode(permissions.mode() | ((permissions.mode() & 0o444) >> 2)); // for every user that can read it
        fs::set_permissions(&file.path, permissions).map_err(|error| not_written(&file.path, &error))?;
    }
    Ok(())
}

fn not_written(path: &Path, error: &io::Error) -> RenderError {
    RenderError::Output(io::Error::new(error.kind(), format!("{}: {error}", path.display())))
}
