//! From a scene file to a checked [`Scene`], with other values in place of some of the file's.

mod gltf_file;
mod model;

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use self::gltf_file::describe;
pub use self::gltf_file::{GltfChoice, is_gltf};
pub use self::model::{is_mesh, is_model};
use crate::around::{Background, of_option, surround};
use crate::course;
use crate::define::{Define, Defines};
use crate::error::SceneError;
use crate::gltf::GltfError;
use crate::key_path::KeyPath;
use crate::note::Note;
use crate::parse::{NOT_UTF8, encoding, invalid, line_of_path, syntax_error};
use crate::parse::{Places, is_course};
use crate::problem::{At, Problem, Problems};
use crate::turntable::turning;
use crate::validate::{LIGHT_SAMPLES, adaptive, adaptive_error, max_depth, sample_count, side};
use crate::{
    AdaptiveDescription, Assets, CameraPath, Description, EnvironmentDescription, Integrator, Pattern, Presentation,
    SamplesDescription, Scene, ViewSettings, ViewTransform,
};
use wgray_image::waiting;

/// The largest scene file in bytes: far above what anyone writes, far below what fills the memory.
const LARGEST_FILE: u64 = 64 << 20;

/// Values that stand in for those of a file. Where one is bad the error is [`SceneError::Override`], which names the
/// field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Width and height of the picture, in pixels, 1 to 65,536.
    pub size: Option<(u32, u32)>,
    /// The count of every pixel's samples; their pattern stays.
    pub pixel_samples: Option<u32>,
    /// The count of samples of every area light at every hit; their pattern stays.
    pub light_samples: Option<u32>,
    /// The seed of all random patterns.
    pub seed: Option<u32>,
    /// The layout of a pixel's samples; their count stays.
    pub pixel_pattern: Option<Pattern>,
    /// The error that adaptive sampling aims at, 0 to 1; the most samples stay.
    pub adaptive: Option<f64>,
    /// What light is simulated.
    pub integrator: Option<Integrator>,
    /// The most bounces of a path, 1 to 64, or 0 to 1024 where the integrator is [`Integrator::Path`].
    pub max_depth: Option<u32>,
    /// The folder that files named by the scene must lie in, instead of the scene's own.
    pub asset_root: Option<PathBuf>,
    /// The frame that [`Scene::camera`] is of, if the camera moves. Without it the camera is as the file has it by itself, or
    /// as in the first key of its path.
    pub frame: Option<f64>,
    /// What surrounds the scene, for [`Integrator::Path`]. Whether the camera sees it stays as it is. Its file may lie anywhere, if its name is
    /// absolute.
    pub environment: Option<EnvironmentDescription>,
    /// What the camera sees where nothing is.
    pub background: Option<Background>,
    /// The view transform.
    pub view_transform: Option<ViewTransform>,
    /// The exposure in stops, -100 to 100.
    pub exposure: Option<f64>,
    /// So many frames, 1 to 100,000, around what the camera looks at, in place of the way that it goes by itself: a picture of one is that of
    /// [`Overrides::frame`], from 1 on.
    pub turntable: Option<u32>,
    /// Whether damage to a file that the scene names is an error. Otherwise it is a warning, and a stand-in is rendered.
    pub strict: bool,
    /// How a model file is shown without a scene.
    pub presentation: Presentation,
    /// What is shown of a glTF file, and from where.
    pub gltf: GltfChoice,
    /// Values for any keys of the file, one after the other; the fields above go before them.
    pub define: Vec<Define>,
}

