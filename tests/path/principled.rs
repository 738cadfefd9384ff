//! The `principled` BSDF over a grid of parameters: white furnace, sample weights, sampled directions against the PDF,
//! and the diffuse and metal lobes against reference BSDFs.

use std::f64::consts::{PI, TAU};
use std::ops::{AddAssign, Mul};
use std::sync::OnceLock;

use bytemuck::Zeroable;
use glam::{DVec2, DVec3, UVec2, UVec4, Vec2, Vec3};
use rayon::prelude::*;
use wgray_trace::cpu::diffuse::{angles_at, diffuse_eval};
use wgray_trace::cpu::principled::{
    PrincipledLobes, principled_eval, principled_mixture, principled_pdf, principled_sample,
};
use wgray_trace::cpu::rng::{hash4, unit_float};
use wgray_trace::cpu::sequence::sobol_sample;
use wgray_trace::records::{DIFFUSE, Material, PRINCIPLED};

/// The mask of all lobes.
const ALL_LOBES: u32 = 31;

fn base_material() -> Material {
    Material {
        kind: PRINCIPLED,
        diffuse: Vec3::ONE,
        specular: Vec3::ONE,
        roughness: 0.5,
        ior: 1.5,
        specular_weight: 1.0,
        thin: 1,
        opacity: 1.0,
        ..Material::zeroed()
    }
}

fn direction(cosine: f64, longitude: f64) -> Vec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    DVec3::new(sine * longitude.cos(), sine * longitude.sin(), cosine).as_vec3()
}

/// Returns outgoing directions from normal to grazing incidence.
fn view_directions() -> [Vec3; 5] {
    [1.0, 0.9, 0.5, 0.15, 0.02].map(|cosine| direction(cosine, 0.7))
}

/// Returns the lobes as seen from outside, without albedo tables, which `tests/path/energy.rs` tests.
fn mixture(material: &Material, wo: Vec3) -> PrincipledLobes {
    // Anisotropic lobes take their albedo from the last argument: 0.95 + 0.05 = 1, so nothing is compensated.
    let aniso_table = u32::from(material.anisotropy > 0.0);
    let material = Material {
        aniso_table,
        ..*material
    };
    principled_mixture(&material, wo, true, Vec3::Z, ALL_LOBES, Vec3::new(0.95, 0.05, 1.0))
}

fn grid() -> Vec<(String, Material)> {
    let mut all = Vec::new();
    let mut add = |name: &str, roughness: f32, change: &dyn Fn(&mut Material)| {
        let mut material = Material {
            roughness,
            ..base_material()
        };
        change(&mut material);
        all.push((format!("{name}, roughness {roughness}"), material));
    };
    for roughness in [0.15, 0.4, 0.7, 1.0] {
        add("dielectric", roughness, &|_| {});
        add("metal", roughness, &|m| m.metallic = 1.0);
        add("half metal", roughness, &|m| {
            m.metallic = 0.5;
            m.diffuse = Vec3::new(0.9, 0.3, 0.1);
        });
        add("coated", roughness, &|m| {
            m.clearcoat = 1.0;
            m.clearcoat_roughness = 0.3;
        });
        add("sheen", roughness, &|m| {
            m.sheen = Vec3::ONE;
            m.sheen_roughness = roughness;
        });
        add("thin", roughness, &|m| m.transmission = 1.0);
        add("volume", roughness, &|m| {
            m.transmission = 1.0;
            m.thin = 0;
        });
        add("anisotropic", roughness, &|m| {
            m.metallic = 1.0;
            m.anisotropy = 0.7;
        });
        add("all", roughness, &|m| {
            m.diffuse = Vec3::new(0.8, 0.5, 0.3);
            m.metallic = 0.3;
            m.transmission = 0.4;
            m.thin = 0;
            m.clearcoat = 0.7;
            m.clearcoat_roughness = 0.5;
            m.sheen = Vec3::new(0.2, 0.4, 0.6);
            m.sheen_roughness = 0.5;
            m.anisotropy = 0.4;
        });
    }
    all
}

