//! The command line: arguments, messages and exit codes. Each subcommand has a file of its own.

mod allocator;
mod check;
mod completions;
mod convert;
#[cfg(feature = "dev")]
mod dev;
mod devices;
mod diff;
mod frames;
mod hints;
mod info;
mod log;
mod man;
mod merge;
mod metadata;
mod numbers;
mod outputs;
mod picture_options;
mod progress;
mod render;
mod scene_options;
mod schema;
mod signal;
mod stats;

use crate::scene::Note;
use std::ffi::OsString;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use crate::error::{Error, RenderError, ShaderError, ShaderErrors};
use crate::scene::{Overrides, Problem, Scene, SceneError};
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use serde_json::Value;
use wgray_image::compare::Unreadable;

pub use self::allocator::Allocator;
use self::log::{Facts, Level};

#[derive(Debug, Parser)]
#[command(name = "wgray", version, about, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// Write messages as text or json
    #[arg(
        long,
        global = true,
        display_order = 95,
        value_enum,
        value_name = "FORMAT",
        default_value_t,
        hide_possible_values = true
    )]
    log_format: log::Format,
}

const EXIT_CODES: &str = "\
Exit codes: 0 success, 1 failure, 2 usage error, 3 invalid scene, 4 no such device, 5 images differ, 6 device lost, \
7 out of memory, 8 output not written, 128 + n ended by signal n.";

/// Exit code after an output could not be written.
const NOT_WRITTEN: u8 = 8;

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene or model to an image
    Render(Box<render::Args>),
    #[cfg_attr(feature = "gpu", doc = "Check scene files and their shaders without rendering")]
    #[cfg_attr(not(feature = "gpu"), doc = "Check scene files without rendering")]
    Check(Box<check::Args>),
    /// Show the contents, memory use and device of a scene
    Info(Box<info::Args>),
    /// Join the parts of `render --tile` into an image
    Merge(Box<merge::Args>),
    /// Write a scene or model as a TOML scene that renders the same image
    Convert(Box<convert::Args>),
    /// Compare two images; fail if they differ
    Diff(Box<diff::Args>),
    /// List the devices and the one that auto selects
    #[command(after_help = EXIT_CODES)]
    Devices,
    /// Print the JSON Schema of scene files, for editors
    #[command(after_help = EXIT_CODES)]
    Schema,
    /// Print a completion script for a shell
    #[command(after_help = EXIT_CODES)]
    Completions(completions::Args),
    /// Print or write the manual pages
    #[command(after_help = EXIT_CODES)]
    Man(man::Args),
    /// Show a scene on a web page and re-render it whenever a file is saved
    #[cfg(feature = "dev")]
    Dev(Box<dev::Args>),
}

/// A signal ended the command.
#[derive(Debug, thiserror::Error)]
#[error("interrupted by {}", signal::name(*.0))]
struct Interrupted(i32);

/// A usage error that is not a parse error, such as contradictory options.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Usage(String);

/// Threads could not be started, usually because memory is exhausted.
#[derive(Debug, thiserror::Error)]
#[error("out of memory: cannot start threads: {0} (--threads)")]
struct NoThreads(rayon::ThreadPoolBuildError);

/// Runs the command line and returns the exit code.
pub fn main() -> ExitCode {
    let start = Instant::now();
    let cli = match parse() {
        Ok(cli) => cli,
        Err(error) => return explain(&hints::improve(error)),
    };
    log::set_format(cli.log_format);
    log::install_panic_hook();
    allocator::catch_signal_stack_failures();
    let threads = match &cli.command {
        Command::Render(args) => args.threads,
        _ => None,
    };
    let requeue = match &cli.command {
        Command::Render(args) => args.requeue_exit.map(|code| (code, args.quiet)),
        _ => None,
    };
    prepare_environment(threads);
    signal::ignore_file_size_signal();
    wgray_image::panic_guard::install_quiet_hook(); // panics caused by a lost device are converted to errors
    let result = start_threads(threads).and_then(|()| match cli.command {
        Command::Render(args) => render::run(*args, start),
        Command::Check(args) => check::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Diff(args) => diff::run(*args),
        Command::Devices => Ok(devices::run()),
        Command::Schema => Ok(schema::run()),
        Command::Completions(args) => Ok(completions::run(&args)),
        Command::Man(args) => man::run(&args),
        #[cfg(feature = "dev")]
        Command::Dev(args) => dev::run(*args),
    });
    match result {
        Ok(code) => code,
        Err(error) => {
            let retry = requeue.filter(|_| may_succeed_later(&error));
            let code = retry.map_or_else(|| exit_code(&error), |(code, _)| code);
            report(&error, code);
            if retry.is_some_and(|(_, quiet)| !quiet) {
                log::print(Level::Note, &format!("exit code {code} requests another attempt"));
            }
            ExitCode::from(code)
        }
    }
}

