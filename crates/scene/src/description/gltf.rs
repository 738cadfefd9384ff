//! What a scene file says of glTF files.

use std::collections::BTreeMap;
use std::fmt;

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Rotation, Scale};
use crate::description::kinds::{Matrix, Place, Point, Seconds};

/// A glTF file: its meshes with their materials and textures, and its lights.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("not" = { "required": ["matrix"], "anyOf": [{ "required": ["scale"] }, { "required": ["rotate"] }, { "required": ["translate"] }] }))]
pub struct GltfDescription {
    /// The file, relative to the scene file's folder.
    #[schemars(length(min = 1))]
    pub file: String,
    /// Which of its scenes; absent, the one that the file names, else the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<Selection>,
    /// At which second of an animation it is; absent, as it is without animations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Seconds>")]
    pub time: Option<f64>,
    /// Which of its animations; absent, the first, where a time is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub animation: Option<Selection>,
    /// Which of its variants of materials; absent, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<Selection>,
    /// Whether its lights are lit.
    #[serde(default = "yes")]
    pub lights: bool,
    /// Names of the scene's materials by those of the file's that they stand in for.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, String>,
    /// Added to its coordinates, after all else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>", extend("default" = [0, 0, 0]))]
    pub translate: Option<DVec3>,
    /// How it is turned, after it was scaled: by three angles about x, y and z, or by one about an axis, each from -360 to 360 degrees. If
    /// absent, not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<Rotation>,
    /// Factors of its coordinates, one or three, each from 1e-6 to 1e6 or negative.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 1))]
    pub scale: Option<Scale>,
    /// The rows of an affine map, in place of `scale`, `rotate` and `translate`. None if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Matrix>")]
    pub matrix: Option<Vec<[f64; 4]>>,
}

impl GltfDescription {
    /// A file, relative to the scene file's folder, as it is.
    pub fn new(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            scene: None,
            time: None,
            animation: None,
            variant: None,
            lights: yes(),
            materials: BTreeMap::new(),
            translate: None,
            rotate: None,
            scale: None,
            matrix: None,
        }
    }
}

/// One of several things, by its number, from 0, or its name.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "must be a name or a number, from 0")]
pub enum Selection {
    /// Its place in the list.
    Number(#[schemars(with = "Place")] u32),
    /// Its name.
    Name(String),
}

impl Selection {
    /// The index of the first of these names that is meant. A name of digits goes before a number.
    pub(crate) fn among(&self, names: &[Option<&str>]) -> Option<usize> {
        let named = |wanted: &str| names.iter().position(|name| *name == Some(wanted));
        match self {
            Selection::Name(name) => named(name),
            Selection::Number(number) => {
                let place = usize::try_from(*number).ok().filter(|place| *place < names.len());
                named(&number.to_string()).or(place)
            }
        }
    }
}

impl From<&str> for Selection {
    /// A text as a command line has it: a number where it is one.
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

fn yes() -> bool {
    true
}
