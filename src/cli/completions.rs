//! `wgray completions`: prints a completion script for a shell.

use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::builder::PossibleValuesParser;
use clap::{Arg, Command, CommandFactory as _, ValueHint};
use clap_complete::Shell;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The shell; docs/command-line.md documents where to install the script
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

pub fn run(args: &Args) -> ExitCode {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut command(), "wgray", &mut text);
    super::finish_output(io::stdout().lock().write_all(&text), ExitCode::SUCCESS)
}

/// Returns the command line definition, extended by completions that the arguments do not define.
fn command() -> Command {
    let all = with_completions(super::Cli::command());
    let names: Vec<String> = all
        .get_subcommands()
        .map(|command| command.get_name().to_owned())
        .collect();
    all.mut_subcommand("man", |man| {
        man.mut_arg("command", |arg| arg.value_parser(PossibleValuesParser::new(names)))
    })
}

/// Adds the completions of a command and its subcommands.
fn with_completions(command: Command) -> Command {
    command.mut_args(complete_arg).mut_subcommands(with_completions)
}

/// Completes device names, and file names only for arguments that are paths.
fn complete_arg(arg: Arg) -> Arg {
    if arg.get_id() == "device" {
        return arg.value_parser(PossibleValuesParser::new(["auto", "gpu", "cpu"]));
    }
    match arg.get_value_hint() {
        ValueHint::Unknown if arg.get_possible_values().is_empty() => arg.value_hint(ValueHint::Other),
        _ => arg,
    }
}