impl Overrides {
    fn apply(&self, description: &mut Description) -> Result<(), Problem> {
        if let Some((width, height)) = self.size {
            description.image.width = side(width).at("size")?;
            description.image.height = side(height).at("size")?;
        }
        description.image.view_transform = self.view_transform.unwrap_or(description.image.view_transform);
        if let Some(stops) = self.exposure {
            let rule = |rule: String| Problem::of("exposure", format!("{stops} {rule}"));
            description.image.exposure = ViewSettings::check_exposure(stops).map_err(rule)?;
        }
        if self.integrator.is_some() {
            description.render.integrator = self.integrator;
        }
        // Before the settings, as they may decide the integrator.
        if let Some(environment) = &self.environment {
            surround(description, environment);
        }
        if let Some(background) = self.background {
            background.show(description).at("background")?;
        }
        let integrator = description.integrator();
        let render = &mut description.render;
        if let Some(depth) = self.max_depth {
            render.max_depth = max_depth(depth, integrator).at("max_depth")?;
        }
        if let Some(pattern) = self.pixel_pattern {
            render.pixel_samples.pattern = Some(pattern);
        }
        set_count(&mut render.pixel_samples, self.pixel_samples, integrator).at("pixel_samples")?;
        set_count(&mut render.light_samples, self.light_samples, integrator).at("light_samples")?;
        render.seed = self.seed.unwrap_or(render.seed);
        if let Some(error) = self.adaptive {
            adaptive_error(error).at("adaptive")?;
            let max_samples = (render.adaptive.as_ref()).and_then(|adaptive| adaptive.max_samples);
            let further = AdaptiveDescription { error, max_samples };
            adaptive(&further, &render.pixel_samples, integrator).at("adaptive")?;
            render.adaptive = Some(further);
        }
        if let Some(frames) = self.turntable
            && description.camera.validate().is_ok()
        {
            description.camera = turning(&description.camera, frames).at("turntable")?;
        }
        Ok(())
    }
}

impl Overrides {
    /// What stands in for the value of a key of the file, or for a part of it, if anything does.
    pub fn in_place_of(&self, key: &KeyPath) -> Option<String> {
        if let Some(define) = self.define.iter().find(|define| define.stands_in_for(key)) {
            return Some(format!("--define {define}"));
        }
        let options: [(bool, &str, &[&str]); 9] = [
            (self.size.is_some(), "--size", &["image.width", "image.height"]),
            (self.integrator.is_some(), "integrator", &["render.integrator"]),
            (self.max_depth.is_some(), "max_depth", &["render.max_depth"]),
            (self.seed.is_some(), "seed", &["render.seed"]),
            (
                self.pixel_samples.is_some() || self.pixel_pattern.is_some(),
                "pixel_samples",
                &["render.pixel_samples"],
            ),
            (self.light_samples.is_some(), "light_samples", &["render.light_samples"]),
            (self.adaptive.is_some(), "adaptive", &["render.adaptive"]),
            (
                self.environment.is_some(),
                "--environment",
                &["environment", "render.background"],
            ),
            (
                self.background.is_some(),
                "--background",
                &["environment", "render.background", "render.alpha"],
            ),
        ];
        let path = key.exact();
        let is_in = |whole: &&str| {
            path.strip_prefix(*whole)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let mut given = options.into_iter().filter(|(is_given, ..)| *is_given);
        let found = given.find(|(_, _, keys)| keys.iter().any(is_in));
        found.map(|(_, name, _)| name.to_owned())
    }
}

fn set_count(samples: &mut SamplesDescription, count: Option<u32>, integrator: Integrator) -> Result<(), Problem> {
    if let Some(count) = count {
        samples.count = sample_count(samples.pattern(integrator), count)?;
    }
    Ok(())
}

impl Scene {
    /// Reads and checks a scene file. The format follows from the file name: `.json` is JSON, `.gltf` and `.glb` are glTF, `.obj`, `.ply` and
    /// `.stl` are meshes, and everything else is TOML.
    ///
    /// # Errors
    ///
    /// Files that cannot be read, hold more than 64 MiB or are not UTF-8, and the errors of [`Scene::parse`].
    pub fn load(path: impl AsRef<Path>) -> Result<Scene, SceneError> {
        Scene::load_with(path, &Overrides::default())
    }

    /// Reads and checks a scene file, with other values in place of some of the file's.
    ///
    /// # Errors
    ///
    /// The errors of [`Scene::load`], and bad overrides.
    pub fn load_with(path: impl AsRef<Path>, overrides: &Overrides) -> Result<Scene, SceneError> {
        Scene::load_described(path, overrides).map(|(scene, _)| scene)
    }

