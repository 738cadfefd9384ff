//! Scattering of materials in SIMD lanes.

use fearless_simd::{Simd, mask32x8};
use glam::Vec3;

use super::super::diffuse::{angles_at, diffuse_pdf, diffuse_sample};
use super::super::lanes::{LaneMaterials, Lanes2, MaterialFields, MaterialRows, Real, Vector3, constant, select};
use super::super::lobe::{LobeSample, facet_alpha, facet_loss, vector_from_lobe, vector_to_lobe};
use super::super::math::{max, normalize};
use super::super::metal::{metal_eval, metal_pdf, metal_sample};
use super::super::path::usable_normal;
use super::super::primitive::Tangents;
use super::super::principled::{
    PrincipledLobes, evaluated_sample, principled_direction, principled_eval, principled_mixture, principled_pdf,
};
use super::super::rough_dielectric::{rough_dielectric_eval, rough_dielectric_pdf, rough_dielectric_sample};
use super::super::warp::frame_around;
use super::rows::{F, Rows3, V, load3, splat3};
use super::surfaces::LaneSurfaces;
use crate::records::{LOBE_COAT, Packed};

/// Values of [`Reflection`](super::super::scattering::Reflection) in lanes.
pub struct Reflections<S: Simd> {
    pub value: V<S>,
    pub pdf: F<S>,
}

/// Directions of the next rays, with the throughputs of their paths.
pub struct NextRays<S: Simd> {
    pub wi: V<S>,
    pub throughput: V<S>,
    pub pdf: F<S>,
    /// [`None`] if no material transmits light.
    pub transmitted: Option<Transmitted<S>>,
}

/// The rays that are transmitted: they leave on the other sides of their surfaces.
#[derive(Clone, Copy)]
pub struct Transmitted<S: Simd> {
    pub mask: mask32x8<S>,
    /// Index of refraction on the side of the previous vertex, relative to that behind the surface.
    pub eta: F<S>,
}

impl<S: Simd> Transmitted<S> {
    #[inline(always)]
    fn of(surface: &LaneSurfaces<S>, sample: &LobeSample<F<S>>) -> Option<Self> {
        surface.transmits.map(|_| Transmitted {
            mask: sample.wi.z.lt(sample.wi.z.splat(0.0)),
            eta: sample.eta,
        })
    }
}

/// Directions to light samples, and random numbers to sample the next rays.
#[derive(Clone, Copy)]
pub struct Directions<S: Simd> {
    /// Throughputs before the bounce.
    pub throughput: V<S>,
    /// [`None`] if the scene has no emitters.
    pub to_light: Option<V<S>>,
    /// Point on the unit square.
    pub u: Lanes2<F<S>>,
    /// Selects a lobe.
    pub random: F<S>,
}

/// Reflected light and next rays at the hits.
pub struct ScatterResult<S: Simd> {
    /// Reflection of the light samples, like the scalar `reflection`.
    pub reflections: Option<Reflections<S>>,
    /// The next rays, like those of the scalar `sample_bsdf`.
    pub next_rays: NextRays<S>,
}

/// Opaque diffuse materials without roughness.
pub struct Diffuse<S: Simd> {
    reflectance: V<S>,
}

impl<S: Simd> Diffuse<S> {
    #[inline(always)]
    pub fn new(material: &LaneMaterials<S>) -> Self {
        Diffuse {
            reflectance: material.diffuse(),
        }
    }

    #[inline(always)]
    pub fn scatter(&self, surface: &LaneSurfaces<S>, directions: Directions<S>) -> ScatterResult<S> {
        ScatterResult {
            reflections: directions.to_light.map(|wi| self.reflections(surface, wi)),
            next_rays: self.next_rays(surface, directions),
        }
    }

    #[inline(always)]
    fn reflections(&self, surface: &LaneSurfaces<S>, wi: V<S>) -> Reflections<S> {
        // The pdf does not depend on the direction to the previous vertex, for which `wi` is passed.
        let pdf = diffuse_pdf(angles_at(surface.shading_normal, wi, wi));
        Reflections {
            value: surface.where_allowed(wi, self.reflectance * pdf),
            pdf,
        }
    }

    #[inline(always)]
    fn next_rays(&self, surface: &LaneSurfaces<S>, directions: Directions<S>) -> NextRays<S> {
        let wi = diffuse_sample(surface.shading_normal, directions.u);
        let Reflections { value, pdf } = self.reflections(surface, wi);
        let zero = pdf.splat(0.0);
        let inverse_pdf = select(zero, constant(1.0) / pdf, pdf.gt(zero));
        NextRays {
            wi,
            throughput: directions.throughput * (value * inverse_pdf),
            pdf,
            transmitted: None,
        }
    }
}

/// `principled` materials.
pub struct Principled<S: Simd> {
    mixture: PrincipledLobes<F<S>>,
    frame: Tangents<V<S>>,
    wo: V<S>,
    lobes: u32,
}

