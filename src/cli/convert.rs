//! `wgray convert`: converts a scene, glTF or mesh file to a TOML scene that renders the same image.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::error::RenderError;
use crate::image::{Output, Pending};
use crate::scene::{Define, Description, Overrides, Scene};
use anyhow::anyhow;
use clap::ValueHint;

use super::log::{self, Level};
use super::numbers::samples;
use super::outputs::protect_inputs;
use super::render::parse_size;
use super::scene_options::SceneOptions;
use super::{Usage, cli_error};

#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
pub struct Args {
    /// Scene or model file: .toml, .json, .gltf, .glb, .obj, .ply or .stl
    scene: PathBuf,

    /// File to write, which references the model, textures and meshes of the scene
    #[arg(short, long, value_name = "SCENE.toml")]
    output: PathBuf,

    /// Overwrite an existing file
    #[arg(short, long)]
    force: bool,

    /// Set the image size in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    size: Option<(u32, u32)>,

    /// Set the number of samples per pixel
    #[arg(long = "spp", visible_aliases = ["samples", "pixel-samples"], value_name = "N", value_parser = samples)]
    pixel_samples: Option<u32>,

    /// Allow the scene to read textures and meshes below DIR
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    asset_root: Option<PathBuf>,

    /// Override a scene value: -D render.seed=3
    #[arg(short = 'D', long, value_name = "KEY=VALUE")]
    define: Vec<Define>,

    #[command(flatten)]
    options: SceneOptions,
}

/// Writes the scene as TOML. The scene is validated first, so that the written file can be rendered.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let is_toml = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"));
    if !is_toml(&args.output) {
        let rule = format!("--output: {}: must end in .toml", args.output.display());
        return Err(Usage(rule).into());
    }
    let output = Output::find(&args.output).map_err(RenderError::Output)?;
    let overrides = args.options.add_to(Overrides {
        size: args.size,
        pixel_samples: args.pixel_samples,
        asset_root: args.asset_root.clone(),
        define: args.define.clone(),
        ..Overrides::default()
    });
    let loaded = Scene::load_described(&args.scene, &overrides);
    let (scene, description) = loaded.map_err(|error| cli_error(error.into()))?;
    for note in &scene.notes {
        log::print(Level::Warning, &super::located(&args.scene, note));
    }
    let inputs = [std::slice::from_ref(&args.scene), &scene.files].concat();
    protect_inputs("--output", &output, &inputs, "choose another name")?;
    if !args.force && output.path().is_some_and(Path::exists) {
        let name = args.output.display();
        return Err(Usage(format!(
            "--output: {name}: already exists; pass --force to overwrite it"
        ))
        .into());
    }
    // The folder of the output file after symbolic links are resolved.
    let folder = (output.path().and_then(Path::parent))
        .unwrap_or(Path::new("."))
        .to_owned();
    let scene_folder = args.scene.parent().unwrap_or(Path::new("."));
    let description = description
        .in_folder(scene_folder, &folder)
        .map_err(|error| anyhow!("{}: {error}", args.scene.display()))?;
    let text = description.to_toml()?;
    let canonical = folder.canonicalize().map_err(RenderError::Output)?;
    let needed_root = common_root(&description, &canonical);
    let mut file = Pending::start(output).map_err(RenderError::Output)?;
    let header = format!(
        "# {}, as a scene. Omitted keys have their defaults.\n\n",
        name_of(&args.scene)
    );
    let written = file
        .write_all(header.as_bytes())
        .and_then(|()| file.write_all(text.as_bytes()));
    written.and_then(|()| file.finish()).map_err(RenderError::Output)?;
    if let Some(root) = needed_root {
        let (name, folder) = (args.output.display(), folder.display());
        let option = quoted(&from_current_dir(&root).to_string_lossy());
        let text =
            format!("{name}: refers to files outside of {folder}; pass --asset-root {option} to render the scene");
        log::print(Level::Note, &text);
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the closest ancestor of `folder` that contains all files of the scene, or `None` if `folder` contains them.
fn common_root(description: &Description, folder: &Path) -> Option<PathBuf> {
    let files = description.files(folder).filter_map(|file| file.canonicalize().ok());
    let outside: Vec<PathBuf> = files.filter(|file| !file.starts_with(folder)).collect();
    if outside.is_empty() {
        return None;
    }
    let contains_all = |root: &&Path| outside.iter().all(|file| file.starts_with(root));
    folder.ancestors().find(contains_all).map(Path::to_owned)
}

/// Returns a path to the folder: relative if it is the current folder, a descendant or an ancestor, else absolute.
fn from_current_dir(folder: &Path) -> PathBuf {
    let Ok(current) = std::env::current_dir().and_then(|current| current.canonicalize()) else {
        return folder.to_owned();
    };
    if folder == current {
        return PathBuf::from(".");
    }
    if let Ok(below) = folder.strip_prefix(&current) {
        return below.to_owned();
    }
    match current.strip_prefix(folder) {
        Ok(rest) => rest.components().map(|_| "..").collect(),
        Err(_) => folder.to_owned(),
    }
}

/// Quotes a word for a shell.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./:=,@%+".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Returns the file name, with control characters replaced by spaces.
fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_quoted_words_unchanged() {
        assert_eq!(quoted("a/b-c_1.toml"), "a/b-c_1.toml");
        for word in ["", "a b", "$HOME", "`id`", "it's", "\"", "\\", "é", "#", "~"] {
            assert_ne!(quoted(word), word);
            #[cfg(unix)]
            {
                let line = format!("printf %s/ {}", quoted(word));
                let printed = std::process::Command::new("sh").args(["-c", &line]).output().unwrap();
                assert_eq!(String::from_utf8(printed.stdout).unwrap(), format!("{word}/"));
            }
        }
    }
}
