//! The options of `wgray render` on the command line of `wgray farm`, which are passed verbatim to the tasks.

use std::ffi::OsString;

use clap::builder::Resettable;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches, Id};

use crate::cli::picture_options::PictureOptions;
use crate::cli::render;

/// Options that the tasks or the engine set.
const OF_TASKS: [&str; 12] = [
    "checkpoint",
    "checkpoint_interval",
    "preview",
    "progress",
    "quiet",
    "requeue_exit",
    "resume",
    "skip_existing",
    "stats",
    "tile",
    "time_limit",
    "verbose",
];

/// Options that `-h` lists.
const COMMON: [&str; 8] = [
    "scene",
    "output",
    "size",
    "pixel_samples",
    "device",
    "integrator",
    "define",
    "frames",
];

/// Options that the generated files pass per task instead.
const IN_FILES: [&str; 2] = ["frames", "output"];

/// A command line option: its name, and its value, if any.
pub type Given = (String, Option<OsString>);

/// The options of `wgray render`, parsed and as given.
#[derive(Debug)]
pub struct Rendering {
    /// Parsed options.
    pub args: render::Args,
    /// Options for rendering a part, in the order of the help.
    pub render: Vec<Given>,
    /// Options for writing the image.
    pub merge: Vec<Given>,
    /// First option that cannot be used with `wgray farm`.
    pub refused: Option<String>,
}

fn ids(command: &Command) -> Vec<String> {
    let ids = command.get_arguments().map(|arg| arg.get_id().to_string());
    ids.collect()
}

impl Rendering {
    fn of(args: render::Args, matches: &ArgMatches) -> Rendering {
        let mut rendering = Rendering {
            args,
            render: Vec::new(),
            merge: Vec::new(),
            refused: None,
        };
        let of_pictures = ids(&PictureOptions::augment_args(Command::new("merge")));
        for arg in render::Args::augment_args(Command::new("render")).get_arguments() {
            let id = arg.get_id().as_str();
            let Some(long) = arg.get_long() else {
                continue; // the scene
            };
            if matches.value_source(id) != Some(ValueSource::CommandLine) || IN_FILES.contains(&id) {
                continue;
            }
            let name = format!("--{long}");
            if OF_TASKS.contains(&id) {
                rendering.refused.get_or_insert(name);
                continue;
            }
            let list = match of_pictures.iter().any(|other| other == id) {
                true => &mut rendering.merge,
                false => &mut rendering.render,
            };
            if !arg.get_action().takes_values() {
                list.push((name, None));
                continue;
            }
            for values in matches.get_raw_occurrences(id).into_iter().flatten() {
                let separator = arg.get_value_delimiter().unwrap_or(',').to_string();
                let values: Vec<_> = values.map(OsString::from).collect();
                list.push((name.clone(), Some(values.join(separator.as_ref()))));
            }
        }
        rendering
    }
}

impl FromArgMatches for Rendering {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Rendering, clap::Error> {
        Ok(Rendering::of(render::Args::from_arg_matches(matches)?, matches))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Rendering::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for Rendering {
    fn augment_args(command: Command) -> Command {
        let all = ids(&render::Args::augment_args(Command::new("render")));
        let rare = all.into_iter().filter(|id| !COMMON.contains(&id.as_str()));
        let command = render::Args::augment_args(command);
        let command = rare.fold(command, |command, id| {
            command.mut_arg(id, |arg| arg.hide_short_help(true))
        });
        OF_TASKS
            .into_iter()
            // The option is refused anyway, so its requirements are not checked.
            .fold(command, |command, id| {
                command.mut_arg(id, |arg| arg.hide(true).requires(Resettable::<Id>::Reset))
            })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Rendering::augment_args(command)
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        rendering: Rendering,
    }

    fn given(words: &[&str]) -> Rendering {
        Line::try_parse_from([&["farm"], words].concat()).unwrap().rendering
    }

    /// Every option of `wgray render` is passed on, refused, or set per task. New options are passed on by default.
    #[test]
    fn every_option_is_known() {
        let all = ids(&render::Args::augment_args(Command::new("render")));
        for id in OF_TASKS.iter().chain(&IN_FILES) {
            assert!(all.iter().any(|other| other == id), "{id}");
        }
    }

    #[test]
    fn options_are_passed_on_verbatim() {
        let rendering = given(&[
            "a.toml",
            "--aov",
            "normal,depth",
            "--aov=uv",
            "-D",
            "a.b=[1, 2]",
            "-Dc=-1",
            "--spp",
            "4",
            "--exact-rounding",
            "--background=-1,2,3",
            "--exposure",
            "-1",
            "-o",
            "x.png",
            "--reproducible",
            "--frames",
            "1-3",
        ]);
        let texts = |list: &[Given]| -> Vec<String> {
            let text = |(name, value): &Given| match value {
                None => name.clone(),
                Some(value) => format!("{name}={}", value.display()),
            };
            let mut all: Vec<String> = list.iter().map(text).collect();
            all.sort();
            all
        };
        assert_eq!(
            texts(&rendering.render),
            [
                "--aov=normal,depth",
                "--aov=uv",
                "--background=-1,2,3",
                "--define=a.b=[1, 2]",
                "--define=c=-1",
                "--exact-rounding",
                "--spp=4",
            ]
        );
        assert_eq!(texts(&rendering.merge), ["--exposure=-1", "--reproducible"]);
        assert_eq!(rendering.refused, None);
        assert_eq!(given(&["a.toml", "--tile", "1/2"]).refused.as_deref(), Some("--tile"));
        // Defaults are not passed on.
        assert_eq!(
            (given(&["a.toml"]).render.len(), given(&["a.toml"]).merge.len()),
            (0, 0)
        );
    }
}
