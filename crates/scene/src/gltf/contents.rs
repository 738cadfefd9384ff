//! Names of the scenes, cameras, animations, variants, materials and images of a glTF file.

use serde::Serialize;
use serde_json::Value;

use super::document::Document;
use super::uri;

/// The names in a glTF file, in the order of the indices that options accept; `None` for entries without a name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ModelContents {
    /// Name of the file.
    pub file: String,
    /// Scenes.
    pub scenes: Vec<Option<String>>,
    /// Cameras of the selected scene.
    pub cameras: Vec<Option<String>>,
    /// Animations.
    pub animations: Vec<Option<String>>,
    /// Material variants.
    pub variants: Vec<Option<String>>,
    /// Materials.
    pub materials: Vec<Option<String>>,
    /// Images; the URI of the file if an image has no name.
    pub images: Vec<Option<String>>,
}

impl ModelContents {
    /// Lists the names in a file, except for those of cameras: `import` adds the cameras of the selected scene.
    pub(super) fn of(document: &Document) -> ModelContents {
        let json = &document.json;
        let file = document.path.file_name().unwrap_or_default();
        let extensions = json.extensions.as_ref();
        let variants = extensions.and_then(|all| all.others.get("KHR_materials_variants")?.get("variants")?.as_array());
        let name = |variant: &Value| variant.get("name").and_then(Value::as_str).map(str::to_owned);
        ModelContents {
            file: file.to_string_lossy().into_owned(),
            scenes: json.scenes.iter().map(|scene| scene.name.clone()).collect(),
            cameras: Vec::new(),
            animations: json.animations.iter().map(|animation| animation.name.clone()).collect(),
            variants: variants.into_iter().flatten().map(name).collect(),
            materials: json.materials.iter().map(|material| material.name.clone()).collect(),
            images: (json.images.iter())
                .map(|image| {
                    image
                        .name
                        .clone()
                        .or_else(|| image.uri.clone().filter(|name| !uri::is_data(name)))
                })
                .collect(),
        }
    }
}
