//! Scenes from bytes in memory, without the file system of the operating system.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::file::{MAX_FILE_BYTES, decode_text, folder_of};
use super::overrides::Overrides;
use super::{PendingScene, is_gltf, load_gltf, load_mesh};
use crate::error::SceneError;
use crate::file_system::{AssetSource, FileSystem, NoFiles};
use crate::mesh::{Mesh, MeshFormat};
use crate::parse::is_json_scene;
use crate::problem::Problem;
use crate::texture::Image;
use crate::{Assets, Scene};

/// A format of scenes and models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SceneFormat {
    /// A scene in TOML.
    Toml,
    /// A scene in JSON.
    Json,
    /// A glTF 2.0 file: JSON, or a binary container.
    Gltf,
    /// A mesh file.
    Mesh(MeshFormat),
}

impl SceneFormat {
    /// Returns the format that the extension of a file name selects: `.json`, `.gltf`, `.glb`, `.obj`, `.ply` or
    /// `.stl`. All other extensions select TOML.
    pub fn of(name: &Path) -> SceneFormat {
        match MeshFormat::of(name) {
            Some(format) => SceneFormat::Mesh(format),
            None if is_gltf(name) => SceneFormat::Gltf,
            None if is_json_scene(name) => SceneFormat::Json,
            None => SceneFormat::Toml,
        }
    }

    fn extension(self) -> &'static str {
        match self {
            SceneFormat::Toml => "toml",
            SceneFormat::Json => "json",
            SceneFormat::Gltf => "gltf",
            SceneFormat::Mesh(format) => format.extension(),
        }
    }
}

/// Options of [`Scene::from_slice`]: the name of the scene in messages, overrides, and the files, images and meshes
/// that the scene may refer to.
#[derive(Clone)]
pub struct LoadOptions {
    name: String,
    overrides: Overrides,
    source: Arc<dyn AssetSource>,
    images: BTreeMap<String, Arc<Image>>,
    meshes: BTreeMap<String, Arc<Mesh>>,
}

impl Default for LoadOptions {
    /// Returns options with the name `scene`, without overrides, files, images or meshes.
    fn default() -> LoadOptions {
        LoadOptions {
            name: "scene".to_owned(),
            overrides: Overrides::default(),
            source: Arc::new(NoFiles),
            images: BTreeMap::new(),
            meshes: BTreeMap::new(),
        }
    }
}

impl LoadOptions {
    /// Returns options with the name `scene`, without overrides, files, images or meshes.
    pub fn new() -> LoadOptions {
        LoadOptions::default()
    }

    /// Sets the name of the scene in messages, a relative path. File names in the scene are relative to the folder of
    /// this path. The extension of the format is appended to a name without this extension.
    #[must_use]
    pub fn with_name(self, name: impl Into<String>) -> LoadOptions {
        LoadOptions {
            name: name.into(),
            ..self
        }
    }

    /// Sets the overrides.
    #[must_use]
    pub fn with_overrides(self, overrides: Overrides) -> LoadOptions {
        LoadOptions { overrides, ..self }
    }

    /// Sets the source of all files that the scene refers to.
    #[must_use]
    pub fn with_source(self, source: impl AssetSource + 'static) -> LoadOptions {
        LoadOptions {
            source: Arc::new(source),
            ..self
        }
    }

    /// Adds an image. Textures with this file name use the image instead of a file.
    #[must_use]
    pub fn with_image(mut self, name: impl Into<String>, image: impl Into<Arc<Image>>) -> LoadOptions {
        self.images.insert(name.into(), image.into());
        self
    }

    /// Adds a mesh. Shapes whose `file` is `name` use the mesh instead of a file.
    #[must_use]
    pub fn with_mesh(mut self, name: impl Into<String>, mesh: impl Into<Arc<Mesh>>) -> LoadOptions {
        self.meshes.insert(name.into(), mesh.into());
        self
    }
}

