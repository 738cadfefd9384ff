//! Energy compensation of microfacet BSDFs: white-furnace tests of metal, glass and `principled`, isotropic and
//! anisotropic, by quadrature over microfacet slopes.

use std::f64::consts::TAU;

use glam::{DVec3, Vec2, Vec3};
use wgray_trace::cpu::energy::principled_energy;
use wgray_trace::cpu::lobe::facet_alpha;
use wgray_trace::cpu::metal::metal_eval;
use wgray_trace::cpu::principled::{
    PrincipledLobes, principled_eval, principled_mixture, principled_pdf, principled_sample,
};
use wgray_trace::cpu::rough_dielectric::{rough_dielectric_eval, rough_dielectric_pdf};
use wgray_trace::cpu::scattering::material_for_view;
use wgray_trace::cpu::sequence::sobol_sample;
use wgray_trace::cpu::surface::Surface;
use wgray_trace::cpu::thin::{thin_eval, thin_pdf};
use wgray_trace::records::{METAL, Material, NO_PRIMITIVE, Packed, ROUGH_GLASS};

use crate::pictures::{both, render};

/// The mask of all lobes.
const ALL_LOBES: u32 = 31;

fn scene_of(keys: &str) -> Packed {
    super::scene(
        1,
        2,
        &format!(
            "camera = {{ position = [0, -4, 1], look_at = [0, 0, 0], fov = 40 }}\n\
             textures.t = {{ type = 'checker', even = [1, 1, 1], odd = [0, 0, 0] }}\nmaterials.m = {{ {keys} }}\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n"
        ),
    )
}

fn direction(cosine: f64, longitude: f64) -> Vec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    DVec3::new(sine * longitude.cos(), sine * longitude.sin(), cosine).as_vec3()
}

/// Returns outgoing directions from normal to grazing incidence, at several azimuths.
fn view_directions() -> Vec<Vec3> {
    let mut all = vec![Vec3::Z];
    for cosine in [0.8, 0.4, 0.04] {
        for longitude in [0.0, 0.7, 1.3, TAU / 4.0] {
            all.push(direction(cosine, longitude));
        }
    }
    all
}

fn evaluated_for(packed: &Packed, material: &Material, wo: Vec3, side: f32) -> Material {
    let surface = Surface {
        position: Vec3::ZERO,
        normal: Vec3::Z,
        smooth_normal: Vec3::Z,
        shading_normal: Vec3::Z,
        wo,
        ray_origin: Vec3::ZERO,
        terminator_offset: Vec3::ZERO,
        side,
        exclude_front: NO_PRIMITIVE,
        exclude_back: NO_PRIMITIVE,
        uv: Vec2::ZERO,
        du: Vec3::X,
        dv: Vec3::Y,
    };
    material_for_view(packed, &surface, *material)
}

fn mixture(packed: &Packed, material: &Material, wo: Vec3, side: f32) -> PrincipledLobes {
    let energy = principled_energy(packed, material, wo, side);
    principled_mixture(material, wo, side > 0.0, Vec3::Z, ALL_LOBES, energy)
}

/// Integrates `f` over reflected directions and, if `ior` is set, over refracted directions, by the midpoint rule over
/// microfacet normals. The normals are spaced by the inverse CDF of their distribution (Walter et al. 2007, section
/// 5.2). Transmitted radiance is not scaled by the squared index.
fn furnace(alpha: Vec2, ior: Option<f64>, thin: bool, wo: Vec3, f: impl Fn(Vec3) -> f32) -> f64 {
    // The integrand is periodic in the longitude, so few longitudes suffice.
    let (steps, longitudes) = (120, 120);
    let a = alpha.as_dvec2();
    let o = wo.as_dvec3();
    let mut sum = 0.0;
    for i in 0..steps {
        // The steps are finer at steep slopes, because steep slopes dominate at grazing angles.
        let t = (f64::from(i) + 0.5) / f64::from(steps);
        let (u, du) = (1.0 - (1.0 - t) * (1.0 - t), 2.0 * (1.0 - t));
        let r = (u / (1.0 - u)).sqrt();
        for j in 0..longitudes {
            let longitude = TAU * (f64::from(j) + 0.5) / f64::from(longitudes);
            let m = DVec3::new(-a.x * r * longitude.cos(), -a.y * r * longitude.sin(), 1.0).normalize();
            let c = o.dot(m);
            if c <= 0.0 {
                continue;
            }
            let s = (m.x / a.x).powi(2) + (m.y / a.y).powi(2) + m.z * m.z;
            let density = m.z / (a.x * a.y * s * s * TAU / 2.0);
            let weight = du / density;
            let wi = m * (2.0 * c) - o;
            if wi.z > 0.0 {
                sum += f64::from(f(wi.as_vec3())) * 4.0 * c * weight;
                if thin {
                    sum += f64::from(f(DVec3::new(wi.x, wi.y, -wi.z).as_vec3())) * 4.0 * c * weight;
                }
            }
            let Some(n) = ior.filter(|_| !thin) else {
                continue;
            };
            let square = 1.0 - (1.0 - c * c) / (n * n);
            if square > 0.0 {
                let cosine = square.sqrt();
                let wi = m * (c / n - cosine) - o / n;
                if wi.z < 0.0 {
                    let area = (c - n * cosine).powi(2) / (n * n * cosine);
                    sum += f64::from(f(wi.normalize().as_vec3())) * area * weight * n * n;
                }
            }
        }
    }
    sum / f64::from(steps * longitudes)
}

