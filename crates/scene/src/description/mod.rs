//! What a scene file says, field for field; `docs/scene-format.md` describes every key.
//!
//! Nothing here is checked but the types: [`Description::validate`] makes a [`Scene`](super::Scene) of it.
//! It is read from a file, or made in code by [`Description::new`] and the constructors of its parts.
//! Serializing a `Description` with the `toml` crate gives a file that reads back as the same `Description`.

mod camera;
mod camera_path;
mod environment;
mod gltf;
mod integrator;
pub(crate) mod kinds;
mod light;
mod material;
mod mesh;
mod principled;
mod render;
mod shape;
pub(crate) mod tables;
pub(super) mod tagged;
pub(crate) mod tagged_schema;
mod texture;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Assets, ViewTransform};
use crate::description::kinds::{Pixels, Stops};

pub use self::camera::*;
pub use self::camera_path::*;
pub use self::environment::*;
pub use self::gltf::*;
pub use self::integrator::*;
pub use self::light::*;
pub use self::material::*;
pub use self::mesh::*;
pub use self::principled::*;
pub use self::render::*;
pub use self::shape::*;
pub use self::texture::*;

/// A whole scene file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Description {
    /// `[image]`: the picture, its size and how it is shown.
    pub image: ImageDescription,
    /// `[camera]`: where the picture is seen from.
    pub camera: CameraDescription,
    /// `[render]`: how it is rendered.
    #[schemars(default)]
    pub render: RenderDescription,
    /// `[environment]`: what surrounds the scene, for `integrator = "path"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentDescription>,
    /// `[textures.NAME]`: colours for each point of a surface, which materials name.
    #[schemars(default)]
    pub textures: BTreeMap<String, TextureDescription>,
    /// `[materials.NAME]`: what surfaces look like.
    #[schemars(default)]
    pub materials: BTreeMap<String, MaterialDescription>,
    /// `[[lights]]`: what shines, besides surfaces and surroundings.
    #[schemars(default)]
    pub lights: Vec<LightDescription>,
    /// `[[shapes]]`: what is seen.
    #[schemars(default)]
    pub shapes: Vec<ShapeDescription>,
    /// `[meshes.NAME]`: meshes that instances name.
    #[schemars(default)]
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub meshes: BTreeMap<String, MeshFileDescription>,
    /// `[[instances]]`: meshes, at places of their own.
    #[schemars(default)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub instances: Vec<InstanceDescription>,
}

impl Description {
    /// An empty scene for a picture of this size, in pixels, rendered by the settings' defaults.
    pub fn new(width: u32, height: u32, camera: impl Into<CameraDescription>) -> Self {
        Self {
            image: ImageDescription::new(width, height),
            camera: camera.into(),
            render: RenderDescription::default(),
            environment: None,
            textures: BTreeMap::new(),
            materials: BTreeMap::new(),
            lights: Vec::new(),
            shapes: Vec::new(),
            meshes: BTreeMap::new(),
            instances: Vec::new(),
        }
    }

    /// The scene with other settings.
    pub fn with_render(mut self, render: RenderDescription) -> Self {
        self.render = render;
        self
    }

    /// The scene with other surroundings.
    pub fn with_environment(mut self, environment: EnvironmentDescription) -> Self {
        self.environment = Some(environment);
        self
    }

    /// The scene with a further texture, in place of any that has its name.
    pub fn with_texture(mut self, name: impl Into<String>, texture: impl Into<TextureDescription>) -> Self {
        self.textures.insert(name.into(), texture.into());
        self
    }

    /// The scene with a further material, in place of any that has its name.
    pub fn with_material(mut self, name: impl Into<String>, material: impl Into<MaterialDescription>) -> Self {
        self.materials.insert(name.into(), material.into());
        self
    }

    /// The scene with a further light.
    pub fn with_light(mut self, light: impl Into<LightDescription>) -> Self {
        self.lights.push(light.into());
        self
    }

    /// The scene with a further shape.
    pub fn with_shape(mut self, shape: impl Into<ShapeDescription>) -> Self {
        self.shapes.push(shape.into());
        self
    }

    /// The scene with a further mesh for instances to name, in place of any that has its name.
    pub fn with_mesh(mut self, name: impl Into<String>, mesh: MeshFileDescription) -> Self {
        self.meshes.insert(name.into(), mesh);
        self
    }

    /// The scene with a further instance of a mesh.
    pub fn with_instance(mut self, instance: InstanceDescription) -> Self {
        self.instances.push(instance);
        self
    }

    /// The files that it names, without the images in memory.
    pub(super) fn files_beside(&self, assets: &Assets) -> impl Iterator<Item = PathBuf> {
        let in_memory = |path: &PathBuf| {
            let mut names = assets.images.keys();
            names.any(|name| assets.folder.join(name) == *path)
        };
        self.files(&assets.folder).filter(move |path| !in_memory(path))
    }

    /// The files that it names, which are relative to the scene file's folder.
    pub fn files(&self, folder: &Path) -> impl Iterator<Item = PathBuf> {
        let images = self.textures.values().filter_map(|texture| match texture {
            TextureDescription::Image(image) => Some(&image.file),
            _ => None,
        });
        let shapes = self.shapes.iter().filter_map(|shape| match shape {
            ShapeDescription::Mesh(mesh) => Some(&mesh.file),
            ShapeDescription::Gltf(gltf) => Some(&gltf.file),
            _ => None,
        });
        let meshes = self.meshes.values().map(|mesh| &mesh.file);
        let around = (self.environment.iter()).filter_map(|environment| environment.file.as_ref());
        let files: BTreeSet<&String> = images.chain(shapes).chain(meshes).chain(around).collect();
        files.into_iter().map(move |file| folder.join(file))
    }
}

/// The picture: its size, and how it is shown.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageDescription {
    /// Its width in pixels.
    #[schemars(with = "Pixels")]
    pub width: u32,
    /// Its height in pixels.
    #[schemars(with = "Pixels")]
    pub height: u32,
    /// From linear light to what a display is sent.
    #[serde(default)]
    pub view_transform: ViewTransform,
    /// In stops: light is multiplied by 2 to this power before it is shown.
    #[serde(default)]
    #[schemars(with = "Stops")]
    pub exposure: f64,
}

impl ImageDescription {
    /// A picture of this size, shown as it is unless something else is said.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            view_transform: ViewTransform::default(),
            exposure: 0.0,
        }
    }
}

fn one() -> f64 {
    1.0
}
