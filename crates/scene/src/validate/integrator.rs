//! The default integrator of a scene: `path` if the scene uses a key that needs the path tracer, otherwise `phong`.

use super::super::key_path::{KeyPath, Segment};
use super::super::{Description, Integrator, MaterialDescription, ShapeDescription};

impl Description {
    /// Returns the integrator of `[render]`. If `[render]` specifies no integrator, returns [`Integrator::Path`] if any
    /// key needs the path tracer, and otherwise [`Integrator::Phong`].
    pub fn integrator(&self) -> Integrator {
        let default = || path_tracer_key(self).map_or(Integrator::Phong, |_| Integrator::Path);
        self.render.integrator.unwrap_or_else(default)
    }
}

/// Returns a note if the path tracer was chosen because of a key.
pub(crate) fn note(description: &Description) -> Option<String> {
    if description.render.integrator.is_some() {
        return None;
    }
    let key = path_tracer_key(description)?;
    Some(format!(
        "render.integrator is not set; using \"path\", which {key} requires. Set it in the scene to silence this warning"
    ))
}

/// Returns the first key that only the path tracer supports.
fn path_tracer_key(description: &Description) -> Option<KeyPath> {
    let render = &description.render;
    let settings = [
        ("rr_depth", render.rr_depth.is_some()),
        ("clamp", render.clamp.is_some()),
        ("alpha", render.alpha.is_some()),
    ];
    if let Some((name, _)) = settings.into_iter().find(|(_, is_set)| *is_set) {
        return Some(key_path([Segment::from("render"), name.into()]));
    }
    if description.environment.is_some() {
        return Some(key_path([Segment::from("environment")]));
    }
    let materials = description.materials.iter();
    let mut material_keys = materials.filter_map(|(name, material)| {
        let key = key_of_material(material)?;
        Some(key_path([Segment::from("materials"), name.as_str().into(), key.into()]))
    });
    let is_gltf = |shape: &ShapeDescription| matches!(shape, ShapeDescription::Gltf(_));
    let gltf_key = || {
        let shape = description.shapes.iter().position(is_gltf)?;
        Some(key_path([Segment::from("shapes"), shape.into(), "type".into()]))
    };
    material_keys.next().or_else(gltf_key)
}

fn key_path<const N: usize>(segments: [Segment; N]) -> KeyPath {
    KeyPath(segments.to_vec())
}

/// Returns the key of a material that only the path tracer supports.
fn key_of_material(material: &MaterialDescription) -> Option<&'static str> {
    let emission = match material {
        MaterialDescription::Phong(phong) => &phong.emission,
        MaterialDescription::Mirror(mirror) => &mirror.emission,
        MaterialDescription::Glass(glass) => &glass.emission,
        MaterialDescription::Diffuse(_)
        | MaterialDescription::Conductor(_)
        | MaterialDescription::Dielectric(_)
        | MaterialDescription::Principled(_) => return Some("type"),
    };
    emission.is_some().then_some("emission")
}

#[cfg(test)]
mod tests {
    use crate::{Background, Define, EnvironmentDescription, Integrator, Overrides, Scene};

    const SCENE: &str = "\
image = { width = 4, height = 3 }
camera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 40 }
materials.red = { type = 'phong', color = [1, 0, 0] }
";

    fn load(extra: &str, overrides: &Overrides) -> Scene {
        Scene::parse_with(&format!("{SCENE}{extra}"), "s.toml", overrides).unwrap()
    }

    #[test]
    fn scenes_without_keys_of_the_path_tracer_are_rendered_by_phong() {
        let scene = load("", &Overrides::default());
        assert_eq!((scene.render.integrator, scene.notes), (Integrator::Phong, vec![]));
    }

    /// Tests settings whose valid values depend on the integrator.
    #[test]
    fn the_chosen_integrator_determines_the_settings() {
        let scene = load(
            "environment.color = [1, 1, 1]\nrender = { max_depth = 0, pixel_samples = 5 }\n",
            &Overrides::default(),
        );
        assert_eq!(scene.render.integrator, Integrator::Path);
        assert_eq!(scene.render.pixel_samples.pattern, crate::Pattern::Sobol);
        let overrides = Overrides {
            max_depth: Some(0),
            pixel_samples: Some(5),
            environment: Some("sky".parse::<EnvironmentDescription>().unwrap()),
            ..Overrides::default()
        };
        let scene = load("", &overrides);
        assert_eq!((scene.render.integrator, scene.render.max_depth), (Integrator::Path, 0));
        assert!(
            scene.notes[0].message.starts_with("render.integrator is not set; "),
            "{:?}",
            scene.notes
        );
    }

    #[test]
    fn overrides_and_defines_also_determine_the_integrator() {
        let transparent = Overrides {
            background: Some(Background::Transparent),
            ..Overrides::default()
        };
        assert!(load("", &transparent).render.alpha);
        let define = |text: &str| Overrides {
            define: vec![text.parse::<Define>().unwrap()],
            ..Overrides::default()
        };
        let emissive = load("", &define("materials.red.emission=[1, 1, 1]"));
        assert_eq!(emissive.render.integrator, Integrator::Path);
        assert!(
            emissive.notes[0]
                .message
                .starts_with("render.integrator is not set; using \"path\", which materials.red.emission requires")
        );
        // A specified integrator is kept without a note.
        let specified = load("environment.color = [1, 1, 1]\n", &define("render.integrator=path"));
        assert!(
            !specified.notes.iter().any(|note| note.message.contains("integrator: ")),
            "{:?}",
            specified.notes
        );
    }

    #[test]
    fn an_unspecified_integrator_stays_unspecified() {
        let text = format!("{SCENE}environment.color = [1, 1, 1]\n");
        let description = crate::Description::parse(&text, "s.toml").unwrap();
        assert_eq!(
            (description.render.integrator, description.integrator()),
            (None, Integrator::Path)
        );
        let written = description.to_toml().unwrap();
        assert!(!written.contains("integrator"), "{written}");
        assert_eq!(crate::Description::parse(&written, "s.toml").unwrap(), description);
    }
}
