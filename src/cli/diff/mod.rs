//! `wgray diff`: measures the difference of two images, and fails if it exceeds a limit.

mod measure;
mod metric;
mod report;

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::error::RenderError;
use crate::image::{Output, Pending};
use anyhow::Context as _;
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};
use wgray_image::compare::{self, COLOR, Flip, Kind, Layer, Picture, layer_of};
use wgray_image::sanitize::escape_control_in_lines;

use super::Usage;
use measure::measure;
use metric::{Limit, METRICS, Metric};
use report::Report;

const EXIT_CODES: &str = "\
Exit codes: 0 identical, or within every --fail limit; 1 a file cannot be read as an image; 2 wrong command line; 5 the images \
differ; 7 an image does not fit into memory; 8 the image of --out could not be written.\n\n\
docs/golden-pictures.md defines the metrics.";

/// Exit code if the images differ.
const DIFFER: u8 = 5;
/// Maximum number of pixels for which FLIP is computed by default. FLIP takes one microsecond per pixel of a display
/// image, and several microseconds per pixel of a linear image.
const MAX_FLIP_PIXELS: u64 = 1 << 24;

#[derive(Debug, clap::Args)]
#[command(after_help = EXIT_CODES)]
#[command(allow_negative_numbers = true)] // report negative numbers as out of range
pub struct Args {
    /// Image to test: PNG, EXR, JPEG or WebP; - reads standard input
    #[arg(value_name = "A")]
    a: PathBuf,

    /// Reference image. An EXR is converted to display values before it is compared with a PNG
    #[arg(value_name = "B")]
    b: PathBuf,

    /// Fail only if a metric is worse than X; may be repeated
    ///
    /// Larger values are worse, except for psnr and ssim. Without this option any difference fails. NaN, infinite
    /// values and missing channels always fail.
    #[arg(long, value_name = "METRIC=X", value_parser = Limit::parse)]
    fail: Vec<Limit>,

    /// Compute only these metrics: different, largest, share, rmse, rel_mse, psnr, ssim, flip
    ///
    /// Separate them by commas. By default all are computed, flip only up to 16.7 million pixels.
    #[arg(long, value_name = "METRICS", value_delimiter = ',', value_parser = Metric::parse)]
    metrics: Vec<Metric>,

    /// Compare only these layers: color is R, G, B, A and Y; normal is normal.X, normal.Y and normal.Z
    ///
    /// Separate them by commas. By default all layers are compared.
    #[arg(long, value_name = "LAYERS", value_delimiter = ',')]
    layers: Vec<String>,

    /// For the metric share, count only pixels with a value that differs by more than X
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = threshold)]
    threshold: f64,

    /// Set the pixels per degree of visual angle for FLIP [default: 67.02]
    ///
    /// The default is a screen 0.7 m wide with 3840 columns at a distance of 0.7 m.
    #[arg(long, value_name = "PIXELS", value_parser = ppd)]
    ppd: Option<f64>,

    /// Write an image that shows A, B and their difference, outlined
    #[arg(long, value_name = "DIFF.png")]
    out: Option<PathBuf>,

    /// Print the report as one JSON object
    #[arg(long)]
    json: bool,
}

fn threshold(text: &str) -> Result<f64, String> {
    number(text, 0.0, f64::MAX).map_err(|()| "must be a number of at least 0".to_owned())
}

fn ppd(text: &str) -> Result<f64, String> {
    number(text, 1.0, 1000.0).map_err(|()| "must be a number from 1 to 1000".to_owned())
}

fn number(text: &str, min: f64, max: f64) -> Result<f64, ()> {
    let number: f64 = text.parse().map_err(|_| ())?;
    if (min..=max).contains(&number) {
        Ok(number)
    } else {
        Err(())
    }
}

/// Compares two images, prints a report, and returns exit code 0 or 5.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    if args.a.as_os_str() == "-" && args.b.as_os_str() == "-" {
        return Err(Usage("-: only one of the images can be standard input".to_owned()).into());
    }
    let out = args.out.as_deref().map(|path| find_output(path, &args)).transpose()?;
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let mut report = Report::new([&args.a, &args.b].map(|path| name(path)), &a, &b);
    let (mut a, mut b) = to_same_kind(a, b, &mut report)?;
    select_layers(&args.layers, &mut a, &mut b)?;
    let mut shown_layer = None;
    if (a.width, a.height, a.position) == (b.width, b.height, b.position) {
        let (layers, only_a, only_b) = compare::layers(&a, &b);
        report.set_only(&only_a, &only_b);
        let requested: Vec<Metric> = args
            .metrics
            .iter()
            .copied()
            .chain(args.fail.iter().map(|limit| limit.metric))
            .collect();
        if let Some(metric) = requested.iter().find(|metric| metric.needs_colors())
            && !(has_colors(&a) && has_colors(&b))
        {
            return Err(Usage(format!(
                "{metric}: requires color channels (R, G and B, or Y) in both images"
            ))
            .into());
        }
        let ppd = args.ppd.unwrap_or(compare::PIXELS_PER_DEGREE);
        let metrics = select_metrics(&args, &b, &requested, &mut report);
        // The first layer that differs, or the first layer if none differs.
        let mut selected: Option<(usize, Option<Flip>)> = None;
        for (i, layer) in layers.iter().enumerate() {
            let step = out.is_some().then(|| compare::step(&b));
            let (found, flip) = measure(layer, &a, &b, &metrics, args.threshold, ppd, step);
            if selected.is_none() || found.is_different() && !report.is_different() {
                selected = Some((i, flip));
            }
            report.layers.push(found);
        }
        shown_layer = selected.and_then(|(i, flip)| Some((layers.get(i)?.clone(), flip)));
        report.metrics = metrics;
    }
    report.judge(&args.fail, args.threshold);
    let shown_layer = match (out, shown_layer) {
        (Some((output, _)), Some((layer, flip))) => Some((output, layer, flip)),
        (Some((_, path)), None) => {
            report.notes.push(format!(
                "{}: not written: the images cannot be shown side by side",
                path.display()
            ));
            None
        }
        (None, _) => None,
    };
    if let Some((output, layer, _)) = &shown_layer
        && layer.name != COLOR
    {
        report
            .notes
            .push(format!("{}: shows layer {}", output.name(), layer.name));
    }
    let text = match args.json {
        true => serde_json::to_string_pretty(&report)? + "\n",
        false => escape_control_in_lines(&report.to_string()).into_owned(),
    };
    let printed = io::stdout().lock().write_all(text.as_bytes());
    if let Some((output, layer, flip)) = shown_layer {
        write(output, &a, &b, &layer, flip)?;
    }
    let code = match report.passes {
        true => ExitCode::SUCCESS,
        false => ExitCode::from(DIFFER),
    };
    Ok(super::finish_output(printed, code))
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