/// Returns the total albedo: reflection and transmission.
fn albedo(packed: &Packed, material: &Material, wo: Vec3, side: f32, compensated: bool) -> f64 {
    let alpha = facet_alpha(material);
    let mut evaluated = evaluated_for(packed, material, wo, side);
    if !compensated {
        evaluated.loss = 0.0;
    }
    match material.kind {
        METAL => furnace(alpha, None, false, wo, |wi| metal_eval(&evaluated, wo, wi).x),
        ROUGH_GLASS => furnace(alpha, Some(f64::from(evaluated.ior)), false, wo, |wi| {
            rough_dielectric_eval(&evaluated, wo, wi).x
        }),
        _ => furnace(alpha, None, true, wo, |wi| thin_eval(&evaluated, wo, wi).x),
    }
}

#[test]
fn anisotropic_metal_and_glass_conserve_energy() {
    let kinds = [
        ("type = 'conductor'", 0.01, false),
        ("type = 'dielectric', thin = true, ior = 1.5", 0.01, false),
        ("type = 'dielectric', ior = 1.5", 0.02, true),
        ("type = 'dielectric', ior = 2.5", 0.02, true),
        ("type = 'dielectric', ior = 1.1", 0.02, true),
    ];
    let mut deviations = Vec::new();
    for (kind, tolerance, has_inside) in kinds {
        for roughness in [0.1, 0.3, 0.6, 1.0] {
            for anisotropy in [0.3, 0.7, 1.0] {
                let keys = format!("{kind}, roughness = {roughness}, anisotropy = {anisotropy}");
                let packed = scene_of(&keys);
                let material = &packed.materials[0];
                for wo in view_directions() {
                    for side in [1.0, -1.0].into_iter().take(1 + usize::from(has_inside)) {
                        let found = albedo(&packed, material, wo, side, true);
                        if !((found - 1.0).abs() < tolerance && found < 1.005) {
                            deviations.push(format!("{keys}, {wo}, {side}: {found}"));
                        }
                    }
                }
            }
        }
    }
    assert!(
        deviations.is_empty(),
        "number of albedos outside the tolerance: {}: {deviations:#?}",
        deviations.len()
    );
    // Negative control: without compensation, energy is lost. The argument `compensated` and the scene key
    // `energy_compensation` have the same effect.
    let packed = scene_of("type = 'conductor', roughness = 0.6, anisotropy = 0.7");
    let loss = 1.0 - albedo(&packed, &packed.materials[0], direction(0.4, 0.7), 1.0, false);
    assert!(loss > 0.1, "{loss}");
    let uncompensated_scene =
        scene_of("type = 'conductor', roughness = 0.6, anisotropy = 0.7, energy_compensation = false");
    assert_eq!(uncompensated_scene.materials[0].aniso_table, 0);
    let uncompensated = 1.0
        - albedo(
            &uncompensated_scene,
            &uncompensated_scene.materials[0],
            direction(0.4, 0.7),
            1.0,
            true,
        );
    assert!((uncompensated - loss).abs() < 1e-9, "{uncompensated} {loss}");
}

#[test]
fn textured_anisotropy_nearly_conserves_energy() {
    let textures = ["{ texture = 't' }", "0.45"];
    for roughness_value in textures {
        for anisotropy_value in textures {
            let keys = format!(
                "type = 'principled', metallic = 1, roughness = {roughness_value}, anisotropy = {anisotropy_value}"
            );
            let packed = scene_of(&keys);
            for (roughness, anisotropy) in [(0.45, 0.45), (0.3, 0.9), (0.85, 0.2)] {
                let mut material = packed.materials[0];
                if roughness_value != "0.45" {
                    material.roughness = roughness;
                }
                if anisotropy_value != "0.45" {
                    material.anisotropy = anisotropy;
                }
                for wo in view_directions() {
                    let m = mixture(&packed, &material, wo, 1.0);
                    let found = furnace(m.alpha, None, false, wo, |wi| principled_eval(&m, wo, wi, ALL_LOBES).x);
                    assert!(
                        (found - 1.0).abs() < 0.05,
                        "{keys}, {roughness} {anisotropy}, {wo}: {found}"
                    );
                }
            }
        }
    }
}

