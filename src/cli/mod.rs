//! The command line: arguments, messages and exit codes. One file a subcommand.

mod check;
mod completions;
mod convert;
#[cfg(feature = "dev")]
mod dev;
mod devices;
mod diff;
mod exit_codes;
mod farm;
mod frames;
mod info;
mod log;
mod man;
mod merge;
mod metadata;
mod outputs;
mod picture_options;
mod progress;
mod render;
mod scene_options;
mod schema;
mod signal;
mod stats;

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clap::{Parser, Subcommand};
use serde_json::Value;
use wgray::compare::Unreadable;
use wgray::error::{Error, RenderError, ShaderError, ShaderErrors};
use wgray::scene::{Overrides, Problem, Scene, SceneError};
use wgray::visible::visible;

use self::log::{Facts, Level};

#[derive(Debug, Parser)]
#[command(name = "wgray", version, about, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// How messages are written on standard error
    #[arg(long, global = true, value_enum, value_name = "FORMAT", default_value_t)]
    log_format: log::Format,
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
    Check(Box<check::Args>),
    /// Tells what is in a scene, what it takes, and what would render it
    Info(Box<info::Args>),
    /// Joins parts of a picture, which render --tile has written, to the picture
    Merge(Box<merge::Args>),
    /// Writes what a render farm takes to render a scene in parts on many machines
    #[command(subcommand)]
    Farm(farm::Engine),
    /// Writes a scene, a glTF file for one, as a TOML file that renders the same picture
    Convert(Box<convert::Args>),
    /// Compares two pictures, and fails if they differ
    Diff(Box<diff::Args>),
    /// Lists the adapters that pictures can be rendered on, and which one "auto" chooses
    #[command(after_help = EXIT_CODES)]
    Devices,
    /// Prints the JSON Schema of scene files, by which editors complete and check them
    #[command(after_help = EXIT_CODES)]
    Schema,
    /// Prints what a shell needs to complete the command line
    #[command(after_help = EXIT_CODES)]
    Completions(completions::Args),
    /// Prints or writes the manual pages
    #[command(after_help = EXIT_CODES)]
    Man(man::Args),
    /// Shows a scene on a web page, and shows it anew whenever the scene file or a shader is saved
    #[cfg(feature = "dev")]
    Dev(Box<dev::Args>),
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
        Err(told) => return explain(&shown(told)),
    };
    log::choose(cli.log_format);
    log::catch_panics();
    let threads = match &cli.command {
        Command::Render(args) => args.threads,
        Command::Farm(engine) => engine.threads(),
        _ => None,
    };
    let requeue = match &cli.command {
        Command::Render(args) => args.requeue_exit.map(|code| (code, args.quiet)),
        _ => None,
    };
    prepare_environment(threads);
    signal::file_size_limit_is_an_error();
    wgray::contain::silence(); // an error tells what a lost device has panicked for
    let result = match cli.command {
        Command::Render(args) => render::run(*args, start),
        Command::Check(args) => check::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Farm(engine) => farm::run(&engine, start),
        Command::Diff(args) => diff::run(*args),
        Command::Devices => Ok(devices::run()),
        Command::Schema => Ok(schema::run()),
        Command::Completions(args) => Ok(completions::run(&args)),
        Command::Man(args) => man::run(&args),
        #[cfg(feature = "dev")]
        Command::Dev(args) => dev::run(*args),
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            let again = requeue.filter(|_| helps_again(&error));
            let code = again.map_or_else(|| exit_code(&error), |(code, _)| code);
            report(&error, code);
            if again.is_some_and(|(_, quiet)| !quiet) {
                log::say(Level::Note, &format!("exit code {code} asks for another try"));
            }
            ExitCode::from(code)
        }
    }
}

/// What is wrong with the command line, with the words of it that cannot be shown, or are long, as messages show them.
fn shown(mut told: clap::Error) -> clap::Error {
    use clap::error::{ContextKind, ContextValue};
    for kind in [
        ContextKind::InvalidArg,
        ContextKind::InvalidSubcommand,
        ContextKind::InvalidValue,
    ] {
        let Some(ContextValue::String(word)) = told.get(kind) else {
            continue;
        };
        let shown = visible(word);
        let shown = match shown.chars().count() {
            0..=LONGEST_WORD => shown.into_owned(),
            _ => shown.chars().take(LONGEST_WORD).chain("...".chars()).collect(),
        };
        if shown != *word {
            told.insert(kind, ContextValue::String(shown));
            told.remove(ContextKind::Suggested); // which has the word as it is
        }
    }
    told
}