/// Returns, for each material of the grid and each direction of view, the albedo of red and green, by quadrature. Red is
/// not scaled by the squared index in transmission.
fn albedos() -> &'static [DVec2] {
    static ALBEDOS: OnceLock<Vec<DVec2>> = OnceLock::new();
    ALBEDOS.get_or_init(|| {
        let of_view = |material: &Material, wo: Vec3| {
            let m = mixture(material, wo);
            let scale = |wi: Vec3| {
                if wi.z < 0.0 {
                    1.0 / f64::from(m.eta * m.eta)
                } else {
                    1.0
                }
            };
            integral(wo, m.eta, |wi| {
                let value = principled_eval(&m, wo, wi, ALL_LOBES);
                DVec2::new(f64::from(value.x) * scale(wi), f64::from(value.y))
            })
        };
        let pairs: Vec<(Material, Vec3)> = grid()
            .into_iter()
            .flat_map(|(_, material)| view_directions().map(|wo| (material, wo)))
            .collect();
        pairs.par_iter().map(|(material, wo)| of_view(material, *wo)).collect()
    })
}

/// Integrates over the sphere, with finer steps around the mirrored and refracted directions.
fn integral<T: Default + AddAssign + Mul<f64, Output = T>>(wo: Vec3, eta: f32, f: impl Fn(Vec3) -> T) -> T {
    let (rings, spokes) = (450, 240);
    let mut sum = T::default();
    for upper in [true, false] {
        let sign = if upper { 1.0 } else { -1.0 };
        let index_ratio = if upper { 1.0 } else { f64::from(eta) };
        let (x, y) = (-f64::from(wo.x) * index_ratio, -f64::from(wo.y) * index_ratio);
        let axis = DVec3::new(x, y, sign * (1.0 - x * x - y * y).max(0.0).sqrt()).normalize();
        let u = axis.any_orthonormal_vector();
        let v = axis.cross(u);
        for i in 0..rings {
            let edge = |i: i32| PI * (f64::from(i) / f64::from(rings)).powi(2);
            let (inner, outer) = (edge(i), edge(i + 1));
            let angle = (inner + outer) / 2.0;
            let area = (inner.cos() - outer.cos()) * TAU / f64::from(spokes);
            for j in 0..spokes {
                let longitude = TAU * (f64::from(j) + 0.5) / f64::from(spokes);
                let d = axis * angle.cos() + (u * longitude.cos() + v * longitude.sin()) * angle.sin();
                if (d.z > 0.0) == upper {
                    sum += f(d.as_vec3()) * area;
                }
            }
        }
    }
    sum
}

#[test]
fn principled_lobes_gain_no_energy_in_a_white_furnace() {
    for ((name, _), albedos) in grid().into_iter().zip(albedos().chunks(view_directions().len())) {
        for (wo, albedo) in view_directions().into_iter().zip(albedos) {
            let albedo = albedo.x;
            assert!(albedo < 1.01 && albedo > 0.0, "{name}, {wo}: {albedo}");
            let is_lossless = ["dielectric", "coated", "metal"]
                .iter()
                .any(|kind| name.starts_with(kind));
            if is_lossless {
                assert!((albedo - 1.0).abs() < 0.02, "{name}, {wo}: {albedo}");
            }
        }
    }
    // Negative control: without compensation, energy is lost.
    let metal = Material {
        metallic: 1.0,
        roughness: 1.0,
        ..base_material()
    };
    let wo = direction(0.5, 0.0);
    let mut m = mixture(&metal, wo);
    (m.f0, m.f90) = (Vec3::ONE, Vec3::ONE);
    let loss = 1.0 - integral(wo, m.eta, |wi| f64::from(principled_eval(&m, wo, wi, ALL_LOBES).x));
    assert!(loss > 0.1, "{loss}");
}

