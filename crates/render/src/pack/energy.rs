//! Single-scattering albedo tables of rough glass and anisotropic microfacets, for multiple-scattering compensation, by
//! quadrature over visible normals. Eight normals at a time are evaluated in SIMD lanes, and summed one after the other.

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x8};
use glam::{DVec2, UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::{ANISO_COLUMNS, ANISO_LINES, ENERGY_SIZE, Material, SMALLEST_ALPHA};
use wgray_trace::cpu::ggx::{ggx_g1, ggx_sample};
use wgray_trace::cpu::lanes::{Lanes2, Real, Vector2, Vector3, constant, select};
use wgray_trace::cpu::lobe::{facet_alpha, facet_weight};
use wgray_trace::cpu::math::{dot, max};
use wgray_trace::cpu::samples::LEVEL;
use wgray_trace::cpu::sequence::sobol_sample;
use wgray_trace::cpu::specular::{fresnel, refracted_cosine};

/// Numbers of sampled normals per table entry, for constant and for textured roughness. The samples are Sobol' points,
/// because few microfacets tilt enough for total internal reflection, and a grid would miss these microfacets.
const NORMAL_SAMPLES: (u32, u32) = (4096, 1024);

/// Returns the tables of both sides of the surface, outside first. Rows: sqrt(alpha), 0 to 1; columns: cosine, 0 to 1.
/// If `alpha` is constant, only the adjacent rows are computed, and the entries of other rows are 1.
pub fn energy_table(ior: f32, alpha: Option<f32>) -> Vec<f32> {
    let last = (ENERGY_SIZE - 1) as f32;
    let is_needed = |row: u32| alpha.is_none_or(|alpha| (row as f32 - alpha.sqrt() * last).abs() < 1.0);
    let facets = points(if alpha.is_some() {
        NORMAL_SAMPLES.0
    } else {
        NORMAL_SAMPLES.1
    });
    let entry = |i: u32| {
        let (table, row, column) = (
            i / (ENERGY_SIZE * ENERGY_SIZE),
            i / ENERGY_SIZE % ENERGY_SIZE,
            i % ENERGY_SIZE,
        );
        if !is_needed(row) {
            return 1.0;
        }
        let root = row as f32 / last;
        let alpha = max(root * root, SMALLEST_ALPHA);
        let cosine = max(column as f32 / last, 0.002);
        let wo = Vec3::new(max(1.0 - cosine * cosine, 0.0).sqrt(), 0.0, cosine);
        let index = if table == 0 { ior } else { 1.0 / ior };
        glass_albedo(index, Vec2::splat(alpha), wo, &facets)
    };
    (0..2 * ENERGY_SIZE * ENERGY_SIZE).into_par_iter().map(entry).collect()
}

/// Coordinates of eight points on the unit square.
type Points = [[f32; 8]; 2];

fn points(count: u32) -> Vec<Points> {
    let point = |i: u32| sobol_sample(i, UVec2::new(1, 2));
    let coordinates = |first: u32| [0, 1].map(|axis| std::array::from_fn(|i| point(first + i as u32)[axis]));
    (0..count).step_by(8).map(coordinates).collect()
}

/// Returns the single-scattering albedo of rough glass: the energy reflected and transmitted.
fn glass_albedo(index: f32, alpha: Vec2, wo: Vec3, facets: &[Points]) -> f32 {
    let mut sum = 0.0;
    dispatch!(*LEVEL, simd => {
        let eta: f32x8<_> = SimdBase::splat(simd, 1.0 / index);
        let (alpha, wo) = in_lanes(simd, alpha, wo);
        for u in facets {
            let (mirrored, refracted) = glass_energy(eta, alpha, wo, point_in_lanes(simd, u));
            let (mirrored, refracted): ([f32; 8], [f32; 8]) = (mirrored.into(), refracted.into());
            for (mirrored, refracted) in mirrored.into_iter().zip(refracted) {
                sum += f64::from(mirrored);
                sum += f64::from(refracted);
            }
        }
    });
    (sum / (8 * facets.len()) as f64) as f32
}

/// Returns the energy that the microfacet selected by `u` reflects, and the energy that it transmits.
#[inline(always)]
fn glass_energy<F: Real>(eta: F, alpha: F::Vec2, wo: F::Vec3, u: F::Vec2) -> (F, F) {
    let zero = eta.splat(0.0);
    let m = ggx_sample(alpha, wo, u);
    let c = max(dot(wo, m), eta.splat(1e-6));
    let t = refracted_cosine(c, eta);
    let reflected = fresnel(c, t, eta);
    let above = m * (constant(2.0) * c) - wo;
    let below = m * (eta * c - t) - wo * eta;
    let mirrored = reflected * facet_weight(alpha, wo, above);
    let refracted = (constant(1.0) - reflected) * ggx_g1(alpha, below);
    (
        select(zero, mirrored, above.z().gt(zero)),
        select(zero, refracted, below.z().lt(zero)),
    )
}

/// Computes by quadrature the factors of F0 and F90 in the single-scattering albedo of reflection with Schlick's
/// Fresnel term. `ggx_albedo` is a fit of the same factors for isotropic lobes.
fn schlick_albedo(alpha: Vec2, wo: Vec3, facets: &[Points]) -> DVec2 {
    let mut sum = DVec2::ZERO;
    dispatch!(*LEVEL, simd => {
        let (alpha, wo) = in_lanes(simd, alpha, wo);
        for u in facets {
            let (cosine, weight) = mirrored_energy(alpha, wo, point_in_lanes(simd, u));
            let (cosine, weight): ([f32; 8], [f32; 8]) = (cosine.into(), weight.into());
            for (c, weight) in cosine.into_iter().zip(weight) {
                let edge = f64::from(max(1.0 - c, 0.0)).powi(5);
                sum += DVec2::new(1.0 - edge, edge) * f64::from(weight);
            }
        }
    });
    sum / (8 * facets.len()) as f64
}

/// Returns the cosine of the angle to the microfacet selected by `u`, and the energy that it reflects without a Fresnel
/// term.
#[inline(always)]
fn mirrored_energy<V: Vector3>(
    alpha: <V::Real as Real>::Vec2,
    wo: V,
    u: <V::Real as Real>::Vec2,
) -> (V::Real, V::Real) {
    let m = ggx_sample(alpha, wo, u);
    let c = dot(wo, m);
    let zero = c.splat(0.0);
    let wi = m * (constant(2.0) * c) - wo;
    (c, select(zero, facet_weight(alpha, wo, wi), wi.z().gt(zero)))
}

/// Returns `alpha` and `wo` in all lanes.
#[inline(always)]
fn in_lanes<S: Simd>(simd: S, alpha: Vec2, wo: Vec3) -> (Lanes2<f32x8<S>>, <f32x8<S> as Real>::Vec3) {
    let zero: f32x8<S> = SimdBase::splat(simd, 0.0);
    (
        Vector2::new(Real::splat(zero, alpha.x), Real::splat(zero, alpha.y)),
        zero.broadcast(wo),
    )
}

#[inline(always)]
fn point_in_lanes<S: Simd>(simd: S, u: &Points) -> Lanes2<f32x8<S>> {
    Vector2::new(f32x8::simd_from(simd, u[0]), f32x8::simd_from(simd, u[1]))
}

/// The lobes of a material that have albedo tables. Each variant lists its tables in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TableLobes {
    /// Reflection with a Fresnel term of 1.
    Reflection,
    /// Rough glass, seen from outside and from inside. The value is the index of refraction, as bits.
    Glass(u32),
    /// The F0 part and the F90 part of reflection. With an index of refraction (as bits), the tables of `Glass` follow.
    Principled(Option<u32>),
}