impl fmt::Debug for LoadOptions {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter
            .debug_struct("LoadOptions")
            .field("name", &self.name)
            .field("overrides", &self.overrides)
            .field("images", &self.images.keys())
            .field("meshes", &self.meshes.keys())
            .finish_non_exhaustive()
    }
}

impl Scene {
    /// Loads and validates a scene or model from the bytes of its file. The file system is not used: all files that the
    /// scene refers to are read from [`LoadOptions::with_source`].
    ///
    /// ```
    /// # use wgray_scene::{LoadOptions, MemoryFiles, Scene, SceneFormat};
    /// #
    /// let triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    /// let scene = b"image = { width = 64, height = 48 }
    /// camera = { position = [0, 0, 3], look_at = [0, 0, 0], fov = 40 }
    /// shapes = [{ type = 'mesh', file = 'triangle.obj' }]";
    /// let options = LoadOptions::new().with_source(MemoryFiles::new().with("triangle.obj", *triangle));
    /// let scene = Scene::from_slice(scene, SceneFormat::Toml, &options)?;
    /// assert_eq!(scene.shapes.len(), 1);
    /// # Ok::<(), wgray_scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// The errors of [`Scene::load_with`]. Also fails if the name is not a relative path, and for overrides that need
    /// the file system: [`Overrides::asset_root`].
    pub fn from_slice(bytes: &[u8], format: SceneFormat, options: &LoadOptions) -> Result<Scene, SceneError> {
        let overrides = &options.overrides;
        if overrides.asset_root.is_some() {
            let rule = "does not apply to a scene in memory, whose files are in its source";
            return Err(SceneError::Override(Problem::of("asset_root", rule)));
        }
        let path = path_of(&options.name, format);
        let _span = tracing::debug_span!("load", path = %path.display()).entered();
        let read_error = |error| SceneError::Read {
            path: path.clone(),
            error,
        };
        let is_text = matches!(format, SceneFormat::Toml | SceneFormat::Json);
        if is_text && bytes.len() as u64 > MAX_FILE_BYTES {
            let too_large = io::Error::new(io::ErrorKind::FileTooLarge, "it is larger than 64 MiB");
            return Err(read_error(too_large));
        }
        let loaded: Arc<[u8]> = if is_text { Arc::default() } else { Arc::from(bytes) };
        let source = Arc::clone(&options.source);
        let file_system = FileSystem::with_loaded(source, &path, loaded).map_err(|error| {
            let rule = format!("'{}' cannot be the name of a scene in memory: {error}", options.name);
            SceneError::Override(Problem::of("name", rule))
        })?;
        let folder = folder_of(&path);
        let assets = Assets {
            folder: folder.to_owned(),
            root: PathBuf::new(),
            images: options.images.clone(),
            meshes: options.meshes.clone(),
            file_system,
            ..Assets::default()
        };
        let files = &mut BTreeSet::new();
        let (scene, _) = match format {
            SceneFormat::Gltf => load_gltf(&path, &assets, overrides, files)?,
            SceneFormat::Mesh(_) => load_mesh(&path, &assets, overrides, files)?,
            SceneFormat::Toml | SceneFormat::Json => {
                let text = decode_text(bytes.to_vec(), &path)?;
                let origin = path.display().to_string();
                let pending = PendingScene::read(&text, &origin, folder, overrides)?;
                pending.with_assets(assets).check(files)?
            }
        };
        Ok(scene)
    }
}

/// Returns the path of a scene with the extension of its format.
fn path_of(name: &str, format: SceneFormat) -> PathBuf {
    let path = Path::new(name);
    let has_extension = match format {
        SceneFormat::Toml => path.extension().is_some_and(|extension| extension == "toml"),
        _ => SceneFormat::of(path) == format,
    };
    match has_extension {
        true => path.to_owned(),
        false => PathBuf::from(format!("{name}.{}", format.extension())),
    }
}