#[test]
fn pdfs_integrate_to_the_fraction_of_valid_samples() {
    for (name, material) in grid() {
        for wo in [direction(0.95, 0.4), direction(0.3, 2.5)] {
            let m = mixture(&material, wo);
            let integral_of_pdf = integral(wo, m.eta, |wi| f64::from(principled_pdf(&m, wo, wi, ALL_LOBES)));
            let count = 16_384;
            let valid = (0..count).filter(|i| {
                let u = sobol_sample(*i, UVec2::new(1, 2));
                let random = sobol_sample(*i, UVec2::new(3, 4)).x;
                let sample = principled_sample(&m, wo, u, random, ALL_LOBES);
                sample.pdf > 0.0 && (sample.wi.length() - 1.0).abs() < 1e-4
            });
            let valid = valid.count() as f64 / f64::from(count);
            // Coat samples below the surface have a PDF but no weight.
            assert!(
                (integral_of_pdf - valid).abs() < 0.012,
                "{name}, {wo}: {integral_of_pdf} {valid}"
            );
        }
    }
}

#[test]
fn mean_sample_weights_equal_the_principled_albedo() {
    for ((name, material), albedos) in grid().into_iter().zip(albedos().chunks(view_directions().len())) {
        for (wo, albedo) in view_directions().into_iter().zip(albedos) {
            let m = mixture(&material, wo);
            let expected = albedo.y;
            let count = 65_536;
            let (mut sum, mut squares) = (0.0, 0.0);
            for i in 0..count {
                let u = sobol_sample(i, UVec2::new(5, 6));
                let random = sobol_sample(i, UVec2::new(7, 8)).x;
                let sample = principled_sample(&m, wo, u, random, ALL_LOBES);
                assert!(
                    sample.weight.is_finite() && sample.weight.min_element() >= 0.0,
                    "{name}: {sample:?}"
                );
                sum += f64::from(sample.weight.y);
                squares += f64::from(sample.weight.y).powi(2);
            }
            let mean = sum / f64::from(count);
            let error = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
            assert!(
                (mean - expected).abs() < 6e-3 + 3.0 * error,
                "{name}, {wo}: {mean} {expected} {error}"
            );
        }
    }
}

/// Returns Pearson's chi-square of sampled directions in cells of equal solid angle, and its degrees of freedom, for the
/// PDF and for a wrong PDF.
fn chi_squares(m: &PrincipledLobes, wo: Vec3) -> [(f64, f64); 2] {
    const SAMPLES: u32 = 100_000;
    const HEIGHTS: usize = 24;
    const LONGITUDES: usize = 24;
    /// Subcells per side of a cell, for integrating the PDF.
    const SUBCELLS: usize = 12;
    let cell = |d: Vec3| {
        let height = ((f64::from(d.z) + 1.0) / 2.0 * HEIGHTS as f64) as usize;
        let longitude = f64::from(d.y).atan2(f64::from(d.x)) / TAU + 0.5;
        height.min(HEIGHTS - 1) * LONGITUDES + ((longitude * LONGITUDES as f64) as usize).min(LONGITUDES - 1)
    };
    let mut counts = vec![0.0; HEIGHTS * LONGITUDES];
    for i in 0..SAMPLES {
        let bits = hash4(UVec4::new(i, 17, 19, 23));
        let [a, b, c] = [bits.x, bits.y, bits.z].map(unit_float);
        let sample = principled_sample(m, wo, Vec2::new(a, b), c, ALL_LOBES);
        if sample.pdf > 0.0 {
            counts[cell(sample.wi)] += 1.0;
        }
    }
    let mut expected = [(); 2].map(|()| vec![0.0; HEIGHTS * LONGITUDES]);
    let area = 4.0 * PI / (HEIGHTS * SUBCELLS * LONGITUDES * SUBCELLS) as f64;
    for i in 0..HEIGHTS * SUBCELLS {
        let z = (i as f64 + 0.5) / (HEIGHTS * SUBCELLS) as f64 * 2.0 - 1.0;
        for j in 0..LONGITUDES * SUBCELLS {
            let d = direction(z, TAU * ((j as f64 + 0.5) / (LONGITUDES * SUBCELLS) as f64 - 0.5));
            let count = f64::from(principled_pdf(m, wo, d, ALL_LOBES)) * area * f64::from(SAMPLES);
            expected[0][cell(d)] += count;
            expected[1][cell(d)] += count * if d.x > 0.0 { 1.1 } else { 0.9 };
        }
    }
    expected.map(|expected| {
        let (mut sum, mut cells) = (0.0, -1.0);
        for (count, expected) in counts.iter().zip(&expected) {
            if *expected > 20.0 {
                sum += (count - expected) * (count - expected) / expected;
                cells += 1.0;
            }
        }
        (sum, cells)
    })
}

