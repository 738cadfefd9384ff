//! glTF lights (KHR_lights_punctual). As in three.js, values in candela are used as intensity and values in lux as
//! irradiance, without conversion.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use serde::Deserialize;

use super::UPRIGHT;
use super::document::Document;
use super::error::{GltfError, json_message, key_within};
use crate::tree;
use crate::{DirectionalLightDescription, LightDescription, PointLightDescription, SpotLightDescription};

const MAX_INTENSITY: f64 = 1e6;

#[derive(Deserialize)]
struct Light {
    #[serde(default = "white")]
    color: [f64; 3],
    #[serde(default = "one")]
    intensity: f64,
    #[serde(rename = "type")]
    kind: String,
    range: Option<f64>,
    #[serde(default)]
    spot: SpotCone,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpotCone {
    inner_cone_angle: f64,
    outer_cone_angle: f64,
}

impl Default for SpotCone {
    fn default() -> Self {
        SpotCone {
            inner_cone_angle: 0.0,
            outer_cone_angle: std::f64::consts::FRAC_PI_4,
        }
    }
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

fn one() -> f64 {
    1.0
}

impl Document {
    /// Returns the light of a node, which emits along its -Z axis.
    pub(super) fn light(
        &self,
        node: usize,
        global: &DAffine3,
        notes: &mut Vec<String>,
    ) -> Result<Option<LightDescription>, GltfError> {
        const NAME: &str = "KHR_lights_punctual";
        let node_extensions = self.json.nodes[node].extensions.as_ref();
        let Some(node_extension) = node_extensions.and_then(|all| all.others.get(NAME)) else {
            return Ok(None);
        };
        let extensions = self.json.extensions.as_ref();
        let lights = extensions.and_then(|all| all.others.get(NAME)?.get("lights")?.as_array());
        let light_index = node_extension.get("light").and_then(serde_json::Value::as_u64);
        let listed_light = light_index.and_then(|i| lights?.get(usize::try_from(i).ok()?));
        let Some((light_index, light)) = light_index.zip(listed_light) else {
            let rule = "refers to a light that does not exist".to_owned();
            return Err(self.fault(format!("nodes[{node}].extensions.{NAME}.light"), rule));
        };
        let location = format!("extensions.{NAME}.lights[{light_index}]");
        let light: Light = tree::read(light.clone())
            .map_err(|error| self.fault(key_within(&location, &error), json_message(error)))?;
        if light.range.is_some() {
            note(
                notes,
                format!("{NAME}: range is ignored; light falls off with the square of the distance"),
            );
        }
        let mut color = DVec3::from_array(light.color) * light.intensity;
        if color.min_element() < 0.0 {
            note(notes, format!("{location}: a negative intensity counts as 0"));
            color = color.max(DVec3::ZERO);
        }
        if !color.is_finite() {
            let rule = format!(
                "color {:?} times intensity {} must be finite",
                light.color, light.intensity
            );
            return Err(self.fault(&location, rule));
        }
        if color.max_element() > MAX_INTENSITY {
            note(notes, format!("{location}: the intensity is clamped to 1e6"));
            color *= MAX_INTENSITY / color.max_element();
            color = color.min(DVec3::splat(MAX_INTENSITY));
        }
        let to_world = UPRIGHT * *global;
        let position = to_world.translation;
        let direction = to_world.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
        if !position.is_finite() || direction == DVec3::ZERO && light.kind != "point" {
            note(
                notes,
                format!("nodes[{node}]: the light is skipped because the node has zero scale"),
            );
            return Ok(None);
        }
        Ok(Some(match light.kind.as_str() {
            "point" => PointLightDescription::new(position, color).into(),
            "directional" => DirectionalLightDescription::new(direction, color).into(),
            "spot" => {
                let [outer, inner] = [light.spot.outer_cone_angle, light.spot.inner_cone_angle].map(f64::to_degrees);
                if !(0.0..=180.0).contains(&outer) || !(0.0..=outer).contains(&inner) {
                    let rule = "the cone angles must satisfy 0 <= inner <= outer <= pi".to_owned();
                    return Err(self.fault(&location, rule));
                }
                // Allows for rounding: pi/2 in f32 exceeds 90 degrees.
                if outer > 90.001 {
                    note(
                        notes,
                        format!("{location}: spot.outerConeAngle exceeds the maximum of pi/2 and is used unchanged"),
                    );
                }
                SpotLightDescription {
                    direction: Some(direction),
                    look_at: None,
                    inner_angle: inner.min(outer.max(0.01)),
                    ..SpotLightDescription::new(position, DVec3::ZERO, color, outer.max(0.01))
                }
                .into()
            }
            other => {
                return Err(self.fault(
                    &location,
                    format!("type {other:?} must be \"directional\", \"point\" or \"spot\""),
                ));
            }
        }))
    }
}

/// Returns a warning if a white surface at `center` would be overexposed, for example by lights with physical units.
pub(super) fn overexposure(lights: &[LightDescription], center: DVec3) -> Option<String> {
    /// Maximum radiance without a warning.
    const MAX_RADIANCE: f64 = 30.0;
    let irradiance = |light: &LightDescription| match light {
        LightDescription::Directional(light) => light.color,
        LightDescription::Point(light) => light.color / light.position.distance_squared(center),
        LightDescription::Spot(light) => light.color / light.position.distance_squared(center),
        LightDescription::Rectangle(_) => DVec3::ZERO,
    };
    let radiance = lights.iter().map(irradiance).sum::<DVec3>().max_element() / PI;
    let stops = radiance.log2().round();
    (radiance > MAX_RADIANCE && stops.is_finite()).then(|| {
        format!(
            "the lights are bright: a white surface at the center of the scene has radiance {radiance:.0}, and 1 is \
             displayed as white. --exposure -{stops} compensates"
        )
    })
}

/// Adds a note, unless it already exists or there are too many notes.
pub(super) fn note(notes: &mut Vec<String>, note: String) {
    const MAX_NOTES: usize = 200;
    let has_room = notes.len() < MAX_NOTES;
    let note = if has_room {
        note
    } else {
        "further warnings are omitted".to_owned()
    };
    if notes.len() <= MAX_NOTES && !notes.contains(&note) {
        notes.push(note);
    }
}