impl<S: Simd> Principled<S> {
    /// Returns the materials, like the part of the scalar `shade` before light is sampled. The shading normals of the
    /// surfaces are usable. `energy` contains the albedos of `principled_energy`.
    #[inline(always)]
    pub fn new(scene: &Packed, material: &LaneMaterials<S>, surface: &LaneSurfaces<S>, energy: &Rows3) -> Self {
        let simd = material.simd;
        let s = &scene.specialization;
        let normal = surface.shading_normal;
        let (frame, local) = frame_and_wo(surface);
        let mut coat = splat3(simd, Vec3::Z);
        if (s.lobes & LOBE_COAT != 0) & (s.normal_maps == 1) {
            coat = vector_to_lobe(frame, normal, usable_normal(*surface, surface.coat_normal));
        }
        let wo: V<S> = Vector3::new(local.x, local.y, max(local.z, local.z.splat(1e-6)));
        let outside = surface.side.gt(surface.side.splat(0.0));
        Principled {
            mixture: principled_mixture(material, wo, outside, coat, s.lobes, load3(simd, energy)),
            frame,
            wo,
            lobes: s.lobes,
        }
    }

    #[inline(always)]
    pub fn scatter(&self, surface: &LaneSurfaces<S>, directions: Directions<S>) -> ScatterResult<S> {
        let normal = surface.shading_normal;
        let direction = principled_direction(&self.mixture, self.wo, directions.u, directions.random, self.lobes);
        let to_light = directions.to_light.unwrap_or(normal);
        // A loop, so that the lobes are compiled only once.
        let mut local = [vector_to_lobe(self.frame, normal, to_light), direction.wi];
        let mut pdfs = [direction.pdf; 2];
        for (wi, pdf) in local.iter_mut().zip(&mut pdfs) {
            *pdf = principled_pdf(&self.mixture, self.wo, *wi, self.lobes);
            *wi = principled_eval(&self.mixture, self.wo, *wi, self.lobes); // replaced by the value
        }
        let [reflected, value] = local;
        let sample = evaluated_sample(direction, value, pdfs[1]);
        let wi = normalize(vector_from_lobe(self.frame, normal, sample.wi));
        ScatterResult {
            reflections: directions.to_light.map(|wi| Reflections {
                value: surface.where_allowed(wi, reflected),
                pdf: pdfs[0],
            }),
            next_rays: NextRays {
                wi,
                throughput: directions.throughput * surface.where_allowed(wi, sample.weight),
                pdf: sample.pdf,
                transmitted: Transmitted::of(surface, &sample),
            },
        }
    }
}

/// Rough conductors or rough dielectrics.
pub struct Facets<'a, S: Simd> {
    material: LaneMaterials<'a, S>,
    is_metal: bool,
    frame: Tangents<V<S>>,
    wo: V<S>,
}

impl<'a, S: Simd> Facets<'a, S> {
    /// Returns conductors, like the scalar `material_for_view`. The shading normals of the surfaces are usable.
    #[inline(always)]
    pub fn metal(simd: S, rows: &'a mut MaterialRows, surface: &LaneSurfaces<S>) -> Self {
        let (frame, wo) = frame_and_wo(surface);
        let alpha = facet_alpha(&LaneMaterials { simd, rows });
        rows.set_loss(facet_loss(alpha, wo));
        Facets {
            material: LaneMaterials { simd, rows },
            is_metal: true,
            frame,
            wo,
        }
    }

    /// Returns dielectrics for materials that were evaluated by the scalar `material_for_view`.
    #[inline(always)]
    pub fn dielectric(material: LaneMaterials<'a, S>, surface: &LaneSurfaces<S>) -> Self {
        let (frame, wo) = frame_and_wo(surface);
        Facets {
            material,
            is_metal: false,
            frame,
            wo,
        }
    }

    #[inline(always)]
    pub fn scatter(&self, surface: &LaneSurfaces<S>, directions: Directions<S>) -> ScatterResult<S> {
        let normal = surface.shading_normal;
        let sample = match self.is_metal {
            true => metal_sample(&self.material, self.wo, directions.u),
            false => rough_dielectric_sample(&self.material, self.wo, directions.u, directions.random),
        };
        let wi = normalize(vector_from_lobe(self.frame, normal, sample.wi));
        ScatterResult {
            reflections: directions.to_light.map(|wi| self.reflections(surface, wi)),
            next_rays: NextRays {
                wi,
                throughput: directions.throughput * surface.where_allowed(wi, sample.weight),
                pdf: sample.pdf,
                transmitted: Transmitted::of(surface, &sample),
            },
        }
    }

    #[inline(always)]
    fn reflections(&self, surface: &LaneSurfaces<S>, wi: V<S>) -> Reflections<S> {
        let local = vector_to_lobe(self.frame, surface.shading_normal, wi);
        let (value, pdf) = match self.is_metal {
            true => (
                metal_eval(&self.material, self.wo, local),
                metal_pdf(&self.material, self.wo, local),
            ),
            false => (
                rough_dielectric_eval(&self.material, self.wo, local),
                rough_dielectric_pdf(&self.material, self.wo, local),
            ),
        };
        let value = surface.where_allowed(wi, value);
        Reflections { value, pdf }
    }
}

/// Returns the frames of lobes around the shading normals, and the directions to the previous vertices in these frames.
#[inline(always)]
fn frame_and_wo<S: Simd>(surface: &LaneSurfaces<S>) -> (Tangents<V<S>>, V<S>) {
    let normal = surface.shading_normal;
    let frame = surface.tangents.unwrap_or_else(|| frame_around(normal));
    (frame, vector_to_lobe(frame, normal, surface.wo))
}