    /// [`Scene::load_with`], and what the file describes, with the other values in their places; files that it names are relative to the file's
    /// folder. A glTF file or a mesh file is described as one shape, with a camera and what lights it.
    ///
    /// # Errors
    ///
    /// Those of [`Scene::load_with`].
    pub fn load_described(path: impl AsRef<Path>, overrides: &Overrides) -> Result<(Scene, Description), SceneError> {
        Scene::load_and_list(path.as_ref(), overrides, &mut BTreeSet::new())
    }

    /// [`Scene::load_described`]. What files the scene is made of is told even if it breaks a rule.
    pub fn load_and_list(
        path: &Path,
        overrides: &Overrides,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<(Scene, Description), SceneError> {
        if is_gltf(path) {
            return load_gltf(path, overrides, files);
        }
        if model::is_mesh(path) {
            return load_mesh(path, overrides, files);
        }
        model::check_format(path)?;
        let text = read_text(path)?;
        parse_beside(&text, &path.display().to_string(), folder_of(path), overrides, files)
    }

    /// Reads and checks the text of a scene file; `origin` is the file's name in messages, which says by `.json` that
    /// it is JSON, and files that the scene names are beside it.
    ///
    /// # Errors
    ///
    /// The errors of [`Description::parse`] and of [`Description::validate`].
    pub fn parse(text: &str, origin: &str) -> Result<Scene, SceneError> {
        Scene::parse_with(text, origin, &Overrides::default())
    }

    /// Reads and checks the text of a scene file, with other values in place of some of its own.
    ///
    /// # Errors
    ///
    /// The errors of [`Scene::parse`], and bad overrides.
    pub fn parse_with(text: &str, origin: &str, overrides: &Overrides) -> Result<Scene, SceneError> {
        let folder = folder_of(Path::new(origin));
        parse_beside(text, origin, folder, overrides, &mut BTreeSet::new()).map(|(scene, _)| scene)
    }
}

/// The folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new("."))
}

/// A glTF file as a scene of its own, with the values in place.
fn load_gltf(
    path: &Path,
    overrides: &Overrides,
    files: &mut BTreeSet<PathBuf>,
) -> Result<(Scene, Description), SceneError> {
    let (mut description, _kept) = describe(path, overrides, files)?;
    let mut defines = Defines::new(&overrides.define);
    if !overrides.define.is_empty() {
        description = description.defined(&mut defines).map_err(SceneError::Override)?;
    }
    overrides.apply(&mut description).map_err(SceneError::Override)?;
    // Messages about the shape are about the file, whose name stands before them.
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let place = format!("{name}: ");
    let own = |message: &str| {
        let message = message.strip_prefix(&place).unwrap_or(message);
        message.replace(&format!("\"{name}/"), "\"")
    };
    let invalid = |problems: Problems| {
        if let Some(error) = problems.of_define(&defines) {
            return error;
        }
        let first = problems.first;
        SceneError::Gltf(GltfError::File {
            path: path.to_owned(),
            message: match first.key.to_string() == "shapes[0].file" {
                true => own(&first.message),
                false => first.to_string(),
            },
        })
    };
    let assets = overrides.assets(folder_of(path), folder_of(path));
    let mut scene = overrides.finish(description.validate_and_list(&assets, files), invalid, |_| {})?;
    for note in &mut scene.notes {
        *note = std::mem::take(note).of_loaded(&name);
        note.message = own(&note.message);
    }
    scene
        .notes
        .extend(overrides.presentation.hiding_ground(&scene).map(Note::from));
    Ok((scene, description))
}

/// A mesh file as a scene of its own, with the values in place.
fn load_mesh(
    path: &Path,
    overrides: &Overrides,
    files: &mut BTreeSet<PathBuf>,
) -> Result<(Scene, Description), SceneError> {
    let (mut description, _mesh) = model::describe(path, overrides)?;
    let mut defines = Defines::new(&overrides.define);
    if !overrides.define.is_empty() {
        description = description.defined(&mut defines).map_err(SceneError::Override)?;
    }
    overrides.apply(&mut description).map_err(SceneError::Override)?;
    let assets = overrides.assets(folder_of(path), folder_of(path));
    let checked = description.validate_and_list(&assets, files);
    let invalid = |problems: Problems| match problems.of_define(&defines) {
        Some(error) => error,
        None => model::error_of(path, problems.first),
    };
    let mut scene = overrides.finish(checked, invalid, |_| {})?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    for note in &mut scene.notes {
        *note = std::mem::take(note).of_loaded(&name);
    }
    scene
        .notes
        .extend(overrides.presentation.hiding_ground(&scene).map(Note::from));
    Ok((scene, description))
}

fn parse_beside(
    text: &str,
    origin: &str,
    folder: &Path,
    overrides: &Overrides,
    files: &mut BTreeSet<PathBuf>,
) -> Result<(Scene, Description), SceneError> {
    Draft::read(text, origin, folder, overrides)?.check(files)
}

/// A scene file's text that has been read, and not checked.
pub struct Draft<'a> {
    text: &'a str,
    origin: &'a str,
    folder: &'a Path,
    overrides: &'a Overrides,
    defines: Defines<'a>,
    /// What it describes, with the other values in their places.
    pub description: Description,
}

