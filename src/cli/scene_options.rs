//! Scene options, shared by all commands that read scenes.

use crate::scene::{
    Background, EnvironmentDescription, GltfChoice, Orbit, Overrides, Presentation, Scene, Selection, UpAxis, View,
};
use clap::ValueHint;

use super::picture_options::name_parser;

/// Options that configure a scene or model file.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Scene")]
pub struct SceneOptions {
    /// Light the scene with FILE.hdr (.exr .png .jpg), studio, sky or COLOR
    #[arg(long, value_name = "ENV", value_hint = ValueHint::FilePath)]
    pub environment: Option<EnvironmentDescription>,

    /// Show COLOR where no surface is hit; none is transparent
    #[arg(long, value_name = "COLOR", allow_hyphen_values = true)]
    pub background: Option<Background>,

    /// Reject damaged inputs instead of rendering placeholders
    #[arg(long)]
    pub strict: bool,

    #[command(flatten)]
    presentation: PresentationOptions,

    #[command(flatten)]
    gltf: GltfOptions,
}

/// Options for a model file that is rendered without a scene file.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Scene")]
struct PresentationOptions {
    /// View the model from azimuth AZ and elevation EL, in degrees: 0,0 is front, 90,0 right, 0,90 top
    #[arg(long, hide_short_help = true, value_name = "AZ,EL", allow_hyphen_values = true, conflicts_with_all = ["view", "camera"])]
    orbit: Option<Orbit>,

    /// Set the vertical field of view of the automatic camera, in degrees
    #[arg(long, hide_short_help = true, value_name = "DEGREES", allow_negative_numbers = true)]
    fov: Option<f64>,

    /// Set the up axis of the model: x, y, z, -x, -y or -z (a file with cameras needs --view or --orbit too)
    #[arg(long, hide_short_help = true, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<UpAxis>,

    /// Add a gray ground disk below the model that catches its shadow
    #[arg(long, hide_short_help = true)]
    ground: bool,
}

/// Options for a view of a model, and for the contents of a glTF file.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Scene")]
struct GltfOptions {
    /// Frame a model: corner, front, back, left, right, top, bottom or iso
    #[arg(long, help_heading = None::<&'static str>, display_order = 3, value_name = "VIEW", value_parser = name_parser(View::ALL, View::name), hide_possible_values = true)]
    view: Option<View>,

    /// Use this camera of a glTF file, counted from 0
    #[arg(long, value_name = "NAME|N", value_parser = selection, conflicts_with = "view")]
    camera: Option<Selection>,

    /// Show glTF animations at this time, in seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time: Option<f64>,

    /// Play this animation of a glTF file, counted from 0
    #[arg(long, value_name = "NAME|N", value_parser = selection)]
    animation: Option<Selection>,

    /// Use this material variant of a glTF file, counted from 0
    #[arg(long, value_name = "NAME|N", value_parser = selection)]
    variant: Option<Selection>,

    /// Use this scene of a glTF file, counted from 0
    #[arg(long, value_name = "NAME|N", value_parser = selection, hide_short_help = true)]
    gltf_scene: Option<Selection>,
}

impl SceneOptions {
    /// Returns true if --time is given.
    pub fn has_time(&self) -> bool {
        self.gltf.time.is_some()
    }

    /// Returns true if the automatic camera is used instead of a camera of the model file.
    pub fn is_framed(&self, scene: &Scene) -> bool {
        self.gltf.view.is_some() || self.presentation.orbit.is_some() || !scene.has_model_cameras()
    }

    /// Adds these options to the values that override the scene.
    pub fn add_to(&self, overrides: Overrides) -> Overrides {
        Overrides {
            environment: self.environment.clone(),
            background: self.background,
            strict: self.strict,
            presentation: self.presentation.presentation(),
            gltf: self.gltf.choice(),
            ..overrides
        }
    }
}

impl PresentationOptions {
    fn presentation(&self) -> Presentation {
        Presentation {
            fov: self.fov,
            orbit: self.orbit,
            up: self.up,
            ground: self.ground,
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

/// Parses a number or a name; never fails.
fn selection(text: &str) -> Result<Selection, String> {
    Ok(Selection::from(text))
}