/// Numbers of rows for textured roughness and for textured anisotropy.
const TEXTURED_ROWS: (u32, u32) = (10, 6);

/// Correction factor of glass tables: at the kink of total internal reflection, linear interpolation is too low.
const KINK_CORRECTION: f32 = 1.004;

/// Returns the table of anisotropic microfacets for `single_scatter_albedo_aniso`: first the numbers of rows for
/// roughness and for anisotropy, each 1 if the value is constant; then the rows of each lobe. A row has a line for each
/// azimuth, and a line has a column for each cosine.
pub fn aniso_table(lobes: TableLobes, roughness: Option<f32>, anisotropy: Option<f32>) -> Vec<u32> {
    let rows = [
        if roughness.is_none() { TEXTURED_ROWS.0 } else { 1 },
        if anisotropy.is_none() { TEXTURED_ROWS.1 } else { 1 },
    ];
    let facets = points(match (roughness, anisotropy) {
        (Some(_), Some(_)) if lobes == TableLobes::Reflection => 1024,
        (Some(_), Some(_)) => 2048,
        (None, None) => 64,
        _ => 128,
    });
    let value =
        |constant: Option<f32>, row: u32, rows: u32| constant.unwrap_or(row as f32 / max(rows as f32 - 1.0, 1.0));
    let mut nodes = Vec::new();
    for r in 0..rows[0] {
        for s in 0..rows[1] {
            let alpha = facet_alpha(&Material {
                roughness: value(roughness, r, rows[0]),
                anisotropy: value(anisotropy, s, rows[1]),
                ..bytemuck::Zeroable::zeroed()
            });
            for line in 0..ANISO_LINES {
                for column in 0..ANISO_COLUMNS {
                    let position = Vec2::new(
                        line as f32 / (ANISO_LINES - 1) as f32,
                        column as f32 / (ANISO_COLUMNS - 1) as f32,
                    );
                    nodes.push((alpha, aniso_direction(alpha, position)));
                }
            }
        }
    }
    let mut words = rows.to_vec();
    let glass = |words: &mut Vec<u32>, ior_bits: u32| {
        let ior = f32::from_bits(ior_bits);
        for relative_ior in [ior, 1.0 / ior] {
            words.par_extend(
                nodes
                    .par_iter()
                    .map(|(alpha, wo)| (glass_albedo(relative_ior, *alpha, *wo, &facets) * KINK_CORRECTION).to_bits()),
            );
        }
    };
    match lobes {
        TableLobes::Glass(ior_bits) => glass(&mut words, ior_bits),
        TableLobes::Reflection => words.par_extend(nodes.par_iter().map(|(alpha, wo)| {
            let albedo = schlick_albedo(*alpha, *wo, &facets);
            ((albedo.x + albedo.y) as f32).to_bits()
        })),
        TableLobes::Principled(ior_bits) => {
            let albedos: Vec<DVec2> = nodes
                .par_iter()
                .map(|(alpha, wo)| schlick_albedo(*alpha, *wo, &facets))
                .collect();
            words.extend(albedos.iter().map(|albedo| (albedo.x as f32).to_bits()));
            words.extend(albedos.iter().map(|albedo| (albedo.y as f32).to_bits()));
            if let Some(ior_bits) = ior_bits {
                glass(&mut words, ior_bits);
            }
        }
    }
    words
}

/// Inverts `aniso_table_position`.
fn aniso_direction(alpha: Vec2, position: Vec2) -> Vec3 {
    let roughness = alpha.y + (alpha.x - alpha.y) * (position.x * position.x);
    let fraction = (roughness * roughness - alpha.y * alpha.y) / max(alpha.x * alpha.x - alpha.y * alpha.y, 1e-12);
    let squared_cosine = max(0.0, if fraction > 1.0 { 1.0 } else { fraction }); // of the azimuth
    let half_way = 0.5 * roughness.sqrt();
    // The cosine is the positive root of a quadratic equation.
    let b = 1.0 + 2.0 * half_way - 2.0 * position.y;
    let root = (b * b + 8.0 * half_way * position.y).sqrt();
    let cosine = max(0.5 * (root - b), 1e-3);
    let cosine = if cosine > 1.0 { 1.0 } else { cosine };
    let sine = max(1.0 - cosine * cosine, 0.0).sqrt();
    Vec3::new(
        sine * squared_cosine.sqrt(),
        sine * (1.0 - squared_cosine).sqrt(),
        cosine,
    )
}
