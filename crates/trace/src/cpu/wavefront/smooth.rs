//! Rays that leave smooth materials, in SIMD lanes: mirrors, conductors, dielectrics and thin sheets without roughness.

use fearless_simd::prelude::*;

use super::super::lanes::{LaneMaterials, MaterialFields, Real, Vector3, constant, select};
use super::super::math::{dot, max, normalize};
use super::super::metal::metal_fresnel;
use super::super::path::usable_normal;
use super::super::specular::{fresnel, reflected_direction, refracted_cosine, refracted_direction};
use super::super::thin::thin_reflectance;
use super::materials::{Directions, NextRays, ScatterResult, Transmitted};
use super::rows::{F, V};
use super::surfaces::LaneSurfaces;

/// A kind of smooth material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SmoothKind {
    Mirror,
    Metal,
    Dielectric,
    Thin,
}

/// Indices of refraction on the sides of the previous vertices, relative to those behind the surfaces, like the scalar
/// `eta_of`.
#[inline(always)]
fn etas<S: Simd>(material: &LaneMaterials<S>, surface: &LaneSurfaces<S>) -> F<S> {
    let ior = material.ior();
    select(ior, constant(1.0) / ior, surface.side.gt(ior.splat(0.0)))
}

/// Returns the shading normals, like the scalar `shaded_normal`.
#[inline(always)]
pub fn smooth_normal<S: Simd>(kind: SmoothKind, material: &LaneMaterials<S>, surface: &LaneSurfaces<S>) -> V<S> {
    let normal = usable_normal(*surface, surface.shading_normal);
    if kind != SmoothKind::Dielectric {
        return normal;
    }
    let eta = etas(material, surface);
    let zero = eta.splat(0.0);
    let cosine_i = max(dot(surface.wo, normal), eta.splat(1e-6));
    let cosine_t = refracted_cosine(cosine_i, eta);
    let refracted = refracted_direction(-surface.wo, normal, eta, cosine_i, cosine_t);
    let is_inward = dot(refracted, surface.normal).lt(zero) | Real::eq(cosine_t, zero);
    Vector3::select(surface.normal, normal, is_inward)
}

/// Samples the next rays, like the scalar `sample_delta_bsdf`. `directions.random` selects reflection or refraction.
#[inline(always)]
pub fn smooth_rays<S: Simd>(
    kind: SmoothKind,
    material: &LaneMaterials<S>,
    surface: &LaneSurfaces<S>,
    directions: Directions<S>,
) -> ScatterResult<S> {
    let Directions { throughput, random, .. } = directions;
    let (d, n) = (-surface.wo, surface.shading_normal);
    let one = random.splat(1.0);
    let always = one.le(one);
    let cosine = dot(surface.wo, n);
    let reflected = reflected_direction(d, n);
    let (reflects, refracted, throughput, eta) = match kind {
        SmoothKind::Mirror => (always, reflected, throughput * material.tint(), one),
        SmoothKind::Metal => (always, reflected, throughput * metal_fresnel(material, cosine), one),
        SmoothKind::Dielectric => {
            let eta = etas(material, surface);
            let cosine_i = max(cosine, one.splat(1e-6));
            let cosine_t = refracted_cosine(cosine_i, eta);
            let reflects = random.lt(fresnel(cosine_i, cosine_t, eta));
            let transmitted = throughput * material.tint() * (eta * eta);
            let refracted = refracted_direction(d, n, eta, cosine_i, cosine_t);
            let throughput = Vector3::select(transmitted, throughput, reflects);
            (reflects, refracted, throughput, select(eta, one, reflects))
        }
        SmoothKind::Thin => {
            let reflects = !random.ge(thin_reflectance(material.ior(), cosine));
            let refracted = refracted_direction(d, n, one, cosine, cosine);
            let throughput = Vector3::select(throughput * material.tint(), throughput, reflects);
            (reflects, refracted, throughput, one)
        }
    };
    ScatterResult {
        reflections: None,
        next_rays: NextRays {
            wi: normalize(Vector3::select(refracted, reflected, reflects)),
            throughput,
            pdf: one.splat(0.0),
            transmitted: Some(Transmitted { mask: !reflects, eta }),
        },
    }
}
