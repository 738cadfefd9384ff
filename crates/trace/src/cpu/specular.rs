//! Twin of `shaders/specular.wgsl`.

use super::lanes::{Real, Vector3, constant};
use super::math::{dot, max};

#[inline(always)]
pub fn reflected_direction<V: Vector3>(d: V, n: V) -> V {
    d - n * (constant(2.0) * dot(d, n))
}

#[inline(always)]
pub fn refracted_direction<V: Vector3>(d: V, n: V, eta: V::Real, cosine_i: V::Real, cosine_t: V::Real) -> V {
    d * eta + n * (eta * cosine_i - cosine_t)
}

#[inline(always)]
pub fn refracted_cosine<F: Real>(cosine_i: F, eta: F) -> F {
    let square = (constant(1.0) - eta * eta) + eta * eta * (cosine_i * cosine_i);
    max(square, eta.splat(0.0)).sqrt()
}

#[inline(always)]
pub fn fresnel<F: Real>(cosine_i: F, cosine_t: F, eta: F) -> F {
    let s = (eta * cosine_i - cosine_t) / (eta * cosine_i + cosine_t);
    let p = (cosine_i - eta * cosine_t) / (cosine_i + eta * cosine_t);
    constant(0.5) * (s * s + p * p)
}
