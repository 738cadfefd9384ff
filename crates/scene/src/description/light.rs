//! What a scene file says of lights.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::tables::ReadError;
use super::tagged::{Tagged, tagged};
use crate::description::kinds::{ConeAngle, InnerAngle, Point, Rgb, Size, Vector};

tagged! {
    /// `[[lights]]`
    LightDescription {
        /// An area light.
        "rectangle" => Rectangle(RectangleLightDescription),
        /// Light from one point.
        "point" => Point(PointLightDescription),
        /// Light from infinitely far away.
        "directional" => Directional(DirectionalLightDescription),
        /// A cone of light from one point.
        "spot" => Spot(SpotLightDescription),
    }
}

/// A rectangle that shines to both sides.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleLightDescription {
    /// The middle.
    #[schemars(with = "Point")]
    pub center: DVec3,
    /// Lengths along the tangent and along the bitangent.
    #[schemars(with = "Size")]
    pub size: [f64; 2],
    /// Perpendicular to the rectangle; any length.
    #[schemars(with = "Vector")]
    pub normal: DVec3,
    /// Along the first edge; any length. If absent, x, or y where the normal is nearly along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub tangent: Option<DVec3>,
    /// Linear RGB.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
    /// Whether the camera sees it.
    #[serde(default = "yes")]
    pub visible: bool,
}

fn yes() -> bool {
    true
}

impl RectangleLightDescription {
    /// A light of this middle, size along tangent and bitangent, normal, tangent and linear RGB.
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
            visible: yes(),
        }
    }
}

/// Light from one point, without falloff.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointLightDescription {
    /// Where it is.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// Linear RGB.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
}

impl PointLightDescription {
    /// A light at this position, of linear RGB.
    pub fn new(position: impl Into<DVec3>, color: impl Into<DVec3>) -> Self {
        Self {
            position: position.into(),
            color: color.into(),
        }
    }
}

/// Light from infinitely far away.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLightDescription {
    /// In which the light travels; any length.
    #[schemars(with = "Vector")]
    pub direction: DVec3,
    /// Linear RGB.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
}

impl DirectionalLightDescription {
    /// Light that travels in this direction, of linear RGB.
    pub fn new(direction: impl Into<DVec3>, color: impl Into<DVec3>) -> Self {
        Self {
            direction: direction.into(),
            color: color.into(),
        }
    }
}

/// A cone of light from one point, without falloff with the distance. It has a direction or looks at a point.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotLightDescription {
    /// Where it is.
    #[schemars(with = "Point")]
    pub position: DVec3,
    /// In which the middle of its light travels; any length.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vector>")]
    pub direction: Option<DVec3>,
    /// The point that the middle of its light goes to.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Point>")]
    pub look_at: Option<DVec3>,
    /// Linear RGB in the middle.
    #[schemars(with = "Rgb")]
    pub color: DVec3,
    /// From the middle to where its light ends, in degrees.
    #[schemars(with = "ConeAngle")]
    pub cone_angle: f64,
    /// From the middle to where its light begins to fall off, in degrees.
    #[serde(default)]
    #[schemars(with = "InnerAngle")]
    pub inner_angle: f64,
}

impl SpotLightDescription {
    /// A light at this position that shines towards a point, of linear RGB and this angle in degrees between its middle and its edge.
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
