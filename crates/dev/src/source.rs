//! The files of a session, and their current states.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant, SystemTime};

use super::diagnostic::Diagnostic;
use super::picture::View;
use wgray_render::gpu::compose::{self, Shaders};
use wgray_render::output::AovSource;
use wgray_render::pack::{self, PackedShading, pack_with};
use wgray_scene::{
    CameraDescription, Description, Integrator, Overrides, PendingScene, Pieces, Places, Scene, folder_of, is_gltf,
    is_json_scene, is_mesh, is_model, read_bytes, read_text,
};
use wgray_trace::records::{Packed, Specialization};

/// The locations of the files of a session, and the overrides.
#[derive(Clone, Debug)]
pub struct Sources {
    /// The scene file.
    pub scene: PathBuf,
    /// Overrides of values in the scene file.
    pub overrides: Overrides,
    /// The folder of the shaders; `None` for the built-in ones.
    pub shaders: Option<PathBuf>,
}

/// A scene that has been loaded and packed.
#[derive(Debug)]
pub struct Loaded {
    /// The text of the scene file; empty for a binary file.
    pub text: String,
    /// The description, with the overrides applied.
    pub description: Description,
    pub camera: CameraDescription,
    pub scene: Scene,
    /// The packed scene, as the backends read it.
    pub packed: Packed,
    /// Packed materials, textures and environment map, which later scenes may share.
    shading: Arc<PackedShading>,
    /// The locations of the pieces of the text, computed on first use.
    places: OnceLock<Places>,
}

impl Loaded {
    /// Packs a scene. Reuses the packed data of `previous`, an earlier scene, where the two scenes are equal.
    pub fn new(text: String, scene: Scene, description: Description, previous: Option<&Loaded>) -> Loaded {
        let shared = previous.filter(|previous| PackedShading::is_shared(&previous.scene, &scene));
        let shading = match (shared, previous) {
            (Some(previous), _) => Arc::clone(&previous.shading),
            (None, Some(previous)) => Arc::new(PackedShading::of_changed(&scene, (&previous.scene, &previous.shading))),
            (None, None) => Arc::new(PackedShading::of(&scene)),
        };
        let packed = match shared.filter(|previous| differ_only_in_camera(previous, &scene)) {
            Some(previous) => {
                let mut packed = previous.packed.clone();
                pack::set_camera(&mut packed, &scene);
                packed
            }
            None => pack_with(&scene, &shading),
        };
        let packed = packed.without_layers(); // layer views have their own kernels
        Loaded {
            shading,
            text,
            camera: description.camera.clone(),
            description,
            scene,
            packed,
            places: OnceLock::new(),
        }
    }

    #[must_use]
    pub(crate) fn with_places(mut self, places: Option<Places>) -> Loaded {
        self.places = places.map_or_else(OnceLock::new, OnceLock::from);
        self
    }

    /// Returns the pieces of the text, which is scanned only once.
    pub(crate) fn pieces(&self) -> Pieces<'_> {
        Pieces::with_places(&self.text, self.places.get_or_init(|| Places::of(&self.text)))
    }
}

/// Returns true if only the camera's record has to be packed again.
fn differ_only_in_camera(previous: &Loaded, scene: &Scene) -> bool {
    let mut moved = previous.scene.clone();
    moved.camera = scene.camera;
    (moved.camera_path, moved.view) = (scene.camera_path.clone(), scene.view);
    moved == *scene && previous.packed.origin == pack::origin(&scene.camera)
}

/// The properties of a scene and a view that determine the kernel, and whether the CPU renders instead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KernelChoice {
    /// The values of the kernel's override constants.
    pub specialization: Specialization,
    pub integrator: Integrator,
    /// True if sampling is adaptive.
    pub adaptive: bool,
    /// True if the CPU, not a kernel, renders the scene.
    pub on_cpu: bool,
}

