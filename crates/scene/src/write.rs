//! Writes scenes as short TOML files, without defaults. The TOML file's folder is the base of relative file names.

use std::io;
use std::path::{Component, Path};

use serde::Serialize;
use toml::{Table, Value};

use super::{Description, RenderDescription, ShapeDescription, TextureDescription, ViewTransform};

/// Default values of keys, except for the keys of `[render]`.
const DEFAULTS: &str = "up = [0.0, 0.0, 1.0]\nfocal_length = 1.0\nblades = 0\nblade_rotation = 0.0\nexposure = 0.0\n\
                        lights = true\nscale = 1.0\nvisible = true\n";

impl Description {
    /// Formats a scene file that parses to this description.
    ///
    /// # Errors
    ///
    /// The description contains values that TOML does not support.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let text = self.sections()?;
        match Description::parse(&text, "") {
            Ok(read) if read == *self => Ok(text),
            _ => toml::to_string(&Table::try_from(self)?), // with all keys
        }
    }

    fn sections(&self) -> Result<String, toml::ser::Error> {
        let mut defaults: Table = toml::from_str(DEFAULTS).unwrap_or_default();
        let transform = Value::try_from(ViewTransform::default())?;
        defaults.insert("view_transform".to_owned(), transform);
        let render = Table::try_from(RenderDescription::default())?;
        let no_defaults = Table::new();
        let mut sections = vec![
            section("image", &self.image, &defaults)?,
            section("camera", &self.camera, &defaults)?,
            section("render", &self.render, &render)?,
        ];
        if let Some(environment) = &self.environment {
            sections.push(section("environment", environment, &defaults)?);
        }
        for (section_name, tables) in [
            ("textures", Table::try_from(&self.textures)?),
            ("materials", Table::try_from(&self.materials)?),
            ("meshes", Table::try_from(&self.meshes)?),
        ] {
            if !tables.is_empty() {
                sections.push(toml::to_string(&Table::from_iter([(
                    section_name.to_owned(),
                    Value::Table(tables),
                )]))?);
            }
        }
        for light in &self.lights {
            sections.push(element("lights", light, &no_defaults)?);
        }
        for shape in &self.shapes {
            let is_gltf = matches!(shape, ShapeDescription::Gltf(_));
            let text = element("shapes", shape, if is_gltf { &defaults } else { &no_defaults })?;
            let comment = "# Meshes with their materials, and lights. A table `materials` replaces materials of the file by materials\n\
                        # of this scene, by name.\n";
            sections.push(format!("{}{text}", if is_gltf { comment } else { "" }));
        }
        for instance in &self.instances {
            sections.push(element("instances", instance, &no_defaults)?);
        }
        Ok(sections.join("\n"))
    }

    /// Moves the scene to another folder by making file names relative to `new_folder`. Names that do not refer to a
    /// file are unchanged.
    ///
    /// # Errors
    ///
    /// A folder does not exist, or a name is not UTF-8.
    pub fn in_folder(mut self, old_folder: &Path, new_folder: &Path) -> io::Result<Description> {
        let current = Path::new(".");
        let canonical = |folder: &Path| if folder.as_os_str().is_empty() { current } else { folder }.canonicalize();
        let (old_folder, new_folder) = (canonical(old_folder)?, canonical(new_folder)?);
        for name in self.file_names() {
            if old_folder == new_folder && !Path::new(name).is_absolute() {
                continue;
            }
            let path = old_folder.join(&*name);
            let (Some(parent), Some(file)) = (path.parent(), path.file_name()) else {
                continue;
            };
            let path = parent.canonicalize()?.join(file);
            *name = relative_path(&new_folder, &path).ok_or_else(|| {
                let message = format!("{} must be UTF-8 to be named in a scene", path.display());
                io::Error::new(io::ErrorKind::InvalidData, message)
            })?;
        }
        Ok(self)
    }

    fn file_names(&mut self) -> Vec<&mut String> {
        let mut names = Vec::new();
        names.extend(self.textures.values_mut().filter_map(|texture| match texture {
            TextureDescription::Image(image) => Some(&mut image.file),
            _ => None,
        }));
        names.extend(self.shapes.iter_mut().filter_map(|shape| match shape {
            ShapeDescription::Mesh(mesh) => Some(&mut mesh.file),
            ShapeDescription::Gltf(gltf) => Some(&mut gltf.file),
            _ => None,
        }));
        names.extend(self.meshes.values_mut().map(|mesh| &mut mesh.file));
        names.extend(
            self.environment
                .iter_mut()
                .filter_map(|environment| environment.file.as_mut()),
        );
        names
    }
}

/// Keys that are written first; other keys follow in alphabetical order.
const FIRST_KEYS: [&str; 5] = ["type", "file", "width", "position", "integrator"];

/// Writes a section without values that equal the defaults.
fn section(name: &str, value: &impl Serialize, defaults: &Table) -> Result<String, toml::ser::Error> {
    format_table(&format!("[{name}]\n"), name, value, defaults, Value::Table)
}

