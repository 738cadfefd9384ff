//! The options of `wgray render`, as they are written.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueHint;
use clap::builder::{NonEmptyStringValueParser, PossibleValuesParser, TypedValueParser as _};
use wgray::device::Device;
use wgray::film::Region;
use wgray::image::Aov;
use wgray::job::Tile;
use wgray::render::Options;
use wgray::scene::{Define, Integrator, Overrides, Pattern, Scene, is_gltf};

use crate::cli::Usage;
use crate::cli::frames::{Frame, Frames};
use crate::cli::outputs::{Layered, Outputs};
use crate::cli::picture_options::PictureOptions;
use crate::cli::progress::Mode;
use crate::cli::scene_options::SceneOptions;

/// The arguments as they are written.
#[derive(Debug, clap::Args)]
#[command(after_help = crate::cli::EXIT_CODES)]
#[command(allow_negative_numbers = true)] // so that a number out of range is told as such
pub struct Args {
    /// Scene file; docs/scene-format.md says what is in it
    pub scene: PathBuf,

    /// Renders these frames, one after the other: N, A-B or A-B:STEP, several with commas between them. The camera is where
    /// camera.path of the scene has it, and # in names of outputs stand for the number: out.####.png is out.0001.png
    #[arg(long, value_name = "FRAMES", allow_hyphen_values = true)]
    pub frames: Option<Frames>,

    /// Renders N frames of a camera that goes once around what it looks at, as --frames 1-N does, or those of them that --frames
    /// names. The way that the scene's camera goes by itself is left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub turntable: Option<u32>,

    /// Frames of a second of the animations of a glTF file: frame N shows second N/F. If absent, 24 for --frames, and --turntable shows
    /// one moment
    #[arg(long, value_name = "F", value_parser = parse_fps, conflicts_with = "time")]
    pub fps: Option<f64>,

    /// Leaves out each picture, or frame, of which all files are there; a part only if it is of this scene and these options
    #[arg(long)]
    pub skip_existing: bool,

    /// Puts a value in place of the scene's, or beside its own: -D render.seed=3, -D materials.red.color=[1,0,0],
    /// -D shapes[2].radius=0.5. It is TOML, or text without quotes. Options for the same go before it
    #[arg(short = 'D', long, value_name = "KEY=VALUE")]
    pub define: Vec<Define>,

    /// Size of the picture in pixels, in place of the scene's
    #[arg(long, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    pub size: Option<(u32, u32)>,

    /// Samples of every pixel, in place of the scene's; a square number for some patterns
    #[arg(long, visible_alias = "spp", value_name = "N")]
    pub pixel_samples: Option<u32>,

    /// Layout of a pixel's samples, in place of the scene's
    #[arg(long, value_name = "PATTERN", value_parser = pattern_parser())]
    pub pixel_pattern: Option<Pattern>,

    /// Gives the pixels whose displayed value, 0 to 1, has a larger standard error than this further rounds of
    /// --pixel-samples samples, 16 rounds at most if the scene names no other number
    #[arg(long, value_name = "ERROR")]
    pub adaptive: Option<f64>,

    /// Samples of every area light at every hit, in place of the scene's
    #[arg(long, value_name = "N")]
    pub light_samples: Option<u32>,

    /// Seed of all random patterns, in place of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,

    /// What light is simulated, in place of the scene's: phong, direct light; path, light from surface to surface
    #[arg(long, value_name = "INTEGRATOR", value_parser = integrator_parser())]
    pub integrator: Option<Integrator>,

    /// Most bounces of a path, in place of the scene's
    #[arg(long, value_name = "N")]
    pub max_depth: Option<u32>,

    /// Folder that pictures and meshes named by the scene must lie in, if not the scene's own
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub asset_root: Option<PathBuf>,

    /// Renders the pixels of columns x0 to x1 - 1 and rows y0 to y1 - 1 only, the same as in the whole picture
    #[arg(long, value_name = "x0,y0,x1,y1", value_parser = parse_crop, allow_hyphen_values = true)]
    pub crop: Option<Region>,

    /// What renders. auto: a real GPU, else software Vulkan, else the CPU, which goes before software Vulkan where a scene has
    /// meshes or more than 64 primitives; gpu: any adapter; cpu: the CPU without any
    /// driver; NAME: the adapter with this as a part of its name, driver or type ("lavapipe" for Mesa's software Vulkan),
    /// or with this number in the list of wgray devices
    #[arg(long, value_name = "auto|gpu|cpu|NAME", default_value = "auto", value_parser = NonEmptyStringValueParser::new())]
    pub device: String,

    /// Rounds quotients and square roots correctly in software. A GPU's own may be off in the last digit; with this, more
    /// GPUs give the CPU's bits, at up to a few times the time. Vulkan only; without effect on the CPU
    #[arg(long)]
    pub exact_rounding: bool,