impl KernelChoice {
    pub fn of(packed: &Packed, view: View, on_cpu: bool) -> KernelChoice {
        let (integrator, adaptive) = (packed.integrator, packed.sampling.adaptive);
        let source = view.aov().map(|aov| aov.source(integrator));
        let denoises = view == View::Denoised;
        let needs_layers = denoises || source == Some(AovSource::Samples);
        let needs_noise = denoises || (source == Some(AovSource::Statistics) && !adaptive);
        KernelChoice {
            specialization: Specialization {
                layers: (needs_layers && integrator.has_layers()).into(),
                noise: needs_noise.into(),
                ..packed.specialization
            },
            integrator,
            adaptive,
            on_cpu,
        }
    }

    /// Returns the view to show if `view` is selected: the color view if `view` needs a different kernel.
    pub fn supported_view(&self, view: View) -> View {
        match view.aov().map(|aov| aov.source(self.integrator)) {
            Some(AovSource::Samples) if self.specialization.layers == 0 => View::Color,
            Some(AovSource::Statistics)
                if self.specialization.noise == 0 && !(self.adaptive && view == View::Variance) =>
            {
                View::Color
            }
            None if self.on_cpu && view.is_rendered_twice() => View::Color,
            _ => view,
        }
    }

    /// Returns true if two kernel choices differ only in the supported views. Ignores whether the CPU renders.
    pub fn differs_only_in_views(&self, other: &KernelChoice) -> bool {
        let without_view = |kernel_choice: &KernelChoice| KernelChoice {
            specialization: Specialization {
                layers: 0,
                noise: 0,
                ..kernel_choice.specialization
            },
            on_cpu: false,
            ..*kernel_choice
        };
        without_view(self) == without_view(other)
    }
}

/// The state of all files at one point in time.
#[derive(Clone, Debug)]
pub struct Snapshot {
    pub scene: Result<Arc<Loaded>, Vec<Diagnostic>>,
    pub shaders: Result<Arc<Shaders>, Box<Diagnostic>>,
    /// Time spent on reading the files, and time spent on packing the scene.
    pub durations: [Duration; 2],
    /// All files of the scene, and their states: the scene is read again if a state changes.
    pub files: Vec<(PathBuf, FileStamp)>,
    /// The last valid scene, if `scene` is an error.
    last_valid: Option<Arc<Loaded>>,
}

/// The state of a file: the content of a scene file; for other files, which may be large, the length and modification
/// time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileStamp {
    /// The file cannot be read.
    Absent,
    Content(Vec<u8>),
    Metadata(u64, Option<SystemTime>),
}

impl FileStamp {
    pub fn size(&self) -> u64 {
        match self {
            FileStamp::Absent => 0,
            FileStamp::Content(bytes) => bytes.len() as u64,
            FileStamp::Metadata(size, _) => *size,
        }
    }
}

impl Sources {
    /// Returns the states of models, meshes and textures in the snapshot, and their current states.
    pub fn assets(&self, snapshot: &Snapshot) -> [Vec<FileStamp>; 2] {
        let text_files = usize::from(!is_model(&self.scene));
        let files = || snapshot.files.iter().skip(text_files);
        let old = files().map(|(_, stamp)| stamp.clone()).collect();
        [old, files().map(|(path, _)| self.stamp(path)).collect()]
    }

    /// Returns the reason if the scene file cannot be edited on the page.
    pub fn read_only(&self) -> Option<String> {
        let kind = match &self.scene {
            scene if is_gltf(scene) => "glTF",
            scene if is_mesh(scene) => "a mesh",
            scene if is_json_scene(scene) => "JSON",
            _ => return None,
        };
        Some(format!(
            "{kind} files are read-only here; run `wgray convert` for an editable scene"
        ))
    }

    /// Reads the shaders and the scene.
    pub fn read(&self) -> Snapshot {
        self.read_scene(self.read_shaders(), None)
    }