/// Parses the command line. `--help` lists all options, `-h` only options without `hide_short_help`.
fn parse() -> Result<Cli, clap::Error> {
    let lists_all_options = std::env::args_os().any(|word| word == "--help")
        || std::env::args_os().nth(1).is_some_and(|word| word == "help");
    let mut command = match lists_all_options {
        true => with_all_options(Cli::command()),
        false => Cli::command(),
    };
    let matches = command.try_get_matches_from_mut(arguments())?;
    Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// Returns the arguments of the program. Joins `--denoise off` to `--denoise=off`: the value is optional, so clap would
/// also accept the name of a scene as the value if the two were separate.
fn arguments() -> Vec<OsString> {
    let mut arguments: Vec<OsString> = Vec::new();
    for argument in std::env::args_os() {
        match arguments.last_mut() {
            Some(option) if option == "--denoise" && (argument == "on" || argument == "off") => {
                option.push("=");
                option.push(argument);
            }
            _ => arguments.push(argument),
        }
    }
    arguments
}

/// Includes the options that `-h` hides in the help of a command and its subcommands.
fn with_all_options(command: clap::Command) -> clap::Command {
    command
        .mut_args(|option| option.hide_short_help(false))
        .mut_subcommands(with_all_options)
}

/// Prints the help, the version, or a command line error.
fn explain(error: &clap::Error) -> ExitCode {
    log::set_format(log::requested_format(std::env::args_os()));
    if !error.use_stderr() {
        return finish_output(error.print(), ExitCode::SUCCESS);
    }
    if !log::is_json() {
        let _ = error.print(); // a failure to print cannot be reported either
        return ExitCode::from(2);
    }
    let text = error.render().to_string();
    let (message, help) = text.split_once("\n\n").unwrap_or((&text, ""));
    let message = message.strip_prefix("error: ").unwrap_or(message);
    let facts = [("exit_code", Value::from(2)), ("help", Value::from(help.trim()))];
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    log::print_with(Level::Error, &message, facts_of(facts));
    ExitCode::from(2)
}

/// Sets environment variables for drivers. Must be called before other threads are started.
fn prepare_environment(threads: Option<u16>) {
    let set = |name: &str, value: &std::ffi::OsStr| {
        // SAFETY: the process has only this thread so far.
        unsafe { std::env::set_var(name, value) }
    };
    if let Some(threads) = threads {
        set("LP_NUM_THREADS", threads.to_string().as_ref());
    }
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Mesa warns if this variable is unset, although only programs with windows need it.
        set("XDG_RUNTIME_DIR", std::env::temp_dir().as_os_str());
    }
}

/// Starts the global thread pool. Returns an error if threads cannot be started; otherwise rayon would panic later.
fn start_threads(threads: Option<u16>) -> anyhow::Result<()> {
    let count = threads.map_or(0, usize::from); // 0: rayon's default
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count);
    Ok(pool.build_global().map_err(NoThreads)?)
}

/// Loads a scene file with the overrides.
fn load(path: &Path, overrides: &Overrides) -> anyhow::Result<Scene> {
    Scene::load_with(path, overrides).map_err(|error| cli_error(error.into()))
}

/// Formats a warning about a scene like an error: with the file, and with the line if the line is known.
fn located(path: &Path, note: &Note) -> String {
    match (&note.file, note.line) {
        (None, Some(line)) => format!("{}:{line}: {}", path.display(), note.message),
        _ => format!("{}: {note}", path.display()),
    }
}

