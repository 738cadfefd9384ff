//! Overrides of the values of a scene file.

use std::path::{Path, PathBuf};

use super::gltf_choice::GltfChoice;
use crate::define::Define;
use crate::environment_override::{Background, option_problem, replace_environment};
use crate::error::SceneError;
use crate::key_path::KeyPath;
use crate::problem::{At, Problem, Problems};
use crate::turntable::with_orbit;
use crate::validate::{LIGHT_SAMPLES, adaptive, adaptive_error, max_depth, sample_count, side};
use crate::{
    AdaptiveDescription, Assets, CameraPath, Description, EnvironmentDescription, Integrator, Pattern, Presentation,
    SamplesDescription, Scene, ViewSettings, ViewTransform,
};

/// Values that override values of the scene file. An invalid override is reported as [`SceneError::Override`], which
/// names the field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Width and height of the image in pixels, each 1 to 65,536.
    pub size: Option<(u32, u32)>,
    /// Samples per pixel; the pattern is not changed.
    pub pixel_samples: Option<u32>,
    /// Samples per area light at each hit; the pattern is not changed.
    pub light_samples: Option<u32>,
    /// The seed of all random patterns.
    pub seed: Option<u32>,
    /// Sample pattern of the pixels; the count is not changed.
    pub pixel_pattern: Option<Pattern>,
    /// Target error of adaptive sampling, 0 to 1; the maximum number of samples is not changed.
    pub adaptive: Option<f64>,
    /// Denoise the image. If `None`, the setting of the scene; a model without a scene is denoised.
    pub denoise: Option<bool>,
    /// The integrator.
    pub integrator: Option<Integrator>,
    /// Maximum path depth, 1 to 64; 0 to 1024 for [`Integrator::Path`].
    pub max_depth: Option<u32>,
    /// Folder that must contain all files of the scene; `None` is the folder of the scene file.
    pub asset_root: Option<PathBuf>,
    /// Frame of an animated camera; `None` uses `[camera]`, and the first key for values that `[camera]` does not set.
    pub frame: Option<f64>,
    /// The environment, for [`Integrator::Path`]; the visibility to the camera is not changed. A file with an absolute
    /// path may be outside of the folder of the scene.
    pub environment: Option<EnvironmentDescription>,
    /// The background.
    pub background: Option<Background>,
    /// The view transform.
    pub view_transform: Option<ViewTransform>,
    /// The exposure in stops, -100 to 100.
    pub exposure: Option<f64>,
    /// Number of frames of an orbit around the look-at point, 1 to 100,000, instead of the camera's path.
    /// [`Overrides::frame`] selects a frame, counted from 1; [`Scene::camera_at`](crate::Scene::camera_at) returns the
    /// camera of any frame.
    pub turntable: Option<u32>,
    /// True to report damage to a file as an error, instead of using a placeholder with a warning.
    pub strict: bool,
    /// Presentation of a model file that is loaded without a scene file.
    pub presentation: Presentation,
    /// The parts of a glTF file to render.
    pub gltf: GltfChoice,
    /// Overrides of arbitrary keys of the file, applied in order; the fields above take precedence.
    pub define: Vec<Define>,
}

