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

pub fn segments_to_local(q: &Primitive, segments: LightSegments) -> LightSegments {
    LightSegments {
        towards: vector_to_local(q, segments.towards),
        u: vector_to_local(q, segments.u),
        v: vector_to_local(q, segments.v),
    }
}

pub fn segment(segments: LightSegments, at: Vec2) -> Vec3 {
    segments.towards + segments.u * (2.0 * at.x - 1.0) + segments.v * (2.0 * at.y - 1.0)
}

pub fn spot_falloff(light: &Light, to_light: Vec3) -> f32 {
    let difference = normalize(to_light) + light.normal;
    let ramp = (light.cone - 0.5 * dot(difference, difference)) * light.falloff;
    let bounded = min(max(ramp, 0.0), 1.0);
    bounded * bounded
}
