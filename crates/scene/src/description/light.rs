//! Lights of scene files.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::tagged::{Tagged, tagged};
use crate::description::kinds::*;

tagged! {
    /// A light. The key `type` selects the variant.
    #[non_exhaustive]
    LightDescription {
        /// An area light.
        "rectangle" => Rectangle(RectangleLightDescription),
        /// A point light.
        "point" => Point(PointLightDescription),
        /// A directional light.
        "directional" => Directional(DirectionalLightDescription),
        /// A spot light.
        "spot" => Spot(SpotLightDescription),
    }
}

/// A rectangular area light. With `integrator = "path"`, only the side of its normal emits light; otherwise both sides.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleLightDescription {
    /// Center.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Lengths along the tangent and the bitangent.
    #[schemars(with = "Size")]
    pub size: [f64; 2],
    /// Normal. Under `"path"` only this side emits.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Direction of the first edge. If absent, x, or y if the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
    /// Radiance under `"path"`; under `"phong"`, the light color of Phong's formula, which does
    /// not decrease with distance.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
    /// Visible to the camera.
    #[serde(default = "default_true")]
    pub visible: bool,
}

fn default_true() -> bool {
    true
}

impl RectangleLightDescription {
    /// Creates a light. `size` contains the lengths along the tangent and the bitangent; `color` is linear RGB.
    pub fn new(
        center: impl Into<DVec3>,
        size: [f64; 2],
        normal: impl Into<DVec3>,
        tangent: impl Into<DVec3>,
        color: impl Into<DVec3>,
    ) -> Self {
        Self {
            center: center.into(),
            size,
            normal: normal.into(),
            tangent: Some(tangent.into()),
            color: color.into(),
            visible: default_true(),
        }
    }
}

/// A point light. With `integrator = "path"`, light falls off with the square of the distance.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointLightDescription {
    /// Position.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// Radiant intensity under `"path"`; under `"phong"`, the light color of Phong's formula, which does
    /// not decrease with distance.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
}

impl PointLightDescription {
    /// Creates a light. `color` is linear RGB.
    pub fn new(position: impl Into<DVec3>, color: impl Into<DVec3>) -> Self {
        Self {
            position: position.into(),
            color: color.into(),
        }
    }
}

/// A directional light.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLightDescription {
    /// Direction of propagation: `[0, 0, -1]` is light from straight above.
    #[schemars(with = "Vector")]
    pub direction: DVec3,
    /// Irradiance under `"path"`; under `"phong"`, the light color of Phong's formula.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
}

impl DirectionalLightDescription {
    /// Creates a light. `direction` is the direction of propagation; `color` is linear RGB.
    pub fn new(direction: impl Into<DVec3>, color: impl Into<DVec3>) -> Self {
        Self {
            direction: direction.into(),
            color: color.into(),
        }
    }
}

/// A spot light, with either `direction` or `look_at`. With `integrator = "path"`, light falls off with the square of
/// the distance.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotLightDescription {
    /// Position.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// Direction of the axis, away from the light.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub direction: Option<DVec3>,
    /// A point on the axis, in front of the light; at least 1e-9 from `position`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>")]
    pub look_at: Option<DVec3>,
    /// Radiant intensity on the axis under `"path"`; under `"phong"`, the light color of Phong's formula on the axis.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
    /// Angle between axis and edge of the cone, in degrees.
    #[schemars(with = "ConeAngle")]
    pub cone_angle: f64,
    /// Angle between the axis and the start of the falloff, in degrees; at most `cone_angle`.
    #[serde(default)]
    #[schemars(with = "InnerAngle")]
    pub inner_angle: f64,
}

impl SpotLightDescription {
    /// Creates a light. `color` is linear RGB; `cone_angle` is the angle between axis and edge, in degrees.
    pub fn new(
        position: impl Into<DVec3>,
        look_at: impl Into<DVec3>,
        color: impl Into<DVec3>,
        cone_angle: f64,
    ) -> Self {
        Self {
            position: position.into(),
            direction: None,
            look_at: Some(look_at.into()),
            color: color.into(),
            cone_angle,
            inner_angle: 0.0,
        }
    }
}
