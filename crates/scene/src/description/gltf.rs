//! glTF files as shapes of scene files.

use std::collections::BTreeMap;
use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Rotation, Scale};
use crate::description::kinds::*;

/// A glTF file: meshes with materials and textures, and lights.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("not" = { "required": ["matrix"], "anyOf": [{ "required": ["scale"] }, { "required": ["rotate"] }, { "required": ["translate"] }] }))]
pub struct GltfDescription {
    /// A .gltf or .glb file, relative to the scene file.
    #[schemars(length(min = 1))]
    pub file: String,
    /// Scene of the file. If absent, the file's default, else its first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<Selection>,
    /// Time of the animation in seconds. If absent, no animation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Seconds>")]
    pub time: Option<f64>,
    /// Animation of the file. If absent, the first if `time` is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub animation: Option<Selection>,
    /// Material variant of the file. If absent, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<Selection>,
    /// Use the lights of the file.
    #[serde(default = "default_true")]
    pub lights: bool,
    /// Materials of the scene that replace materials of the file, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, String>,
    /// Translation, applied last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>", extend("default" = [0, 0, 0]))]
    pub translate: Option<DVec3>,
    /// Rotation, applied after the scale: about x, y and z, or about one axis; each angle from -360 to 360 degrees. If
    /// absent, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<Rotation>,
    /// Factors, each from 1e-6 to 1e6, or from -1e6 to -1e-6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 1))]
    pub scale: Option<Scale>,
    /// Affine transform, which replaces `scale`, `rotate` and `translate`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Matrix>")]
    pub matrix: Option<Vec<[f64; 4]>>,
}

impl GltfDescription {
    /// Creates a shape with default settings. `file` is relative to the scene file's folder.
    pub fn new(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            scene: None,
            time: None,
            animation: None,
            variant: None,
            lights: default_true(),
            materials: BTreeMap::new(),
            translate: None,
            rotate: None,
            scale: None,
            matrix: None,
        }
    }
}

/// An element of a list, selected by name or by an index counted from 0.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "must be a name or an index, counted from 0")]
pub enum Selection {
    /// Index in the list.
    Number(#[schemars(with = "ListIndex")] u32),
    /// Name of the element.
    Name(String),
}

impl Selection {
    /// Returns the index of the selected element in a list of names. A number selects the first element with
    /// this number as its name, or, if none exists, the element at this index.
    pub(crate) fn among(&self, names: &[Option<&str>]) -> Option<usize> {
        let position = |selected: &str| names.iter().position(|name| *name == Some(selected));
        match self {
            Selection::Name(name) => position(name),
            Selection::Number(number) => {
                let index = usize::try_from(*number).ok().filter(|index| *index < names.len());
                position(&number.to_string()).or(index)
            }
        }
    }
}

impl From<&str> for Selection {
    /// Parses the text of an option: a number is an index, other text is a name.
    fn from(text: &str) -> Self {
        text.parse()
            .map_or_else(|_| Selection::Name(text.to_owned()), Selection::Number)
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Selection::Number(number) => write!(f, "{number}"),
            Selection::Name(name) => write!(f, "{name:?}"),
        }
    }
}

fn default_true() -> bool {
    true
}
