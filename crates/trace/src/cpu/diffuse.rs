//! Twin of `shaders/diffuse.wgsl`: the material `diffuse`.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::lanes::{Real, Vector3};
use super::math::{atan2, dot, max};
use super::warp::hemisphere_sample;
use crate::records::Material;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles<F = f32> {
    pub wi: F,
    pub wo: F,
    pub between: F,
}

#[inline(always)]
pub fn angles_at<V: Vector3>(normal: V, wo: V, wi: V) -> Angles<V::Real> {
    Angles {
        wi: dot(normal, wi),
        wo: dot(normal, wo),
        between: dot(wi, wo),
    }
}

pub fn diffuse_eval(material: &Material, angles: Angles) -> Vec3 {
    material.diffuse * (max(angles.wi, 0.0) * FRAC_1_PI)
}

pub fn rough_diffuse_eval(material: &Material, angles: Angles) -> Vec3 {
    let wi = max(angles.wi, 0.0);
    let wo = max(angles.wo, 0.0);
    let r = material.roughness;
    let scale = 1.0 / (1.0 + r * 0.287_793_4);
    let s = angles.between - wi * wo;
    let single = scale * (1.0 + r * s / if s > 0.0 { max(max(wi, wo), 1e-6) } else { 1.0 });
    let lost_i = max(1.0 - scale * (1.0 + r * albedo_growth(wi)), 1e-6);
    let lost_o = max(1.0 - scale * (1.0 + r * albedo_growth(wo)), 1e-6);
    let mean = scale * (1.0 + r * 0.072_488_21);
    let lost = max(1.0 - mean, 1e-6);
    let color = material.diffuse;
    let multiple = color * color * (mean * lost_i * lost_o / lost) / (Vec3::ONE - color * (1.0 - mean));
    (color * single + multiple) * (wi * FRAC_1_PI)
}

pub fn albedo_growth(cosine: f32) -> f32 {
    let s = max(1.0 - cosine * cosine, 0.0).sqrt();
    let angle = atan2(s, cosine);
    let tangent = s * cosine * (1.0 + s + s * s) / (1.0 + s);
    (s * (angle - s * cosine) + 0.666_666_7 * (tangent - s)) * FRAC_1_PI
}

#[inline(always)]
pub fn diffuse_pdf<F: Real>(angles: Angles<F>) -> F {
    max(angles.wi, angles.wi.splat(0.0)) * FRAC_1_PI
}

#[inline(always)]
pub fn diffuse_sample<V: Vector3>(normal: V, u: <V::Real as Real>::Vec2) -> V {
    hemisphere_sample(normal, u)
}
