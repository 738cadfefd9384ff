//! Tests of single BSDFs: white furnace, reciprocity, normalized PDFs, sampled directions against the PDF. Integrals
//! are f64 quadratures.

use std::f64::consts::{PI, TAU};

use bytemuck::Zeroable;
use glam::{DVec3, Vec2, Vec3};
use wgray_trace::cpu::diffuse::{angles_at, diffuse_eval, diffuse_pdf, diffuse_sample, rough_diffuse_eval};
use wgray_trace::cpu::lobe::{LobeSample, facet_alpha, facet_loss};
use wgray_trace::cpu::metal::{metal_eval, metal_pdf, metal_sample};
use wgray_trace::cpu::modified_phong::{modified_phong_eval, modified_phong_pdf, modified_phong_sample};
use wgray_trace::cpu::rough_dielectric::{rough_dielectric_eval, rough_dielectric_pdf, rough_dielectric_sample};
use wgray_trace::cpu::sequence::sobol_sample;
use wgray_trace::cpu::thin::{thin_eval, thin_pdf, thin_sample};
use wgray_trace::records::{DIFFUSE, METAL, Material, PHONG, ROUGH_GLASS, THIN};

struct Bsdf {
    name: String,
    material: Material,
    /// True if a white material of this kind conserves energy.
    conserves_energy: bool,
}

/// Returns the factor that undoes the scaling of transmission by the squared index.
fn inverse_transmission_scale(material: &Material, wi: Vec3) -> f64 {
    if wi.z < 0.0 && material.kind == ROUGH_GLASS {
        f64::from(material.ior).powi(2)
    } else {
        1.0
    }
}

impl Bsdf {
    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let angles = angles_at(Vec3::Z, wo, wi);
        match self.material.kind {
            METAL => metal_eval(&self.with_energy_loss(wo), wo, wi),
            ROUGH_GLASS => rough_dielectric_eval(&self.material, wo, wi),
            THIN => thin_eval(&self.with_energy_loss(wo), wo, wi),
            PHONG => modified_phong_eval(&self.material, angles),
            _ if self.material.roughness > 0.0 => rough_diffuse_eval(&self.material, angles),
            _ => diffuse_eval(&self.material, angles),
        }
    }

    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let angles = angles_at(Vec3::Z, wo, wi);
        match self.material.kind {
            METAL => metal_pdf(&self.material, wo, wi),
            ROUGH_GLASS => rough_dielectric_pdf(&self.material, wo, wi),
            THIN => thin_pdf(&self.material, wo, wi),
            PHONG => modified_phong_pdf(&self.material, angles),
            _ => diffuse_pdf(angles),
        }
    }

    /// Returns the material with its energy loss for wo.
    fn with_energy_loss(&self, wo: Vec3) -> Material {
        let loss = if self.conserves_energy {
            facet_loss(facet_alpha(&self.material), wo)
        } else {
            0.0
        };
        Material { loss, ..self.material }
    }

    fn facet_sample(&self, wo: Vec3, u: Vec2, random: f32) -> Option<LobeSample> {
        match self.material.kind {
            METAL => Some(metal_sample(&self.with_energy_loss(wo), wo, u)),
            ROUGH_GLASS => Some(rough_dielectric_sample(&self.material, wo, u, random)),
            THIN => Some(thin_sample(&self.with_energy_loss(wo), wo, u, random)),
            _ => None,
        }
    }

    /// Samples wi. Returns `None` for samples below the surface.
    fn sample(&self, wo: Vec3, u: Vec2, random: f32) -> Option<Vec3> {
        if let Some(found) = self.facet_sample(wo, u, random) {
            return (found.pdf > 0.0).then_some(found.wi);
        }
        Some(match self.material.kind {
            PHONG => modified_phong_sample(&self.material, Vec3::Z, wo, u, random),
            _ => diffuse_sample(Vec3::Z, u),
        })
    }

    fn has_facets(&self) -> bool {
        [METAL, ROUGH_GLASS, THIN].contains(&self.material.kind)
    }

    fn albedo(&self, wo: Vec3) -> f64 {
        integral(wo, |wi| {
            if wi.z > 0.0 || self.has_facets() {
                f64::from(self.eval(wo, wi).x) * inverse_transmission_scale(&self.material, wi)
            } else {
                0.0
            }
        })
    }
}

