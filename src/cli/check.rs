//! `wgray check`: scenes and, with the feature `gpu`, shaders; without a device.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::ValueHint;
#[cfg(feature = "gpu")]
use wgray::gpu::{Forms, check_kernels, compose::Shaders};
use wgray::pack::pack;
use wgray::scene::{CameraPath, Define, Overrides, Projection, Scene, SceneError};
use wgray::visible::visible;

use super::log::{self, Level};
use super::scene_options::SceneOptions;

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
pub struct Args {
    /// Scene files
    #[arg(value_name = "SCENE", required = true)]
    scenes: Vec<PathBuf>,

    /// Folder of the shaders to check, with the files of the project's own, in place of those in the program
    #[cfg(feature = "gpu")]
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    shaders: Option<PathBuf>,

    /// Folder that files named by the scenes, their textures and meshes, must lie in, in place of the scenes' own
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    asset_root: Option<PathBuf>,

    /// Puts a value in place of each scene's: -D render.seed=3
    #[arg(short = 'D', long, value_name = "KEY=VALUE")]
    define: Vec<Define>,

    #[command(flatten)]
    options: SceneOptions,
}

/// The most frames of a path that are looked at.
const MOST_FRAMES: f64 = 100_000.0;

/// Checks all files, whatever is wrong with some; the exit code is that of the first bad one.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    #[cfg(feature = "gpu")]
    let shaders = match &args.shaders {
        Some(folder) => Shaders::read(folder)?,
        None => Shaders::built_in(),
    };
    let overrides = args.options.over(Overrides {
        asset_root: args.asset_root.clone(),
        define: args.define.clone(),
        ..Overrides::default()
    });
    let mut code = None;
    let mut printed = Ok(());
    for path in &args.scenes {
        let checked = check(
            path,
            &overrides,
            #[cfg(feature = "gpu")]
            &shaders,
        );
        match checked {
            Ok(summary) if printed.is_ok() => {
                printed = writeln!(
                    io::stdout().lock(),
                    "{}",
                    visible(&format!("{}: {summary}", path.display()))
                );
            }
            Ok(_) => {} // nobody reads any more
            Err(error) => {
                super::report(&error, super::exit_code(&error));
                code.get_or_insert(ExitCode::from(super::exit_code(&error)));
            }
        }
    }
    Ok(match code {
        Some(code) => code,
        None => super::ended(printed, ExitCode::SUCCESS),
    })
}

fn check(path: &Path, overrides: &Overrides, #[cfg(feature = "gpu")] shaders: &Shaders) -> anyhow::Result<String> {
    let scene = super::load(path, overrides)?;
    for note in &scene.notes {
        log::say(Level::Warning, &format!("{}: {note}", path.display()));
    }
    let frames = check_path(&scene)?;
    let packed = pack(&scene);
    #[cfg(feature = "gpu")]
    check_kernels(&packed, shaders, Forms::All)?;
    let triangles = packed.meshes.iter().map(|mesh| mesh.triangles.len());
    let bytes = packed.meshes.iter().map(|mesh| mesh.bytes()).sum::<u64>();
    let meshes = match packed.instances.len() {
        0 => String::new(),
        instances => format!(
            "; meshes: {} of {} triangles in {:.1} MiB, instances of them: {instances}",
            packed.meshes.len(),
            triangles.sum::<usize>(),
            bytes as f64 / f64::from(1 << 20),
        ),
    };
    let camera = match (scene.camera.projection, scene.camera.lens) {
        (Projection::Panorama, _) => "; a panorama".to_owned(),
        (_, Some(lens)) => format!(
            "; a lens {} wide, sharp at {}",
            short(2.0 * lens.radius),
            short(lens.focus)
        ),
        _ => String::new(),
    };
    Ok(format!(
        "good; {} x {} pixels, {} samples each, {} of light{camera}; shapes: {} of {} primitives{meshes}; lights: {}{frames}",
        scene.width,
        scene.height,
        packed.pixel_samples,
        packed.light_samples(),
        scene.shapes.len() - packed.instances.len(),
        packed.primitives.len(),
        scene.lights.len(),
    ))
}

/// Checks the camera at all frames from its path's first key to its last, and says which these are.
fn check_path(scene: &Scene) -> Result<String, SceneError> {
    let Some((first, last)) = scene.camera_path.as_ref().map(CameraPath::frames) else {
        return Ok(String::new());
    };
    let count = (last.floor() - first.ceil() + 1.0).clamp(0.0, MOST_FRAMES) as u32;
    for i in 0..count {
        scene.camera_at(first.ceil() + f64::from(i))?;
    }
    Ok(format!("; the camera moves from frame {first} to {last}"))
}

/// A length with four digits.
fn short(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}
