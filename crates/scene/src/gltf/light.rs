//! glTF lights (KHR_lights_punctual). As in three.js, values in candela are used as intensity and values in lux as
//! irradiance, without conversion.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use serde::Deserialize;

use super::UPRIGHT;
use super::document::Document;
use super::error::{GltfError, plain};
use crate::{DirectionalLightDescription, LightDescription, PointLightDescription, SpotLightDescription};

const BRIGHTEST: f64 = 1e6;

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
        let of_node = self.json.nodes[node].extensions.as_ref();
        let Some(of_node) = of_node.and_then(|all| all.others.get(NAME)) else {
            return Ok(None);
        };
        let all = self.json.extensions.as_ref();
        let lights = all.and_then(|all| all.others.get(NAME)?.get("lights")?.as_array());
        let number = of_node.get("light").and_then(serde_json::Value::as_u64);
        let found = number.and_then(|i| lights?.get(usize::try_from(i).ok()?));
        let Some((number, light)) = number.zip(found) else {
            let rule = "refers to a light that does not exist".to_owned();
            return Err(self.fault(format!("nodes[{node}].extensions.{NAME}.light"), rule));
        };
        let place = format!("extensions.{NAME}.lights[{number}]");
        let light = Light::deserialize(light).map_err(|error| self.fault(&place, plain(&error)))?;
        if light.range.is_some() {
            note(
                notes,
                format!("{NAME}: range is ignored; light falls off with the square of the distance"),
            );
        }
        let mut color = DVec3::from_array(light.color) * light.intensity;
        if color.min_element() < 0.0 {
            note(notes, format!("{place}: a negative intensity counts as 0"));
            color = color.max(DVec3::ZERO);
        }
        if !color.is_finite() {
            let rule = format!(
                "color {:?} times intensity {} must be finite",
                light.color, light.intensity
            );
            return Err(self.fault(&place, rule));
        }
        if color.max_element() > BRIGHTEST {
            note(notes, format!("{place}: the intensity is clamped to 1e6"));
            color *= BRIGHTEST / color.max_element();
            color = color.min(DVec3::splat(BRIGHTEST));
        }
        let map = UPRIGHT * *global;
        let position = map.translation;
        let direction = map.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
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
                    let rule = "its cone's angles must be 0 <= inner <= outer <= pi".to_owned();
                    return Err(self.fault(&place, rule));
                }
                // Allows for rounding: pi/2 in f32 exceeds 90 degrees.
                if outer > 90.001 {
                    note(
                        notes,
                        format!(
                            "{place}: spot.outerConeAngle is larger than pi/2, as it must not be; it is taken as it is"
                        ),
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
                    &place,
                    format!("type {other:?} must be \"directional\", \"point\" or \"spot\""),
                ));
            }
        }))
    }
}

/// Warns if a white surface at `middle` would be overexposed, as with physical units.
pub(super) fn brightness(lights: &[LightDescription], middle: DVec3) -> Option<String> {
    /// Maximum radiance without a warning.
    const MOST: f64 = 30.0;
    let irradiance = |light: &LightDescription| match light {
        LightDescription::Directional(light) => light.color,
        LightDescription::Point(light) => light.color / light.position.distance_squared(middle),
        LightDescription::Spot(light) => light.color / light.position.distance_squared(middle),
        LightDescription::Rectangle(_) => DVec3::ZERO,
    };
    let radiance = lights.iter().map(irradiance).sum::<DVec3>().max_element() / PI;
    let stops = radiance.log2().round();
    (radiance > MOST && stops.is_finite()).then(|| {
        format!(
            "its lights are bright: white in its middle shows as {radiance:.0}, where 1 is white. --exposure -{stops} takes that back"
        )
    })
}

/// Adds a note, unless it already exists or there are too many notes.
pub(super) fn note(notes: &mut Vec<String>, note: String) {
    const MOST: usize = 200;
    let is_room = notes.len() < MOST;
    let note = if is_room {
        note
    } else {
        "and more of the kind".to_owned()
    };
    if notes.len() <= MOST && !notes.contains(&note) {
        notes.push(note);
    }
}
