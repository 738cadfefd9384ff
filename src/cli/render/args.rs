//! The options of `wgray render`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::device::Device;
use crate::image::Aov;
use crate::options::Options;
use crate::scene::{Define, Integrator, Overrides, Pattern, Scene, is_gltf};
use clap::ValueHint;
use clap::builder::{NonEmptyStringValueParser, PossibleValuesParser, TypedValueParser};
use wgray_image::Region;
use wgray_render::job::Tile;

use crate::cli::Usage;
use crate::cli::frames::{Frame, Frames};
use crate::cli::numbers::{bounces, integer, samples};
use crate::cli::outputs::{LayerPolicy, Outputs};
use crate::cli::picture_options::{PictureOptions, name_parser};
use crate::cli::progress::Mode;
use crate::cli::scene_options::SceneOptions;

/// Arguments of `wgray render`. `-h` omits the options with `hide_short_help`.
#[derive(Debug, clap::Args)]
#[command(after_help = crate::cli::EXIT_CODES)]
#[command(allow_negative_numbers = true)] // report negative numbers as out of range
pub struct Args {
    /// Scene (.toml, .json) or model to render
    pub scene: PathBuf,

    /// Set the image size in pixels
    #[arg(long, display_order = 1, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    pub size: Option<(u32, u32)>,

    /// Set the samples per pixel
    #[arg(long = "spp", visible_aliases = ["samples", "pixel-samples"], display_order = 2, value_name = "N", value_parser = samples)]
    pub pixel_samples: Option<u32>,

    /// Render on auto, gpu, cpu or a device of `wgray devices`
    #[arg(long, display_order = 4, value_name = "DEVICE", default_value = "auto", value_parser = NonEmptyStringValueParser::new())]
    pub device: String,

    /// Use integrator phong (direct light) or path (global illumination)
    #[arg(long, display_order = 5, value_name = "NAME", value_parser = name_parser(Integrator::ALL, Integrator::name), hide_possible_values = true)]
    pub integrator: Option<Integrator>,

    /// Denoise the image: on or off [default: the scene's setting]
    #[arg(long, display_order = 6, value_name = "on|off", value_parser = on_or_off(), hide_possible_values = true, num_args = 0..=1, require_equals = true, default_missing_value = "on")]
    pub denoise: Option<bool>,

    /// Stop after TIME (30, 90s, 1.5m, 2h) and write the samples taken so far
    #[arg(long, display_order = 6, value_name = "TIME", value_parser = parse_duration, conflicts_with = "tile")]
    pub time_limit: Option<Duration>,

    /// Stop when 95 % of the pixels have a relative error below X, such as 0.02
    #[arg(long, display_order = 6, value_name = "X", value_parser = parse_noise, conflicts_with_all = ["tile", "adaptive"])]
    pub noise: Option<f64>,

    /// Also write intermediate images; Ctrl+C writes the last complete pass
    #[arg(long, display_order = 7, conflicts_with = "tile")]
    pub preview: bool,

    /// Override a scene value, such as render.seed=3
    #[arg(short = 'D', long, display_order = 8, value_name = "KEY=VALUE")]
    pub define: Vec<Define>,

    /// Suppress all output except errors
    #[arg(short, long, display_order = 90, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Print the device, timings and details
    #[arg(short, long, display_order = 91)]
    pub verbose: bool,

    #[command(flatten)]
    pub options: SceneOptions,

    /// Allow the scene to read textures and meshes below DIR
    #[arg(long, help_heading = "Scene", value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub asset_root: Option<PathBuf>,

    /// Add samples where a pixel's standard error exceeds ERROR
    #[arg(long, help_heading = "Sampling", value_name = "ERROR", value_parser = parse_error)]
    pub adaptive: Option<f64>,

    /// Limit paths to N bounces
    #[arg(long, help_heading = "Sampling", value_name = "N", value_parser = bounces)]
    pub max_depth: Option<u32>,

    /// Set the samples per area light at each hit (integrator phong)
    #[arg(long, help_heading = "Sampling", value_name = "N", value_parser = samples, hide_short_help = true)]
    pub light_samples: Option<u32>,