#[test]
fn anisotropic_principled_metal_conserves_energy() {
    for roughness in [0.1, 0.3, 0.6, 1.0] {
        for anisotropy in [0.3, 0.7, 1.0] {
            let keys = format!("type = 'principled', roughness = {roughness}, anisotropy = {anisotropy}");
            let packed = scene_of(&keys);
            for wo in view_directions() {
                let m = mixture(&packed, &packed.materials[0], wo, 1.0);
                let found = furnace(m.alpha, None, false, wo, |wi| principled_eval(&m, wo, wi, ALL_LOBES).x);
                assert!((found - 1.0).abs() < 0.01 && found < 1.005, "{keys}, {wo}: {found}");
            }
        }
    }
}

#[test]
fn fully_transmissive_principled_equals_dielectric() {
    for anisotropy in [0.0, 0.6] {
        for (ior, thin) in [(1.1, false), (1.5, false), (2.5, false), (1.5, true), (2.5, true)] {
            let roughnesses = [0.1, 0.3, 0.6, 1.0];
            for roughness in if anisotropy == 0.0 {
                &roughnesses[..]
            } else {
                &roughnesses[1..2]
            } {
                let options = format!("ior = {ior}, roughness = {roughness}, anisotropy = {anisotropy}");
                let glass = scene_of(&format!("type = 'dielectric', thin = {thin}, {options}"));
                let thickness = if thin { 0 } else { 1 };
                let packed = scene_of(&format!(
                    "type = 'principled', metallic = 0, transmission = 1, thickness = {thickness}, {options}"
                ));
                let material = &packed.materials[0];
                for wo in [Vec3::Z, direction(0.7, 0.3), direction(0.3, 1.2), direction(0.06, 0.8)] {
                    for side in [1.0, -1.0] {
                        let name = format!("{options}, thin {thin}, {wo}, {side}");
                        let m = mixture(&packed, material, wo, side);
                        let evaluated = evaluated_for(&glass, &glass.materials[0], wo, side);
                        for k in 0..64 {
                            let u = sobol_sample(k, glam::UVec2::new(1, 2));
                            let found =
                                principled_sample(&m, wo, u, sobol_sample(k, glam::UVec2::new(3, 4)).x, ALL_LOBES);
                            if found.pdf == 0.0 || found.wi.z.abs() < 0.02 {
                                continue;
                            }
                            let (wi, value) = (found.wi, principled_eval(&m, wo, found.wi, ALL_LOBES).x);
                            let (expected, expected_pdf) = if thin {
                                (thin_eval(&evaluated, wo, wi).x, thin_pdf(&evaluated, wo, wi))
                            } else {
                                (
                                    rough_dielectric_eval(&evaluated, wo, wi).x,
                                    rough_dielectric_pdf(&evaluated, wo, wi),
                                )
                            };
                            let error = (value - expected).abs() / expected;
                            let pdf_error = (principled_pdf(&m, wo, wi, ALL_LOBES) - expected_pdf).abs() / expected_pdf;
                            assert!(error < 0.01 && pdf_error < 0.01, "{name}, {wi}: {error} {pdf_error}");
                        }
                        let n = (!thin).then(|| f64::from(1.0 / m.eta));
                        let albedo = furnace(m.alpha, n, thin, wo, |wi| principled_eval(&m, wo, wi, ALL_LOBES).x);
                        assert!((albedo - 1.0).abs() < 0.01, "{name}: {albedo}");
                    }
                }
            }
        }
    }
    // Negative control: with albedos of 1 instead of the table, energy is lost.
    let keys = "type = 'principled', metallic = 0, transmission = 1, thickness = 1, roughness = 1";
    let material = scene_of(keys).materials[0];
    let wo = direction(0.3, 0.0);
    let m = principled_mixture(&material, wo, true, Vec3::Z, ALL_LOBES, Vec3::ONE);
    let albedo = furnace(m.alpha, Some(1.5), false, wo, |wi| {
        principled_eval(&m, wo, wi, ALL_LOBES).x
    });
    assert!((albedo - 0.555).abs() < 0.01, "{albedo}");
}

