//! `wgray check`: validates scenes and, with the feature `gpu`, shaders, without a device.

use crate::scene::Note;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::scene::{CameraPath, Define, Overrides, Projection, Scene, SceneError};
use clap::ValueHint;
use wgray_image::sanitize::escape_control;
#[cfg(feature = "gpu")]
use wgray_render::gpu::{Forms, check_kernels, compose::Shaders};
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use super::log::{self, Level};
use super::scene_options::SceneOptions;

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
pub struct Args {
    /// Scene files
    #[arg(value_name = "SCENE", required = true)]
    scenes: Vec<PathBuf>,

    /// Check the shaders in DIR, a modified copy of the project's shaders/
    #[cfg(feature = "gpu")]
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    shaders: Option<PathBuf>,

    /// Allow the scenes to read textures and meshes below DIR
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    asset_root: Option<PathBuf>,

    /// Override a value of each scene: -D render.seed=3
    #[arg(short = 'D', long, value_name = "KEY=VALUE")]
    define: Vec<Define>,

    #[command(flatten)]
    options: SceneOptions,
}

/// Maximum number of frames of a camera path to check.
const MAX_FRAMES: f64 = 100_000.0;

/// Checks all files. Returns the exit code of the first invalid file.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    #[cfg(feature = "gpu")]
    let shaders = match &args.shaders {
        Some(folder) => Shaders::read(folder)?,
        None => Shaders::built_in(),
    };
    let overrides = args.options.add_to(Overrides {
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
                    escape_control(&format!("{}: ok: {summary}", path.display()))
                );
            }
            Ok(_) => {} // the reader has closed standard output
            Err(error) => {
                super::report(&error, super::exit_code(&error));
                code.get_or_insert(ExitCode::from(super::exit_code(&error)));
            }
        }
    }
    Ok(match code {
        Some(code) => code,
        None => super::finish_output(printed, ExitCode::SUCCESS),
    })
}

fn check(path: &Path, overrides: &Overrides, #[cfg(feature = "gpu")] shaders: &Shaders) -> anyhow::Result<String> {
    let scene = super::load(path, overrides)?;
    let warnings = scene.visibility_warnings().into_iter().map(Note::from);
    for note in scene.notes.iter().cloned().chain(warnings) {
        log::print(Level::Warning, &super::located(path, &note));
    }
    let frames = check_path(&scene)?;
    let packed = pack(&scene);
    #[cfg(feature = "gpu")]
    check_kernels(&packed, shaders, Forms::All)?;
    Ok([
        Some(image(&scene, &packed)),
        Some(shapes(&scene, &packed)),
        Some(count(scene.lights.len(), "light")),
        scene.environment.as_ref().map(|_| "environment".to_owned()),
        camera(&scene),
        frames,
    ]
    .into_iter()
    .flatten()
    .collect::<Vec<_>>()
    .join("; "))
}

fn image(scene: &Scene, packed: &Packed) -> String {
    let integrator = scene.render.integrator;
    let lights = match packed.light_samples() {
        0 => String::new(),
        _ if integrator.needs_emitters() => String::new(),
        lights => format!(", {}", count(lights as usize, "light sample")),
    };
    let samples = count(packed.sampling.pixel_samples as usize, "sample");
    format!(
        "{} x {} pixels, {samples} per pixel{lights}, {}",
        scene.width,
        scene.height,
        integrator.name()
    )
}

/// Describes the shapes: their number, the number of mesh instances, and the number and memory use of meshes.
fn shapes(scene: &Scene, packed: &Packed) -> String {
    let shapes = count(scene.shapes.len(), "shape");
    if packed.bvh.instances.is_empty() {
        return shapes;
    }
    let triangles: usize = packed.bvh.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let bytes: u64 = packed.bvh.meshes.iter().map(|mesh| mesh.bytes()).sum();
    format!(
        "{shapes}, including {} of {} ({}, {:.1} MiB)",
        count(packed.bvh.instances.len(), "instance"),
        count(packed.bvh.meshes.len(), "mesh"),
        count(triangles, "triangle"),
        bytes as f64 / f64::from(1 << 20),
    )
}

/// Describes a panoramic camera or a lens; `None` for other cameras.
fn camera(scene: &Scene) -> Option<String> {
    match (scene.camera.projection, scene.camera.lens) {
        (Projection::Panorama, _) => Some("panorama".to_owned()),
        (_, Some(lens)) => {
            let (width, focus) = (rounded(2.0 * lens.radius), rounded(lens.focus));
            Some(format!("lens {width} wide, focused at {focus}"))
        }
        _ => None,
    }
}

/// Checks the camera at each frame of its path, and returns a description of the frame range.
fn check_path(scene: &Scene) -> Result<Option<String>, SceneError> {
    let Some((first, last)) = scene.camera_path.as_ref().map(CameraPath::frames) else {
        return Ok(None);
    };
    let count = (last.floor() - first.ceil() + 1.0).clamp(0.0, MAX_FRAMES) as u32;
    for i in 0..count {
        scene.camera_at(first.ceil() + f64::from(i))?;
    }
    Ok(Some(format!("the camera moves from frame {first} to {last}")))
}

/// Formats a count with its noun in the singular or plural.
fn count(n: usize, noun: &str) -> String {
    match (n, noun.ends_with("sh")) {
        (1, _) => format!("1 {noun}"),
        (_, true) => format!("{n} {noun}es"),
        (_, false) => format!("{n} {noun}s"),
    }
}

/// Rounds a length to four significant digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}