    /// Set the sampling pattern within a pixel
    #[arg(long, help_heading = "Sampling", value_name = "PATTERN", value_parser = name_parser(Pattern::ALL, Pattern::name), hide_short_help = true)]
    pub pixel_pattern: Option<Pattern>,

    /// Set the seed of all random numbers
    #[arg(long, help_heading = "Sampling", value_name = "N", value_parser = integer::<u32>(0..=u32::MAX))]
    pub seed: Option<u32>,

    /// Render frames such as 5, 1-10 or 1-10:2, numbered by # in names
    #[arg(long, help_heading = "Animation", value_name = "FRAMES", allow_hyphen_values = true)]
    pub frames: Option<Frames>,

    /// Render N frames of a camera that orbits the scene
    #[arg(long, help_heading = "Animation", value_name = "N", value_parser = integer::<u32>(1..=100_000))]
    pub turntable: Option<u32>,

    /// Play glTF animations at F frames per second [default: 24 with --frames]
    #[arg(long, help_heading = "Animation", value_name = "F", value_parser = parse_fps, conflicts_with = "time")]
    pub fps: Option<f64>,

    /// Skip frames and parts whose files exist
    #[arg(long, help_heading = "Animation")]
    pub skip_existing: bool,

    #[command(flatten)]
    pub picture_options: PictureOptions,

    /// Also write layers, such as depth,normal, into an EXR or beside a PNG
    #[arg(long, help_heading = "Output images", value_name = "LAYERS", value_delimiter = ',', value_parser = name_parser(Aov::ALL, Aov::name), hide_possible_values = true)]
    pub aov: Vec<Aov>,

    /// Render only the columns x0 to x1 - 1 and the rows y0 to y1 - 1
    #[arg(long, help_heading = "Output images", value_name = "x0,y0,x1,y1", value_parser = parse_crop, allow_hyphen_values = true)]
    pub crop: Option<Region>,

    /// Save progress in FILE, or in a file in DIR, for --resume
    #[arg(long, help_heading = LONG_RENDERS, value_name = "FILE|DIR")]
    pub checkpoint: Option<PathBuf>,

    /// Save unfinished work every TIME
    #[arg(long, help_heading = LONG_RENDERS, value_name = "TIME", value_parser = parse_duration, default_value = "30", requires = "checkpoint", hide_short_help = true)]
    pub checkpoint_interval: Duration,

    /// Continue from the checkpoint if it exists
    #[arg(long, help_heading = LONG_RENDERS, requires = "checkpoint")]
    pub resume: bool,

    /// Render part i of n into NAME.part; `wgray merge` joins the parts
    #[arg(long, help_heading = LONG_RENDERS, value_name = "i/n", value_parser = parse_tile)]
    pub tile: Option<Tile>,

    /// Exit with CODE after a lost device or SIGTERM, so that a farm retries
    #[arg(long, help_heading = LONG_RENDERS, value_name = "CODE", value_parser = integer::<u8>(9..=125), hide_short_help = true)]
    pub requeue_exit: Option<u8>,

    /// Write timings and counts as JSON; - is standard output
    #[arg(long, help_heading = LONG_RENDERS, value_name = "FILE|-", hide_short_help = true)]
    pub stats: Option<PathBuf>,

    /// Show progress: auto is a bar on a terminal and lines elsewhere
    #[arg(long, help_heading = LONG_RENDERS, value_enum, value_name = "MODE", default_value_t = Mode::Auto, hide_short_help = true)]
    pub progress: Mode,

    /// Use N threads for the CPU and software Vulkan [default: all]
    #[arg(long, help_heading = LONG_RENDERS, value_name = "N", value_parser = integer::<u16>(1..=1024), hide_short_help = true)]
    pub threads: Option<u16>,

    /// Round in software for identical bits on more GPUs (slower, Vulkan only)
    #[arg(long, help_heading = LONG_RENDERS, hide_short_help = true)]
    pub exact_rounding: bool,
}

/// Returns the parser of `on` and `off`.
fn on_or_off() -> impl TypedValueParser<Value = bool> {
    PossibleValuesParser::new(["on", "off"]).map(|text| text == "on")
}

/// Heading of the options for long, tiled or measured renders.
const LONG_RENDERS: &str = "Long renders and farms";

