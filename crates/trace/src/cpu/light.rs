//! Twin of `shaders/light.wgsl`.

use glam::Vec3;

use super::lanes::{Real, Vector2, Vector3, constant};
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

#[inline(always)]
pub fn segment<V: Vector3>(segments: LightSegments, at: <V::Real as Real>::Vec2) -> V {
    let (x, y) = (constant(2.0) * at.x() - 1.0, constant(2.0) * at.y() - 1.0);
    let [towards, u, v] = [segments.towards, segments.u, segments.v].map(|v| x.broadcast(v));
    towards + u * x + v * y
}

pub fn spot_falloff(light: &Light, to_light: Vec3) -> f32 {
    let difference = normalize(to_light) + light.normal;
    let ramp = (light.cone - 0.5 * dot(difference, difference)) * light.falloff;
    let bounded = min(max(ramp, 0.0), 1.0);
    bounded * bounded
}