impl<'a> Draft<'a> {
    /// Reads the text of a file of this name, beside which the files lie that it names.
    pub fn read(
        text: &'a str,
        origin: &'a str,
        folder: &'a Path,
        overrides: &'a Overrides,
    ) -> Result<Draft<'a>, SceneError> {
        let mut defines = Defines::new(&overrides.define);
        let description = Description::parse_with(text, origin, &mut defines)?;
        let draft = Draft {
            text,
            origin,
            folder,
            overrides,
            defines,
            description,
        };
        draft.overridden()
    }

    /// Reads a text that differs from one that was read as `before` inside of one table alone, that at the first two steps of a path.
    /// Where that table has a header of its own nothing else is read again. Also where the text's parts are, if that was found.
    pub fn change(
        text: &'a str,
        origin: &'a str,
        folder: &'a Path,
        overrides: &'a Overrides,
        (before, at): (&Description, &KeyPath),
    ) -> Result<(Draft<'a>, Option<Places>), SceneError> {
        let mut defines = Defines::new(&overrides.define);
        let Some(change) = Description::parse_change(text, origin, &mut defines, before, at)? else {
            return Ok((Draft::read(text, origin, folder, overrides)?, None));
        };
        let mut draft = Draft {
            text,
            origin,
            folder,
            overrides,
            defines,
            description: change.description,
        };
        // The options stand in for values outside of the parts, and are in their places still where these were not read again.
        if change.is_rest {
            draft = draft.overridden()?;
        }
        Ok((draft, Some(change.places)))
    }

    fn overridden(mut self) -> Result<Draft<'a>, SceneError> {
        let applied = self.overrides.apply(&mut self.description);
        applied.map_err(SceneError::Override)?;
        let gltf = self.overrides.gltf.first();
        if let Some(option) = gltf.or(self.overrides.presentation.first()) {
            let rule = format!("only applies to model files, and {} is a scene file", self.origin);
            return Err(SceneError::Override(Problem::of(option, rule)));
        }
        Ok(self)
    }

    /// Checks every value. What files the scene is made of is told even if it breaks a rule.
    pub fn check(self, files: &mut BTreeSet<PathBuf>) -> Result<(Scene, Description), SceneError> {
        let Draft {
            text,
            origin,
            folder,
            overrides,
            defines,
            description,
        } = self;
        let is_course = is_course(Path::new(origin));
        let root = if is_course {
            course::asset_root(folder)
        } else {
            folder.to_owned()
        };
        let assets = overrides.assets(folder, &root);
        let invalid = |problems| match is_course {
            true => course::invalid(text, origin, problems, &defines),
            false => invalid(text, origin, problems, &defines),
        };
        let checked = description.validate_and_list(&assets, files);
        let scene = overrides.finish(checked, invalid, |path| path.set_place(origin, line_of_path(text)))?;
        Ok((scene, description))
    }
}