fn all() -> Vec<Bsdf> {
    let diffuse = |roughness: f32| Bsdf {
        name: format!("diffuse, roughness {roughness}"),
        material: Material {
            kind: DIFFUSE,
            diffuse: Vec3::ONE,
            roughness,
            ..Material::zeroed()
        },
        conserves_energy: true,
    };
    let phong = |kd: f32, ks: f32, shininess: f32| Bsdf {
        name: format!("phong {kd} {ks} {shininess}"),
        material: Material {
            kind: PHONG,
            diffuse: Vec3::splat(kd),
            specular: Vec3::splat(ks),
            shininess,
            ..Material::zeroed()
        },
        conserves_energy: false,
    };
    let mut list = vec![
        diffuse(0.0),
        diffuse(1e-6),
        diffuse(0.3),
        diffuse(1.0),
        phong(1.0, 0.0, 16.0),
        phong(0.0, 1.0, 1e-6),
        phong(0.4, 0.6, 1.0),
        phong(0.5, 0.5, 37.5),
        phong(0.0, 1.0, 1000.0),
        phong(0.7, 0.7, 16.0),
    ];
    let rough = |kind: u32, roughness: f32, anisotropy: f32| Material {
        kind,
        tint: Vec3::ONE,
        roughness,
        anisotropy,
        ..Material::zeroed()
    };
    for (roughness, anisotropy) in [(0.3, 0.0), (0.6, 0.0), (1.0, 0.0), (0.4, 0.5)] {
        for conserves_energy in [false, true] {
            list.push(Bsdf {
                name: format!(
                    "metal, roughness {roughness}, anisotropy {anisotropy}, conserves energy: {conserves_energy}"
                ),
                material: rough(METAL, roughness, anisotropy),
                conserves_energy,
            });
        }
    }
    list.push(Bsdf {
        name: "gold".to_owned(),
        material: Material {
            eta: Vec3::new(0.17, 0.35, 1.5),
            k: Vec3::new(3.1, 2.7, 1.9),
            ..rough(METAL, 0.5, 0.0)
        },
        conserves_energy: false,
    });
    for (ior, roughness, anisotropy) in [(1.5, 0.4, 0.0), (1.5, 1.0, 0.0), (0.7, 0.5, 0.0), (2.4, 0.5, 0.6)] {
        list.push(Bsdf {
            name: format!("rough glass {ior}, roughness {roughness}, anisotropy {anisotropy}"),
            material: Material {
                ior,
                ..rough(ROUGH_GLASS, roughness, anisotropy)
            },
            conserves_energy: false,
        });
    }
    for (roughness, anisotropy, conserves_energy) in [(0.4, 0.0, true), (1.0, 0.0, false), (0.5, 0.7, false)] {
        list.push(Bsdf {
            name: format!("thin dielectric, roughness {roughness}, anisotropy {anisotropy}"),
            material: Material {
                ior: 1.5,
                ..rough(THIN, roughness, anisotropy)
            },
            conserves_energy,
        });
    }
    list
}

fn direction(cosine: f64, longitude: f64) -> Vec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    DVec3::new(sine * longitude.cos(), sine * longitude.sin(), cosine).as_vec3()
}

/// Returns outgoing directions from normal to grazing incidence.
fn view_directions() -> Vec<Vec3> {
    [1.0, 0.9, 0.5, 0.1, 0.01].map(|cosine| direction(cosine, 0.7)).to_vec()
}

/// Integrates over all directions, with finer steps around the mirrored direction.
fn integral(wo: Vec3, mut f: impl FnMut(Vec3) -> f64) -> f64 {
    let (rings, spokes) = (1000, 200);
    let axis = Vec3::new(-wo.x, -wo.y, wo.z).as_dvec3().normalize();
    let u = axis.any_orthonormal_vector();
    let v = axis.cross(u);
    let mut sum = 0.0;
    for i in 0..rings {
        let edge = |i: i32| PI * (f64::from(i) / f64::from(rings)).powi(2);
        let (inner, outer) = (edge(i), edge(i + 1));
        let angle = (inner + outer) / 2.0;
        let area = (inner.cos() - outer.cos()) * TAU / f64::from(spokes);
        for j in 0..spokes {
            let longitude = TAU * (f64::from(j) + 0.5) / f64::from(spokes);
            let d = axis * angle.cos() + (u * longitude.cos() + v * longitude.sin()) * angle.sin();
            sum += f(d.as_vec3()) * area;
        }
    }
    sum
}