    /// Reads the files that have changed since a snapshot, if any. Calls `begin` before reading a scene.
    pub fn reread(&self, last: &Snapshot, begin: impl FnOnce()) -> Option<Snapshot> {
        let start = Instant::now();
        let shaders = match (self.read_shaders(), &last.shaders) {
            (Ok(new), Ok(old)) if new == *old => Ok(old.clone()), // keeps the pointer, which is compared later
            (shaders, _) => shaders,
        };
        let same_shaders = match (&shaders, &last.shaders) {
            (Ok(new), Ok(old)) => Arc::ptr_eq(new, old),
            (Err(new), Err(old)) => new == old,
            _ => false,
        };
        let same_scene = last.files.iter().all(|(path, stamp)| self.stamp(path) == *stamp);
        match (same_scene, same_shaders) {
            (true, true) => None,
            (true, false) => Some(Snapshot {
                shaders,
                durations: [start.elapsed(), Duration::ZERO],
                ..last.clone()
            }),
            (false, _) => {
                begin();
                let mut new = self.read_scene(shaders, last.scene.as_ref().ok().or(last.last_valid.as_ref()));
                if new.files.len() == 1 {
                    // The scene file may be incomplete, so the files of the last scene are still watched.
                    new.files.extend(
                        last.files
                            .iter()
                            .skip(1)
                            .map(|(path, _)| (path.clone(), self.stamp(path))),
                    );
                }
                Some(new)
            }
        }
    }

    fn read_shaders(&self) -> Result<Arc<Shaders>, Box<Diagnostic>> {
        let shaders = match &self.shaders {
            Some(folder) => {
                Shaders::read(folder).map_err(|error| Box::new(Diagnostic::plain("file", error.to_string())))?
            }
            None => Shaders::built_in(),
        };
        Ok(Arc::new(shaders))
    }

    /// Reads the scene. `previous` is the last valid scene.
    fn read_scene(&self, shaders: Result<Arc<Shaders>, Box<Diagnostic>>, previous: Option<&Arc<Loaded>>) -> Snapshot {
        let start = Instant::now();
        // The states are determined before the files are read, so that a file that changes meanwhile is read again.
        let mut files = vec![(self.scene.clone(), self.stamp(&self.scene))];
        let mut used_files = BTreeSet::new();
        let (mut text, origin) = (String::new(), self.scene.display().to_string());
        let scene = match is_model(&self.scene) {
            true => Scene::load_and_list(&self.scene, &self.overrides, &mut used_files),
            false => read_text(&self.scene).and_then(|scene_text| {
                text = scene_text;
                let pending = PendingScene::read(&text, &origin, folder_of(&self.scene), &self.overrides)?;
                let assets = self.asset_files(&pending.description);
                files.extend(assets.map(|path| (path.clone(), self.stamp(&path))));
                pending.check(&mut used_files)
            }),
        };
        for path in used_files {
            if files.iter().all(|(listed, _)| *listed != path) {
                let stamp = self.stamp(&path);
                files.push((path, stamp));
            }
        }
        let mut durations = [start.elapsed(), Duration::ZERO];
        let scene = match scene {
            Ok((scene, description)) => {
                let start = Instant::now();
                let loaded = Loaded::new(text, scene, description, previous.map(|previous| &**previous));
                durations[1] = start.elapsed();
                Ok(Arc::new(loaded))
            }
            Err(error) => Err(Diagnostic::scene(&error, &text)),
        };
        Snapshot {
            last_valid: previous.filter(|_| scene.is_err()).cloned(),
            scene,
            shaders,
            durations,
            files,
        }
    }

    fn asset_files(&self, description: &Description) -> impl Iterator<Item = PathBuf> {
        description.files(self.scene.parent().unwrap_or(Path::new("")))
    }

    fn stamp(&self, path: &Path) -> FileStamp {
        if path == self.scene && !is_model(path) {
            return read_bytes(path).map_or(FileStamp::Absent, FileStamp::Content);
        }
        fs::metadata(path).map_or(FileStamp::Absent, |data| {
            FileStamp::Metadata(data.len(), data.modified().ok())
        })
    }