    /// Threads of the CPU and of software Vulkan, if not all
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// What else to write, of the first hit through each pixel's centre. In an EXR these are further layers: normal.X,
    /// .Y, .Z, outwards, and shading_normal; depth.Z, along the ray, 0 where nothing is; uv.U, .V; instance.ID, the shape's
    /// number; primitive.ID, that or a triangle's number in its mesh; barycentric.U, .V. Beside a PNG they are
    /// further files, NAME.normal.png and so on: normals moved to 0..1, depth bright where near (half bright at the picture's middle), fractions of texture coordinates in
    /// red and green, shapes in colours. Under --integrator path also means over the samples: albedo, emission, direct and
    /// indirect .R, .G, .B, the last three of which are the picture together, shown as it is beside a PNG; and
    /// shading_normal with normal maps. Under adaptive sampling also what it is like: sample_count.N; variance.R, .G, .B
    /// of the pixel's value. Beside a PNG counts are shown on a logarithmic scale, variances by their square root
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = aov_parser())]
    pub aov: Vec<Aov>,

    /// Keeps every finished piece of the picture in a file, and the one that is being rendered every --checkpoint-interval and
    /// at signals, so that --resume can go on from it after any end. It remains after success. In a folder that is there each job has a file of
    /// its own: a changed scene is begun anew beside what was kept of the old one
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// How often the piece that is being rendered is kept: seconds, or with a unit, as 90s, 1.5m, 2h
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "30", requires = "checkpoint")]
    pub checkpoint_interval: Duration,

    /// Goes on from the checkpoint, if there is one; else starts anew
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,

    /// Stops rendering so long after the start, or that of each frame, and writes the whole picture with the samples that it has by then, one of each
    /// pixel at least: seconds, or with a unit, as 90s, 1.5m, 2h
    #[arg(long, value_name = "TIME", value_parser = parse_duration, conflicts_with = "tile")]
    pub time_limit: Option<Duration>,

    /// Renders the i-th of n parts of the picture, counted from 1, to a file NAME.part; wgray merge joins them
    #[arg(long, value_name = "i/n", value_parser = parse_tile)]
    pub tile: Option<Tile>,

    /// The exit code, in place of 6 or 143, of an end after which the same command may succeed elsewhere or later: the device was lost and did
    /// not come back, or SIGTERM came, as farms send it before the time is up or the machine is wanted. 75 is usual
    #[arg(long, value_name = "CODE", value_parser = clap::value_parser!(u8).range(9..=125))]
    pub requeue_exit: Option<u8>,

    /// Writes what the render took, as JSON. - is standard output
    #[arg(long, value_name = "FILE.json|-")]
    pub stats: Option<PathBuf>,

    /// How progress is shown, on standard error
    #[arg(long, value_enum, default_value_t = Mode::Auto)]
    pub progress: Mode,

    /// Says nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Says what takes how long, on standard error
    #[arg(short, long)]
    pub verbose: bool,

    #[command(flatten)]
    pub options: SceneOptions,

    #[command(flatten)]
    pub pictures: PictureOptions,
}

impl Args {
    /// The layers that are asked for, each once.
    pub fn aovs(&self) -> Vec<Aov> {
        let mut aovs = Vec::new();
        for aov in &self.aov {
            if !aovs.contains(aov) {
                aovs.push(*aov);
            }
        }
        aovs
    }

    /// What the library is asked for.
    pub fn rendering(&self) -> Options {
        Options {
            device: Device::from(self.device.as_str()),
            crop: self.crop,
            aovs: self.aovs(),
            exact_rounding: self.exact_rounding,
        }
    }

    /// How progress is shown.
    pub fn shown_progress(&self) -> Mode {
        if self.quiet { Mode::None } else { self.progress }
    }

    /// The frames to render; one that has no number, if none are asked for.
    pub fn frames(&self) -> Vec<Frame> {
        let around = self.turntable.map(Frames::first);
        Frame::all(self.frames.as_ref().or(around.as_ref()))
    }

    /// Frames of a second, if frames are moments of the scene's animations.
    pub fn fps(&self, scene: &Scene) -> Result<Option<f64>, Usage> {
        let refused = |rule: &str| Err(Usage(format!("--fps: {rule}")));
        // Of what another scene holds that one says the time.
        let is_animated = scene.has_animations() && is_gltf(&self.scene);
        match self.fps {
            Some(_) if self.frames.is_none() && self.turntable.is_none() => refused("needs --frames or --turntable"),
            Some(_) if !is_animated => refused("is for glTF files that have animations, and this scene is none"),
            Some(fps) => Ok(Some(fps)),
            None => {
                let plays = self.frames.is_some() && self.turntable.is_none() && !self.options.has_time();
                Ok((plays && is_animated).then_some(FPS))
            }
        }
    }