#[test]
fn no_bsdf_gains_energy_in_a_white_furnace() {
    for bsdf in all() {
        for wo in view_directions() {
            let albedo = bsdf.albedo(wo);
            let name = &bsdf.name;
            if bsdf.conserves_energy {
                // The energy loss is a fitted function.
                let tolerance = if bsdf.has_facets() { 0.01 } else { 2e-3 };
                assert!((albedo - 1.0).abs() < tolerance, "{name}, {wo}: {albedo}");
            } else {
                assert!(albedo < 1.001 && albedo > 0.0, "{name}, {wo}: {albedo}");
            }
        }
    }
    // Negative control: without compensation, energy is lost.
    let single_scattering = Material {
        diffuse: Vec3::splat(1e-3),
        roughness: 1.0,
        ..Material::zeroed()
    };
    let wo = view_directions()[1];
    let loss = 1.0
        - integral(wo, |wi| {
            f64::from(rough_diffuse_eval(&single_scattering, angles_at(Vec3::Z, wo, wi)).x)
        }) / 1e-3;
    assert!(loss > 0.05, "{loss}");
}

#[test]
fn reflection_is_reciprocal() {
    // Turquin's compensation factor depends only on wo and is not reciprocal.
    for bsdf in all()
        .into_iter()
        .filter(|bsdf| !(bsdf.conserves_energy && bsdf.has_facets()))
    {
        for wo in view_directions() {
            for wi in [direction(0.8, 0.1), direction(0.3, 3.9), direction(0.02, 2.0)] {
                let forward = bsdf.eval(wo, wi) / wi.z;
                let backward = bsdf.eval(wi, wo) / wo.z;
                // Fresnel reflectance is steep near the critical angle.
                let tolerance = if bsdf.material.kind == ROUGH_GLASS { 4e-3 } else { 2e-5 };
                assert!(
                    forward.abs_diff_eq(backward, tolerance * forward.x.max(1.0)),
                    "{}: {forward} {backward}",
                    bsdf.name
                );
            }
        }
    }
}

/// Refraction scales radiance by the squared index: Veach's thesis, equation 5.14.
#[test]
fn refraction_is_reciprocal_up_to_the_squared_index() {
    for bsdf in all().iter().filter(|bsdf| bsdf.material.kind == ROUGH_GLASS) {
        let n = bsdf.material.ior;
        let inverse = Material {
            ior: 1.0 / n,
            ..bsdf.material
        };
        let flipped = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
        let mut compared = 0;
        for wo in view_directions() {
            for wi in [direction(0.9, 3.6), direction(0.5, 4.0), direction(0.3, 2.0)].map(flipped) {
                let forward = rough_dielectric_eval(&bsdf.material, wo, wi).x / -wi.z;
                let backward = rough_dielectric_eval(&inverse, flipped(wi), flipped(wo)).x / wo.z;
                let expected = forward * n * n;
                assert!(
                    (backward - expected).abs() < 4e-3 * expected.max(1e-3),
                    "{}, {wo} {wi}: {forward} {backward}",
                    bsdf.name
                );
                compared += u32::from(forward > 1e-3);
            }
        }
        assert!(compared > 3, "{}: only {compared} values were compared", bsdf.name);
    }
}

#[test]
fn pdfs_integrate_to_one() {
    for bsdf in all() {
        for wo in view_directions() {
            let total = integral(wo, |wi| f64::from(bsdf.pdf(wo, wi)));
            // For microfacets, the PDF integrates to the fraction of valid samples.
            let count = 65_536;
            let valid = (0..count).filter(|i| {
                let u = sobol_sample(*i, glam::UVec2::new(1, 2));
                let random = sobol_sample(*i, glam::UVec2::new(3, 4)).x;
                !bsdf.has_facets() || bsdf.sample(wo, u, random).is_some()
            });
            let expected = valid.count() as f64 / f64::from(count);
            assert!(
                (total - expected).abs() < 3e-3,
                "{}, {wo}: {total} {expected}",
                bsdf.name
            );
        }
    }
}

