//! The options that say which pictures are written, and how: the same wherever pictures are made.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use wgray::image::{BitDepth, ExrCompression, ExrType, Format, Metadata, SaveOptions, Saved};
use wgray::scene::{ViewSettings, ViewTransform};

use super::Usage;

/// The options as they are written.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Pictures")]
pub struct PictureOptions {
    /// Picture to write, once or several times: a .png, .jpg, .jpeg or .webp, as a display shows it, or an .exr, linear. - is
    /// standard output. If absent: the scene's name with .png, of frames with .####.png, in the current folder
    #[arg(short, long, value_name = "OUT.png|OUT.exr|...|-")]
    pub output: Vec<PathBuf>,

    /// Format of pictures whose names do not tell; if absent, png for standard output, pipes and devices
    #[arg(long, value_name = "FORMAT", value_parser = named(Format::ALL, Format::name))]
    pub format: Option<Format>,

    /// How light is shown, but in an EXR, in place of the scene's view_transform: gamma22, clamped and to the power 1/2.2; srgb,
    /// clamped, with sRGB's curve; agx and khronos-pbr-neutral, which keep what is too bright from being cut off
    #[arg(long, value_name = "TRANSFORM", value_parser = named(ViewTransform::ALL, ViewTransform::name))]
    pub view_transform: Option<ViewTransform>,

    /// Stops that what is shown is brighter by, but in an EXR, in place of the scene's exposure; -100 to 100
    #[arg(long, value_name = "STOPS", value_parser = parse_exposure, allow_negative_numbers = true)]
    pub exposure: Option<f64>,

    /// Bits of a channel of a PNG; if absent, 8
    #[arg(long, value_name = "BITS", value_parser = depth_parser())]
    pub bit_depth: Option<BitDepth>,

    /// Numbers of an EXR, layers too: float, 32 bits, if absent; half, 16 bits, up to 65504. Whole numbers have 32 bits
    #[arg(long, value_name = "TYPE", value_parser = named(ExrType::ALL, ExrType::name))]
    pub exr_type: Option<ExrType>,

    /// How an EXR is compressed, always without loss; if absent, zip
    #[arg(long, value_name = "METHOD", value_parser = named(ExrCompression::ALL, ExrCompression::name))]
    pub exr_compression: Option<ExrCompression>,

    /// Quality of a JPEG, 1 to 100; if absent, 90
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=100))]
    pub quality: Option<u8>,

    /// Writes nothing into pictures that depends on where they were rendered, such as the device's name: the same scene gives the
    /// same bytes
    #[arg(long)]
    pub reproducible: bool,
}

impl PictureOptions {
    /// How the pictures are shown, for a scene that says something of it.
    pub fn view(&self, scene: ViewSettings) -> ViewSettings {
        ViewSettings {
            transform: self.view_transform.unwrap_or(scene.transform),
            exposure: self.exposure.unwrap_or(scene.exposure),
        }
    }

    /// How the files are written, and what is told in them.
    pub fn save_options(&self, metadata: Metadata) -> SaveOptions {
        SaveOptions {
            bit_depth: self.bit_depth.unwrap_or_default(),
            exr_type: self.exr_type.unwrap_or_default(),
            exr_compression: self.exr_compression.unwrap_or_default(),
            quality: self.quality.unwrap_or(SaveOptions::QUALITY),
            metadata,
        }
    }

    /// Tells what was noticed when the pictures were written.
    pub fn warn(&self, saved: &Saved, say: &mut dyn FnMut(&str)) {
        for (name, count) in &saved.too_large {
            say(&format!(
                "{name}: {count} values are too large for 16 bits, which hold 65504 at most, and are infinite there"
            ));
        }
    }

    /// Refuses options that none of the pictures heeds.
    pub fn check(&self, formats: &[Format]) -> Result<(), Usage> {
        use Format::{Exr, Jpeg, Png, WebP};
        let shown = &[Png, Jpeg, WebP][..];
        let options = [
            ("--view-transform", self.view_transform.is_some(), shown),
            ("--exposure", self.exposure.is_some(), shown),
            ("--bit-depth", self.bit_depth.is_some(), &[Png]),
            ("--exr-type", self.exr_type.is_some(), &[Exr]),
            ("--exr-compression", self.exr_compression.is_some(), &[Exr]),
            ("--quality", self.quality.is_some(), &[Jpeg]),
        ];
        let idle = |(_, given, heeding): &(&str, bool, &[Format])| {
            *given && !heeding.iter().any(|format| formats.contains(format))
        };
        match options.into_iter().find(idle) {
            None => Ok(()),
            Some((option, _, heeding)) => {
                let heeding: Vec<&str> = heeding.iter().map(|format| format.title()).collect();
                let heeding = heeding.join(", ");
                Err(Usage(format!("{option}: is for {heeding}, and no output is one")))
            }
        }
    }
}

/// Takes one of some names.
fn named<T: Clone + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl clap::builder::TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.clone().map(name)).try_map(move |given| {
        let found = all.iter().find(|value| name((*value).clone()) == given);
        found.cloned().ok_or(format!("no such name: {given}"))
    })
}

fn depth_parser() -> impl clap::builder::TypedValueParser<Value = BitDepth> {
    PossibleValuesParser::new(["8", "16"]).map(|bits| match bits.as_str() {
        "16" => BitDepth::Sixteen,
        _ => BitDepth::Eight,
    })
}

fn parse_exposure(text: &str) -> Result<f64, String> {
    let rule = "must be stops from -100 to 100, such as 1.5".to_owned();
    let stops: f64 = text.parse().map_err(|_| rule)?;
    ViewSettings::check_exposure(stops)
}
