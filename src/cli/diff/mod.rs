//! `wgray diff`: how far two pictures are apart, and whether that is too far.

mod measure;
mod metric;
mod report;

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};
use wgray::compare::{self, COLOR, Flip, Kind, Layer, Picture, layer_of};
use wgray::error::RenderError;
use wgray::image::{Output, Pending};
use wgray::visible::visible_lines;

use super::Usage;
use measure::measure;
use metric::{Limit, METRICS, Metric};
use report::Report;

const EXIT_CODES: &str = "\
Exit codes: 0 the same bits, or within every --fail; 1 a file is no picture or cannot be read; 2 wrong command line; 5 the \
pictures differ; 7 a picture does not fit memory; 8 the picture of --out could not be written.\n\n\
docs/golden-pictures.md says what each metric is.";

/// The exit code of pictures that differ.
const DIFFER: u8 = 5;
/// Pixels up to which FLIP is computed without being asked for: it takes a microsecond for each, linear ones several.
const QUICK: u64 = 1 << 24;

#[derive(Debug, clap::Args)]
#[command(after_help = EXIT_CODES)]
#[command(allow_negative_numbers = true)] // so that a number out of range is told as such
pub struct Args {
    /// Picture to look at: PNG, EXR, JPEG, WebP; - is standard input
    #[arg(value_name = "A")]
    a: PathBuf,

    /// Reference that it is compared with; an EXR beside a PNG is shown as a PNG first
    #[arg(value_name = "B")]
    b: PathBuf,

    /// Fails only what is worse than this: different, largest, share, rmse, rel_mse and flip are worse above it, psnr and ssim
    /// below. May be repeated. If absent, any other bit fails; NaN, infinities and missing channels always do
    #[arg(long, value_name = "METRIC=X", value_parser = Limit::parse)]
    fail: Vec<Limit>,

    /// What is computed, with commas between: different, largest, share, rmse, rel_mse, psnr, ssim, flip. If absent all, flip up
    /// to 16.7 million pixels
    #[arg(long, value_name = "METRICS", value_delimiter = ',', value_parser = Metric::parse)]
    metrics: Vec<Metric>,

    /// What is compared, with commas between: color is R, G, B, A and Y, normal is normal.X and so on. If absent all
    #[arg(long, value_name = "LAYERS", value_delimiter = ',')]
    layers: Vec<String>,

    /// Difference of a value that must be surpassed for its pixel to be in the share
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = threshold)]
    threshold: f64,

    /// Pixels per degree of what is seen, for FLIP: how far away the screen is. If absent 67.02, a screen 0.7 m wide with 3840
    /// columns at 0.7 m
    #[arg(long, value_name = "PIXELS", value_parser = ppd)]
    ppd: Option<f64>,

    /// Picture to write: A, B and where they differ, with a line around what does
    #[arg(long, value_name = "DIFF.png")]
    out: Option<PathBuf>,

    /// Prints one JSON object in place of the text
    #[arg(long)]
    json: bool,
}

fn threshold(text: &str) -> Result<f64, String> {
    number(text, 0.0, f64::MAX).map_err(|()| "must be a number of 0 or more".to_owned())
}

fn ppd(text: &str) -> Result<f64, String> {
    number(text, 1.0, 1000.0).map_err(|()| "must be a number from 1 to 1000".to_owned())
}

fn number(text: &str, least: f64, most: f64) -> Result<f64, ()> {
    let number: f64 = text.parse().map_err(|_| ())?;
    if (least..=most).contains(&number) {
        Ok(number)
    } else {
        Err(())
    }
}

