//! `wgray farm`: the files that an engine of render farms takes for a scene. Each task renders a part of a picture, as `wgray render
//! --tile` does; others join the parts. What tasks are told is what this command was told.

mod given;
mod openjd;
mod slurm;
mod text;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{fs, io};

use clap::Subcommand;
use clap::builder::NonEmptyStringValueParser;
use wgray::error::RenderError;
use wgray::image::{Output, Pending};
use wgray::job::Tile;

use self::given::{Given, Rendering};
use self::text::{plain, word};
use super::frames::Frames;
use super::log::{self, Level};
use super::outputs::keep_inputs;
use super::render::{Job, Trial, parse_duration};
use super::{Usage, ended, option};

/// What runs the tasks.
#[derive(Debug, Subcommand)]
pub enum Engine {
    /// Writes a template of Open Job Description (jobtemplate-2023-09): a step of parts, and one that joins them
    Openjd(Box<Args>),
    /// Writes batch scripts of Slurm, an array of parts and one that joins them, and a script that submits both
    Slurm(Box<Args>),
}

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
#[command(allow_negative_numbers = true)] // so that a number out of range is told as such
#[group(id = "farm")] // beside those of wgray render, which are among these
pub struct Args {
    #[command(flatten)]
    own: Own,

    #[command(flatten)]
    rendering: Rendering,
}

/// What is the farm's own.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Farm")]
struct Own {
    /// Where the files go. openjd: the template, NAME.yaml; if absent, the scene's name with .openjd.yaml. slurm: a folder for the scripts,
    /// in which parts and logs will be too; if absent, the scene's name with .farm
    #[arg(long, value_name = "PATH")]
    to: Option<PathBuf>,

    /// Parts of each picture. If absent, as many as --task-time says, by a trial of some seconds on this machine
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    tiles: Option<u32>,

    /// How long a task is to take, from its start on, on a machine like this one: seconds, or with a unit, as 90s, 1.5m, 2h
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "10m", conflicts_with = "tiles")]
    task_time: Duration,

    /// After how long the engine ends a task, 2m or more. If absent, four times what the trial has found, 10m at least; the engine's own
    /// with --tiles
    #[arg(long, value_name = "TIME", value_parser = parse_limit)]
    limit: Option<Duration>,

    /// What wgray is called on the machines of the farm
    #[arg(long, value_name = "NAME", default_value = "wgray", value_parser = NonEmptyStringValueParser::new())]
    program: String,

    /// Replaces files of an earlier wgray farm
    #[arg(long)]
    overwrite: bool,
}

fn parse_limit(text: &str) -> Result<Duration, String> {
    let limit = parse_duration(text)?;
    let rule = "must be 2m or more: a minute before it is up a task is told to keep what it has";
    (limit >= LEAST_LIMIT).then_some(limit).ok_or(rule.to_owned())
}

const LEAST_LIMIT: Duration = Duration::from_secs(120);
/// The limit of tasks whose time is known.
const SURELY: u32 = 4;
const SURELY_AT_LEAST: Duration = Duration::from_secs(600);

impl Engine {
    /// Threads of the CPU and of software Vulkan, if not all.
    pub fn threads(&self) -> Option<u16> {
        self.args().rendering.args.threads
    }

    fn args(&self) -> &Args {
        match self {
            Engine::Openjd(args) | Engine::Slurm(args) => args,
        }
    }
}

/// What the files are written of. All texts are plain.
struct Work {
    /// The folder that names are counted from.
    folder: String,
    /// Where the tasks keep what they make.
    place: String,
    scene: String,
    /// The scene's name, for people.
    name: String,
    outputs: Vec<String>,
    program: String,
    tiles: u32,
    frames: Option<Frames>,
    /// Words of a shell: the options of `wgray render` and of `wgray merge`.
    render: Vec<String>,
    merge: Vec<String>,
    limit: Option<Duration>,
    /// Lines that tell of the trial.
    told: Vec<String>,
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
        return Err(Usage(format!("{option}: is not for farms, whose tasks have their own")).into());
    }
    let outputs = &rendering.args.pictures.output;
    if outputs.is_empty() {
        return Err(Usage("--output: must be there: -o NAME.exr".to_owned()).into());
    }
    let is_stream =
        |output: &&PathBuf| output.as_os_str() == "-" || Output::find(output).is_ok_and(|output| !output.is_file());
    if let Some(output) = outputs.iter().find(is_stream) {
        let rule = "must be a file, which the tasks' machines reach";
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
    // Before a trial is made for files that may not be written.
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
    let mut lines = work.told.clone();
    let (tasks, pictures) = (work.tasks(), work.pictures());
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
        of(pictures)
    ));
    lines.push(match engine {
        Engine::Openjd(_) => openjd::next(&work, &to),
        Engine::Slurm(_) => slurm::next(&to),
    });
    let text = lines.join("\n") + "\n";
    Ok(ended(io::stdout().lock().write_all(text.as_bytes()), ExitCode::SUCCESS))
}

