//! Twin of `shaders/lobe.wgsl`: microfacet lobes.

use glam::{Vec2, Vec3};

use super::ggx::{ggx_albedo_along, ggx_d, ggx_length};
use super::lanes::{MaterialFields, Real, Vector2, Vector3, constant};
use super::math::{atan2, cross, dot, max, min, normalize, sine};
use super::primitive::Tangents;
use super::surface::Surface;
use super::warp::frame_around;
use crate::records::{Material, SMALLEST_ALPHA};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeSample<F: Real = f32> {
    pub wi: F::Vec3,
    pub weight: F::Vec3,
    pub pdf: F,
    pub eta: F,
}

#[inline(always)]
pub fn plain_alpha<F: Real, M: MaterialFields<Real = F>>(material: &M) -> F::Vec2 {
    let (roughness, anisotropy) = (material.roughness(), material.anisotropy());
    let alpha_v = roughness * roughness;
    let alpha_u = alpha_v + (constant(1.0) - alpha_v) * (anisotropy * anisotropy);
    Vector2::new(alpha_u, alpha_v)
}

pub fn is_polished(material: &Material) -> bool {
    plain_alpha(material).x < SMALLEST_ALPHA
}

#[inline(always)]
pub fn facet_alpha<F: Real, M: MaterialFields<Real = F>>(material: &M) -> F::Vec2 {
    let alpha = plain_alpha(material);
    let smallest = alpha.x().splat(SMALLEST_ALPHA);
    Vector2::new(max(alpha.x(), smallest), max(alpha.y(), smallest))
}

pub fn lobe_frame(surface: &Surface, rotation: f32) -> Tangents {
    let n = surface.shading_normal;
    let tangent = surface.du - n * dot(n, surface.du);
    let length2 = dot(tangent, tangent);
    let is_usable = (length2 > 1e-12 * dot(surface.du, surface.du)) & (length2 < 1e30);
    let fallback = frame_around(n);
    let first = if is_usable {
        tangent * (1.0 / max(length2, 1e-30).sqrt())
    } else {
        fallback.u
    };
    let perpendicular = cross(n, first);
    let second = perpendicular
        * if dot(perpendicular, surface.dv) >= 0.0 {
            1.0
        } else {
            -1.0
        };
    let u = normalize(first * sine(rotation + 0.5) + second * sine(rotation));
    Tangents { u, v: cross(n, u) }
}

pub fn direction_turn(color: Vec3) -> f32 {
    atan2(2.0 * color.y - 1.0, 2.0 * color.x - 1.0) * std::f32::consts::FRAC_1_PI
}

#[inline(always)]
pub fn vector_to_lobe<V: Vector3>(frame: Tangents<V>, n: V, w: V) -> V {
    V::new(dot(frame.u, w), dot(frame.v, w), dot(n, w))
}

#[inline(always)]
pub fn vector_from_lobe<V: Vector3>(frame: Tangents<V>, n: V, w: V) -> V {
    frame.u * w.x() + frame.v * w.y() + n * w.z()
}

#[inline(always)]
pub fn half_vector<V: Vector3>(wo: V, wi: V) -> V {
    let sum = wo + wi;
    let length2 = dot(sum, sum);
    let unit = sum * (constant(1.0) / length2.sqrt());
    V::select(sum.broadcast(Vec3::Z), unit, length2.gt(length2.splat(1e-20)))
}

#[inline(always)]
pub fn facet_eval<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, wi: V) -> V::Real {
    let o = wo.z().abs();
    let i = wi.z().abs();
    let masking = constant(0.5) * i / max(o * ggx_length(alpha, wi) + i * ggx_length(alpha, wo), o.splat(1e-30));
    ggx_d(alpha, half_vector(wo, wi)) * masking
}

#[inline(always)]
pub fn facet_pdf<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, wi: V) -> V::Real {
    let length = ggx_length(alpha, wo);
    ggx_d(alpha, half_vector(wo, wi)) * 0.5 / max(wo.z() + length, length.splat(1e-30))
}

#[inline(always)]
pub fn facet_weight<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, wi: V) -> V::Real {
    let length = ggx_length(alpha, wo);
    wi.z() * (wo.z() + length) / max(wo.z() * ggx_length(alpha, wi) + wi.z() * length, length.splat(1e-30))
}

pub fn aniso_table_position(alpha: Vec2, w: Vec3) -> Vec2 {
    let x = alpha.x * w.x;
    let y = alpha.y * w.y;
    let square = (x * x + y * y) / max(w.x * w.x + w.y * w.y, 1e-30);
    let roughness = max(square.sqrt(), alpha.y);
    let line = min((roughness - alpha.y) / max(alpha.x - alpha.y, 1e-6), 1.0).sqrt();
    let half_way = 0.5 * roughness.sqrt();
    let cosine = min(max(w.z, 0.0), 1.0);
    Vec2::new(line, 0.5 * (cosine + cosine * (1.0 + half_way) / (cosine + half_way)))
}

#[inline(always)]
pub fn facet_loss<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V) -> V::Real {
    let albedo = ggx_albedo_along(alpha, wo);
    let excess = constant(1.0) / (albedo.x() + albedo.y()) - 1.005;
    max(excess, excess.splat(0.0))
}
