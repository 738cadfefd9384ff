//! The command line: arguments, messages and exit codes. One file a subcommand.

mod check;
mod convert;
#[cfg(feature = "dev")]
mod dev;
mod devices;
mod diff;
mod merge;
mod metadata;
mod outputs;
mod picture_options;
mod progress;
mod render;
mod scene_options;
mod signal;
mod stats;

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clap::{Parser, Subcommand};
use wgray::compare::Unreadable;
use wgray::error::{Error, RenderError, ShaderError, ShaderErrors};
use wgray::scene::{Overrides, Problem, Scene, SceneError};
use wgray::visible::{visible, visible_lines};

#[derive(Debug, Parser)]
#[command(name = "wgray", version, about, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 failed, 2 wrong command line, 3 bad scene, 4 no such device, 5 pictures differ, 6 device lost, \
7 out of memory, 8 output not written, 130, 143 and 129 ended by SIGINT, SIGTERM and SIGHUP.";

/// The exit code of what could not be written.
const NOT_WRITTEN: u8 = 8;

#[derive(Debug, Subcommand)]
enum Command {
    /// Renders a scene file to a picture
    Render(Box<render::Args>),
    #[cfg_attr(
        feature = "gpu",
        doc = "Validates scene files, and the shaders for them, without a device"
    )]
    #[cfg_attr(not(feature = "gpu"), doc = "Validates scene files")]
    Check(check::Args),
    /// Joins parts of a picture, which render --tile has written, to the picture
    Merge(Box<merge::Args>),
    /// Writes a scene, a glTF file for one, as a TOML file that renders the same picture
    Convert(Box<convert::Args>),
    /// Compares two pictures, and fails if they differ
    Diff(Box<diff::Args>),
    /// Lists the adapters that pictures can be rendered on, and which one "auto" chooses
    #[command(after_help = EXIT_CODES)]
    Devices,
    /// Shows a scene on a web page, and shows it anew whenever the scene file or a shader is saved
    #[cfg(feature = "dev")]
    Dev(dev::Args),
}

/// The work was ended by a signal.
#[derive(Debug, thiserror::Error)]
#[error("cancelled")]
struct Interrupted(i32);

/// A command line that can be read but makes no sense.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Usage(String);

/// Reads the command line, does what it says, and returns the exit code.
pub fn main() -> ExitCode {
    let start = Instant::now();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(told) => return explain(&told),
    };
    let threads = match &cli.command {
        Command::Render(args) => args.threads,
        Command::Check(_) | Command::Convert(_) | Command::Diff(_) | Command::Merge(_) | Command::Devices => None,
        #[cfg(feature = "dev")]
        Command::Dev(_) => None,
    };
    prepare_environment(threads);
    signal::file_size_limit_is_an_error();
    wgray::contain::silence(); // an error tells what a lost device has panicked for
    let result = match cli.command {
        Command::Render(args) => render::run(*args, start),
        Command::Check(args) => check::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Diff(args) => diff::run(*args),
        Command::Devices => Ok(devices::run()),
        #[cfg(feature = "dev")]
        Command::Dev(args) => dev::run(args),
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            report(&error);
            exit_code(&error)
        }
    }
}

/// Prints the help or the version, or what is wrong with the command line.
fn explain(told: &clap::Error) -> ExitCode {
    match (told.print(), told.use_stderr()) {
        (_, true) => ExitCode::from(2),
        (printed, false) => ended(printed, ExitCode::SUCCESS),
    }
}

/// What drivers learn from the environment. Nothing else runs yet.
fn prepare_environment(threads: Option<u16>) {
    let set = |name: &str, value: &std::ffi::OsStr| {
        // SAFETY: the process has only this thread so far.
        unsafe { std::env::set_var(name, value) }
    };
    if let Some(threads) = threads {
        set("LP_NUM_THREADS", threads.to_string().as_ref());
    }
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Mesa complains on standard error where it is not set, and makes no other use of it without a window.
        set("XDG_RUNTIME_DIR", std::env::temp_dir().as_os_str());
    }
}

/// Reads a scene file, with options in place of some of its values.
fn load(path: &Path, overrides: &Overrides) -> anyhow::Result<Scene> {
    Scene::load_with(path, overrides).map_err(|error| plain(error.into()))
}

/// An error of the library in the words of the command line.
fn plain(error: Error) -> anyhow::Error {
    match error {
        Error::Option(problem) | Error::Scene(SceneError::Override(problem)) => option(&problem).into(),
        Error::Render(error) => error.into(),
        Error::Scene(error) => error.into(),
        error => error.into(),
    }
}

/// A problem of an option, called as the command line calls it.
fn option(problem: &Problem) -> Usage {
    let key = problem.key.to_string();
    let (name, rest) = key.split_once('.').unwrap_or((&key, ""));
    let place = if rest.is_empty() {
        String::new()
    } else {
        format!(" {rest}")
    };
    let hint = match name {
        "adaptive" if problem.message.contains("pixel_samples") => ", as with --pixel-pattern sobol",
        "aov" if problem.message.contains("integrator") => ", as with --integrator path",
        "aov" => "; --adaptive 0 gives all pixels the most samples",
        _ => "",
    };
    Usage(format!(
        "--{}{place}: {}{hint}",
        name.replace('_', "-"),
        problem.message
    ))
}

/// Says on standard error what went wrong.
fn report(error: &anyhow::Error) {
    let shader = shader_errors(error);
    if shader.is_empty() {
        let hint = match error.downcast_ref() {
            Some(RenderError::OutOfMemory { .. }) => " (--crop, --size, --device cpu)",
            _ => "",
        };
        say(&format!("error: {error:#}{hint}"));
    }
    for error in shader {
        say(&format!("error: {error}"));
        if let Some(excerpt) = &error.excerpt {
            put(&visible_lines(excerpt));
        }
    }
}

/// A line on standard error, in which names and values of files do nothing to a terminal.
fn say(line: &str) {
    put(&visible(line));
}

/// Lines on standard error. Where they cannot be written there is nobody to tell, and whatever is under way goes on.
fn put(line: &str) {
    let _ = io::stderr().lock().write_all(format!("{line}\n").as_bytes());
}

/// The exit code of a command that has printed something: a reader who has gone wanted no more, but a full disk is a
/// failure.
fn ended(printed: io::Result<()>, code: ExitCode) -> ExitCode {
    match printed.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            say(&format!("error: standard output: cannot be written: {error}"));
            ExitCode::from(NOT_WRITTEN)
        }
        _ => code,
    }
}

fn shader_errors(error: &anyhow::Error) -> &[ShaderError] {
    match (error.downcast_ref(), error.downcast_ref::<ShaderErrors>()) {
        (Some(RenderError::Shader(error)), _) => std::slice::from_ref(error),
        (_, Some(errors)) => &errors.0,
        _ => &[],
    }
}

fn exit_code(error: &anyhow::Error) -> ExitCode {
    let code = if error.is::<Usage>() {
        2
    } else if let Some(Interrupted(signal)) = error.downcast_ref() {
        signal::exit_code(*signal)
    } else if let Some(Unreadable::Memory { .. }) = error.downcast_ref() {
        7
    } else if error.is::<SceneError>() {
        3
    } else {
        match error.downcast_ref::<RenderError>() {
            Some(RenderError::NoDevice(_)) => 4,
            Some(RenderError::Lost { .. }) => 6,
            Some(RenderError::OutOfMemory { .. } | RenderError::Memory(_)) => 7,
            Some(RenderError::Output(_)) => NOT_WRITTEN,
            _ => 1,
        }
    };
    ExitCode::from(code)
}
