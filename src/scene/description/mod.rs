//! What a scene file says, field for field; `docs/scene-format.md` describes every key.
//!
//! Nothing here is checked but the types: [`Description::validate`] makes a [`Scene`](super::Scene) of it.
//! Serializing a `Description` with the `toml` crate gives a file that reads back as the same `Description`.

mod light;
mod material;
mod render;
mod shape;
pub(super) mod tagged;
mod texture;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::Table;

use self::tagged::{ReadError, Tagged, tagged};

pub use self::light::*;
pub use self::material::*;
pub use self::render::*;
pub use self::shape::*;
pub use self::texture::*;

/// A whole scene file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Description {
    /// `[image]`
    pub image: ImageDescription,
    /// `[camera]`
    pub camera: CameraDescription,
    /// `[render]`
    pub render: RenderDescription,
    /// `[textures.NAME]`
    pub textures: BTreeMap<String, TextureDescription>,
    /// `[materials.NAME]`
    pub materials: BTreeMap<String, MaterialDescription>,
    /// `[[lights]]`
    pub lights: Vec<LightDescription>,
    /// `[[shapes]]`
    pub shapes: Vec<ShapeDescription>,
}

impl Description {
    /// The files that it names, which are relative to the scene file's folder.
    pub fn files(&self, folder: &Path) -> impl Iterator<Item = PathBuf> {
        self.textures.values().filter_map(move |texture| match texture {
            TextureDescription::Image(image) => Some(folder.join(&image.file)),
            _ => None,
        })
    }
}

/// The size of the picture.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ImageDescription {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
}

tagged! {
    /// `[camera]`
    CameraDescription {
        /// All rays start at the camera's position.
        "perspective" => Perspective(PerspectiveDescription),
        /// All rays are parallel.
        "orthographic" => Orthographic(OrthographicDescription),
    }
}

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PerspectiveDescription {
    /// The centre of projection.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    pub up: DVec3,
    /// Vertical field of view in degrees.
    pub fov: f64,
    /// Distance of the image plane, without effect in a pinhole camera.
    #[serde(default = "one")]
    pub focal_length: f64,
}

/// A camera of parallel rays.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OrthographicDescription {
    /// The middle of the image plane, where the rays start.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    pub up: DVec3,
    /// Height of the seen rectangle in scene units.
    pub height: f64,
}

fn z_up() -> DVec3 {
    DVec3::Z
}

fn one() -> f64 {
    1.0
}
