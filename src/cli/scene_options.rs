//! The options that say what scene is meant beside its file: the same wherever scenes are read.

use clap::ValueHint;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use wgray::scene::{Background, EnvironmentDescription, GltfChoice, Overrides, Scene, Selection, View};

/// The options as they are written.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Surroundings")]
pub struct SceneOptions {
    /// What surrounds the scene and lights it, in place of its own: an equirectangular image, FILE.hdr, .exr, .png or .jpg; studio; sky; or a
    /// colour from everywhere, #rrggbb as displays have it or r,g,b as linear light. For --integrator path
    #[arg(long, value_name = "FILE|studio|sky|COLOR", value_hint = ValueHint::FilePath)]
    pub environment: Option<EnvironmentDescription>,

    /// What the camera sees where nothing is, while the surroundings light the scene as before: a colour, #rrggbb or r,g,b, or none, for a
    /// transparent picture. It is light: agx and khronos-pbr-neutral show white as light grey, and 20,20,20 as white
    #[arg(long, value_name = "COLOR|none", allow_hyphen_values = true)]
    pub background: Option<Background>,

    /// Refuse damaged inputs, such as missing textures, instead of rendering stand-ins with a warning
    #[arg(long)]
    pub strict: bool,

    #[command(flatten)]
    gltf: GltfOptions,
}

/// What is shown of a glTF file.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "glTF files")]
struct GltfOptions {
    /// Which scene of a file of several; if absent, the one that it names
    #[arg(long, value_name = "NAME|N", value_parser = selection)]
    gltf_scene: Option<Selection>,

    /// Which of the file's cameras, counted from 0; if absent, the first, and if there is none the whole scene is shown. Its aspect gives
    /// way to --size
    #[arg(long, value_name = "NAME|N", value_parser = selection, conflicts_with = "view")]
    camera: Option<Selection>,

    /// Shows the whole scene from this side, whatever cameras the file has; corner, from the front and a little from the right and above,
    /// if it has none
    #[arg(long, value_name = "VIEW", value_parser = view_parser())]
    view: Option<View>,

    /// At which second of an animation
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time: Option<f64>,

    /// Which of the animations, counted from 0; if absent, the first, where a time is said
    #[arg(long, value_name = "NAME|N", value_parser = selection)]
    animation: Option<Selection>,

    /// Which of the variants of materials, counted from 0; if absent, none
    #[arg(long, value_name = "NAME|N", value_parser = selection)]
    variant: Option<Selection>,
}

impl SceneOptions {
    /// Whether a moment of an animation is named.
    pub fn has_time(&self) -> bool {
        self.gltf.time.is_some()
    }

    /// Whether a glTF file is seen by a camera that frames it, and not by one of its own.
    pub fn is_framed(&self, scene: &Scene) -> bool {
        self.gltf.view.is_some() || !scene.has_model_cameras()
    }

    /// Puts them among the values in place of the scene's.
    pub fn over(&self, overrides: Overrides) -> Overrides {
        Overrides {
            environment: self.environment.clone(),
            background: self.background,
            strict: self.strict,
            gltf: self.gltf.choice(),
            ..overrides
        }
    }
}

impl GltfOptions {
    fn choice(&self) -> GltfChoice {
        GltfChoice {
            scene: self.gltf_scene.clone(),
            camera: self.camera.clone(),
            view: self.view,
            time: self.time,
            animation: self.animation.clone(),
            variant: self.variant.clone(),
        }
    }
}

/// A number where it is one, else a name. No rule is broken here.
fn selection(text: &str) -> Result<Selection, String> {
    Ok(Selection::from(text))
}

fn view_parser() -> impl clap::builder::TypedValueParser<Value = View> {
    PossibleValuesParser::new(View::ALL.map(View::name)).try_map(|name| {
        let found = View::ALL.into_iter().find(|view| view.name() == name);
        found.ok_or(format!("no such view: {name}"))
    })
}
