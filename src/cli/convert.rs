//! `wgray convert`: a scene of any kind as a TOML file that renders the same picture.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::anyhow;
use clap::ValueHint;
use wgray::error::RenderError;
use wgray::image::{Output, Pending};
use wgray::scene::{Define, Overrides, Scene};

use super::log::{self, Level};
use super::outputs::keep_inputs;
use super::render::parse_size;
use super::scene_options::SceneOptions;
use super::{Usage, plain};

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
pub struct Args {
    /// Scene file: .gltf or .glb, .json or .toml
    scene: PathBuf,

    /// File to write. It refers to the model, images and meshes that the scene names
    #[arg(short, long, value_name = "SCENE.toml")]
    output: PathBuf,

    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    size: Option<(u32, u32)>,

    /// Samples of every pixel
    #[arg(long, visible_alias = "spp", value_name = "N")]
    pixel_samples: Option<u32>,

    /// Folder that files named by the scene must lie in, in place of the scene's own
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    asset_root: Option<PathBuf>,

    /// Puts a value in place of the scene's: -D render.seed=3
    #[arg(short = 'D', long, value_name = "KEY=VALUE")]
    define: Vec<Define>,

    #[command(flatten)]
    options: SceneOptions,
}

/// Checks the scene, so that what is written can be rendered.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let ends = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"));
    if !ends(&args.output) {
        let rule = format!("--output: {}: must end in .toml", args.output.display());
        return Err(Usage(rule).into());
    }
    let output = Output::find(&args.output).map_err(RenderError::Output)?;
    let overrides = args.options.over(Overrides {
        size: args.size,
        pixel_samples: args.pixel_samples,
        asset_root: args.asset_root.clone(),
        define: args.define.clone(),
        ..Overrides::default()
    });
    let loaded = Scene::load_described(&args.scene, &overrides);
    let (scene, description) = loaded.map_err(|error| plain(error.into()))?;
    for note in &scene.notes {
        log::say(Level::Warning, &format!("{}: {note}", args.scene.display()));
    }
    let inputs = [std::slice::from_ref(&args.scene), &scene.files].concat();
    keep_inputs("--output", &output, &inputs, "choose another name")?;
    // Where the file will be, behind links.
    let folder = (output.path().and_then(Path::parent))
        .unwrap_or(Path::new("."))
        .to_owned();
    let before = args.scene.parent().unwrap_or(Path::new("."));
    let description = description
        .in_folder(before, &folder)
        .map_err(|error| anyhow!("{}: {error}", args.scene.display()))?;
    let text = description.to_toml()?;
    let root = folder.canonicalize().map_err(RenderError::Output)?;
    let is_outside =
        (description.files(&folder)).any(|file| file.canonicalize().is_ok_and(|file| !file.starts_with(&root)));
    let mut file = Pending::start(output).map_err(RenderError::Output)?;
    let head = format!(
        "# {}, as a scene. What is not said here has its default.\n\n",
        name_of(&args.scene)
    );
    let written = file
        .write_all(head.as_bytes())
        .and_then(|()| file.write_all(text.as_bytes()));
    written.and_then(|()| file.finish()).map_err(RenderError::Output)?;
    if is_outside {
        let (name, folder) = (args.output.display(), folder.display());
        log::say(
            Level::Note,
            &format!(
                "{name} names files outside of {folder}: it is rendered with --asset-root, a folder that they lie in"
            ),
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// A file's name, in one line.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
