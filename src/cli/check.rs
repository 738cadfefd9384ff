//! `wgray check`: scenes and shaders, without a device.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use wgray::gpu::{check_kernels, compose::Shaders};
use wgray::pack::pack;
use wgray::scene::{Overrides, Scene};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene files
    #[arg(value_name = "SCENE", required = true)]
    scenes: Vec<PathBuf>,
}

/// Checks all files, whatever is wrong with some; the exit code is that of the first bad one.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let shaders = Shaders::built_in();
    let mut code = None;
    for path in &args.scenes {
        match check(path, &shaders) {
            Ok(summary) => writeln!(io::stdout().lock(), "{}: {summary}", path.display())?,
            Err(error) => {
                super::report(&error);
                code.get_or_insert(super::exit_code(&error));
            }
        }
    }
    Ok(code.unwrap_or(ExitCode::SUCCESS))
}

fn check(path: &Path, shaders: &Shaders) -> anyhow::Result<String> {
    let scene = Scene::load(path, &Overrides::default())?;
    let packed = pack(&scene);
    check_kernels(&packed, shaders)?;
    Ok(format!(
        "good; {} x {} pixels, {} samples each, {} of light; shapes: {} of {} primitives; lights: {}",
        scene.width,
        scene.height,
        packed.pixel_samples,
        packed.light_samples(),
        scene.shapes.len(),
        packed.primitives.len(),
        scene.lights.len(),
    ))
}
