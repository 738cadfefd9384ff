//! Scene files as Rust values, with a field for each key; `docs/scene-format.md` describes the keys.
//!
//! Parsing checks only types; [`Description::validate`] checks the values and creates a [`Scene`](super::Scene). A
//! `Description` is parsed from a file, or created by [`Description::new`] and the constructors of its parts. The
//! `toml` crate serializes a `Description` to a file that parses to the same `Description`.

mod camera;
mod camera_path;
mod environment;
mod gltf;
mod integrator;
#[cfg_attr(not(test), path = "no_kinds.rs")]
pub(crate) mod kinds;
mod light;
mod material;
mod mesh;
mod principled;
mod render;
mod shape;
pub(super) mod tagged;
#[cfg(test)]
pub(crate) mod tagged_schema;
mod texture;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Assets, ViewTransform};
use crate::description::kinds::*;

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

/// A scene file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Description {
    /// `[image]`: size and display settings.
    pub image: ImageDescription,
    /// `[camera]`: the camera.
    pub camera: CameraDescription,
    /// `[render]`: render settings.
    #[schemars(default)]
    pub render: RenderDescription,
    /// `[environment]`: the environment, for `integrator = "path"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentDescription>,
    /// `[textures.NAME]`: textures of materials.
    #[schemars(default)]
    pub textures: BTreeMap<String, TextureDescription>,
    /// `[materials.NAME]`: materials of surfaces.
    #[schemars(default)]
    pub materials: BTreeMap<String, MaterialDescription>,
    /// `[[lights]]`: lights other than emissive surfaces and the environment.
    #[schemars(default)]
    pub lights: Vec<LightDescription>,
    /// `[[shapes]]`: geometry.
    #[schemars(default)]
    pub shapes: Vec<ShapeDescription>,
    /// `[meshes.NAME]`: meshes for instances.
    #[schemars(default)]
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub meshes: BTreeMap<String, MeshFileDescription>,
    /// `[[instances]]`: instances of meshes.
    #[schemars(default)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub instances: Vec<InstanceDescription>,
}

impl Description {
    /// Creates the description of an empty scene with default render settings. The width and height are in pixels.
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

    /// Replaces the render settings.
    pub fn with_render(mut self, render: RenderDescription) -> Self {
        self.render = render;
        self
    }

    /// Replaces the environment.
    pub fn with_environment(mut self, environment: EnvironmentDescription) -> Self {
        self.environment = Some(environment);
        self
    }

    /// Adds a texture, or replaces the texture with this name.
    pub fn with_texture(mut self, name: impl Into<String>, texture: impl Into<TextureDescription>) -> Self {
        self.textures.insert(name.into(), texture.into());
        self
    }

    /// Adds a material, or replaces the material with this name.
    pub fn with_material(mut self, name: impl Into<String>, material: impl Into<MaterialDescription>) -> Self {
        self.materials.insert(name.into(), material.into());
        self
    }

    /// Adds a light.
    pub fn with_light(mut self, light: impl Into<LightDescription>) -> Self {
        self.lights.push(light.into());
        self
    }

    /// Adds a shape.
    pub fn with_shape(mut self, shape: impl Into<ShapeDescription>) -> Self {
        self.shapes.push(shape.into());
        self
    }

    /// Adds a mesh for instances, or replaces the mesh with this name.
    pub fn with_mesh(mut self, name: impl Into<String>, mesh: MeshFileDescription) -> Self {
        self.meshes.insert(name.into(), mesh);
        self
    }

    /// Adds an instance of a mesh.
    pub fn with_instance(mut self, instance: InstanceDescription) -> Self {
        self.instances.push(instance);
        self
    }

    /// Returns the files of the scene, except images and meshes in memory.
    pub(super) fn files_on_disk(&self, assets: &Assets) -> impl Iterator<Item = PathBuf> {
        let in_memory = |path: &PathBuf| {
            let mut names = assets.images.keys().chain(assets.meshes.keys());
            names.any(|name| assets.folder.join(name) == *path)
        };
        self.files(&assets.folder).filter(move |path| !in_memory(path))
    }

    /// Returns the files of the scene, relative to `folder`.
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
        let environment_map = (self.environment.iter()).filter_map(|environment| environment.file.as_ref());
        let files: BTreeSet<&String> = images.chain(shapes).chain(meshes).chain(environment_map).collect();
        files.into_iter().map(move |file| folder.join(file))
    }
}

/// Size and display settings of the image.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageDescription {
    /// Width in pixels.
    #[schemars(with = "Pixels")]
    pub width: u32,
    /// Height in pixels.
    #[schemars(with = "Pixels")]
    pub height: u32,
    /// View transform, from linear radiance to display values.
    #[serde(default)]
    #[schemars(with = "ViewTransformName")]
    pub view_transform: ViewTransform,
    /// Exposure in stops: radiance is multiplied by 2 to this power before the view transform.
    #[serde(default)]
    #[schemars(with = "Stops")]
    pub exposure: f64,
}

impl ImageDescription {
    /// Creates an image with default display settings.
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