#[test]
fn sampled_directions_follow_their_pdf() {
    // The test uses only lobes that are wide compared with the cells.
    for (name, material) in grid().into_iter().filter(|(_, material)| material.roughness >= 0.4) {
        for wo in [direction(0.9, 0.4), direction(0.4, 2.5)] {
            let m = mixture(&material, wo);
            let [(sum, degrees_of_freedom), (wrong, _)] = chi_squares(&m, wo);
            let max_sum = degrees_of_freedom + 7.0 * (2.0 * degrees_of_freedom).sqrt();
            assert!(
                degrees_of_freedom > 5.0 && sum < max_sum,
                "{name}, {wo}: chi-square {sum} for {degrees_of_freedom} degrees of freedom"
            );
            assert!(
                wrong > max_sum,
                "{name}: a wrong PDF is accepted: chi-square {wrong} for {degrees_of_freedom} degrees of freedom"
            );
        }
    }
}

#[test]
fn diffuse_and_metal_lobes_equal_reference_bsdfs() {
    for wo in view_directions() {
        for wi in [direction(0.9, 1.0), direction(0.4, 3.0), direction(0.05, 5.0)] {
            // Without metal and specular reflection, the material is bit-identical to `diffuse`.
            let color = Vec3::new(0.8, 0.4, 0.1);
            let matte = Material {
                diffuse: color,
                specular_weight: 0.0,
                ..base_material()
            };
            let diffuse = Material {
                kind: DIFFUSE,
                diffuse: color,
                ..Material::zeroed()
            };
            let found = principled_eval(&mixture(&matte, wo), wo, wi, ALL_LOBES);
            assert_eq!(found, diffuse_eval(&diffuse, angles_at(Vec3::Z, wo, wi)));
            // Metal equals uncompensated GGX with Schlick's approximation, computed in f64 by other formulas (Walter et
            // al. 2007, with tangents).
            for roughness in [0.3, 0.6, 1.0] {
                let metal = Material {
                    metallic: 1.0,
                    diffuse: color,
                    roughness,
                    ..base_material()
                };
                let mut m = mixture(&metal, wo);
                (m.f0, m.f90) = (color, Vec3::ONE);
                let found = principled_eval(&m, wo, wi, ALL_LOBES).as_dvec3();
                let expected = metal_f64(
                    color.as_dvec3(),
                    f64::from(roughness).powi(2),
                    wo.as_dvec3(),
                    wi.as_dvec3(),
                );
                let error = (found - expected).abs().max_element();
                assert!(
                    error < 1e-4 * expected.max_element().max(1.0),
                    "{roughness} {wo} {wi}: {found} {expected}"
                );
            }
        }
    }
}

fn metal_f64(f0: DVec3, alpha: f64, wo: DVec3, wi: DVec3) -> DVec3 {
    let h = (wo + wi).normalize();
    let tan2 = |v: DVec3| (1.0 - v.z * v.z).max(0.0) / (v.z * v.z);
    let d = alpha * alpha / (PI * h.z.powi(4) * (alpha * alpha + tan2(h)).powi(2));
    let lambda = |v: DVec3| ((1.0 + alpha * alpha * tan2(v)).sqrt() - 1.0) / 2.0;
    let g = 1.0 / (1.0 + lambda(wo) + lambda(wi));
    let f = f0 + (DVec3::ONE - f0) * (1.0 - wo.dot(h)).powi(5);
    f * (d * g / (4.0 * wo.z))
}