impl Args {
    /// Returns the requested layers without duplicates.
    pub fn aovs(&self) -> Vec<Aov> {
        let mut aovs = Vec::new();
        for aov in &self.aov {
            if !aovs.contains(aov) {
                aovs.push(*aov);
            }
        }
        aovs
    }

    /// Returns the options for the library.
    pub fn rendering(&self) -> Options {
        Options {
            device: Device::from(self.device.as_str()),
            crop: self.crop,
            aovs: self.aovs(),
            noise: self.noise.is_some(),
            exact_rounding: self.exact_rounding,
        }
    }

    /// Returns the progress mode; --quiet disables progress.
    pub fn progress_mode(&self) -> Mode {
        if self.quiet { Mode::None } else { self.progress }
    }

    /// Returns the frames to render: a single frame without a number unless frames are requested.
    pub fn frames(&self) -> Vec<Frame> {
        let turntable = self.turntable.map(Frames::first);
        Frame::all(self.frames.as_ref().or(turntable.as_ref()))
    }

    /// Returns the frames per second of glTF animations; `None` if the animation time does not
    /// depend on the frame.
    pub fn fps(&self, scene: &Scene) -> Result<Option<f64>, Usage> {
        let error = |rule: &str| Err(Usage(format!("--fps: {rule}")));
        // A scene file that includes a model sets the animation time itself.
        let is_animated = scene.has_animations() && is_gltf(&self.scene);
        match self.fps {
            Some(_) if self.frames.is_none() && self.turntable.is_none() => error("needs --frames or --turntable"),
            Some(_) if !is_animated => error("only applies to glTF files with animations"),
            Some(fps) => Ok(Some(fps)),
            None => {
                let frames_set_time = self.frames.is_some() && self.turntable.is_none() && !self.options.has_time();
                Ok((frames_set_time && is_animated).then_some(DEFAULT_FPS))
            }
        }
    }

    /// Returns the destinations of a frame: the images or the part, and the statistics.
    pub fn outputs(&self, frame: Frame) -> anyhow::Result<Outputs> {
        let output_name = |output: &PathBuf| frame.name("--output", output);
        let picture_options = PictureOptions {
            output: (self.picture_options.output.iter().map(output_name)).collect::<Result<_, _>>()?,
            ..self.picture_options.clone()
        };
        let stats = match &self.stats {
            Some(path) if path.as_os_str() == "-" => Some(path.clone()),
            Some(path) => Some(frame.name("--stats", path)?),
            None => None,
        };
        match self.tile {
            Some(_) => Outputs::find_part(&picture_options, stats.as_deref()),
            None => Outputs::find(
                &picture_options,
                &self.default_name(frame)?,
                (&self.aovs(), LayerPolicy::Requested),
                stats.as_deref(),
            ),
        }
    }

    /// Returns the default name of the image, derived from the name of the scene.
    fn default_name(&self, frame: Frame) -> anyhow::Result<PathBuf> {
        let name = PathBuf::from(self.scene.file_stem().unwrap_or("scene".as_ref()));
        Ok(match frame.number {
            None => name.with_added_extension("png"),
            // The name of the scene may contain #.
            Some(_) => {
                let number = frame.name("--output", Path::new("####"))?;
                name.with_added_extension(number).with_added_extension("png")
            }
        })
    }

    /// Returns the path of a frame's checkpoint.
    pub fn checkpoint(&self, frame: Frame) -> anyhow::Result<Option<PathBuf>> {
        let name = self.checkpoint.as_ref().map(|path| frame.name("--checkpoint", path));
        Ok(name.transpose()?)
    }

    /// Returns the values that override the scene.
    pub fn overrides(&self) -> Overrides {
        self.options.add_to(Overrides {
            size: self.size,
            pixel_samples: self.scene_samples(),
            light_samples: self.light_samples,
            seed: self.seed,
            denoise: self.denoise,
            pixel_pattern: self.pixel_pattern,
            adaptive: self.adaptive,
            integrator: self.integrator,
            max_depth: self.max_depth,
            asset_root: self.asset_root.clone(),
            view_transform: self.picture_options.view_transform,
            exposure: self.picture_options.exposure,
            turntable: self.turntable,
            define: self.defines(),
            ..Overrides::default()
        })
    }

