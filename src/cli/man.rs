//! `wgray man`: manual pages, generated from the same definitions as the help.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::error::RenderError;
use clap::{Command, CommandFactory as _, ValueHint};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use super::{Cli, Usage};
use crate::image::{Output, Pending};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The command to document, such as render [default: the program]
    #[arg(value_name = "COMMAND", conflicts_with = "output")]
    command: Option<String>,

    /// Write all pages (wgray.1, wgray-render.1, ...) to DIR, which is created if it does not exist
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    output: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let mut program = super::with_all_options(Cli::command()).disable_help_subcommand(true);
    program.build(); // sets the full names of the subcommands
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).map_err(|error| output_error(folder, &error))?;
        for command in std::iter::once(&program).chain(program.get_subcommands()) {
            let path = folder.join(format!("{}.1", name_of(command)));
            write(&path, &page(command, &program)?).map_err(|error| output_error(&path, &error))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let command = match &args.command {
        None => &program,
        Some(name) => program.find_subcommand(name).ok_or_else(|| {
            let names: Vec<&str> = program.get_subcommands().map(Command::get_name).collect();
            Usage(format!("COMMAND: {name:?} must be one of {}", names.join(", ")))
        })?,
    };
    let text = page(command, &program)?;
    Ok(super::finish_output(
        io::stdout().lock().write_all(&text),
        ExitCode::SUCCESS,
    ))
}

fn write(path: &Path, text: &[u8]) -> io::Result<()> {
    let mut file = Pending::start(Output::find(path)?)?;
    file.write_all(text)?;
    file.finish()
}

fn output_error(path: &Path, error: &io::Error) -> RenderError {
    RenderError::Output(io::Error::new(error.kind(), format!("{}: {error}", path.display())))
}

/// Returns the name of a page: `wgray-render`.
fn name_of(command: &Command) -> &str {
    command.get_display_name().unwrap_or(command.get_name())
}

/// Returns a page in roff.
fn page(command: &Command, program: &Command) -> io::Result<Vec<u8>> {
    let name = name_of(command);
    let man = Man::new(command.clone());
    // The title line is written here, because reproducible builds need pages without a date, and `clap_mangen` shifts
    // the other fields if the date is missing.
    let (title, version) = (name.to_uppercase(), env!("CARGO_PKG_VERSION"));
    let mut text = format!(".TH {title} 1 \"\" \"wgray {version}\" \"User Commands\"\n").into_bytes();
    man.render_name_section(&mut text)?;
    man.render_synopsis_section(&mut text)?;
    man.render_description_section(&mut text)?;
    if command.has_subcommands() {
        man.render_subcommands_section(&mut text)?;
    }
    man.render_options_section(&mut text)?;
    let mut sections = Roff::default();
    let codes = command.get_after_help().unwrap_or_default().to_string();
    sections.control("SH", ["EXIT STATUS"]);
    for paragraph in codes.trim_start_matches("Exit codes: ").split("\n\n") {
        sections.control("PP", []).text([roman(paragraph)]);
    }
    if name == "wgray" || name == "wgray-render" {
        for (section, entries) in [("ENVIRONMENT", ENVIRONMENT), ("FILES", FILES)] {
            sections.control("SH", [section]);
            for (term, meaning) in entries {
                sections.control("TP", []).text([bold(*term)]).text([roman(*meaning)]);
            }
        }
    }
    sections.control("SH", ["EXAMPLES"]);
    for (purpose, line) in examples(name) {
        sections.control("PP", []).text([roman(format!("{purpose}:"))]);
        sections.control("RS", ["4"]).text([bold(line)]).control("RE", []);
    }
    sections.control("SH", ["SEE ALSO"]);
    let all = std::iter::once(program).chain(program.get_subcommands()).map(name_of);
    let others: Vec<String> = all
        .filter(|other| *other != name)
        .map(|other| format!("{other}(1)"))
        .collect();
    sections.text([roman(others.join(", "))]);
    sections.to_writer(&mut text)?;
    Ok(text)
}