impl Overrides {
    /// Where the files of a scene in this folder are, which lie in a root of their own unless these say another.
    pub fn assets(&self, folder: &Path, root: &Path) -> Assets {
        let mut assets = Assets::beside(folder);
        if let Some(root) = self.asset_root.as_deref().or((root != folder).then_some(root)) {
            assets.root = root.to_owned();
        }
        let around = self.environment.as_ref().and_then(|around| around.file.clone());
        assets.elsewhere.extend(around.map(PathBuf::from));
        assets.strict = self.strict;
        assets
    }

    /// A scene that was checked, at its frame, or why there is none.
    fn finish(
        &self,
        checked: Result<Scene, Problems>,
        invalid: impl Fn(Problems) -> SceneError,
        place: impl Fn(&mut CameraPath),
    ) -> Result<Scene, SceneError> {
        let mut scene = checked.map_err(|problems| {
            let of_option = self
                .environment
                .as_ref()
                .and_then(|_| problems.iter().find_map(of_option));
            of_option.map_or_else(|| invalid(problems), SceneError::Override)
        })?;
        if let Some(path) = &mut scene.camera_path {
            place(path);
        }
        if let Some(frame) = self.frame {
            scene.camera = scene.camera_at(frame)?;
        }
        // The count may be the default, and yet somebody asked for it.
        let is_asked = self.light_samples.is_some() && scene.render.integrator.follows_paths();
        if is_asked && !scene.notes.iter().any(|note| note.message == LIGHT_SAMPLES) {
            scene.notes.push(LIGHT_SAMPLES.into());
        }
        Ok(scene)
    }
}

/// The text of a file.
pub fn read_text(path: &Path) -> Result<String, SceneError> {
    let bytes = read_bytes(path).map_err(|error| SceneError::Read {
        path: path.to_owned(),
        error,
    })?;
    String::from_utf8(bytes).map_err(|error| {
        let text = String::from_utf8_lossy(error.as_bytes());
        // Up to there the lossy text is the file's.
        let valid = error.utf8_error().valid_up_to();
        let name = path.display().to_string();
        match encoding(error.as_bytes()) {
            Some(message) => SceneError::Syntax {
                origin: name,
                line: 1,
                column: 1,
                message,
            },
            None => syntax_error(&text, &name, valid, NOT_UTF8),
        }
    })
}