#[test]
fn smooth_lobes_are_deltas_and_all_values_are_finite() {
    let smooth = Material {
        roughness: 0.0,
        transmission: 1.0,
        thin: 0,
        ..base_material()
    };
    let wo = direction(0.6, 0.3);
    let m = mixture(&smooth, wo);
    let mut transmitted = Vec3::ZERO;
    let sample_count = 4096;
    for i in 0..sample_count {
        let random = (i as f32 + 0.5) / sample_count as f32;
        let sample = principled_sample(&m, wo, Vec2::new(0.3, 0.8), random, ALL_LOBES);
        assert!(sample.pdf == 0.0 || sample.weight == Vec3::ZERO, "{sample:?}");
        if sample.wi.z < 0.0 {
            // Snell's law.
            assert!((sample.wi.truncate() * 1.5 + wo.truncate()).length() < 1e-5);
            transmitted += sample.weight / sample_count as f32;
        }
    }
    // Fresnel transmittance from sines and tangents, converted to radiance in glass.
    let (i, t) = (0.6f32.acos(), (0.8f32 / 1.5).asin());
    let reflectance = |ratio: f32| 0.5 * ratio * ratio;
    let reflected = reflectance((i - t).sin() / (i + t).sin()) + reflectance((i - t).tan() / (i + t).tan());
    let expected = (1.0 - reflected) / 2.25;
    assert!((transmitted.x - expected).abs() < 2e-3, "{transmitted} {expected}");
    let limits = [0.0, 1e-38, 1e-20, 1e-4, 0.5, 1.0];
    for i in 0..20_000 {
        let bits = hash4(UVec4::new(i, 1, 2, 3));
        let pick = |k: u32| limits[(hash4(UVec4::new(i, k, 5, 6)).x % 6) as usize];
        let material = Material {
            diffuse: Vec3::new(pick(1), pick(2), pick(3)),
            specular: Vec3::new(pick(4), 1e6, pick(5)),
            ior: [1.0, 1.0005, 1.5, 100.0][(bits.x % 4) as usize],
            roughness: pick(6),
            metallic: pick(7),
            anisotropy: pick(8),
            transmission: pick(9),
            thin: bits.y % 2,
            clearcoat: pick(10),
            clearcoat_roughness: pick(11),
            sheen: Vec3::splat(pick(12)),
            sheen_roughness: pick(13),
            specular_weight: pick(14),
            ..base_material()
        };
        let wo = direction([1.0, 0.5, 1e-3, 1e-6][(bits.z % 4) as usize], f64::from(i));
        let energy = Vec3::new(pick(15), pick(16), pick(17));
        let m = principled_mixture(&material, wo, bits.w.is_multiple_of(2), Vec3::Z, ALL_LOBES, energy);
        let u = sobol_sample(i, UVec2::new(1, 2));
        let sample = principled_sample(&m, wo, u, sobol_sample(i, UVec2::new(3, 4)).x, ALL_LOBES);
        assert!(
            sample.weight.is_finite() && sample.wi.is_finite() && sample.pdf.is_finite(),
            "{material:?} {m:?} {sample:?}"
        );
        assert!(
            sample.weight.min_element() >= 0.0 && sample.pdf >= 0.0,
            "{material:?} {sample:?}"
        );
        for wi in [
            sample.wi,
            -wo,
            Vec3::new(-wo.x, -wo.y, wo.z),
            Vec3::X,
            Vec3::Z,
            Vec3::NEG_Z,
        ] {
            let value = principled_eval(&m, wo, wi, ALL_LOBES);
            assert!(
                value.is_finite() && principled_pdf(&m, wo, wi, ALL_LOBES) >= 0.0,
                "{material:?} {wo} {wi}: {value}"
            );
        }
    }
}

fn sphere_scene(keys: &str, textures: &str) -> wgray_trace::records::Packed {
    super::scene(
        16,
        4,
        &format!(
            "camera = {{ position = [0, -4, 1], look_at = [0, 0, 0], fov = 40 }}\nenvironment = {{ color = [0.3, 0.4, 0.5] }}\n\
             {textures}\n[materials.m]\ntype = 'principled'\n{keys}\n\
             [[lights]]\ntype = 'point'\nposition = [1, -2, 4]\ncolor = [9, 9, 9]\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n"
        ),
    )
}

