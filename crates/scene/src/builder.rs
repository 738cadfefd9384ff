//! Scenes built in code, with handles instead of names.

use std::sync::Arc;

use glam::DAffine3;

use crate::file_system::NoFiles;
use crate::gltf_shape::rows;
use crate::mesh::Mesh;
use crate::texture::Image;
use crate::{
    Assets, CameraDescription, Description, EnvironmentDescription, ImageDescription, ImageTextureDescription,
    InstanceDescription, LightDescription, MaterialDescription, MeshFileDescription, Problem, RenderDescription, Scene,
    ShapeDescription, TextureDescription,
};

/// Declares a type of handles. A handle contains a unique name, and converts to the names in descriptions.
macro_rules! handle {
    ($(#[$attribute:meta])* $name:ident) => {
        $(#[$attribute])*
        #[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(Arc<str>);

        impl $name {
            /// Returns the name of the item in the description.
            pub fn name(&self) -> &str {
                &self.0
            }
        }

        impl From<&$name> for String {
            fn from(handle: &$name) -> String {
                handle.0.to_string()
            }
        }
    };
}

handle! {
    /// Handle of an image, from [`SceneBuilder::image`].
    ImageId
}
handle! {
    /// Handle of a texture, from [`SceneBuilder::texture`] or [`SceneBuilder::image_texture`].
    TextureId
}
handle! {
    /// Handle of a material, from [`SceneBuilder::material`].
    MaterialId
}
handle! {
    /// Handle of a mesh, from [`SceneBuilder::mesh`].
    MeshId
}

/// Builds a scene in code, without files. Images, textures, materials and meshes have handles.
///
/// ```
/// use glam::{DAffine3, DVec3};
/// # use wgray_scene::mesh::Mesh;
/// # use wgray_scene::{
/// #     ColorDescription, DiffuseDescription, EnvironmentDescription, Integrator, PerspectiveDescription,
/// #     RenderDescription, SceneBuilder, SphereDescription,
/// # };
/// #
/// let mut builder = SceneBuilder::new(64, 48, PerspectiveDescription::new([0.0, -5.0, 2.0], [0.0, 0.0, 0.0], 40.0));
/// builder.render(RenderDescription { integrator: Some(Integrator::Path), ..Default::default() });
/// builder.environment(EnvironmentDescription::new([1.0, 1.0, 1.0]));
/// let red = builder.material(DiffuseDescription::new([0.8, 0.1, 0.1]));
/// let triangle = Mesh::builder()
///     .positions(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
///     .triangles(&[[0, 1, 2]])
///     .build()?;
/// let triangle = builder.mesh(triangle);
/// for x in 0..3 {
///     builder.instance(&triangle, &red, DAffine3::from_translation(DVec3::new(x.into(), 0.0, 0.0)));
/// }
/// builder.shape(SphereDescription::new(&red, [0.0, 0.0, -1.0], 1.0));
/// let scene = builder.build()?;
/// assert_eq!(scene.shapes.len(), 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    description: Description,
    assets: Assets,
    count: usize,
}

impl SceneBuilder {
    /// Creates a builder of an empty scene with default render settings. The width and height are in pixels.
    pub fn new(width: u32, height: u32, camera: impl Into<CameraDescription>) -> SceneBuilder {
        SceneBuilder {
            description: Description::new(width, height, camera),
            assets: Assets::from_source(NoFiles),
            count: 0,
        }
    }

    fn unique_name(&mut self, kind: &str) -> Arc<str> {
        self.count += 1;
        Arc::from(format!("{kind} {}", self.count))
    }

    /// Sets the size of the image and the display settings.
    pub fn image_settings(&mut self, image: ImageDescription) {
        self.description.image = image;
    }

    /// Sets the render settings.
    pub fn render(&mut self, render: RenderDescription) {
        self.description.render = render;
    }

    /// Sets the environment.
    pub fn environment(&mut self, environment: EnvironmentDescription) {
        self.description.environment = Some(environment);
    }

    /// Sets the environment to an equirectangular map.
    pub fn environment_map(&mut self, image: &ImageId) {
        self.environment(EnvironmentDescription::image(image));
    }

    /// Adds an image.
    pub fn image(&mut self, image: impl Into<Arc<Image>>) -> ImageId {
        let name = self.unique_name("image");
        self.assets.images.insert(name.to_string(), image.into());
        ImageId(name)
    }

    /// Adds a texture.
    pub fn texture(&mut self, texture: impl Into<TextureDescription>) -> TextureId {
        let name = self.unique_name("texture");
        self.description.textures.insert(name.to_string(), texture.into());
        TextureId(name)
    }

    /// Adds an image texture with default settings. For other settings, pass an [`ImageTextureDescription`] to
    /// [`SceneBuilder::texture`].
    pub fn image_texture(&mut self, image: &ImageId) -> TextureId {
        self.texture(ImageTextureDescription::new(image))
    }

    /// Adds a material.
    pub fn material(&mut self, material: impl Into<MaterialDescription>) -> MaterialId {
        let name = self.unique_name("material");
        self.description.materials.insert(name.to_string(), material.into());
        MaterialId(name)
    }

    /// Adds a mesh. [`SceneBuilder::instance`] places the mesh in the scene.
    pub fn mesh(&mut self, mesh: impl Into<Arc<Mesh>>) -> MeshId {
        let name = self.unique_name("mesh");
        self.assets.meshes.insert(name.to_string(), mesh.into());
        let description = MeshFileDescription::new(&*name);
        self.description.meshes.insert(name.to_string(), description);
        MeshId(name)
    }

    /// Adds an instance of a mesh, with one material for all groups.
    pub fn instance(&mut self, mesh: &MeshId, material: &MaterialId, to_world: DAffine3) {
        self.instance_with(InstanceDescription {
            matrix: Some(rows(&to_world)),
            ..InstanceDescription::new(material, mesh)
        });
    }

    /// Adds an instance of a mesh with other settings, such as a material for each group.
    pub fn instance_with(&mut self, instance: InstanceDescription) {
        self.description.instances.push(instance);
    }

    /// Adds a shape.
    pub fn shape(&mut self, shape: impl Into<ShapeDescription>) {
        self.description.shapes.push(shape.into());
    }

    /// Adds a light.
    pub fn light(&mut self, light: impl Into<LightDescription>) {
        self.description.lights.push(light.into());
    }

    /// Validates the scene.
    ///
    /// # Errors
    ///
    /// A value is out of range, a mesh or an image is invalid, or a name is unknown.
    pub fn build(self) -> Result<Scene, Problem> {
        self.description.validate_with(&self.assets)
    }
}
