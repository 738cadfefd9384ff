//! `wgray info`: prints the contents of a scene, its memory use and the device that would render it.

mod gather;
mod kernel;
mod show;

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use crate::device::Device;
use crate::device_plan::plan_device;
use crate::options::Options;
use crate::scene::{Define, Overrides};
use clap::ValueHint;
use clap::builder::NonEmptyStringValueParser;
use wgray_image::sanitize::escape_control_in_lines;

use super::numbers::samples;
use super::render::parse_size;
use super::scene_options::SceneOptions;
use gather::Info;

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
pub struct Args {
    /// Scene or model file: .toml, .json, .gltf, .glb, .obj, .ply or .stl
    scene: PathBuf,

    /// Print the information as one JSON object
    #[arg(long)]
    json: bool,

    /// Also print sampling, memory, kernel and driver details
    #[arg(short, long)]
    verbose: bool,

    /// Set the image size in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    size: Option<(u32, u32)>,

    /// Set the number of samples per pixel
    #[arg(long = "spp", visible_aliases = ["samples", "pixel-samples"], value_name = "N", value_parser = samples)]
    pixel_samples: Option<u32>,

    /// Render on auto, gpu, cpu or a device of `wgray devices`
    #[arg(long, value_name = "auto|gpu|cpu|NAME", default_value = "auto", value_parser = NonEmptyStringValueParser::new())]
    device: String,

    /// Allow the scene to read textures and meshes below DIR
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    asset_root: Option<PathBuf>,

    /// Override a scene value: -D render.integrator=path
    #[arg(short = 'D', long, value_name = "KEY=VALUE")]
    define: Vec<Define>,

    #[command(flatten)]
    options: SceneOptions,
}

pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let overrides = args.options.add_to(Overrides {
        size: args.size,
        pixel_samples: args.pixel_samples,
        asset_root: args.asset_root.clone(),
        define: args.define.clone(),
        ..Overrides::default()
    });
    let scene = super::load(&args.scene, &overrides)?;
    let packed = Options::default().pack(&scene);
    let plan = plan_device(&packed, &Device::from(args.device.as_str()))?;
    let info = Info::of(&args.scene, &scene, &packed, &plan);
    let text = match args.json {
        true => format!("{}\n", serde_json::to_string_pretty(&info)?),
        false => escape_control_in_lines(&show::table(&info, args.verbose)).into_owned(),
    };
    Ok(super::finish_output(
        io::stdout().lock().write_all(text.as_bytes()),
        ExitCode::SUCCESS,
    ))
}