#[test]
fn values_come_from_the_channels_of_a_texture() {
    let texture = |kind: &str| match kind {
        "constant" => "[textures.t]\ntype = 'constant'\ncolor = [0.75, 0.5, 0.25]",
        _ => "[textures.t]\ntype = 'checker'\neven = [0.75, 0.5, 0.25]\nodd = [0.75, 0.5, 0.25]",
    };
    let untextured = sphere_scene(
        "metallic = 0.25\nroughness = 0.5\nclearcoat = 0.75\nclearcoat_roughness = 0.5",
        "",
    );
    let textured = "metallic = { texture = 't', channel = 'b' }\nroughness = { texture = 't', channel = 'g' }\n\
                    clearcoat = { texture = 't' }\nclearcoat_roughness = { texture = 't', channel = 'g' }";
    let expected = crate::pictures::reference(&untextured);
    for kind in ["constant", "checker"] {
        let packed = sphere_scene(textured, texture(kind));
        // All four values share one texture lookup; a constant texture needs no lookup.
        assert_eq!(packed.textures.lookups.len(), usize::from(kind == "checker"));
        for mode in crate::pictures::exact_modes() {
            assert_eq!(
                crate::pictures::differing(&crate::pictures::render(&packed, mode), &expected),
                0,
                "{kind} {mode:?}"
            );
        }
    }
    // Negative control: another channel gives another image.
    let wrong_channel = sphere_scene(&textured.replace("'b'", "'g'"), texture("checker"));
    assert!(crate::pictures::differing(&crate::pictures::reference(&wrong_channel), &expected) > 20);
}

#[test]
fn invalid_parameters_are_reported() {
    let validate = |keys: &str| {
        let text = format!(
            "image = {{ width = 4, height = 4 }}\ncamera = {{ position = [0, -4, 1], look_at = [0, 0, 0], fov = 40 }}\n\
             render = {{ integrator = 'path' }}\ntextures.t = {{ type = 'checker', even = [1, 1, 1], odd = [0, 0, 0] }}\n\
             [materials.m]\ntype = 'principled'\n{keys}\n"
        );
        wgray::scene::Scene::parse(&text, "s.toml")
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    for (keys, message) in [
        ("metallic = 1.5", "materials.m.metallic: 1.5 must be"),
        ("roughness = -0.1", "materials.m.roughness: -0.1 must be"),
        ("ior = 0.9", "materials.m.ior: 0.9 must be"),
        ("thickness = -1", "materials.m.thickness: -1 must be from 0 to 1e9"),
        ("thickness = inf", "materials.m.thickness: "),
        ("base_color = [1.1, 0, 0]", "materials.m.base_color: 1.1 must be"),
        (
            "attenuation_color = [0.5, 1, 1]\nthickness = 1",
            "materials.m.attenuation_distance is missing",
        ),
        (
            "attenuation_color = [0.5, 1, 1]\nattenuation_distance = 1",
            "materials.m.attenuation_color: needs a thickness",
        ),
        (
            "attenuation_distance = 0",
            "materials.m.attenuation_distance: 0 must be from 1e-6 to 1e9",
        ),
        (
            "alpha_mode = 'cutout'",
            "materials.m.alpha_mode: \"cutout\" must be one of",
        ),
        ("alpha_cutoff = 2", "materials.m.alpha_cutoff: 2 must be"),
        (
            "alpha = { texture = 't', channel = 'x' }",
            "materials.m.alpha.channel: \"x\" must be one of",
        ),
        (
            "alpha = { texture = 't', channel = 'a' }",
            "materials.m.alpha.channel: \"t\" must be a texture of type \"image\"",
        ),
        (
            "alpha = { texture = 'u', channel = 'a' }",
            "materials.m.alpha.texture: there is no texture \"u\"",
        ),
        (
            "clearcoat_normal_map = { texture = 't' }",
            "materials.m.clearcoat_normal_map.texture: \"t\" must be",
        ),
        ("coat = 1", "materials.m.coat: unknown key"),
    ] {
        let found = validate(keys).expect_err(keys);
        assert!(found.contains(message), "{keys}: {found}");
    }
    for keys in [
        "",
        "metallic = 0\nroughness = 0\nior = 1\nspecular = 0\ntransmission = 1\nthickness = 1e9\nalpha_mode = 'blend'\nalpha = 0",
        "attenuation_color = [0, 1, 1e-30]\nattenuation_distance = 1e-6\nthickness = 0.1",
        "specular_color = [1e6, 0, 0]\nior = 100\nanisotropy = 1\nanisotropy_rotation = -360",
    ] {
        assert_eq!(validate(keys), Ok(()), "{keys}");
    }
}
