//! Twin of `shaders/shadow.wgsl`.

use glam::{UVec2, Vec2, Vec3};

use super::lanes::{Real, Vector3};
use super::light::{LightSegments, segments_to_light, segments_to_local};
use super::math::dot;
use super::primitive::{occludes, solid_levels};
use super::ray::vector_to_local;
use super::samples::{LEVEL, Samples, occluded_directions};
use super::sampling::sample_square;
use super::traversal::Directions;
use crate::records::{Light, Primitive, Sphere};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleBlock {
    pub pattern: u32,
    pub side: u32,
    pub first: u32,
    pub count: u32,
    pub group: u32,
    pub key: UVec2,
}

#[inline(always)] // compiled for each kind
pub fn occlusion_mask(kind: u32, q: &Primitive, p: Vec3, from_inside: bool, light: &Light, block: SampleBlock) -> u32 {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let levels = solid_levels(kind, q, from_anchor, from_inside);
    let segments = segments_to_local(q, segments_to_light(light, p));
    let mut directions = Directions::EMPTY;
    Samples::of(block).write_segments(*LEVEL, segments, &mut directions);
    occluded_directions(kind, o, &directions, levels, light.t_max)
}

#[inline(always)] // compiled for each kind
pub fn occludes_segment<V: Vector3>(
    kind: u32,
    q: &Primitive,
    p: V,
    from_inside: <V::Real as Real>::Mask,
    to_light: V,
    t_max: V::Real,
) -> <V::Real as Real>::Mask {
    let from_anchor = vector_to_local(q, p - p.broadcast(q.anchor));
    let levels = solid_levels(kind, q, from_anchor, from_inside);
    occludes(
        kind,
        from_anchor - from_anchor.broadcast(q.middle),
        vector_to_local(q, to_light),
        levels,
        t_max,
    )
}

pub fn block_sample(block: SampleBlock, i: u32) -> Vec2 {
    sample_square(block.pattern, block.side, block.first + i, block.group, block.key)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowFrustum {
    pub apex: Vec3,
    pub segments: LightSegments,
    pub length2: f32,
    pub inverse_depth: f32,
}

pub fn light_frustum(light: &Light, p: Vec3) -> ShadowFrustum {
    let segments = segments_to_light(light, p);
    let length2 = dot(segments.towards, segments.towards);
    let depth = length2 - dot(segments.towards, segments.u).abs() - dot(segments.towards, segments.v).abs();
    ShadowFrustum {
        apex: p,
        segments,
        length2,
        inverse_depth: if depth > 0.0 { 1.0 / depth } else { -1.0 },
    }
}

pub fn may_block(sphere: &Sphere, frustum: &ShadowFrustum) -> bool {
    let w = sphere.center - frustum.apex;
    let along = dot(w, frustum.segments.towards);
    let m = w - frustum.segments.towards * (along / frustum.length2);
    let m2 = dot(m, m);
    let slope = (dot(m, frustum.segments.u).abs() + dot(m, frustum.segments.v).abs()) * frustum.inverse_depth;
    let height = m2 - slope * along;
    let radius2 = sphere.radius * sphere.radius;
    (slope < 0.0) | (height <= 0.0) | (height * height <= radius2 * (m2 + slope * slope * frustum.length2))
}
