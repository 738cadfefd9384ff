//! Loads scene files and model files with overrides, and validates them to a [`Scene`].

mod file;
mod from_slice;
mod gltf_choice;
mod gltf_file;
mod model;
mod overrides;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub use self::file::{folder_of, read_bytes, read_text};
pub use self::from_slice::{LoadOptions, SceneFormat};
pub use self::gltf_choice::GltfChoice;
use self::gltf_file::describe;
pub use self::gltf_file::is_gltf;
pub use self::model::{is_mesh, is_model};
pub use self::overrides::Overrides;
use crate::course;
use crate::defines::Defines;
use crate::error::SceneError;
use crate::gltf::GltfError;
use crate::key_path::KeyPath;
use crate::note::Note;
use crate::parse::{Places, invalid, is_json_scene, line_of_path};
use crate::problem::{Problem, Problems};
use crate::{Assets, Description, Scene};

impl Scene {
    /// Loads and validates a scene file. The file name determines the format: `.json` is JSON, `.gltf` and `.glb` are
    /// glTF, `.obj`, `.ply` and `.stl` are meshes, and all other files are TOML.
    ///
    /// # Errors
    ///
    /// The file cannot be read, has more than 64 MiB or is not UTF-8; or an error of [`Scene::parse`].
    pub fn load(path: impl AsRef<Path>) -> Result<Scene, SceneError> {
        Scene::load_with(path, &Overrides::default())
    }

    /// Loads and validates a scene file with overrides.
    ///
    /// # Errors
    ///
    /// The errors of [`Scene::load`]; also fails if an override is invalid.
    pub fn load_with(path: impl AsRef<Path>, overrides: &Overrides) -> Result<Scene, SceneError> {
        Scene::load_described(path, overrides).map(|(scene, _)| scene)
    }

    /// Returns the scene of [`Scene::load_with`], and its description with the overrides applied. File names in the
    /// description are relative to the file's folder. A model file is described as one shape with a camera and
    /// lighting.
    ///
    /// # Errors
    ///
    /// The errors of [`Scene::load_with`].
    pub fn load_described(path: impl AsRef<Path>, overrides: &Overrides) -> Result<(Scene, Description), SceneError> {
        Scene::load_and_list(path.as_ref(), overrides, &mut BTreeSet::new())
    }

    /// Like [`Scene::load_described`], and adds all files of the scene to `files`, even on failure.
    pub fn load_and_list(
        path: &Path,
        overrides: &Overrides,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<(Scene, Description), SceneError> {
        let _span = tracing::debug_span!("load", path = %path.display()).entered();
        let assets = Assets::beside(folder_of(path));
        if is_gltf(path) {
            return load_gltf(path, &assets, overrides, files);
        }
        if model::is_mesh(path) {
            return load_mesh(path, &assets, overrides, files);
        }
        model::check_format(path)?;
        let text = read_text(path)?;
        parse_in_folder(&text, &path.display().to_string(), folder_of(path), overrides, files)
    }

    /// Parses and validates the text of a scene file. `origin` is the path of the file, for messages and for relative
    /// file names. The text is JSON if `origin` ends in `.json`.
    ///
    /// # Errors
    ///
    /// The errors of [`Description::parse`] and of [`Description::validate`].
    pub fn parse(text: &str, origin: &str) -> Result<Scene, SceneError> {
        Scene::parse_with(text, origin, &Overrides::default())
    }

    /// Parses and validates the text of a scene file with overrides.
    ///
    /// # Errors
    ///
    /// The errors of [`Scene::parse`]; also fails if an override is invalid.
    pub fn parse_with(text: &str, origin: &str, overrides: &Overrides) -> Result<Scene, SceneError> {
        let folder = folder_of(Path::new(origin));
        parse_in_folder(text, origin, folder, overrides, &mut BTreeSet::new()).map(|(scene, _)| scene)
    }
}

fn load_gltf(
    path: &Path,
    assets: &Assets,
    overrides: &Overrides,
    files: &mut BTreeSet<PathBuf>,
) -> Result<(Scene, Description), SceneError> {
    let assets = overrides.adjust(assets.clone());
    let (mut description, _imported) = describe(path, &assets, overrides, files)?;
    let mut defines = Defines::new(&overrides.define);
    if !overrides.define.is_empty() {
        description = description.with_defines(&mut defines).map_err(SceneError::Override)?;
    }
    overrides.apply(&mut description).map_err(SceneError::Override)?;
    // Errors of the shape are reported as errors of the file.
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let prefix = format!("{name}: ");
    let without_name = |message: &str| {
        let message = message.strip_prefix(&prefix).unwrap_or(message);
        message.replace(&format!("\"{name}/"), "\"")
    };
    let invalid = |problems: Problems| {
        if let Some(error) = problems.define_error(&defines) {
            return error;
        }
        let first = problems.first;
        SceneError::Gltf(GltfError::File {
            path: path.to_owned(),
            message: match first.key.to_string() == "shapes[0].file" {
                true => without_name(&first.message),
                false => first.to_string(),
            },
        })
    };
    let mut scene = overrides.finish(description.validate_and_list(&assets, files), invalid, |_| {})?;
    for note in &mut scene.notes {
        *note = std::mem::take(note).without_loaded_file(&name);
        note.message = without_name(&note.message);
    }
    scene
        .notes
        .extend(overrides.presentation.ground_warning(&scene).map(Note::from));
    Ok((scene, description))
}

fn load_mesh(
    path: &Path,
    assets: &Assets,
    overrides: &Overrides,
    files: &mut BTreeSet<PathBuf>,
) -> Result<(Scene, Description), SceneError> {
    let assets = overrides.adjust(assets.clone());
    let (mut description, _mesh) = model::describe(path, &assets, overrides)?;
    let mut defines = Defines::new(&overrides.define);
    if !overrides.define.is_empty() {
        description = description.with_defines(&mut defines).map_err(SceneError::Override)?;
    }
    overrides.apply(&mut description).map_err(SceneError::Override)?;
    let validated = description.validate_and_list(&assets, files);
    let invalid = |problems: Problems| match problems.define_error(&defines) {
        Some(error) => error,
        None => model::error_of(path, problems.first),
    };
    let mut scene = overrides.finish(validated, invalid, |_| {})?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    for note in &mut scene.notes {
        *note = std::mem::take(note).without_loaded_file(&name);
    }
    scene
        .notes
        .extend(overrides.presentation.ground_warning(&scene).map(Note::from));
    Ok((scene, description))
}

fn parse_in_folder(
    text: &str,
    origin: &str,
    folder: &Path,
    overrides: &Overrides,
    files: &mut BTreeSet<PathBuf>,
) -> Result<(Scene, Description), SceneError> {
    PendingScene::read(text, origin, folder, overrides)?.check(files)
}

/// A parsed scene file that is not yet validated.
pub struct PendingScene<'a> {
    text: &'a str,
    origin: &'a str,
    folder: &'a Path,
    overrides: &'a Overrides,
    defines: Defines<'a>,
    /// Images and meshes in memory, and the source of files.
    assets: Assets,
    /// The description with the overrides applied.
    pub description: Description,
}

