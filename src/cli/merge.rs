//! `wgray merge`: joins the parts of an image.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{fs, io};

use crate::error::RenderError;
use crate::image::{self, Aov, Band, Sink};
use anyhow::{Context as _, bail};
use wgray_render::denoise;
use wgray_render::job::Parts;

use super::frames::{self, Frame};
use super::log::{self, Level};
use super::numbers::integer;
use super::outputs::{Files, LayerPolicy, Outputs};
use super::picture_options::PictureOptions;
use super::{Interrupted, Usage, signal};

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
#[command(allow_negative_numbers = true)] // report negative numbers as out of range
#[command(override_usage = "wgray merge [OPTIONS] -o <FILE> <PART>...")]
#[command(mut_arg("output", |output| output.help("Write FILE.png, .exr, .jpg, .webp, or - (stdout); required")))]
pub struct Args {
    /// All parts of an image, written by wgray render --tile, or folders of parts
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,

    /// Replace # in output names with the number N: out.####.png becomes out.0007.png
    #[arg(long, value_name = "N", value_parser = integer::<u32>(0..=frames::MAX_NUMBER))]
    frame: Option<u32>,

    #[command(flatten)]
    picture_options: PictureOptions,

    /// Suppress all output except errors
    #[arg(short, long)]
    quiet: bool,
}

/// Joins the parts into the image and its layers, byte-identical to the files of a single render.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let frame = Frame::single(args.frame);
    let output_names = args
        .picture_options
        .output
        .iter()
        .map(|output| frame.name("--output", output));
    let picture_options = PictureOptions {
        output: output_names.collect::<Result<_, _>>()?,
        ..args.picture_options.clone()
    };
    let files = files(&args.parts)?;
    let parts = Parts::open(
        &files,
        args.picture_options.view_transform.is_some() && args.picture_options.exposure.is_some(),
    )?;
    let [first, ..] = picture_options.output.as_slice() else {
        return Err(Usage("--output: is required: -o NAME.exr".to_owned()).into());
    };
    let mut layout = parts.layout();
    layout.view = args.picture_options.view(layout.view);
    let outputs = Outputs::find(&picture_options, first, (&layout.aovs, LayerPolicy::Available), None)?;
    outputs.check(&files, None)?;
    outputs.check_size(layout.region)?;
    let open_outputs = outputs.open().map_err(RenderError::Output)?;
    let stop = signal::install_handlers().context("signal handler")?;
    let Files::Images(targets) = open_outputs.files else {
        return Ok(ExitCode::SUCCESS); // unreachable: merge does not write parts
    };
    let options = args.picture_options.save_options(parts.metadata());
    let read = |sink: &mut Sink| {
        parts.read(&mut |band| match stop.signal() {
            None => sink(band),
            Some(_) => Err(RenderError::Cancelled),
        })
    };
    let written = image::save(targets, &layout, &options, &mut |sink| {
        if !layout.aovs.contains(&Aov::Denoised) {
            return read(sink);
        }
        let (mut film, hits) = denoise::collect(layout.region, parts.film_layout(), &mut |sink| read(sink))?;
        film.denoised = denoise::denoise(&film);
        sink(Band {
            film: &film,
            hits: &hits,
        })
    });
    match (written, stop.signal()) {
        (Err(RenderError::Cancelled), Some(signal)) => Err(Interrupted(signal).into()),
        (Err(error), _) => Err(error.into()),
        (Ok(saved), _) => {
            if !args.quiet {
                args.picture_options
                    .warn(&saved, &mut |line| log::print(Level::Warning, line));
            }
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// Returns the parts, including those in folders. Skips hidden files, which another process may still be writing.
fn files(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let name = path.display();
        let entries = fs::read_dir(path).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let entries = entries.with_context(|| format!("{name}: cannot be read"))?;
        let is_part = |entry: &fs::DirEntry| {
            let name = entry.file_name();
            Path::new(&name).extension().is_some_and(|end| end == "part") && !name.as_encoded_bytes().starts_with(b".")
        };
        let before = files.len();
        files.extend(entries.iter().filter(|entry| is_part(entry)).map(fs::DirEntry::path));
        if files.len() == before {
            bail!("{name}: contains no parts (NAME.part, written by wgray render --tile)");
        }
        files[before..].sort();
    }
    Ok(files)
}