#[test]
fn mixed_principled_glass_conserves_energy() {
    for (metallic, transmission) in [(0.3, 1.0), (0.0, 0.5), (0.5, 0.5), (0.2, 0.05)] {
        for (roughness, anisotropy) in [(0.3, 0.0), (1.0, 0.0), (0.3, 0.8)] {
            let keys = format!(
                "type = 'principled', metallic = {metallic}, transmission = {transmission}, thickness = 1, roughness = {roughness}, \
                 anisotropy = {anisotropy}"
            );
            let packed = scene_of(&keys);
            for (wo, side) in view_directions().into_iter().flat_map(|wo| [(wo, 1.0), (wo, -1.0)]) {
                let m = mixture(&packed, &packed.materials[0], wo, side);
                let specular = furnace(m.alpha, Some(f64::from(1.0 / m.eta)), false, wo, |wi| {
                    (principled_eval(&m, wo, wi, ALL_LOBES) - m.diffuse * (wi.z.max(0.0) / std::f32::consts::PI)).x
                });
                let found = specular + f64::from(m.diffuse.x);
                assert!((found - 1.0).abs() < 0.02, "{keys}, {wo}, {side}: {found}");
            }
        }
    }
}

#[test]
fn matched_indices_do_not_reflect() {
    for (transmission, thickness) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.5, 1.0)] {
        let keys = |ior: f64| {
            format!(
                "type = 'principled', metallic = 0, transmission = {transmission}, thickness = {thickness}, roughness = 0.3, ior = {ior}"
            )
        };
        for wo in [Vec3::Z, direction(0.3, 0.7), direction(0.02, 0.7)] {
            let reflectance = |ior: f64| {
                let packed = scene_of(&keys(ior));
                let m = mixture(&packed, &packed.materials[0], wo, 1.0);
                furnace(m.alpha, None, false, wo, |wi| {
                    (principled_eval(&m, wo, wi, ALL_LOBES) - m.diffuse * (wi.z.max(0.0) / std::f32::consts::PI)).x
                })
            };
            let matched = reflectance(1.0);
            assert!(matched.abs() < 1e-3, "{}, {wo}: {matched}", keys(1.0));
            // Negative control: the default index reflects light.
            assert!(reflectance(1.5) > 0.03, "{wo}");
        }
    }
}

#[test]
fn glass_around_the_camera_absorbs_over_the_full_path() {
    // Paths start in glass, cross transparent or camera-invisible surfaces, and reach an emitter behind the glass
    // boundary. The radiance is exp(-a d) times the Fresnel transmittance at normal incidence times n^2.
    let (a, d) = (0.4_f64, 2.0);
    let wall = |z: f64, material: &str| {
        format!(
            "[[shapes]]\ntype = 'rectangle'\nmaterial = '{material}'\ncenter = [0, 0, {z}]\nsize = [9, 9]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\n"
        )
    };
    let scene = |between: &str| {
        super::scene(
            4096,
            1,
            &format!(
                "camera = {{ position = [0, 0, {d}], look_at = [0, 0, 0], up = [0, 1, 0], fov = 1 }}\nenvironment = {{ color = [0, 0, 0] }}\n\
                 materials.m = {{ type = 'dielectric', ior = 1.5, absorption = [{a}, {a}, {a}] }}\n\
                 materials.s = {{ type = 'diffuse', color = [0, 0, 0], emission = [1, 1, 1] }}\n\
                 materials.absent = {{ type = 'principled', alpha = 0, alpha_mode = 'blend' }}\n\
                 materials.unseen = {{ type = 'diffuse', color = [1, 1, 1], visible = false }}\n\
                 {between}{}\
                 [[shapes]]\ntype = 'rectangle'\nmaterial = 's'\ncenter = [0, 0, -1]\nsize = [9, 9]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n",
                wall(0.0, "m")
            ),
        )
    };
    let expected = (1.0 - 0.04) * (-a * d).exp() * 1.5 * 1.5;
    for between in [
        String::new(),
        wall(0.7, "absent"),
        wall(1.3, "unseen"),
        wall(1.1, "absent") + &wall(0.7, "unseen") + &wall(0.3, "absent"),
    ] {
        let packed = scene(&between);
        for mode in both() {
            let found = super::mean(&render(&packed, mode))[1];
            // The tolerance covers the noise: 1 of 25 paths is reflected.
            assert!(
                (found / expected - 1.0).abs() < 2e-3,
                "{mode:?}, {between}: {found}, expected {expected}"
            );
            // Negative control: if only the glass behind the first surface absorbed, the value would differ.
            let partial = (1.0 - 0.04) * (-a * 0.7).exp() * 1.5 * 1.5;
            assert!(
                (found / partial - 1.0).abs() > 0.1,
                "absorption in front of the first surface has no effect"
            );
        }
    }
}