/// The longest word of a command line in a message, in characters.
const LONGEST_WORD: usize = 200;

/// Prints the help or the version, or what is wrong with the command line.
fn explain(told: &clap::Error) -> ExitCode {
    log::choose(log::asked(std::env::args_os()));
    if !told.use_stderr() {
        return ended(told.print(), ExitCode::SUCCESS);
    }
    if !log::is_json() {
        let _ = told.print(); // where this cannot be written there is nobody to tell
        return ExitCode::from(2);
    }
    let text = told.render().to_string();
    let (message, help) = text.split_once("\n\n").unwrap_or((&text, ""));
    let message = message.strip_prefix("error: ").unwrap_or(message);
    let facts = [("exit_code", Value::from(2)), ("help", Value::from(help.trim()))];
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    log::tell(Level::Error, &message, facts_of(facts));
    ExitCode::from(2)
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
fn report(error: &anyhow::Error, code: u8) {
    let code = Value::from(code);
    let shader = shader_errors(error);
    if shader.is_empty() {
        let hint = match error.downcast_ref() {
            Some(RenderError::OutOfMemory { .. }) => " (--crop, --size, --device cpu)",
            _ => "",
        };
        let mut facts = facts_of([("exit_code", code.clone())]);
        if let Some(error) = error.downcast_ref::<SceneError>() {
            let place = error.place();
            let numbers = [("line", place.line), ("column", place.column)];
            let texts = [("file", place.file), ("key", place.key)];
            let texts = texts.map(|(name, text)| (name, text.map(Value::from)));
            let all = numbers.map(|(name, number)| (name, number.map(Value::from)));
            let known = all.into_iter().chain(texts);
            facts.extend(known.filter_map(|(name, value)| Some((name.to_owned(), value?))));
        }
        log::tell(Level::Error, &format!("{error:#}{hint}"), facts);
    }
    for error in shader {
        let mut facts = facts_of([("exit_code", code.clone())]);
        let mut place = error.place.rsplitn(3, ':');
        if let (Some(Ok(column)), Some(Ok(line)), Some(file)) =
            (place.next().map(str::parse), place.next().map(str::parse), place.next())
        {
            let (line, column): (u64, u64) = (line, column);
            facts.extend(facts_of([
                ("file", file.into()),
                ("line", line.into()),
                ("column", column.into()),
            ]));
        }
        if let Some(excerpt) = &error.excerpt {
            facts.insert("excerpt".to_owned(), excerpt.as_str().into());
        }
        log::tell(Level::Error, &error.to_string(), facts);
        if let Some(excerpt) = &error.excerpt {
            log::explain(excerpt);
        }
    }
}

/// Facts by their names.
fn facts_of<const N: usize>(facts: [(&str, Value); N]) -> Facts {
    facts
        .map(|(name, value)| (name.to_owned(), value))
        .into_iter()
        .collect()
}

/// The exit code of a command that has printed something: a reader who has gone wanted no more, but a full disk is a
/// failure.
fn ended(printed: io::Result<()>, code: ExitCode) -> ExitCode {
    match printed.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            let facts = facts_of([("exit_code", NOT_WRITTEN.into())]);
            log::tell(
                Level::Error,
                &format!("standard output: cannot be written: {error}"),
                facts,
            );
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

/// Whether the same command may succeed after this, on another machine or later: not if the scene, the command line or the want of memory
/// would end it again.
fn helps_again(error: &anyhow::Error) -> bool {
    match error.downcast_ref() {
        Some(Interrupted(signal)) => *signal == signal_hook::consts::SIGTERM,
        None => matches!(error.downcast_ref(), Some(RenderError::Lost { .. })),
    }
}

fn exit_code(error: &anyhow::Error) -> u8 {
    if error.is::<Usage>() {
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
    }
}