    /// Returns the paths of the shader files in the folder of `--shaders`.
    pub fn shader_files(&self) -> impl Iterator<Item = PathBuf> {
        let folder = self.shaders.iter();
        folder.flat_map(|folder| compose::built_in().map(move |(name, _)| folder.join(name)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgray_render::pack::pack;

    const SCENE: &str = "
        image = { width = 8, height = 8 }
        camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }
        render = { integrator = 'path', seed = 1 }
        environment = { file = 'map.hdr' }
        textures.t = { type = 'image', file = 'texture.hdr' }
        materials.m = { type = 'diffuse', color = [0.5, 0.5, 0.5] }
        materials.glass = { type = 'dielectric', ior = 1.5, roughness = 0.2 }
        shapes = [
            { type = 'sphere', material = 'm', center = [0, 0, 0], radius = 1 },
            { type = 'sphere', material = 'glass', center = [2, 0, 0], radius = 1 },
        ]
    ";

    /// Returns an image file in the Radiance format.
    fn hdr(width: usize, height: usize) -> Vec<u8> {
        let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
        file.extend((0..width * height).flat_map(|i| [10 * i as u8 + 5, 40, 90, 128]));
        file
    }

    struct Files {
        _folder: tempfile::TempDir,
        sources: Sources,
    }

    impl Files {
        fn new() -> Files {
            let folder = tempfile::tempdir().unwrap();
            fs::write(folder.path().join("map.hdr"), hdr(6, 3)).unwrap();
            fs::write(folder.path().join("texture.hdr"), hdr(2, 2)).unwrap();
            let sources = Sources {
                scene: folder.path().join("scene.toml"),
                overrides: Overrides::default(),
                shaders: None,
            };
            Files {
                _folder: folder,
                sources,
            }
        }

        fn read(&self, text: &str, last: Option<&Snapshot>) -> Snapshot {
            fs::write(&self.sources.scene, text).unwrap();
            match last {
                None => self.sources.read(),
                Some(last) => self.sources.reread(last, || ()).expect("a changed scene"),
            }
        }
    }

    fn edited(old: &str, new: &str) -> String {
        assert!(SCENE.contains(old), "{old}");
        SCENE.replacen(old, new, 1)
    }

    #[test]
    fn changed_scenes_are_packed_like_new_scenes_and_share_equal_texels() {
        let files = Files::new();
        let first = files.read(SCENE, None);
        let loaded = first.scene.clone().unwrap();
        assert!(!loaded.packed.textures.texels.is_empty());
        for (old, new, is_shared) in [
            ("fov = 40", "fov = 50", true),
            ("fov = 40", "fov = 40, aperture = 0.1", true),
            ("look_at = [0, 0, 0]", "look_at = [900, 0, 0]", true),
            ("width = 8", "width = 9", true),
            ("seed = 1", "seed = 2", true),
            ("radius = 1", "radius = 2", true),
            ("[0.5, 0.5, 0.5]", "[0.5, 0.5, 0.2]", true),
            ("color = [0.5, 0.5, 0.5]", "color = { texture = 't' }", false),
            ("roughness = 0.2", "roughness = 0.3", false),
            ("file = 'map.hdr'", "file = 'map.hdr', scale = 2", false),
            ("file = 'map.hdr'", "color = [1, 1, 1]", false),
        ] {
            let changed = files.read(&edited(old, new), Some(&first)).scene.unwrap();
            assert!(changed.packed == pack(&changed.scene).without_layers(), "{new}");
            assert!(changed.packed != loaded.packed, "{new}");
            let [new_texels, old_texels] = [&changed, &loaded].map(|loaded| &loaded.packed.textures.texels);
            assert_eq!(Arc::ptr_eq(new_texels, old_texels), is_shared, "{new}");
        }
    }

    #[test]
    fn a_scene_whose_error_is_fixed_shares_the_texels_of_the_last_valid_scene() {
        let files = Files::new();
        let first = files.read(SCENE, None);
        let broken = files.read(&edited("radius = 1", "radius = -1"), Some(&first));
        assert!(broken.scene.is_err());
        let still_broken = files.read(&edited("radius = 1", "radius = -2"), Some(&broken));
        let fixed = files.read(&edited("radius = 1", "radius = 3"), Some(&still_broken));
        let [first_texels, fixed_texels] =
            [first, fixed].map(|snapshot| Arc::clone(&snapshot.scene.unwrap().packed.textures.texels));
        assert!(Arc::ptr_eq(&first_texels, &fixed_texels));
    }
}
