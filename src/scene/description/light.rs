//! What a scene file says of lights.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::Table;

use super::tagged::{ReadError, Tagged, tagged};

tagged! {
    /// `[[lights]]`
    LightDescription {
        /// An area light.
        "rectangle" => Rectangle(RectangleLightDescription),
        /// Light from one point.
        "point" => Point(PointLightDescription),
        /// Light from infinitely far away.
        "directional" => Directional(DirectionalLightDescription),
    }
}

/// A rectangle that shines to both sides.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleLightDescription {
    /// The middle.
    pub center: DVec3,
    /// Lengths along the tangent and along the bitangent.
    pub size: [f64; 2],
    /// Perpendicular to the rectangle; any length.
    pub normal: DVec3,
    /// Along the first edge; any length.
    pub tangent: DVec3,
    /// Linear RGB.
    pub color: DVec3,
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
            tangent: tangent.into(),
            color: color.into(),
        }
    }
}

/// Light from one point, without falloff.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PointLightDescription {
    /// Where it is.
    pub position: DVec3,
    /// Linear RGB.
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
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLightDescription {
    /// In which the light travels; any length.
    pub direction: DVec3,
    /// Linear RGB.
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