fn element(name: &str, value: &impl Serialize, defaults: &Table) -> Result<String, toml::ser::Error> {
    let list = |table| Value::Array(vec![Value::Table(table)]);
    format_table(&format!("[[{name}]]\n"), name, value, defaults, list)
}

fn format_table(
    header: &str,
    name: &str,
    value: &impl Serialize,
    defaults: &Table,
    nested: impl Fn(Table) -> Value,
) -> Result<String, toml::ser::Error> {
    let mut table = Table::try_from(value)?;
    table.retain(|key, value| defaults.get(key) != Some(value));
    let mut text = header.to_owned();
    for key in FIRST_KEYS {
        if let Some(value) = table.remove(key) {
            text += &toml::to_string(&Table::from_iter([(key.to_owned(), value)]))?;
        }
    }
    let rest = toml::to_string(&Table::from_iter([(name.to_owned(), nested(table))]))?;
    Ok(text + rest.strip_prefix(header).unwrap_or(&rest))
}

/// Returns the path of a file relative to a folder, with `/` as separator; `None` if no such path exists, or if the
/// path is not UTF-8. The paths `folder` and `path` are canonical.
pub(super) fn relative_path(folder: &Path, path: &Path) -> Option<String> {
    let (folder, path): (Vec<_>, Vec<_>) = (folder.components().collect(), path.components().collect());
    let common = folder.iter().zip(&path).take_while(|(a, b)| a == b).count();
    let up = folder[common..].iter().map(|_| Some(".."));
    let down = path[common..].iter().map(|part| match part {
        Component::Normal(name) => name.to_str(),
        _ => None, // another drive
    });
    let parts: Vec<&str> = up.chain(down).collect::<Option<_>>()?;
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests all scenes of the project.
    #[test]
    fn written_scenes_parse_to_the_same_description() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let mut count = 0;
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            let description = Description::parse(&std::fs::read_to_string(&path).unwrap(), "s.toml").unwrap();
            let text = description.sections().unwrap();
            assert_eq!(Description::parse(&text, "s.toml").unwrap(), description, "{text}");
            assert_eq!(description.to_toml().unwrap(), text);
            count += 1;
        }
        assert!(count > 10);
    }

    #[test]
    fn a_gltf_scene_is_written_without_defaults() {
        let camera = crate::PerspectiveDescription::new([0.1, -5.0, 1e-7], [0.0; 3], 35.0);
        let description = Description::new(1024, 512, camera)
            .with_environment(super::super::EnvironmentDescription::named(
                super::super::EnvironmentName::Studio,
            ))
            .with_shape(ShapeDescription::Gltf(super::super::GltfDescription::new("a b.glb")));
        let text = description.to_toml().unwrap();
        assert_eq!(
            text,
            "[image]\nwidth = 1024\nheight = 512\n\n\
             [camera]\ntype = \"perspective\"\nposition = [0.1, -5.0, 0.0000001]\nfov = 35.0\nlook_at = [0.0, 0.0, 0.0]\n\n\
             [render]\n\n[environment]\nname = \"studio\"\n\n\
             # Meshes with their materials, and lights. A table `materials` replaces materials of the file by materials\n\
             # of this scene, by name.\n\
             [[shapes]]\ntype = \"gltf\"\nfile = \"a b.glb\"\n"
        );
        assert_eq!(Description::parse(&text, "s.toml").unwrap(), description);
    }

    #[test]
    fn file_names_become_relative_to_the_new_folder() {
        let root = tempfile::tempdir().unwrap();
        for folder in ["a/b", "c"] {
            std::fs::create_dir_all(root.path().join(folder)).unwrap();
        }
        let moved_name = |file: &str, old_folder: &str, new_folder: &str| {
            let camera = crate::PerspectiveDescription::new([0.0, -5.0, 0.0], [0.0; 3], 35.0);
            let shape = ShapeDescription::Gltf(super::super::GltfDescription::new(file));
            let description = Description::new(1, 1, camera).with_shape(shape);
            let moved = description.in_folder(&root.path().join(old_folder), &root.path().join(new_folder));
            match moved.unwrap().shapes.remove(0) {
                ShapeDescription::Gltf(gltf) => gltf.file,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(moved_name("x.glb", "a", "a"), "x.glb");
        assert_eq!(moved_name("b/../x.glb", "a", "a"), "b/../x.glb");
        assert_eq!(moved_name("x.glb", "a/b", "a"), "b/x.glb");
        assert_eq!(moved_name("x.glb", "a/b", ""), "a/b/x.glb");
        assert_eq!(moved_name("x.glb", "a", "a/b"), "../x.glb");
        assert_eq!(moved_name("x.glb", "a/b", "c"), "../a/b/x.glb");
        assert_eq!(moved_name("../x.glb", "a/b", "c"), "../a/x.glb");
        let absolute = root.path().join("a/b/x.glb").display().to_string();
        assert_eq!(moved_name(&absolute, "c", "a"), "b/x.glb");
        assert_eq!(moved_name(&absolute, "a", "a"), "b/x.glb");
    }
}
