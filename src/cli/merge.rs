//! `wgray merge`: parts of a picture, joined.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use wgray::error::RenderError;
use wgray::image;
use wgray::job::Parts;

use super::log::{self, Level};
use super::outputs::{Layered, Outputs, Places};
use super::picture_options::PictureOptions;
use super::{Interrupted, Usage, signal};

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
#[command(allow_negative_numbers = true)] // so that a number out of range is told as such
pub struct Args {
    /// All parts of one picture, which wgray render --tile has written, in any order
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,

    #[command(flatten)]
    pictures: PictureOptions,

    /// Says nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Writes the picture that the parts make, with their layers: the same bytes as those of one render.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let [first, ..] = args.pictures.output.as_slice() else {
        return Err(Usage("--output: must be there: -o NAME.exr".to_owned()).into());
    };
    let parts = Parts::open(
        &args.parts,
        args.pictures.view_transform.is_some() && args.pictures.exposure.is_some(),
    )?;
    let mut layout = parts.layout();
    layout.view = args.pictures.view(layout.view);
    let outputs = Outputs::find(&args.pictures, first, (&layout.aovs, Layered::There), None)?;
    outputs.check(&args.parts, None)?;
    outputs.check_size(layout.region)?;
    let begun = outputs.begin().map_err(RenderError::Output)?;
    let stop = signal::stop().context("signal handler")?;
    let Places::Pictures(targets) = begun.places else {
        return Ok(ExitCode::SUCCESS); // a part is found by `find_part` alone
    };
    let options = args.pictures.save_options(parts.told());
    let written = image::save(targets, &layout, &options, &mut |sink| {
        parts.read(&mut |band| match stop.signal() {
            None => sink(band),
            Some(_) => Err(RenderError::Cancelled),
        })
    });
    match (written, stop.signal()) {
        (Err(RenderError::Cancelled), Some(signal)) => Err(Interrupted(signal).into()),
        (Err(error), _) => Err(error.into()),
        (Ok(saved), _) => {
            if !args.quiet {
                args.pictures.warn(&saved, &mut |line| log::say(Level::Warning, line));
            }
            Ok(ExitCode::SUCCESS)
        }
    }
}