/// Compares, says what was found, and returns 0 or 5.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if args.a.as_os_str() == "-" && args.b.as_os_str() == "-" {
        return Err(Usage("-: only one of the pictures may be standard input".to_owned()).into());
    }
    let out = args.out.as_deref().map(|path| find_out(path, &args)).transpose()?;
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let mut report = Report::new([&args.a, &args.b].map(|path| name(path)), &a, &b);
    let (mut a, mut b) = alike(a, b, &mut report)?;
    choose(&args.layers, &mut a, &mut b)?;
    let mut shown = None;
    if (a.width, a.height, a.position) == (b.width, b.height, b.position) {
        let (layers, only_a, only_b) = compare::layers(&a, &b);
        report.set_only(&only_a, &only_b);
        let asked: Vec<Metric> = args
            .metrics
            .iter()
            .copied()
            .chain(args.fail.iter().map(|limit| limit.metric))
            .collect();
        if let Some(metric) = asked.iter().find(|metric| metric.is_of_colors())
            && !(has_colors(&a) && has_colors(&b))
        {
            return Err(Usage(format!(
                "{metric}: needs colours, which are R, G and B, or Y, in both pictures"
            ))
            .into());
        }
        let ppd = args.ppd.unwrap_or(compare::PIXELS_PER_DEGREE);
        let metrics = wanted(&args, &b, &asked, &mut report);
        // the first that differs
        let mut best: Option<(usize, Option<Flip>)> = None;
        for (i, layer) in layers.iter().enumerate() {
            let step = out.is_some().then(|| compare::step(&b));
            let (found, flip) = measure(layer, &a, &b, &metrics, args.threshold, ppd, step);
            if best.is_none() || found.is_different() && !report.is_different() {
                best = Some((i, flip));
            }
            report.layers.push(found);
        }
        shown = best.and_then(|(i, flip)| Some((layers.get(i)?.clone(), flip)));
        report.metrics = metrics;
    }
    report.judge(&args.fail, args.threshold);
    let shown = match (out, shown) {
        (Some((output, _)), Some((layer, flip))) => Some((output, layer, flip)),
        (Some((_, path)), None) => {
            report.notes.push(format!(
                "{}: is not written, as there is nothing to lay side by side",
                path.display()
            ));
            None
        }
        (None, _) => None,
    };
    if let Some((output, layer, _)) = &shown
        && layer.name != COLOR
    {
        report
            .notes
            .push(format!("{}: shows the layer {}", output.name(), layer.name));
    }
    let text = match args.json {
        true => serde_json::to_string_pretty(&report)? + "\n",
        false => visible_lines(&report.to_string()).into_owned(),
    };
    let printed = io::stdout().lock().write_all(text.as_bytes());
    if let Some((output, layer, flip)) = shown {
        write(output, &a, &b, &layer, flip)?;
    }
    let code = match report.passes {
        true => ExitCode::SUCCESS,
        false => ExitCode::from(DIFFER),
    };
    Ok(super::ended(printed, code))
}

fn name(path: &Path) -> String {
    match path.to_str() {
        Some("-") => "standard input".to_owned(),
        _ => path.display().to_string(),
    }
}

fn read(path: &Path) -> anyhow::Result<Picture> {
    Picture::read(path).with_context(|| name(path))
}

fn has_colors(picture: &Picture) -> bool {
    picture.colors().is_some()
}

/// Brings two pictures of different kinds to one: what is linear is shown as the other one is. A screen's picture without alpha
/// covers all.
fn alike(a: Picture, b: Picture, report: &mut Report) -> anyhow::Result<(Picture, Picture)> {
    let mut shown = |linear: Picture, bits: u8, name: String| -> anyhow::Result<Picture> {
        let displayed = linear.displayed(bits).ok_or_else(|| {
            anyhow::anyhow!("{name}: has no colours, which are R, G and B, or Y; only such are compared with a PNG")
        })?;
        let left: Vec<&str> = linear.channels.iter().map(|channel| channel.name.as_str()).collect();
        let left: Vec<&str> = left.into_iter().filter(|name| layer_of(name) != COLOR).collect();
        let left = match left.is_empty() {
            true => String::new(),
            false => format!("; {} are not compared", left.join(" ")),
        };
        report.notes.push(format!(
            "{name}: is linear, and compared as wgray render writes it to a PNG of {bits} bits by gamma22{left}"
        ));
        Ok(displayed)
    };
    let (a, b) = match (a.kind, b.kind) {
        (Kind::Linear, Kind::Display { bits }) => {
            let name = report.a.clone();
            (shown(a, bits, name)?, b)
        }
        (Kind::Display { bits }, Kind::Linear) => {
            let name = report.b.clone();
            (a, shown(b, bits, name)?)
        }
        _ => (a, b),
    };
    let is_display = matches!(b.kind, Kind::Display { .. });
    let has_alpha = a.channel("A").is_some() || b.channel("A").is_some();
    Ok(match is_display && has_alpha {
        true => (a.with_alpha(), b.with_alpha()),
        false => (a, b),
    })
}