/// What is known before the scene is read. There is one part.
fn work(args: &Args, place: String) -> anyhow::Result<Work> {
    let (
        own,
        Rendering {
            args, render, merge, ..
        },
    ) = (&args.own, &args.rendering);
    let words = |options: &[Given]| -> Result<Vec<String>, Usage> {
        let told = |(name, value): &Given| match value {
            None => Ok(word(name)),
            Some(value) => Ok(word(&format!("{name}={}", plain(name, value)?))),
        };
        options.iter().map(told).collect()
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
        told: Vec::new(),
    })
}

/// Looks at the job, and settles how many parts a picture has.
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
                "--tiles: {tiles}: parts are whole rows, and the picture has {rows} of them"
            ))
            .into());
        }
        work.tiles = tiles;
        return Ok(());
    }
    let trial = Trial::of(job, frame, start)?;
    let (fixed, all) = (trial.fixed.as_secs_f64(), own.task_time.as_secs_f64());
    let rendering = (all - fixed).max(fixed); // no more than half of a task is lost to its beginning
    work.tiles = (trial.rendering / rendering).ceil().clamp(1.0, f64::from(rows)) as u32;
    let of_a_task = trial.rendering / f64::from(work.tiles);
    let surely = Duration::from_secs_f64(((fixed + of_a_task) * f64::from(SURELY)).min(1e9));
    work.limit = work.limit.or(Some(surely.max(SURELY_AT_LEAST)));
    work.told.push(format!(
        "A task takes some {}: {} to begin, {} to render; the slowest rows take {:.1} times the mean.",
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
    work.told.push(format!(
        "This is by a trial{of} on {device}; a picture by itself takes {}.",
        seconds(fixed + trial.rendering)
    ));
    let (of, begins) = (seconds(all), seconds(fixed));
    let told = if trial.rendering > rendering * f64::from(rows) {
        Some(format!("a part is a row at least, and takes longer than {of}"))
    } else if all < 2.0 * fixed && work.tiles == 1 {
        Some(format!(
            "of {of} each task needs {begins} to begin; the picture is one task"
        ))
    } else if all < 2.0 * fixed {
        Some(format!(
            "of {of} each task needs {begins} to begin; tasks are longer, so that it is half of them at most"
        ))
    } else {
        None
    };
    if let Some(told) = told {
        log::say(Level::Warning, &format!("--task-time: {told}"));
    }
    Ok(())
}

impl Work {
    fn pictures(&self) -> u64 {
        self.frames.as_ref().map_or(1, Frames::count) as u64
    }

    fn tasks(&self) -> u64 {
        self.pictures() * u64::from(self.tiles)
    }

    /// What the tasks render together.
    fn what(&self) -> String {
        match self.tiles {
            1 => format!("{} of {}", self.count_of_pictures(), self.name),
            tiles => format!("{} of {} in {tiles} parts", self.count_of_pictures(), self.name),
        }
    }

    fn count_of_pictures(&self) -> String {
        match &self.frames {
            None => "One picture".to_owned(),
            Some(frames) if frames.count() == 1 => "One frame".to_owned(),
            Some(frames) => format!("{} frames", frames.count()),
        }
    }

    /// What the first lines of each file say.
    fn head(&self, what: &str) -> Vec<String> {
        let mut lines = vec![
            what.to_owned(),
            concat!("Written by wgray farm, version ", env!("CARGO_PKG_VERSION"), ".").to_owned(),
        ];
        lines.extend(self.told.iter().cloned());
        lines
    }
}

/// A time for people.
fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.1 => format!("{:.0} ms", s * 1e3),
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} minutes", s / 60.0),
        s => format!("{:.1} hours", s / 3600.0),
    }
}

/// Lines of comments.
fn comments(lines: &[String]) -> String {
    lines.iter().map(|line| format!("# {line}\n")).collect()
}

/// A command over several lines.
fn command(indent: &str, words: &[String]) -> String {
    words.join(&format!(" \\\n{indent}    "))
}

/// Refuses to replace what is there: an earlier job whose scripts were changed by hand, or a file that has nothing to do with farms.
fn check(files: &[File], inputs: &[PathBuf], overwrite: bool) -> anyhow::Result<()> {
    for File { path, .. } in files {
        let output = Output::find(path).map_err(RenderError::Output)?;
        keep_inputs("--to", &output, inputs, "choose another name")?;
        let name = path.display();
        if !output.is_file() {
            return Err(Usage(format!("--to: {name}: must be a file, there or not yet")).into());
        }
        if !overwrite && fs::symlink_metadata(path).is_ok() {
            let rule = "is there already; --overwrite replaces it, --to names another place";
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
        permissions.set_mode(permissions.mode() | ((permissions.mode() & 0o444) >> 2)); // for those who read it
        fs::set_permissions(&file.path, permissions).map_err(|error| not_written(&file.path, &error))?;
    }
    Ok(())
}

fn not_written(path: &Path, error: &io::Error) -> RenderError {
    RenderError::Output(io::Error::new(error.kind(), format!("{}: {error}", path.display())))
}