impl Overrides {
    pub(super) fn apply(&self, description: &mut Description) -> Result<(), Problem> {
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
        // The environment and the background may determine the integrator, on which the following overrides depend.
        if let Some(environment) = &self.environment {
            replace_environment(description, environment);
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
        render.denoise = self.denoise.or(render.denoise);
        if let Some(error) = self.adaptive {
            adaptive_error(error).at("adaptive")?;
            let max_samples = (render.adaptive.as_ref()).and_then(|adaptive| adaptive.max_samples);
            let settings = AdaptiveDescription { error, max_samples };
            adaptive(&settings, &render.pixel_samples, integrator).at("adaptive")?;
            render.adaptive = Some(settings);
        }
        if let Some(frames) = self.turntable
            && description.camera.validate().is_ok()
        {
            description.camera = with_orbit(&description.camera, frames).at("turntable")?;
        }
        Ok(())
    }
}

impl Overrides {
    /// Returns the option that overrides the value of this key, or a part of the value.
    pub fn in_place_of(&self, key: &KeyPath) -> Option<String> {
        if let Some(define) = self.define.iter().find(|define| define.overrides_key(key)) {
            return Some(format!("--define {define}"));
        }
        let options: [(bool, &str, &[&str]); 10] = [
            (self.size.is_some(), "--size", &["image.width", "image.height"]),
            (self.integrator.is_some(), "integrator", &["render.integrator"]),
            (self.max_depth.is_some(), "max_depth", &["render.max_depth"]),
            (self.seed.is_some(), "seed", &["render.seed"]),
            (self.denoise.is_some(), "denoise", &["render.denoise"]),
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
        let is_within = |option_key: &&str| {
            path.strip_prefix(*option_key)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let mut active = options.into_iter().filter(|(is_set, ..)| *is_set);
        let found = active.find(|(_, _, keys)| keys.iter().any(is_within));
        found.map(|(_, name, _)| name.to_owned())
    }
}

fn set_count(samples: &mut SamplesDescription, count: Option<u32>, integrator: Integrator) -> Result<(), Problem> {
    if let Some(count) = count {
        samples.count = sample_count(samples.pattern(integrator), count)?;
    }
    Ok(())
}

impl Overrides {
    /// Returns the file locations of a scene in `folder`. The files must be below `root`, or below the overridden root.
    pub fn assets(&self, folder: &Path, root: &Path) -> Assets {
        let mut assets = Assets::beside(folder);
        if root != folder {
            assets.root = root.to_owned();
        }
        self.adjust(assets)
    }

    /// Applies the overrides of file locations.
    pub(super) fn adjust(&self, mut assets: Assets) -> Assets {
        if let Some(root) = &self.asset_root {
            assets.root.clone_from(root);
        }
        let environment = self.environment.as_ref();
        let environment_file = environment.and_then(|environment| environment.file.clone());
        assets.elsewhere.extend(environment_file.map(PathBuf::from));
        assets.strict = self.strict;
        assets
    }

    /// Sets the camera of the frame in a validated scene, and adds a note if `light_samples` is ignored. Returns the
    /// errors of a failed validation.
    pub(super) fn finish(
        &self,
        validated: Result<Scene, Problems>,
        invalid: impl Fn(Problems) -> SceneError,
        set_location: impl Fn(&mut CameraPath),
    ) -> Result<Scene, SceneError> {
        let mut scene = validated.map_err(|problems| {
            let environment_problem = self
                .environment
                .as_ref()
                .and_then(|_| problems.iter().find_map(option_problem));
            environment_problem.map_or_else(|| invalid(problems), SceneError::Override)
        })?;
        if let Some(path) = &mut scene.camera_path {
            set_location(path);
        }
        if let Some(frame) = self.frame {
            scene.camera = scene.camera_at(frame)?;
        }
        // Validation adds no note for a count that equals the default, because it treats such a count as absent.
        let is_ignored = self.light_samples.is_some() && scene.render.integrator.follows_paths();
        if is_ignored && !scene.notes.iter().any(|note| note.message == LIGHT_SAMPLES) {
            scene.notes.push(LIGHT_SAMPLES.into());
        }
        Ok(scene)
    }
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
    fn overrides_replace_values_of_the_file() {
        let overrides = Overrides {
            size: Some((50, 40)),
            pixel_samples: Some(9),
            light_samples: Some(8),
            seed: Some(3),
            pixel_pattern: None,
            adaptive: None,
            denoise: Some(true),
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
        assert_eq!(
            (render.pixel_samples.count, render.light_samples.count, render.denoise),
            (9, 8, true)
        );
        let scene = Scene::parse(SCENE, "s.toml").unwrap();
        let render = scene.render;
        assert_eq!((scene.width, scene.height, render.seed), (4, 3, 0));
        assert_eq!(
            (render.pixel_samples.count, render.light_samples.count, render.denoise),
            (16, 5, false)
        );
    }

    #[test]
    fn ranges_depend_on_the_overridden_integrator() {
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
        let message = |integrator, depth| load(integrator, Some(depth)).unwrap_err().to_string();
        assert_eq!(message(None, 0), "max_depth: 0 must be from 1 to 64");
        assert_eq!(message(phong, 65), "max_depth: 65 must be from 1 to 64");
        assert_eq!(message(path, 1025), "max_depth: 1025 must be from 0 to 1024");
        // The default pattern depends on the integrator.
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
    fn invalid_overrides_are_reported_by_name() {
        let default = Overrides::default;
        for (overrides, expected) in [
            (
                Overrides {
                    size: Some((0, 1)),
                    ..default()
                },
                "size: 0 must be from 1 to 65536",
            ),
            (
                Overrides {
                    size: Some((1, 65_537)),
                    ..default()
                },
                "size: 65537 must be from 1 to 65536",
            ),
            (
                Overrides {
                    pixel_samples: Some(8),
                    ..default()
                },
                "pixel_samples: 8 must be a square number, such as 4 or 9: the pattern \"grid\" is an n x n grid; other patterns take any number",
            ),
            (
                Overrides {
                    light_samples: Some(0),
                    ..default()
                },
                "light_samples: 0 must be from 1 to 65536",
            ),
        ] {
            let error = Scene::parse_with(SCENE, "s.toml", &overrides).unwrap_err();
            assert!(matches!(error, SceneError::Override(_)), "{error}");
            assert_eq!(error.to_string(), expected);
        }
    }
}
