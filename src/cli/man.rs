//! `wgray man`: manual pages, generated from the same definitions as the help.

mod text;

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::error::RenderError;
use crate::image::{Output, Pending};
use clap::{CommandFactory as _, ValueHint};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use super::exit_codes::EXIT_CODES;
use super::{Cli, Usage};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The command to document, such as render or farm slurm [default: the program]
    #[arg(value_name = "COMMAND", conflicts_with = "output")]
    command: Vec<String>,

    /// Write all pages (wgray.1, wgray-render.1, ...) to DIR, which is created if it does not exist
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    output: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let commands = commands();
    let Some(folder) = &args.output else {
        let name = [&["wgray".to_owned()], args.command.as_slice()].concat().join("-");
        let Some(command) = commands.iter().find(|command| name_of(command) == name) else {
            let names = commands
                .iter()
                .filter_map(|command| name_of(command).strip_prefix("wgray-"));
            let names = names.map(|name| name.replace('-', " ")).collect::<Vec<_>>().join(", ");
            let wanted = args.command.join(" ");
            return Err(Usage(format!("COMMAND: {wanted:?} must be one of {names}")).into());
        };
        let text = page(command)?;
        return Ok(super::ended(io::stdout().lock().write_all(&text), ExitCode::SUCCESS));
    };
    std::fs::create_dir_all(folder).map_err(|error| not_written(folder, &error))?;
    for command in &commands {
        let path = folder.join(format!("{}.1", name_of(command)));
        write(&path, &page(command)?).map_err(|error| not_written(&path, &error))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn not_written(path: &Path, error: &io::Error) -> RenderError {
    let message = match error.to_string() {
        text if text.contains(&*path.to_string_lossy()) => text,
        text => format!("{}: {text}", path.display()),
    };
    RenderError::Output(io::Error::new(error.kind(), message))
}

fn write(path: &Path, text: &[u8]) -> io::Result<()> {
    let mut file = Pending::start(Output::find(path)?)?;
    file.write_all(text)?;
    file.finish()
}

/// Returns the program and each of its subcommands.
fn commands() -> Vec<clap::Command> {
    let mut program = super::with_all_options(Cli::command()).disable_help_subcommand(true);
    program.build(); // sets the full names of the subcommands
    let mut all = Vec::new();
    add(program, &mut all);
    all
}

/// Adds a command and its subcommands.
fn add(command: clap::Command, all: &mut Vec<clap::Command>) {
    let below: Vec<_> = command
        .get_subcommands()
        .filter(|below| below.get_name() != "help")
        .cloned()
        .collect();
    all.push(command);
    below.into_iter().for_each(|command| add(command, all));
}

/// Returns the name of a page: `wgray-render`.
fn name_of(command: &clap::Command) -> &str {
    command.get_display_name().unwrap_or(command.get_name())
}

/// Returns a page in roff.
fn page(command: &clap::Command) -> io::Result<Vec<u8>> {
    let name = name_of(command);
    let is_program = name == "wgray";
    let man = Man::new(command.clone());
    // Written by hand: reproducible builds need an empty date, which `clap_mangen` would omit, shifting the other fields.
    let (title, version) = (name.to_uppercase(), env!("CARGO_PKG_VERSION"));
    let mut text = format!(".TH {title} 1 \"\" \"wgray {version}\" \"User Commands\"\n").into_bytes();
    man.render_name_section(&mut text)?;
    man.render_synopsis_section(&mut text)?;
    man.render_description_section(&mut text)?;
    if command.has_subcommands() {
        man.render_subcommands_section(&mut text)?;
    }
    man.render_options_section(&mut text)?;
    let mut rest = Roff::default();
    if is_program {
        section(&mut rest, "SCENES", text::SCENES);
    }
    rest.control("SH", ["EXIT STATUS"]);
    match own_exit_codes(command) {
        Some(text) => paragraphs(&mut rest, &text),
        None => entries(&mut rest, EXIT_CODES.iter().copied()),
    }
    let of_all = is_program || name == "wgray-render";
    let variables = text::ENVIRONMENT
        .iter()
        .filter(|(_, _, commands)| is_program || commands.contains(&name));
    let mut variables = variables.map(|(name, meaning, _)| (*name, *meaning)).peekable();
    if variables.peek().is_some() {
        rest.control("SH", ["ENVIRONMENT"]);
        entries(&mut rest, variables);
    }
    if of_all {
        rest.control("SH", ["FILES"]);
        entries(&mut rest, text::FILES.iter().copied());
    }
    let mut examples = text::EXAMPLES.iter().filter(|example| example.of(name)).peekable();
    if examples.peek().is_some() {
        rest.control("SH", ["EXAMPLES"]);
        for (i, example) in examples.enumerate() {
            if i > 0 {
                rest.control("PP", []);
            }
            rest.text([roman(example.what)]);
            rest.control("PP", []);
            rest.control("RS", ["4"]);
            rest.text([bold(example.line)]);
            rest.control("RE", []);
        }
    }
    rest.control("SH", ["SEE ALSO"]);
    let names = commands()
        .iter()
        .map(|command| name_of(command).to_owned())
        .collect::<Vec<_>>();
    let others = names.iter().filter(|other| *other != name);
    let others = others.map(|other| format!("{other}(1)")).collect::<Vec<_>>();
    rest.text([roman(others.join(", "))]);
    rest.to_writer(&mut text)?;
    Ok(text)
}

/// Returns the exit codes that a command documents itself, if any.
fn own_exit_codes(command: &clap::Command) -> Option<String> {
    let text = command.get_after_help()?.to_string();
    let own = text.strip_prefix("Exit codes: ")?;
    (text != super::EXIT_CODES).then(|| own.to_owned())
}

fn section(roff: &mut Roff, title: &str, text: &str) {
    roff.control("SH", [title]);
    paragraphs(roff, text);
}

fn paragraphs(roff: &mut Roff, text: &str) {
    for (i, paragraph) in text.split("\n\n").enumerate() {
        if i > 0 {
            roff.control("PP", []);
        }
        roff.text([roman(paragraph)]);
    }
}

/// Writes a list of terms and definitions.
fn entries<'a>(roff: &mut Roff, all: impl Iterator<Item = (&'a str, &'a str)>) {
    for (term, meaning) in all {
        roff.control("TP", []);
        roff.text([bold(term)]);
        roff.text([roman(meaning)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser as _;

    #[test]
    fn every_example_can_be_read() {
        for example in text::EXAMPLES {
            let words = example.line.split_whitespace().map(|word| word.trim_matches('\''));
            let words: Vec<&str> = words.take_while(|word| !["|", ">"].contains(word)).collect();
            if let Err(error) = Cli::try_parse_from(words) {
                panic!("{}: {error}", example.line);
            }
        }
        assert!(Cli::try_parse_from(["wgray", "render", "a.toml", "--bad"]).is_err());
    }

    #[test]
    fn every_command_has_an_example() {
        for command in commands() {
            let name = name_of(&command);
            assert!(text::EXAMPLES.iter().any(|example| example.of(name)), "{name}");
        }
    }

    #[test]
    fn variables_are_of_commands() {
        let commands = commands();
        let names: Vec<&str> = commands.iter().map(name_of).collect();
        for (variable, _, of) in text::ENVIRONMENT {
            for name in *of {
                let is_left_out = cfg!(not(feature = "dev")) && *name == "wgray-dev";
                assert!(is_left_out || names.contains(name), "{variable}: {name}");
            }
        }
    }
}
