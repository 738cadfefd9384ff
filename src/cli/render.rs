//! `wgray render`: a scene file to a picture.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use clap::builder::{NonEmptyStringValueParser, PossibleValuesParser, TypedValueParser as _};
use tracing::info;
use wgray::backend::Backend;
use wgray::device::{Device, Renderer};
use wgray::error::RenderError;
use wgray::film::{Region, mean};
use wgray::image::{self, Aov, Band, Format, Layout, Pending};
use wgray::job::{self, Bands, Cut, Order};
use wgray::pack::Packed;
use wgray::render::{Options, middle_depth, needs_first_hits};
use wgray::scene::{Integrator, Overrides, Pattern};

use super::outputs::Outputs;
use super::progress::{self, Mode, Progress};
use super::stats::Stats;
use super::{say, signal};

/// The arguments as they are written.
#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
#[command(allow_negative_numbers = true)] // so that a number out of range is told as such
pub struct Args {
    /// Scene file; docs/scene-format.md says what is in it
    scene: PathBuf,

    /// Picture to write: a .png, clamped to 0..1 and encoded by the power 1/2.2, or an .exr, linear. - is standard output.
    /// If absent: the scene's name with .png, in the current folder
    #[arg(short, long, value_name = "OUT.png|OUT.exr|-")]
    output: Option<PathBuf>,

    /// Format of a picture whose name does not tell; if absent, png for standard output, pipes and devices
    #[arg(long, value_name = "png|exr", value_parser = format_parser())]
    format: Option<Format>,

    /// Size of the picture in pixels, in place of the scene's
    #[arg(long, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    size: Option<(u32, u32)>,

    /// Samples of every pixel, in place of the scene's; a square number for some patterns
    #[arg(long, visible_alias = "spp", value_name = "N")]
    pixel_samples: Option<u32>,

    /// Layout of a pixel's samples, in place of the scene's
    #[arg(long, value_name = "PATTERN", value_parser = pattern_parser())]
    pixel_pattern: Option<Pattern>,

    /// Gives the pixels whose displayed value, 0 to 1, has a larger standard error than this further rounds of
    /// --pixel-samples samples, 16 rounds at most if the scene names no other number
    #[arg(long, value_name = "ERROR")]
    adaptive: Option<f64>,

    /// Samples of every area light at every hit, in place of the scene's
    #[arg(long, value_name = "N")]
    light_samples: Option<u32>,

    /// Seed of all random patterns, in place of the scene's
    #[arg(long, value_name = "N")]
    seed: Option<u32>,

    /// What light is simulated, in place of the scene's: phong, direct light; path, light from surface to surface
    #[arg(long, value_name = "INTEGRATOR", value_parser = integrator_parser())]
    integrator: Option<Integrator>,

    /// Most bounces of a path, in place of the scene's
    #[arg(long, value_name = "N")]
    max_depth: Option<u32>,

    /// Folder that pictures and meshes named by the scene must lie in, if not the scene's own
    #[arg(long, value_name = "DIR")]
    asset_root: Option<PathBuf>,

    /// Renders the pixels of columns x0 to x1 - 1 and rows y0 to y1 - 1 only, the same as in the whole picture
    #[arg(long, value_name = "x0,y0,x1,y1", value_parser = parse_crop, allow_hyphen_values = true)]
    crop: Option<Region>,

    /// What renders. auto: a real GPU, else software Vulkan, else the CPU, which goes before software Vulkan where a scene has
    /// meshes or more than 64 primitives; gpu: any adapter; cpu: the CPU without any
    /// driver; NAME: the adapter with this as a part of its name, driver or type ("lavapipe" for Mesa's software Vulkan),
    /// or with this number in the list of wgray devices
    #[arg(long, value_name = "auto|gpu|cpu|NAME", default_value = "auto", value_parser = NonEmptyStringValueParser::new())]
    device: String,