/// Returns Pearson's chi-square of sampled directions and its degrees of freedom, for the PDF and for a wrong PDF; small
/// cells are merged.
fn chi_squares(bsdf: &Bsdf, wo: Vec3) -> [(f64, f64); 2] {
    const SAMPLES: u32 = 200_000;
    const RINGS: usize = 40;
    const SPOKES: usize = 40;
    // Cells are in the frame of the mirrored direction, around which the lobes are narrow.
    let axis = Vec3::new(-wo.x, -wo.y, wo.z).as_dvec3().normalize();
    let u = axis.any_orthonormal_vector();
    let v = axis.cross(u);
    let cell = |d: DVec3| {
        let angle = d.dot(axis).clamp(-1.0, 1.0).acos();
        let ring = ((angle / PI).sqrt() * RINGS as f64) as usize;
        let longitude = d.dot(v).atan2(d.dot(u)) / TAU + 0.5;
        ring.min(RINGS - 1) * SPOKES + ((longitude * SPOKES as f64) as usize).min(SPOKES - 1)
    };
    let mut counts = vec![0.0; RINGS * SPOKES];
    for i in 0..SAMPLES {
        // Independent samples, because low-discrepancy sequences are too even.
        let bits = wgray_trace::cpu::rng::hash4(glam::UVec4::new(i, 7, 11, 13));
        let [a, b, c] = [bits.x, bits.y, bits.z].map(wgray_trace::cpu::rng::unit_float);
        let Some(wi) = bsdf.sample(wo, Vec2::new(a, b), c) else {
            continue;
        };
        let wi = wi.as_dvec3();
        assert!((wi.length() - 1.0).abs() < 1e-5, "{}: {wi}", bsdf.name);
        counts[cell(wi)] += 1.0;
    }
    let mut expected = [(); 2].map(|()| vec![0.0; RINGS * SPOKES]);
    let fine = 10;
    for ring in 0..RINGS * fine {
        let edge = |i: usize| PI * (i as f64 / (RINGS * fine) as f64).powi(2);
        let (inner, outer) = (edge(ring), edge(ring + 1));
        let angle = (inner + outer) / 2.0;
        for spoke in 0..SPOKES * fine {
            let longitude = TAU * ((spoke as f64 + 0.5) / (SPOKES * fine) as f64 - 0.5);
            let d = axis * angle.cos() + (u * longitude.cos() + v * longitude.sin()) * angle.sin();
            let area = (inner.cos() - outer.cos()) * TAU / (SPOKES * fine) as f64;
            let count = f64::from(bsdf.pdf(wo, d.as_vec3())) * area * f64::from(SAMPLES);
            expected[0][cell(d)] += count;
            expected[1][cell(d)] += count * if d.x > 0.0 { 1.08 } else { 0.92 };
        }
    }
    expected.map(|expected| {
        let (mut sum, mut cells, mut merged) = (0.0, -1.0, (0.0, 0.0));
        for (count, expected) in counts.iter().zip(&expected) {
            if *expected < 10.0 {
                merged = (merged.0 + count, merged.1 + expected);
            } else {
                sum += (count - expected) * (count - expected) / expected;
                cells += 1.0;
            }
        }
        if merged.1 > 10.0 {
            sum += (merged.0 - merged.1) * (merged.0 - merged.1) / merged.1;
            cells += 1.0;
        }
        (sum, cells)
    })
}

#[test]
fn sampled_directions_follow_their_pdf() {
    for bsdf in all() {
        for wo in [direction(0.95, 0.4), direction(0.3, 2.5)] {
            let [(sum, degrees_of_freedom), (wrong, _)] = chi_squares(&bsdf, wo);
            // The mean plus six standard deviations.
            let max_sum = degrees_of_freedom + 6.0 * (2.0 * degrees_of_freedom).sqrt();
            assert!(
                degrees_of_freedom > 5.0 && sum < max_sum,
                "{}, {wo}: chi-square {sum} for {degrees_of_freedom} degrees of freedom",
                bsdf.name
            );
            assert!(
                wrong > max_sum,
                "{}: a wrong PDF is accepted: chi-square {wrong} for {degrees_of_freedom} degrees of freedom",
                bsdf.name
            );
        }
    }
}