/// Returns the examples of a page, each with its purpose. The page of the program shows all examples.
fn examples(name: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    let words = name.replace('-', " ");
    let pairs = EXAMPLES.lines().filter_map(|line| line.split_once(": "));
    pairs.filter(move |(_, line)| {
        line.strip_prefix(&words)
            .is_some_and(|rest| !rest.starts_with(char::is_alphabetic))
    })
}

/// Environment variables that the program or its libraries read.
const ENVIRONMENT: &[(&str, &str)] = &[
    (
        "VK_DRIVER_FILES",
        "Vulkan drivers to use instead of all installed ones.",
    ),
    (
        "WGPU_BACKEND",
        "Graphics APIs to use: vulkan, metal or dx12, separated by commas.",
    ),
    (
        "LP_NUM_THREADS",
        "Number of threads of Mesa's software Vulkan. --threads sets it.",
    ),
    ("MESA_SHADER_CACHE_DIR", "Folder in which Mesa caches compiled kernels."),
    (
        "RAYON_NUM_THREADS",
        "Number of CPU threads unless --threads is given; by default all.",
    ),
    ("NO_COLOR", "Disables colors in messages of wgray dev."),
];

/// Output files.
const FILES: &[(&str, &str)] = &[
    (
        "NAME.png, NAME.exr, NAME.jpg, NAME.webp",
        "Images, written as .wgray-* in the same folder and renamed when complete.",
    ),
    (
        "NAME.checkpoint",
        "Saved progress of an image, for --checkpoint and --resume. It is kept after success.",
    ),
    (
        "NAME.part",
        "A part of an image, written by --tile; wgray merge joins parts.",
    ),
];

/// Examples, one per line: the purpose, then the command.
const EXAMPLES: &str = "\
Render a model, in a neutral studio if it has no lights: wgray render model.glb -o image.png
Render an EXR with layers: wgray render a.toml --size 1920x1200 --spp 64 -o a.exr --aov normal,depth
Render the missing frames of an animation: wgray render a.toml --frames 1-100 -o 'out.####.png' --skip-existing
Resume a long render after any interruption: wgray render a.toml --spp 4096 --checkpoint a.checkpoint --resume
Render the second of four parts of an image: wgray render a.toml --tile 2/4 -o 2.part
Join four parts: wgray merge 1.part 2.part 3.part 4.part -o image.exr
Validate a scene: wgray check scene.toml
Print the contents of a scene and the device that would render it: wgray info scene.toml
Convert a model to an editable scene that renders the same bits: wgray convert model.glb -o scene.toml
Check whether two images differ visibly: wgray diff new.png golden.png --fail flip=0.01 --out differences.png
Show a scene on a web page that updates after every save: wgray dev scene.toml
List the devices: wgray devices
Write the JSON Schema of scene files for an editor: wgray schema > wgray.schema.json
Print completions for bash: wgray completions bash
Read a page: wgray man render | man -l -
Write all pages: wgray man -o man1
";

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser as _;

    #[test]
    fn every_example_can_be_parsed() {
        assert_eq!(examples("wgray").count(), EXAMPLES.lines().count());
        for (_, line) in examples("wgray").filter(|(_, line)| cfg!(feature = "dev") || !line.starts_with("wgray dev "))
        {
            let words = line.split_whitespace().map(|word| word.trim_matches('\''));
            let words: Vec<&str> = words.take_while(|word| !["|", ">"].contains(word)).collect();
            if let Err(error) = Cli::try_parse_from(words) {
                panic!("{line}: {error}");
            }
        }
        assert!(Cli::try_parse_from(["wgray", "render", "a.toml", "--bad"]).is_err());
    }

    #[test]
    fn every_command_has_an_example() {
        for command in Cli::command().get_subcommands() {
            let name = format!("wgray-{}", command.get_name());
            assert!(examples(&name).next().is_some(), "{name}");
        }
    }
}
