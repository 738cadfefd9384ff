//! Output image options, shared by `render` and `merge`.

use std::path::PathBuf;

use crate::image::{BitDepth, ExrCompression, ExrType, Format, Metadata, SaveOptions, SaveReport};
use crate::scene::{ViewSettings, ViewTransform};
use clap::builder::{PossibleValuesParser, TypedValueParser as _};

use super::Usage;
use super::numbers::integer;

/// Options for output images.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Output images")]
pub struct PictureOptions {
    /// Write FILE.png, .exr, .jpg, .webp, or - (stdout) [default: SCENE.png]
    #[arg(short, long, help_heading = None::<&'static str>, display_order = 0, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Set the exposure in stops, -100 to 100; not for EXR
    #[arg(long, value_name = "STOPS", value_parser = parse_exposure, allow_negative_numbers = true)]
    pub exposure: Option<f64>,

    /// Set the view transform: gamma22, srgb, agx or khronos-pbr-neutral; not for EXR
    #[arg(long, value_name = "NAME", value_parser = name_parser(ViewTransform::ALL, ViewTransform::name), hide_possible_values = true)]
    pub view_transform: Option<ViewTransform>,

    /// Set the format of outputs without a known extension
    #[arg(long, value_name = "FORMAT", value_parser = name_parser(Format::ALL, Format::name), hide_short_help = true)]
    pub format: Option<Format>,

    /// Set the bits per channel of a PNG [default: 8]
    #[arg(long, value_name = "BITS", value_parser = depth_parser(), hide_short_help = true)]
    pub bit_depth: Option<BitDepth>,

    /// Set the channel type of an EXR [default: float]
    #[arg(long, value_name = "TYPE", value_parser = name_parser(ExrType::ALL, ExrType::name), hide_short_help = true)]
    pub exr_type: Option<ExrType>,

    /// Set the lossless compression of an EXR [default: zip]
    #[arg(long, value_name = "METHOD", value_parser = name_parser(ExrCompression::ALL, ExrCompression::name), hide_short_help = true)]
    pub exr_compression: Option<ExrCompression>,

    /// Set the quality of a JPEG, 1 to 100 [default: 90]
    #[arg(long, value_name = "N", value_parser = integer::<u8>(1..=100), hide_short_help = true)]
    pub quality: Option<u8>,

    /// Omit device and driver names, so that equal scenes give equal files
    #[arg(long, hide_short_help = true)]
    pub reproducible: bool,
}

impl PictureOptions {
    /// Returns the view settings: the options override the scene.
    pub fn view(&self, scene: ViewSettings) -> ViewSettings {
        ViewSettings {
            transform: self.view_transform.unwrap_or(scene.transform),
            exposure: self.exposure.unwrap_or(scene.exposure),
        }
    }

    /// Returns the encoding options and metadata of the files.
    pub fn save_options(&self, metadata: Metadata) -> SaveOptions {
        SaveOptions {
            bit_depth: self.bit_depth.unwrap_or_default(),
            exr_type: self.exr_type.unwrap_or_default(),
            exr_compression: self.exr_compression.unwrap_or_default(),
            quality: self.quality.unwrap_or(SaveOptions::QUALITY),
            metadata,
        }
    }

    /// Warns about values that exceeded the range of a format.
    pub fn warn(&self, saved: &SaveReport, log: &mut dyn FnMut(&str)) {
        for (name, count) in &saved.too_large {
            log(&format!(
                "{name}: values beyond 65504, the maximum of a 16-bit float, were written as infinity (number of these values: \
                 {count}); use --exr-type float"
            ));
        }
    }

    /// Rejects options that apply to none of the outputs.
    pub fn check(&self, formats: &[Format]) -> Result<(), Usage> {
        use Format::{Exr, Jpeg, Png, WebP};
        let display_formats = &[Png, Jpeg, WebP][..];
        let options = [
            ("--view-transform", self.view_transform.is_some(), display_formats),
            ("--exposure", self.exposure.is_some(), display_formats),
            ("--bit-depth", self.bit_depth.is_some(), &[Png]),
            ("--exr-type", self.exr_type.is_some(), &[Exr]),
            ("--exr-compression", self.exr_compression.is_some(), &[Exr]),
            ("--quality", self.quality.is_some(), &[Jpeg]),
        ];
        let unused = |(_, is_set, supporting_formats): &(&str, bool, &[Format])| {
            *is_set && !supporting_formats.iter().any(|format| formats.contains(format))
        };
        match options.into_iter().find(unused) {
            None => Ok(()),
            Some((option, _, supporting_formats)) => {
                let names: Vec<String> = (supporting_formats.iter())
                    .map(|format| format.name().to_uppercase())
                    .collect();
                let names = names.join(", ");
                Err(Usage(format!("{option}: only applies to {names} outputs")))
            }
        }
    }
}

/// Returns a parser that maps the name of each value to the value.
pub fn name_parser<T: Clone + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl clap::builder::TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.clone().map(name)).try_map(move |text| {
        let found = all.iter().find(|value| name((*value).clone()) == text);
        found.cloned().ok_or(format!("unknown name: {text}"))
    })
}

fn depth_parser() -> impl clap::builder::TypedValueParser<Value = BitDepth> {
    PossibleValuesParser::new(["8", "16"]).map(|bits| match bits.as_str() {
        "16" => BitDepth::Sixteen,
        _ => BitDepth::Eight,
    })
}

fn parse_exposure(text: &str) -> Result<f64, String> {
    let rule = "must be a number from -100 to 100, such as 1.5".to_owned();
    let stops: f64 = text.parse().map_err(|_| rule)?;
    ViewSettings::check_exposure(stops)
}
