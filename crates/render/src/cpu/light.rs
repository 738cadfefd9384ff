//! Twin of `shaders/light.wgsl`.

use glam::{Vec2, Vec3};

use super::math::{dot, max, min, normalize};
use super::ray::vector_to_local;
use crate::records::{Light, Primitive};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSegments {
    pub towards: Vec3,
    pub u: Vec3,
    pub v: Vec3,
}

pub fn segments_to_light(light: &Light, p: Vec3) -> LightSegments {
    LightSegments {
        towards: light.center - p * light.finite,
        u: light.u,
        v: light.v,
    }
}

pub fn segments_to_local(q: &Primitive, to: LightSegments) -> LightSegments {
    LightSegments {
        towards: vector_to_local(q, to.towards),
        u: vector_to_local(q, to.u),
        v: vector_to_local(q, to.v),
    }
}

pub fn segment(to: LightSegments, at: Vec2) -> Vec3 {
    to.towards + to.u * (2.0 * at.x - 1.0) + to.v * (2.0 * at.y - 1.0)
}

pub fn spot_falloff(light: &Light, to: Vec3) -> f32 {
    let away = normalize(to) + light.normal;
    let ramp = (light.cone - 0.5 * dot(away, away)) * light.falloff;
    let bounded = min(max(ramp, 0.0), 1.0);
    bounded * bounded
}