/// Converts an error of the library. Names of fields are replaced by names of command line options.
fn cli_error(error: Error) -> anyhow::Error {
    match error {
        Error::Option(problem) | Error::Scene(SceneError::Override(problem)) => option_error(&problem).into(),
        Error::Render(error) => error.into(),
        Error::Scene(error) => error.into(),
        error => error.into(),
    }
}

/// Converts an invalid option value into a usage error.
fn option_error(problem: &Problem) -> Usage {
    let key = problem.key.to_string();
    let (name, rest) = key.split_once('.').unwrap_or((&key, ""));
    let sub_key = if rest.is_empty() {
        String::new()
    } else {
        format!(" {rest}")
    };
    let name = match name {
        "pixel_samples" => "spp".to_owned(),
        name => name.replace('_', "-"),
    };
    let hint = match (name.as_str(), rest) {
        ("aov", _) => " (--integrator path)",
        ("adaptive", "") => " (--pixel-pattern sobol)", // the value itself has been validated
        _ => "",
    };
    Usage(format!("--{name}{sub_key}: {}{hint}", problem.message))
}

/// Returns the messages of an error and its sources. A source is omitted if the message already ends with its text.
fn chain_message(error: &anyhow::Error) -> String {
    let mut message = error.to_string();
    for source in error.chain().skip(1).map(ToString::to_string) {
        if !message.ends_with(&source) {
            message = format!("{message}: {source}");
        }
    }
    message
}

/// Prints an error.
fn report(error: &anyhow::Error, code: u8) {
    let code = Value::from(code);
    if let Some(error) = error.downcast_ref::<SceneError>() {
        let (errors, more) = error.each();
        for error in errors {
            let mut facts = facts_of([("exit_code", code.clone())]);
            let location = error.place();
            let numbers = [("line", location.line), ("column", location.column)];
            let texts = [("file", location.file), ("key", location.key)];
            let texts = texts.map(|(name, text)| (name, text.map(Value::from)));
            let numbers = numbers.map(|(name, number)| (name, number.map(Value::from)));
            let fields = numbers.into_iter().chain(texts);
            facts.extend(fields.filter_map(|(name, value)| Some((name.to_owned(), value?))));
            log::print_with(Level::Error, &error.to_string(), facts);
        }
        if let Some(more) = more {
            log::print_with(Level::Error, &more, facts_of([("exit_code", code)]));
        }
        return;
    }
    let shader_errors = shader_errors(error);
    if shader_errors.is_empty() {
        let hint = match error.downcast_ref() {
            Some(RenderError::OutOfMemory { .. }) => " (--crop, --size, --device cpu)",
            _ => "",
        };
        let facts = facts_of([("exit_code", code.clone())]);
        log::print_with(Level::Error, &(chain_message(error) + hint), facts);
    }
    for error in shader_errors {
        let mut facts = facts_of([("exit_code", code.clone())]);
        let mut location = error.place.rsplitn(3, ':');
        if let (Some(Ok(column)), Some(Ok(line)), Some(file)) = (
            location.next().map(str::parse),
            location.next().map(str::parse),
            location.next(),
        ) {
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
        log::print_with(Level::Error, &error.to_string(), facts);
        if let Some(excerpt) = &error.excerpt {
            log::print_continuation(excerpt);
        }
    }
}

/// Builds the additional fields of a JSON message.
fn facts_of<const N: usize>(facts: [(&str, Value); N]) -> Facts {
    facts
        .map(|(name, value)| (name.to_owned(), value))
        .into_iter()
        .collect()
}

/// Returns the exit code of a command after its output was printed. A closed pipe is not a failure, but a full disk is.
fn finish_output(printed: io::Result<()>, code: ExitCode) -> ExitCode {
    match printed.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            let facts = facts_of([("exit_code", NOT_WRITTEN.into())]);
            log::print_with(
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

/// Returns true if the same command may succeed later, or on another machine.
fn may_succeed_later(error: &anyhow::Error) -> bool {
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
    } else if error.is::<NoThreads>() {
        7
    } else if let Some(error) = error.downcast_ref::<SceneError>() {
        if error.is_out_of_memory() { 7 } else { 3 }
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