/// Leaves only the layers that are asked for.
fn choose(layers: &[String], a: &mut Picture, b: &mut Picture) -> Result<(), Usage> {
    if layers.is_empty() {
        return Ok(());
    }
    let mut known: Vec<String> = Vec::new();
    for channel in a.channels.iter().chain(&b.channels) {
        let layer = layer_of(&channel.name).to_owned();
        if !known.contains(&layer) {
            known.push(layer);
        }
    }
    if let Some(unknown) = layers.iter().find(|layer| !known.contains(layer)) {
        let known = known.join(", ");
        return Err(Usage(format!(
            "--layers: {unknown}: must be a layer of the pictures: {known}"
        )));
    }
    for picture in [a, b] {
        let is_asked = |name: &str| layers.iter().any(|layer| layer == layer_of(name));
        picture.channels.retain(|channel| is_asked(&channel.name));
    }
    Ok(())
}

/// What is computed.
fn wanted(args: &Args, picture: &Picture, asked: &[Metric], report: &mut Report) -> Vec<Metric> {
    let is_large = picture.pixels() as u64 > QUICK;
    let is_wanted = |metric: &Metric| match args.metrics.is_empty() {
        false => asked.contains(metric),
        true => asked.contains(metric) || *metric != Metric::Flip || !is_large,
    };
    let wanted: Vec<Metric> = METRICS.into_iter().filter(is_wanted).collect();
    if args.metrics.is_empty() && !wanted.contains(&Metric::Flip) {
        report
            .notes
            .push("flip: is left out of so large a picture; --metrics names it to have it".to_owned());
    }
    wanted
}

/// The place of the picture, which must be a PNG and replace neither of the others.
fn find_out<'a>(path: &'a Path, args: &Args) -> anyhow::Result<(Output, &'a Path)> {
    let name = path.display();
    if path.as_os_str() == "-" {
        return Err(Usage("--out: -: standard output gets the figures; choose a file".to_owned()).into());
    }
    let output = Output::find(path).map_err(RenderError::Output)?;
    if output.is_same(&Output::standard()) {
        return Err(Usage(format!(
            "--out: {name}: standard output gets the figures; choose a file"
        ))
        .into());
    }
    if output.is_file() && path.extension().is_none_or(|end| !end.eq_ignore_ascii_case("png")) {
        return Err(Usage(format!("--out: {name}: must end in .png")).into());
    }
    for input in [&args.a, &args.b] {
        if output.is_input(input) {
            let input = input.display();
            return Err(Usage(format!(
                "--out: {name}: is the picture {input}, which must stay; choose another name"
            ))
            .into());
        }
    }
    Ok((output, path))
}

fn write(output: Output, a: &Picture, b: &Picture, layer: &Layer, flip: Option<Flip>) -> Result<(), RenderError> {
    let shown = compare::show(a, b, layer, flip.and_then(|flip| flip.map));
    let plain = |error: EncodingError| match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    };
    let mut pending = Pending::start(output)?;
    let mut png = Encoder::new(&mut pending, shown.width as u32, shown.height as u32);
    png.set_color(ColorType::Rgb);
    png.set_depth(BitDepth::Eight);
    png.set_compression(Compression::Fast);
    let mut writer = png.write_header().map_err(plain)?;
    let mut stream = writer.stream_writer().map_err(plain)?;
    for y in 0..shown.height {
        stream.write_all(&shown.row(y))?;
    }
    stream.finish().map_err(plain)?;
    writer.finish().map_err(plain)?;
    Ok(pending.finish()?)
}