impl<'a> PendingScene<'a> {
    /// Parses the text of the file `origin`. File names are relative to `folder`.
    pub fn read(
        text: &'a str,
        origin: &'a str,
        folder: &'a Path,
        overrides: &'a Overrides,
    ) -> Result<PendingScene<'a>, SceneError> {
        let mut defines = Defines::new(&overrides.define);
        let description = Description::parse_with(text, origin, &mut defines)?;
        let pending = PendingScene {
            text,
            origin,
            folder,
            overrides,
            defines,
            assets: Assets::default(),
            description,
        };
        pending.with_overrides()
    }

    /// Parses a text that differs from the text of `before` only in one table, which the first two segments of `path`
    /// name. Parses only this table if it has its own header. Also returns where the tables are in the text, unless the
    /// full text is parsed.
    pub fn change(
        text: &'a str,
        origin: &'a str,
        folder: &'a Path,
        overrides: &'a Overrides,
        (before, path): (&Description, &KeyPath),
    ) -> Result<(PendingScene<'a>, Option<Places>), SceneError> {
        let mut defines = Defines::new(&overrides.define);
        let Some(change) = Description::parse_change(text, origin, &mut defines, before, path)? else {
            return Ok((PendingScene::read(text, origin, folder, overrides)?, None));
        };
        let mut pending = PendingScene {
            text,
            origin,
            folder,
            overrides,
            defines,
            assets: Assets::default(),
            description: change.description,
        };
        // The overrides have been applied to `before`. Values outside of the changed part lack them only if they were
        // parsed again.
        if change.parsed_rest {
            pending = pending.with_overrides()?;
        }
        Ok((pending, Some(change.places)))
    }

    /// Uses the images, meshes and files of these assets.
    fn with_assets(self, assets: Assets) -> PendingScene<'a> {
        PendingScene { assets, ..self }
    }

    fn with_overrides(mut self) -> Result<PendingScene<'a>, SceneError> {
        let applied = self.overrides.apply(&mut self.description);
        applied.map_err(SceneError::Override)?;
        let gltf_option = self.overrides.gltf.first_option();
        if let Some(option) = gltf_option.or(self.overrides.presentation.first_option()) {
            let rule = format!("only applies to model files, and {} is a scene file", self.origin);
            return Err(SceneError::Override(Problem::of(option, rule)));
        }
        Ok(self)
    }

    /// Validates the scene. Adds the files of the scene to `files`, even if validation fails.
    pub fn check(self, files: &mut BTreeSet<PathBuf>) -> Result<(Scene, Description), SceneError> {
        let PendingScene {
            text,
            origin,
            folder,
            overrides,
            defines,
            assets,
            description,
        } = self;
        let is_json_scene = is_json_scene(Path::new(origin));
        let mut assets = assets.in_folder(folder);
        if is_json_scene && assets.file_system.is_disk() {
            assets.root = course::asset_root(folder);
        }
        let assets = overrides.adjust(assets);
        let invalid = |problems| match is_json_scene {
            true => course::invalid(text, origin, problems, &defines),
            false => invalid(text, origin, problems, &defines),
        };
        let validated = description.validate_and_list(&assets, files);
        let scene = overrides.finish(validated, invalid, |path| path.set_location(origin, line_of_path(text)))?;
        Ok((scene, description))
    }
}