#[test]
fn mean_sample_weights_equal_the_albedo() {
    // The mean of eval / pdf equals the albedo by quadrature.
    for bsdf in all() {
        for wo in view_directions() {
            let expected = bsdf.albedo(wo);
            let count = 65_536;
            let mut sum = 0.0;
            for i in 0..count {
                let u = sobol_sample(i, glam::UVec2::new(1, 2));
                let random = sobol_sample(i, glam::UVec2::new(3, 4)).x;
                let Some(wi) = bsdf.sample(wo, u, random) else {
                    continue;
                };
                let pdf = bsdf.pdf(wo, wi);
                if (wi.z > 0.0 || bsdf.has_facets()) && pdf > 0.0 {
                    let weight = f64::from(bsdf.eval(wo, wi).x) / f64::from(pdf);
                    sum += weight * inverse_transmission_scale(&bsdf.material, wi);
                    if let Some(found) = bsdf.facet_sample(wo, u, random) {
                        // Weight and PDF of the sample agree with `eval` and `pdf`, except at grazing angles.
                        let weight_error = (f64::from(found.weight.x) - weight).abs() / weight.max(1e-3);
                        let pdf_error = f64::from((found.pdf - pdf).abs() / pdf);
                        let is_grazing = wi.z.abs() < 0.02 || wo.z < 0.02;
                        assert!(
                            is_grazing || weight_error < 5e-3 && pdf_error < 2e-2,
                            "{}: {wo} {wi} {weight_error} {pdf_error}",
                            bsdf.name
                        );
                    }
                }
            }
            let mean = sum / f64::from(count);
            assert!((mean - expected).abs() < 6e-3, "{}, {wo}: {mean} {expected}", bsdf.name);
        }
    }
}

#[test]
fn parameter_limits_give_finite_values() {
    let tiny = f32::from_bits(1);
    let directions = [
        Vec3::Z,
        Vec3::new(0.6, 0.0, 0.8),
        Vec3::new(0.0, 1.0, tiny),
        Vec3::new(0.8, -0.6, 1e-12),
        Vec3::X,
    ];
    let points = [
        Vec2::ZERO,
        Vec2::splat(0.5),
        Vec2::splat(1.0 - 6e-8),
        Vec2::new(0.0, 0.7),
    ];
    for kind in [METAL, ROUGH_GLASS, THIN] {
        for (roughness, anisotropy) in [(0.0, 0.0), (0.032, 0.0), (1e-20, 1.0), (0.5, 0.0), (1.0, 1.0)] {
            for ior in [0.01, 0.7, 0.9989, 1.0, 1.0011, 1.5, 100.0] {
                for (eta, k) in [(0.0, 0.0), (0.001, 0.0), (0.001, 100.0), (100.0, 100.0)] {
                    let material = Material {
                        kind,
                        tint: Vec3::ONE,
                        roughness,
                        anisotropy,
                        ior,
                        eta: Vec3::splat(eta),
                        k: Vec3::splat(k),
                        ..Material::zeroed()
                    };
                    let bsdf = Bsdf {
                        name: format!("{kind} {roughness} {anisotropy} {ior} {eta} {k}"),
                        material,
                        conserves_energy: true,
                    };
                    for wo in directions {
                        for u in points {
                            for random in [0.0, 0.5, 1.0 - 6e-8] {
                                let found = bsdf.facet_sample(wo, u, random).unwrap();
                                let is_finite = found.weight.is_finite() && found.pdf.is_finite() && found.pdf >= 0.0;
                                assert!(is_finite && found.wi.is_finite(), "{} {wo} {u}: {found:?}", bsdf.name);
                                assert!(found.weight.min_element() >= 0.0, "{} {wo} {u}: {found:?}", bsdf.name);
                                // With compensation, the weight of a sample may exceed 1.
                                assert!(found.weight.max_element() < 1e5, "{} {wo} {u}: {found:?}", bsdf.name);
                            }
                        }
                        for wi in directions {
                            for wi in [wi, -wi] {
                                let (value, pdf) = (bsdf.eval(wo, wi), bsdf.pdf(wo, wi));
                                let is_finite = value.is_finite() && pdf.is_finite() && value.min_element() >= 0.0;
                                assert!(is_finite && pdf >= 0.0, "{} {wo} {wi}: {value} {pdf}", bsdf.name);
                            }
                        }
                    }
                }
            }
        }
    }
}