/// Converts a linear image to display values if the other image has display values. Display images without alpha are
/// opaque.
fn to_same_kind(a: Picture, b: Picture, report: &mut Report) -> anyhow::Result<(Picture, Picture)> {
    let mut to_display = |linear: Picture, bits: u8, name: String| -> anyhow::Result<Picture> {
        let displayed = linear
            .displayed(bits)
            .ok_or_else(|| anyhow::anyhow!("{name}: has no color channels (R, G and B, or Y) to compare with a PNG"))?;
        let names = linear.channels.iter().map(|channel| channel.name.as_str());
        let omitted: Vec<&str> = names.filter(|name| layer_of(name) != COLOR).collect();
        let omitted = match omitted.is_empty() {
            true => String::new(),
            false => format!("; not compared: {}", omitted.join(" ")),
        };
        report.notes.push(format!(
            "{name}: linear; converted to a PNG with {bits} bits and gamma22 for the comparison{omitted}"
        ));
        Ok(displayed)
    };
    let (a, b) = match (a.kind, b.kind) {
        (Kind::Linear, Kind::Display { bits }) => {
            let name = report.a.clone();
            (to_display(a, bits, name)?, b)
        }
        (Kind::Display { bits }, Kind::Linear) => {
            let name = report.b.clone();
            (a, to_display(b, bits, name)?)
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

/// Removes layers that were not requested.
fn select_layers(layers: &[String], a: &mut Picture, b: &mut Picture) -> Result<(), Usage> {
    if layers.is_empty() {
        return Ok(());
    }
    let mut available: Vec<String> = Vec::new();
    for channel in a.channels.iter().chain(&b.channels) {
        let layer = layer_of(&channel.name).to_owned();
        if !available.contains(&layer) {
            available.push(layer);
        }
    }
    if let Some(unknown) = layers.iter().find(|layer| !available.contains(layer)) {
        let available = available.join(", ");
        return Err(Usage(format!(
            "--layers: {unknown}: must be a layer of the images: {available}"
        )));
    }
    for picture in [a, b] {
        let is_requested = |name: &str| layers.iter().any(|layer| layer == layer_of(name));
        picture.channels.retain(|channel| is_requested(&channel.name));
    }
    Ok(())
}

/// Returns the metrics to compute.
fn select_metrics(args: &Args, picture: &Picture, requested: &[Metric], report: &mut Report) -> Vec<Metric> {
    let is_large = picture.pixels() as u64 > MAX_FLIP_PIXELS;
    let is_selected = |metric: &Metric| match args.metrics.is_empty() {
        false => requested.contains(metric),
        true => requested.contains(metric) || *metric != Metric::Flip || !is_large,
    };
    let selected: Vec<Metric> = METRICS.into_iter().filter(is_selected).collect();
    if args.metrics.is_empty() && !selected.contains(&Metric::Flip) {
        report
            .notes
            .push("flip: omitted for an image this large; pass --metrics flip to compute it".to_owned());
    }
    selected
}

/// Returns the output, which must be a PNG and replace neither input.
fn find_output<'a>(path: &'a Path, args: &Args) -> anyhow::Result<(Output, &'a Path)> {
    let name = path.display();
    if path.as_os_str() == "-" {
        return Err(Usage("--out: -: standard output receives the report; choose a file".to_owned()).into());
    }
    let output = Output::find(path).map_err(RenderError::Output)?;
    if output.is_same(&Output::standard()) {
        return Err(Usage(format!(
            "--out: {name}: standard output receives the report; choose a file"
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
                "--out: {name}: would overwrite the input {input}; choose another name"
            ))
            .into());
        }
    }
    Ok((output, path))
}

fn write(output: Output, a: &Picture, b: &Picture, layer: &Layer, flip: Option<Flip>) -> Result<(), RenderError> {
    let shown = compare::show(a, b, layer, flip.and_then(|flip| flip.map));
    let io_error = |error: EncodingError| match error {
        EncodingError::IoError(error) => error,
        error => io::Error::other(error),
    };
    let mut pending = Pending::start(output)?;
    let mut png = Encoder::new(&mut pending, shown.width as u32, shown.height as u32);
    png.set_color(ColorType::Rgb);
    png.set_depth(BitDepth::Eight);
    png.set_compression(Compression::Fast);
    let mut writer = png.write_header().map_err(io_error)?;
    let mut stream = writer.stream_writer().map_err(io_error)?;
    for y in 0..shown.height {
        stream.write_all(&shown.row(y))?;
    }
    stream.finish().map_err(io_error)?;
    writer.finish().map_err(io_error)?;
    Ok(pending.finish()?)
}