    /// Rounds quotients and square roots correctly in software. A GPU's own may be off in the last digit; with this, more
    /// GPUs give the CPU's bits, at up to a few times the time. Vulkan only; without effect on the CPU
    #[arg(long)]
    exact_rounding: bool,

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
    aov: Vec<Aov>,

    /// Writes what the render took, as JSON. - is standard output
    #[arg(long, value_name = "FILE.json|-")]
    stats: Option<PathBuf>,

    /// How progress is shown, on standard error
    #[arg(long, value_enum, default_value_t = Mode::Auto)]
    progress: Mode,

    /// Says nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    quiet: bool,

    /// Says what takes how long, on standard error
    #[arg(short, long)]
    verbose: bool,
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

fn format_parser() -> impl clap::builder::TypedValueParser<Value = Format> {
    PossibleValuesParser::new(["png", "exr"]).map(|name| match name.as_str() {
        "png" => Format::Png,
        _ => Format::Exr,
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

/// What the arguments come to, checked against the scene.
struct Plan {
    scene: Packed,
    format: Format,
    region: Region,
    options: Options,
    progress: Mode,
    quiet: bool,
}

impl Plan {
    fn resolve(args: Args) -> anyhow::Result<(Plan, Outputs)> {
        let mut aovs = Vec::new();
        for aov in args.aov {
            if !aovs.contains(&aov) {
                aovs.push(aov);
            }
        }
        let output = args.output.unwrap_or_else(|| {
            let name = args.scene.file_stem().unwrap_or("scene".as_ref());
            PathBuf::from(name).with_added_extension("png")
        });
        let outputs = Outputs::find(&output, args.format, &aovs, args.stats.as_deref())?;
        let overrides = Overrides {
            size: args.size,
            pixel_samples: args.pixel_samples,
            light_samples: args.light_samples,
            seed: args.seed,
            pixel_pattern: args.pixel_pattern,
            adaptive: args.adaptive,
            integrator: args.integrator,
            max_depth: args.max_depth,
            asset_root: args.asset_root,
        };
        let progress = if args.quiet { Mode::None } else { args.progress };
        let scene = progress::named(progress, "reading the scene", || super::load(&args.scene, &overrides))?;
        for note in scene.notes.iter().filter(|_| !args.quiet) {
            say(&format!("warning: {}: {note}", args.scene.display()));
        }
        outputs.check(&[&[args.scene][..], &scene.files].concat())?;
        let options = Options {
            device: Device::from(args.device.as_str()),
            crop: args.crop,
            aovs,
            exact_rounding: args.exact_rounding,
        };
        let region = options.region(&scene).map_err(|problem| super::option(&problem))?;
        let plan = Plan {
            scene: progress::named(progress, "building trees", || options.pack(&scene)),
            format: outputs.format,
            region,
            options,
            progress,
            quiet: args.quiet,
        };
        Ok((plan, outputs))
    }

    /// Makes the device ready for the scene.
    fn renderer(&self) -> anyhow::Result<Renderer<'_>> {
        let on_cpu = |why: &RenderError| {
            if !self.quiet {
                say(&format!("warning: rendering on the CPU: {why}"));
            }
        };
        let renderer = Renderer::new(&self.scene, &self.options, Box::new(on_cpu)).map_err(super::plain)?;
        if let Some(why) = renderer.why().filter(|_| !self.quiet) {
            say(&format!("note: {why}"));
        }
        Ok(renderer)
    }
}

pub fn run(args: Args, start: Instant) -> anyhow::Result<ExitCode> {
    if args.verbose {
        speak();
    }
    if let Some(threads) = args.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        pool.build_global().context("threads")?; // before anything else is done in parallel
    }
    let (plan, outputs) = Plan::resolve(args)?;
    info!(seconds = start.elapsed().as_secs_f64(), "scene read");
    let outputs = outputs.begin().map_err(RenderError::Output)?;
    let stopped = signal::stop().context("signal handler")?;
    let mut renderer = plan.renderer()?;
    let setup = start.elapsed();
    info!(seconds = setup.as_secs_f64(), "ready");
    let (render, camera_rays) = write_picture(&plan, &mut renderer, outputs.pictures, &stopped)?;
    let total = start.elapsed();
    info!(
        render = render.as_secs_f64(),
        seconds = total.as_secs_f64(),
        "picture written"
    );
    if let Some(file) = outputs.stats {
        let device = renderer.info();
        let (width, height) = (plan.region.width(), plan.region.height());
        let (pixel_samples, light_samples) = (plan.scene.pixel_samples, plan.scene.light_samples());
        let stats = Stats {
            device: device.name.clone(),
            driver: device.driver.clone(),
            backend: device.interface.clone(),
            width,
            height,
            pixel_samples,
            light_samples,
            setup_s: setup.as_secs_f64(),
            render_s: render.as_secs_f64(),
            total_s: total.as_secs_f64(),
            camera_rays,
            shadow_rays: None,
            nominal_mrays_per_s: Stats::nominal(camera_rays, light_samples, render.as_secs_f64()),
        };
        stats.write(file).map_err(RenderError::Output)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Renders band by band into the picture's files; returns the time it took without writing, and the camera's rays.
fn write_picture(
    plan: &Plan,
    renderer: &mut Renderer,
    files: Vec<Pending>,
    stopped: &AtomicBool,
) -> anyhow::Result<(Duration, u64)> {
    let layout = Layout {
        picture: (plan.scene.camera.width, plan.scene.camera.height),
        region: plan.region,
        aovs: plan.options.aovs.clone(),
        alpha: plan.scene.has_alpha(),
        middle_depth: match plan.format {
            Format::Png => renderer.work(|backend, _| middle_depth(&plan.scene, &plan.options.aovs, backend))?,
            Format::Exr => 1.0,
        },
        most_samples: plan.scene.pixel_samples,
    };
    let name = files.first().map(|file| file.name().to_owned()).unwrap_or_default();
    let mut progress = Progress::new(plan.progress);
    let mut time = Duration::ZERO;
    let mut strange = 0;
    let mut camera_rays = 0;
    image::save(files, plan.format, &layout, &mut |sink| {
        let (cut, most) = (Cut::of(plan.scene.form()), renderer.largest_film());
        let mut bands = Bands::new(plan.region, plan.scene.pixel_samples, &cut, Order::Rows, most);
        let mut watch = |_: &mut dyn Backend, _: Region, share: f64| {
            progress.update(share);
            Ok(!stopped.load(Ordering::Relaxed))
        };
        loop {
            let start = Instant::now();
            let Some(film) = renderer.work(|backend, _| bands.render_next(backend, &mut watch))? else {
                return Ok(());
            };
            time += start.elapsed();
            camera_rays += match plan.scene.adaptive {
                true => film.sample_counts().map(u64::from).sum(),
                false => film.region.pixels() * u64::from(plan.scene.pixel_samples),
            };
            let hits = match needs_first_hits(&plan.scene, &plan.options.aovs) {
                true => renderer.work(|backend, _| job::first_hits(backend, film.region))?,
                false => Vec::new(),
            };
            strange += film
                .sums
                .iter()
                .filter(|sum| !mean(**sum).iter().all(|value| value.is_finite()))
                .count();
            sink(Band {
                film: &film,
                hits: &hits,
            })?;
        }
    })?;
    drop(progress);
    if strange > 0 && !plan.quiet {
        say(&format!("warning: {name}: {strange} pixels are not finite numbers"));
    }
    Ok((time, camera_rays))
}

/// Events of this program on standard error, and warnings of others.
fn speak() {
    use tracing_subscriber::filter::{LevelFilter, Targets};
    use tracing_subscriber::prelude::*;
    let ours = Targets::new()
        .with_target("wgray", LevelFilter::DEBUG)
        .with_default(LevelFilter::WARN);
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_target(false)
        .without_time()
        .with_ansi(std::io::stderr().is_terminal());
    tracing_subscriber::registry().with(lines).with(ours).init();
}