    /// Returns the samples per pixel that override the scene. With a noise limit, `--spp` is the maximum, and the scene's
    /// number still determines the filter width of textures; but patterns that cannot be combined with the limit require
    /// square numbers.
    fn scene_samples(&self) -> Option<u32> {
        let overrides_scene = self.noise.is_none() || self.pixel_pattern.is_some_and(Pattern::needs_square);
        self.pixel_samples.filter(|_| overrides_scene)
    }

    /// Returns the values of `--define`. If they set keys of `render.adaptive`, the error of `--adaptive` is added, because
    /// that table requires an error.
    fn defines(&self) -> Vec<Define> {
        let mut defines = self.define.clone();
        let sets_adaptive = |define: &Define| define.to_string().starts_with("render.adaptive");
        if let Some(error) = self.adaptive
            && defines.iter().any(sets_adaptive)
        {
            defines.extend(Define::new("render.adaptive.error", &format!("{error:?}")));
        }
        defines
    }
}

/// Parses the error threshold of adaptive sampling.
fn parse_error(text: &str) -> Result<f64, String> {
    let error = text.parse().ok().filter(|error| (0.0..=1.0).contains(error));
    error.ok_or("must be a number from 0 to 1, such as 0.01".to_owned())
}

/// Parses the limit of the noise.
fn parse_noise(text: &str) -> Result<f64, String> {
    let limit = text.parse().ok().filter(|limit: &f64| *limit > 0.0 && *limit <= 1.0);
    limit.ok_or("must be a number greater than 0 and at most 1, such as 0.02".to_owned())
}

/// Parses an image size.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let numbers = text
        .split_once('x')
        .map(|(width, height)| (width.parse(), height.parse()));
    match numbers {
        Some((Ok(width), Ok(height))) => Ok((width, height)),
        _ => Err("must be WIDTHxHEIGHT, two whole numbers such as 640x480".to_string()),
    }
}

/// Frames per second of `--frames` without `--fps`.
const DEFAULT_FPS: f64 = 24.0;

fn parse_fps(text: &str) -> Result<f64, String> {
    let fps = text.parse().ok().filter(|fps: &f64| (1e-3..=1e6).contains(fps));
    fps.ok_or("must be a number from 0.001 to 1e6, such as 24 or 29.97".to_owned())
}

/// Maximum duration: 1e9 seconds, about thirty years.
const MAX_TIME: Duration = Duration::from_secs(1_000_000_000);

/// Parses a duration: a decimal number of seconds, or a decimal number with a unit.
fn parse_duration(text: &str) -> Result<Duration, String> {
    const UNITS: [(&str, f64); 4] = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0)];
    let number = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = &text[number.len()..];
    let scale = match unit {
        "" => Some(1.0),
        _ => UNITS.iter().find(|(name, _)| *name == unit).map(|(_, scale)| *scale),
    };
    let seconds = number
        .parse()
        .ok()
        .zip(scale)
        .map(|(number, scale): (f64, f64)| number * scale);
    let duration = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    let rule = "must be from 0 to 1e9 seconds, such as 90, 0.3, 250ms, 90s, 1.5m or 2h";
    duration.filter(|time| *time <= MAX_TIME).ok_or(rule.to_owned())
}

fn parse_tile(text: &str) -> Result<Tile, String> {
    let numbers = text
        .split_once('/')
        .map(|(number, count)| (number.parse(), count.parse()));
    match numbers {
        Some((Ok(number), Ok(count))) if 1 <= number && number <= count => Ok(Tile { number, of: count }),
        _ => Err("must be i/n, two whole numbers with i from 1 to n, such as 2/8".to_owned()),
    }
}

fn parse_crop(text: &str) -> Result<Region, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(str::parse).collect();
    let Ok(&[x0, y0, x1, y1]) = numbers.as_deref() else {
        return Err("must be four whole numbers, such as 0,0,640,480".to_string());
    };
    if x0 >= x1 || y0 >= y1 {
        return Err("x0 must be less than x1, and y0 less than y1".to_string());
    }
    Ok(Region { x0, y0, x1, y1 })
}