/// The bytes of a file, which must be one that ends, and no longer than a scene may be.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    waiting::check(path)?;
    if path.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "it is a folder, and a scene is a file",
        ));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(LARGEST_FILE + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it is larger than 64 MiB"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "\
image = { width = 4, height = 3 }
camera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 40 }
[render]
light_samples = { pattern = 'random', count = 5 }
";

    #[test]
    fn overrides_stand_in_for_the_files_values() {
        let overrides = Overrides {
            size: Some((50, 40)),
            pixel_samples: Some(9),
            light_samples: Some(8),
            seed: Some(3),
            pixel_pattern: None,
            adaptive: None,
            integrator: None,
            max_depth: None,
            asset_root: None,
            frame: None,
            environment: None,
            background: None,
            view_transform: None,
            exposure: None,
            turntable: None,
            strict: false,
            presentation: Presentation::default(),
            gltf: GltfChoice::default(),
            define: Vec::new(),
        };
        let scene = Scene::parse_with(SCENE, "s.toml", &overrides).unwrap();
        let render = scene.render;
        assert_eq!((scene.width, scene.height, render.seed), (50, 40, 3));
        assert_eq!((render.pixel_samples.count, render.light_samples.count), (9, 8));
        let scene = Scene::parse(SCENE, "s.toml").unwrap();
        let render = scene.render;
        assert_eq!((scene.width, scene.height, render.seed), (4, 3, 0));
        assert_eq!((render.pixel_samples.count, render.light_samples.count), (16, 5));
    }

    #[test]
    fn an_integrator_brings_its_own_ranges() {
        let load = |integrator, max_depth| {
            let overrides = Overrides {
                integrator,
                max_depth,
                ..Overrides::default()
            };
            Scene::parse_with(SCENE, "s.toml", &overrides).map(|scene| scene.render)
        };
        let (phong, path) = (Some(Integrator::Phong), Some(Integrator::Path));
        for (integrator, depth) in [
            (None, 1),
            (None, 64),
            (phong, 1),
            (phong, 64),
            (path, 0),
            (path, 64),
            (path, 1024),
        ] {
            let render = load(integrator, Some(depth)).unwrap();
            assert_eq!(render.integrator, integrator.unwrap_or(Integrator::Phong));
            assert_eq!(render.max_depth, depth);
        }
        assert_eq!(load(path, None).unwrap().max_depth, 8);
        let told = |integrator, depth| load(integrator, Some(depth)).unwrap_err().to_string();
        assert_eq!(told(None, 0), "max_depth: 0 must be from 1 to 64");
        assert_eq!(told(phong, 65), "max_depth: 65 must be from 1 to 64");
        assert_eq!(told(path, 1025), "max_depth: 1025 must be from 0 to 1024");
        // The pattern of the samples is the integrator's, if none is said.
        let samples = |integrator| {
            let overrides = Overrides {
                integrator,
                pixel_samples: Some(8),
                ..Overrides::default()
            };
            Scene::parse_with(SCENE, "s.toml", &overrides)
        };
        assert_eq!(samples(path).unwrap().render.pixel_samples.pattern, Pattern::Sobol);
        assert!(samples(phong).is_err());
    }

    #[test]
    fn bad_overrides_are_told_by_their_names() {
        let none = Overrides::default;
        for (overrides, told) in [
            (
                Overrides {
                    size: Some((0, 1)),
                    ..none()
                },
                "size: 0 must be from 1 to 65536",
            ),
            (
                Overrides {
                    size: Some((1, 65_537)),
                    ..none()
                },
                "size: 65537 must be from 1 to 65536",
            ),
            (
                Overrides {
                    pixel_samples: Some(8),
                    ..none()
                },
                "pixel_samples: 8 must be a square number, such as 4 or 9: the pattern \"grid\" is an n x n grid; other patterns take any number",
            ),
            (
                Overrides {
                    light_samples: Some(0),
                    ..none()
                },
                "light_samples: 0 must be from 1 to 65536",
            ),
        ] {
            let error = Scene::parse_with(SCENE, "s.toml", &overrides).unwrap_err();
            assert!(matches!(error, SceneError::Override(_)), "{error}");
            assert_eq!(error.to_string(), told);
        }
    }

    #[test]
    fn files_are_read_or_the_message_says_why_not() {
        let folder = tempfile::tempdir().unwrap();
        let load = |name: &str| Scene::load(folder.path().join(name));
        let told = |name: &str| load(name).unwrap_err().to_string();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
        write("good.toml", SCENE.as_bytes());
        assert_eq!(load("good.toml").unwrap().width, 4);
        write("latin.toml", b"# \xc3\xa9t\xc3\xa9\n# \xc3\xa9t\xe9");
        assert_eq!(
            told("latin.toml"),
            format!("{}:2:5: not valid UTF-8", path("latin.toml"))
        );
        for (name, bytes, encoding) in [
            ("little.toml", &b"\xff\xfe[\0"[..], "UTF-16 (little-endian)"),
            ("big.toml", b"\xfe\xff\0[", "UTF-16 (big-endian)"),
        ] {
            write(name, bytes);
            let message = format!(
                "{}:1:1: the file is encoded in {encoding}; save it as UTF-8",
                path(name)
            );
            assert_eq!(told(name), message);
        }
        assert!(told("none.toml").starts_with(&format!("{}: cannot be read: ", path("none.toml"))));
        File::create(folder.path().join("huge.toml"))
            .unwrap()
            .set_len(LARGEST_FILE + 1)
            .unwrap();
        assert_eq!(
            told("huge.toml"),
            format!("{}: cannot be read: it is larger than 64 MiB", path("huge.toml"))
        );
    }
}
