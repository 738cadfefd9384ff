//! glTF textures (section 3.8) with KHR_texture_basisu, KHR_texture_transform and EXT_texture_webp.

use gltf_json::texture::{MagFilter, WrappingMode};
use gltf_json::validation::Checked;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::document::Document;
use super::error::{GltfError, json_message, key_within};
use crate::tree;
use crate::{Encoding, ImageTextureDescription, TextureFilter, Wrap};

/// Limits of texture transforms: a scale whose magnitude is below the first value is replaced by this value; scales and
/// offsets whose magnitude exceeds the second value are rejected.
const SCALE_LIMITS: (f64, f64) = (1e-6, 1e6);

/// Maximum index of a texture coordinate set.
pub(super) const MAX_SET: u32 = 7;

/// A texture reference of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Slot {
    pub texture: usize,
    pub set: u32,
    pub transform: Transform,
}

/// KHR_texture_transform.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct Transform {
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
    tex_coord: Option<u32>,
}

impl Default for Transform {
    fn default() -> Self {
        Transform {
            offset: [0.0; 2],
            rotation: 0.0,
            scale: [1.0; 2],
            tex_coord: None,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct TextureInfo {
    index: usize,
    #[serde(default)]
    tex_coord: u32,
    #[serde(default)]
    extensions: Map<String, Value>,
    scale: Option<f64>,
}

impl Slot {
    /// Creates the slot of a texture reference from core glTF (not from an extension).
    pub fn new(
        document: &Document,
        location: &str,
        (texture, set): (usize, u32),
        extensions: Option<&Map<String, Value>>,
    ) -> Result<Slot, GltfError> {
        let transform = match extensions.and_then(|all| all.get("KHR_texture_transform")) {
            None => Transform::default(),
            Some(transform) => {
                let key = format!("{location}.extensions.KHR_texture_transform");
                tree::read(transform.clone())
                    .map_err(|error| document.fault(key_within(&key, &error), json_message(error)))?
            }
        };
        let count = document.json.textures.len();
        if texture >= count {
            return Err(document.fault(
                format!("{location}.index"),
                format!("{texture} is out of range; number of textures: {count}"),
            ));
        }
        let set = transform.tex_coord.unwrap_or(set);
        if set > MAX_SET {
            let rule = format!("{set} must be from 0 to {MAX_SET}");
            return Err(document.fault(format!("{location}.texCoord"), rule));
        }
        Ok(Slot {
            texture,
            set,
            transform,
        })
    }

    /// Creates the slot of a texture reference from an extension; also returns the `scale` of a normal map.
    pub fn of_value(document: &Document, location: &str, value: &Value) -> Result<(Slot, f64), GltfError> {
        let info: TextureInfo = tree::read(value.clone())
            .map_err(|error| document.fault(key_within(location, &error), json_message(error)))?;
        let slot = Slot::new(document, location, (info.index, info.tex_coord), Some(&info.extensions))?;
        Ok((slot, info.scale.unwrap_or(1.0)))
    }

    /// Returns the second row of the transform, and the determinant.
    pub fn second_row(&self) -> ([f64; 2], f64) {
        let Transform { rotation, scale, .. } = self.transform;
        let (sin, cos) = rotation.sin_cos();
        ([sin * scale[0], cos * scale[1]], scale[0] * scale[1])
    }

    /// Returns true if the transform contains a rotation or a reflection.
    pub fn rotates_tangents(&self) -> bool {
        let Transform { rotation, scale, .. } = self.transform;
        rotation != 0.0 || scale.iter().any(|scale| *scale < 0.0)
    }
}

impl Document {
    /// Returns the texture with its transform. In the top row of an image, v is 0 in glTF, but 1 in wgray, so the
    /// transform is flipped like the texture coordinates of the mesh.
    pub(super) fn lookup(
        &self,
        slot: &Slot,
        location: &str,
        file: &str,
        encoding: Encoding,
    ) -> Result<ImageTextureDescription, GltfError> {
        let texture = &self.json.textures[slot.texture];
        let sampler = texture
            .sampler
            .and_then(|sampler| self.json.samplers.get(sampler.value()));
        let wrap = |mode: Option<&Checked<WrappingMode>>| match mode {
            Some(Checked::Valid(WrappingMode::ClampToEdge)) => Wrap::Clamp,
            Some(Checked::Valid(WrappingMode::MirroredRepeat)) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let is_nearest = sampler.is_some_and(|sampler| sampler.mag_filter == Some(Checked::Valid(MagFilter::Nearest)));
        let Transform {
            offset,
            rotation,
            scale,
            ..
        } = slot.transform;
        let is_valid = |x: f64| x.is_finite() && x.abs() <= SCALE_LIMITS.1;
        if !(offset.into_iter().chain(scale).all(is_valid) && rotation.is_finite()) {
            let rule = "offset, rotation and scale must be finite, offset and scale from -1e6 to 1e6".to_owned();
            return Err(self.fault(format!("{location}.extensions.KHR_texture_transform"), rule));
        }
        let scale = scale.map(|x| if x.abs() < SCALE_LIMITS.0 { SCALE_LIMITS.0 } else { x });
        let (sin, cos) = rotation.sin_cos();
        Ok(ImageTextureDescription {
            encoding: Some(encoding),
            wrap: [wrap(sampler.map(|s| &s.wrap_s)), wrap(sampler.map(|s| &s.wrap_t))].into(),
            filter: if is_nearest {
                TextureFilter::Nearest
            } else {
                TextureFilter::default()
            },
            scale,
            rotate: rotation.to_degrees() % 360.0,
            offset: [offset[0] + sin * scale[1], 1.0 - cos * scale[1] - offset[1]],
            uv_set: slot.set,
            ..ImageTextureDescription::new(file)
        })
    }
}
