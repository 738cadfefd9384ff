//! How much light rough glass reflects and lets pass at once, as a table: what further bounces between its facets bring is as much
//! as is missing. By an integral over the facets that are seen.

use glam::{UVec2, Vec2, Vec3};

use super::{ENERGY_SIZE, SMALLEST_ALPHA};
use crate::cpu::ggx::{ggx_g1, ggx_sample};
use crate::cpu::lobe::facet_weight;
use crate::cpu::math::{dot, max};
use crate::cpu::sequence::sobol_sample;
use crate::cpu::specular::{fresnel, refracted_cosine};

/// Facets that are looked at where the roughness is known, and where it is not, for each of so many more numbers. They are points of Sobol's
/// sequence: few facets lean so far that all light is reflected inside, and a grid would miss them.
const FACETS: (u32, u32) = (4096, 1024);

/// The tables of both sides, the outer one first: rows by the root of alpha from 0 to 1, columns by the cosine,
/// from 0 to 1. Only rows about `alpha` where it is known; 1 elsewhere.
pub fn energy_table(ior: f32, alpha: Option<f32>) -> Vec<f32> {
    let last = (ENERGY_SIZE - 1) as f32;
    let wanted = |row: u32| alpha.is_none_or(|alpha| (row as f32 - alpha.sqrt() * last).abs() < 1.0);
    let facets = if alpha.is_some() { FACETS.0 } else { FACETS.1 };
    let mut table = Vec::new();
    for index in [ior, 1.0 / ior] {
        for row in 0..ENERGY_SIZE {
            let root = row as f32 / last;
            let alpha = max(root * root, SMALLEST_ALPHA);
            for column in 0..ENERGY_SIZE {
                let cosine = max(column as f32 / last, 0.002);
                table.push(if wanted(row) {
                    kept(index, alpha, cosine, facets)
                } else {
                    1.0
                });
            }
        }
    }
    table
}

/// The share of light from everywhere that comes to the viewer, in whose direction the normal has this cosine, by one bounce.
fn kept(index: f32, alpha: f32, cosine: f32, facets: u32) -> f32 {
    let alpha = Vec2::splat(alpha);
    let wo = Vec3::new(max(1.0 - cosine * cosine, 0.0).sqrt(), 0.0, cosine);
    let eta = 1.0 / index;
    let mut sum = 0.0;
    for i in 0..facets {
        let m = ggx_sample(alpha, wo, sobol_sample(i, UVec2::new(1, 2)));
        let c = max(dot(wo, m), 1e-6);
        let t = refracted_cosine(c, eta);
        let reflected = fresnel(c, t, eta);
        let above = m * (2.0 * c) - wo;
        let below = m * (eta * c - t) - wo * eta;
        if above.z > 0.0 {
            sum += f64::from(reflected * facet_weight(alpha, wo, above));
        }
        if below.z < 0.0 {
            sum += f64::from((1.0 - reflected) * ggx_g1(alpha, below));
        }
    }
    (sum / f64::from(facets)) as f32
}