    /// Where a frame's pictures, or its part of one, and figures are written to.
    pub fn outputs(&self, frame: Frame) -> anyhow::Result<Outputs> {
        let named = |output: &PathBuf| frame.name("--output", output);
        let pictures = PictureOptions {
            output: self.pictures.output.iter().map(named).collect::<Result<_, _>>()?,
            ..self.pictures.clone()
        };
        let stats = match &self.stats {
            Some(stream) if stream.as_os_str() == "-" => Some(stream.clone()),
            Some(file) => Some(frame.name("--stats", file)?),
            None => None,
        };
        match self.tile {
            Some(_) => Outputs::find_part(&pictures, stats.as_deref()),
            None => Outputs::find(
                &pictures,
                &self.default_name(frame)?,
                (&self.aovs(), Layered::Asked),
                stats.as_deref(),
            ),
        }
    }

    /// What a picture is called that is not named: as the scene.
    fn default_name(&self, frame: Frame) -> anyhow::Result<PathBuf> {
        let name = PathBuf::from(self.scene.file_stem().unwrap_or("scene".as_ref()));
        Ok(match frame.number {
            None => name.with_added_extension("png"),
            // The scene's own name may have a #.
            Some(_) => {
                let number = frame.name("--output", Path::new("####"))?;
                name.with_added_extension(number).with_added_extension("png")
            }
        })
    }

    /// Where a frame's checkpoint is.
    pub fn checkpoint(&self, frame: Frame) -> anyhow::Result<Option<PathBuf>> {
        let name = self.checkpoint.as_ref().map(|path| frame.name("--checkpoint", path));
        Ok(name.transpose()?)
    }

    /// Values in place of the scene's.
    pub fn overrides(&self) -> Overrides {
        self.options.over(Overrides {
            size: self.size,
            pixel_samples: self.pixel_samples,
            light_samples: self.light_samples,
            seed: self.seed,
            pixel_pattern: self.pixel_pattern,
            adaptive: self.adaptive,
            integrator: self.integrator,
            max_depth: self.max_depth,
            asset_root: self.asset_root.clone(),
            turntable: self.turntable,
            define: self.define.clone(),
            ..Overrides::default()
        })
    }
}

fn pattern_parser() -> impl clap::builder::TypedValueParser<Value = Pattern> {
    PossibleValuesParser::new(Pattern::ALL.map(Pattern::name)).try_map(|name| {
        let found = Pattern::ALL.into_iter().find(|pattern| pattern.name() == name);
        found.ok_or(format!("no such pattern: {name}"))
    })
}

fn integrator_parser() -> impl clap::builder::TypedValueParser<Value = Integrator> {
    PossibleValuesParser::new(Integrator::ALL.map(Integrator::name)).try_map(|name| {
        let found = Integrator::ALL.into_iter().find(|integrator| integrator.name() == name);
        found.ok_or(format!("no such integrator: {name}"))
    })
}

fn aov_parser() -> impl clap::builder::TypedValueParser<Value = Aov> {
    PossibleValuesParser::new(Aov::ALL.map(Aov::name)).try_map(|name| {
        let found = Aov::ALL.into_iter().find(|aov| aov.name() == name);
        found.ok_or(format!("no such output: {name}"))
    })
}

pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let numbers = text
        .split_once('x')
        .map(|(width, height)| (width.parse(), height.parse()));
    match numbers {
        Some((Ok(width), Ok(height))) => Ok((width, height)),
        _ => Err("must be two whole numbers, such as 640x480".to_string()),
    }
}

/// Frames of a second, if nothing is said.
const FPS: f64 = 24.0;

fn parse_fps(text: &str) -> Result<f64, String> {
    let fps = text.parse().ok().filter(|fps: &f64| (1e-3..=1e6).contains(fps));
    fps.ok_or("must be a number from 0.001 to 1e6, such as 24 or 29.97".to_owned())
}

/// Some thirty years.
const LONGEST_TIME: Duration = Duration::from_secs(1_000_000_000);

/// Seconds, as a decimal number without a unit or with one.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
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
    let rule = "must be a time from 0 to 1e9 s: seconds, or with a unit, as 90, 0.3, 250ms, 90s, 1.5m, 2h";
    duration.filter(|time| *time <= LONGEST_TIME).ok_or(rule.to_owned())
}

fn parse_tile(text: &str) -> Result<Tile, String> {
    let numbers = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
    match numbers {
        Some((Ok(number), Ok(of))) if 1 <= number && number <= of => Ok(Tile { number, of }),
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
