//! Twin of `shaders/ggx.wgsl`: the GGX microfacet distribution.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::lanes::{Real, Vector2, Vector3, constant, select};
use super::math::{dot, max, normalize};
use super::warp::{cap_sample, disk_sample};

#[inline(always)]
pub fn ggx_d<V: Vector3>(alpha: <V::Real as Real>::Vec2, m: V) -> V::Real {
    let x = m.x() / alpha.x();
    let y = m.y() / alpha.y();
    let s = x * x + y * y + m.z() * m.z();
    let density = constant(FRAC_1_PI) / (alpha.x() * alpha.y() * s * s);
    select(s.splat(0.0), density, m.z().gt(s.splat(0.0)))
}

#[inline(always)]
pub fn ggx_length<V: Vector3>(alpha: <V::Real as Real>::Vec2, w: V) -> V::Real {
    let x = w.x() * alpha.x();
    let y = w.y() * alpha.y();
    (x * x + y * y + w.z() * w.z()).sqrt()
}

#[inline(always)]
pub fn ggx_g1<V: Vector3>(alpha: <V::Real as Real>::Vec2, w: V) -> V::Real {
    let cosine = w.z().abs();
    constant(2.0) * cosine / max(cosine + ggx_length(alpha, w), cosine.splat(1e-30))
}

#[inline(always)]
pub fn ggx_g2<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, wi: V) -> V::Real {
    let o = wo.z().abs();
    let i = wi.z().abs();
    constant(2.0) * i * o / max(o * ggx_length(alpha, wi) + i * ggx_length(alpha, wo), o.splat(1e-30))
}

#[inline(always)]
pub fn ggx_sample<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, u: <V::Real as Real>::Vec2) -> V {
    let stretched = normalize(V::new(wo.x() * alpha.x(), wo.y() * alpha.y(), wo.z()));
    let middle = cap_sample(disk_sample(u), constant(1.0) + stretched.z()) + stretched;
    let height = max(middle.z(), middle.z().splat(0.0));
    let m = V::new(middle.x() * alpha.x(), middle.y() * alpha.y(), height);
    let length2 = dot(m, m);
    let unit = m * (constant(1.0) / length2.sqrt());
    V::select(m.broadcast(Vec3::Z), unit, length2.gt(length2.splat(1e-20)))
}

#[inline(always)]
pub fn ggx_pdf<V: Vector3>(alpha: <V::Real as Real>::Vec2, wo: V, m: V) -> V::Real {
    let cosine = dot(wo, m);
    constant(2.0) * max(cosine, cosine.splat(0.0)) * ggx_d(alpha, m)
        / max(wo.z() + ggx_length(alpha, wo), cosine.splat(1e-30))
}

#[inline(always)]
pub fn ggx_albedo<F: Real>(alpha: F, mu: F) -> F::Vec2 {
    let length = (alpha * alpha * (constant(1.0) - mu * mu) + mu * mu).sqrt();
    ggx_albedo_fit(alpha, mu / length, length)
}

#[inline(always)]
pub fn ggx_albedo_along<V: Vector3>(alpha: <V::Real as Real>::Vec2, w: V) -> <V::Real as Real>::Vec2 {
    let square = constant(0.5) * (alpha.x() * alpha.x() + alpha.y() * alpha.y());
    let length = (square * (constant(1.0) - w.z() * w.z()) + w.z() * w.z()).sqrt();
    ggx_albedo_fit(square.sqrt(), w.z().abs() / ggx_length(alpha, w), length)
}

#[inline(always)]
pub fn ggx_albedo_fit<F: Real>(alpha: F, t: F, l: F) -> F::Vec2 {
    let a = alpha;
    let c = constant;
    let lost_0 = c(0.005_480_34) + t * (c(0.063_229_1) + t * (c(1.183_11) - t * 1.249_38));
    let lost_1 = c(-0.009_514_8) + t * (c(0.365_153) - t * (c(0.350_613) + t * 0.129_283));
    let lost_2 = c(0.008_129_75) + t * (c(1.568_84) + t * (c(1.185_46) - t * 1.092_09));
    let divisor_0 = c(1.0) + t * (c(3.349_08) - t * (c(1.559_2) + t * 1.920_2));
    let divisor_1 = t * (t * 1.209_1 - 0.391_082) - 1.120_89;
    let divisor_2 = c(0.644_689) + t * 1.026_91;
    let lost = (lost_0 + a * (lost_1 + a * lost_2)) / (divisor_0 + a * (divisor_1 + a * divisor_2));
    let edge_0 =
        c(0.966_613) + l * (c(2.475_01) - l * (c(12.614_7) - l * (c(22.980_2) - l * (c(18.285_2) - l * 5.389_7))));
    let edge_1 = c(-0.386_341) - l * (c(7.148_16) - l * (c(8.055_95) - l * (c(7.343_51) - l * 1.950_36)));
    let edge_2 = c(-0.489_888) + l * (c(9.380_23) - l * (c(2.590_02) - l * 2.932_96));
    let edge_3 = c(0.498_131) - l * (c(5.664_61) + l * 1.885_25);
    let edge_4 = c(-0.553_876) + l * 2.072_51;
    let edge = edge_0 + t * (edge_1 + t * (edge_2 + t * (edge_3 + t * (edge_4 + t * 0.267_055))));
    let edge_divisor = c(1.0) + l * (c(17.865) + l * 1.841_66) - t * (c(0.237_295) + l * 15.323_6 + t * 0.459_621);
    let y = max(edge / edge_divisor, a.splat(0.0));
    Vector2::new(max(c(1.0) - lost - y, a.splat(0.0)), y)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use glam::{DVec3, Vec2};

    use super::*;
    use crate::cpu::rng::{hash4, unit_float};

    /// Pairs (alpha_x, alpha_y).
    const ALPHAS: [(f64, f64); 8] = [
        (0.001, 0.001),
        (0.02, 0.02),
        (0.25, 0.25),
        (1.0, 1.0),
        (0.001, 0.05),
        (0.6, 0.1),
        (1.0, 0.04),
        (0.04, 1.0),
    ];

    fn pair((x, y): (f64, f64)) -> Vec2 {
        Vec2::new(x as f32, y as f32)
    }

    fn unit(cosine: f64, longitude: f64) -> Vec3 {
        let sine = (1.0 - cosine * cosine).sqrt();
        DVec3::new(sine * longitude.cos(), sine * longitude.sin(), cosine).as_vec3()
    }

    /// Integrates over microfacet normals with slopes x = ax tan(angle) cos(longitude) and y = ay tan(angle)
    /// sin(longitude). Steps in angle and longitude are dense where the distribution is large.
    fn over_normals((ax, ay): (f64, f64), mut f: impl FnMut(DVec3) -> f64) -> f64 {
        let (rings, spokes) = (400, 400);
        let mut sum = 0.0;
        for i in 0..rings {
            let angle = (f64::from(i) + 0.5) / f64::from(rings) * PI / 2.0;
            for j in 0..spokes {
                let longitude = (f64::from(j) + 0.5) / f64::from(spokes) * TAU;
                let slopes = DVec3::new(ax * longitude.cos(), ay * longitude.sin(), 0.0) * angle.tan();
                let m = (slopes + DVec3::Z).normalize();
                // d(slopes) = ax ay tan(angle) / cos(angle)^2 d(angle) d(longitude), d(solid angle) = m.z^3 d(slopes).
                let step = ax * ay * angle.tan() / angle.cos().powi(2);
                sum += f(m) * step * m.z.powi(3);
            }
        }
        sum * (PI / 2.0 / f64::from(rings)) * (TAU / f64::from(spokes))
    }

    #[test]
    fn the_projected_area_of_all_microfacets_is_one() {
        for alpha in ALPHAS {
            let area = over_normals(alpha, |m| f64::from(ggx_d(pair(alpha), m.as_vec3())) * m.z);
            assert!((area - 1.0).abs() < 1e-4, "{alpha:?}: {area}");
        }
        assert_eq!(ggx_d(Vec2::ONE, -Vec3::Z), 0.0);
    }

    #[test]
    fn visible_microfacets_have_the_projected_area_of_the_surface() {
        for alpha in ALPHAS {
            for (cosine, longitude) in [(1.0, 0.0), (0.7, 0.3), (0.3, 1.5), (0.05, 2.9)] {
                let wo = unit(cosine, longitude);
                // G1 times the projected area of all microfacets that face the viewer equals the projected area of the
                // surface.
                let facing = over_normals(alpha, |m| {
                    f64::from(ggx_d(pair(alpha), m.as_vec3())) * m.dot(wo.as_dvec3()).max(0.0)
                });
                let visible = facing * f64::from(ggx_g1(pair(alpha), wo));
                assert!((visible / cosine - 1.0).abs() < 3e-3, "{alpha:?} {wo}: {visible}");
                let density = over_normals(alpha, |m| f64::from(ggx_pdf(pair(alpha), wo, m.as_vec3())));
                assert!((density - 1.0).abs() < 3e-3, "{alpha:?} {wo}: {density}");
            }
        }
    }

    #[test]
    fn g2_is_at_most_g1_of_either_direction() {
        for alpha in ALPHAS {
            let alpha = pair(alpha);
            for (wo, wi) in [(unit(0.9, 0.2), unit(0.2, 3.0)), (unit(0.1, 1.0), unit(0.4, 1.2))] {
                let g2 = ggx_g2(alpha, wo, wi);
                let (o, i) = (ggx_g1(alpha, wo), ggx_g1(alpha, wi));
                assert!(g2 <= o.min(i) * 1.000_001 && g2 >= o * i * 0.999_999);
                // Heitz, JCGT 3(2), 2014, equation 99.
                let lambda = |g: f32| (1.0 - f64::from(g)) / f64::from(g);
                let expected = 1.0 / (1.0 + lambda(o) + lambda(i));
                assert!((f64::from(g2) / expected - 1.0).abs() < 1e-5, "{g2} {expected}");
            }
        }
    }

    /// Returns the chi-square statistic of sampled normals, in standard deviations above its expected value. Cells are
    /// uniform in the angle and longitude of stretched slopes. The pdf is multiplied by `pdf_factor` on one half of the
    /// hemisphere, and by 2 - `pdf_factor` on the other half.
    fn chi_square(alpha: (f64, f64), wo: Vec3, pdf_factor: f64) -> f64 {
        const CELLS: usize = 20;
        const SAMPLES: u32 = 100_000;
        let (ax, ay) = alpha;
        let cell = |m: DVec3| {
            let (x, y) = (m.x / ax / m.z, m.y / ay / m.z);
            let angle = x.hypot(y).atan() / (PI / 2.0);
            let longitude = y.atan2(x) / TAU + 0.5;
            let cell_index = |fraction: f64| ((fraction * CELLS as f64) as usize).min(CELLS - 1);
            cell_index(angle) * CELLS + cell_index(longitude)
        };
        let mut counts = vec![0.0; CELLS * CELLS];
        for i in 0..SAMPLES {
            let bits = hash4(glam::UVec4::new(i, 3, 5, 7));
            let m = ggx_sample(pair(alpha), wo, Vec2::new(unit_float(bits.x), unit_float(bits.y)));
            assert!((m.length() - 1.0).abs() < 1e-5 && m.z >= 0.0, "{m}");
            counts[cell(m.as_dvec3())] += 1.0;
        }
        let mut expected = vec![0.0; CELLS * CELLS];
        let _ = over_normals(alpha, |m| {
            let density = f64::from(ggx_pdf(pair(alpha), wo, m.as_vec3()))
                * if m.x > 0.0 { pdf_factor } else { 2.0 - pdf_factor };
            let slope = (m.x / ax / m.z).hypot(m.y / ay / m.z);
            // Solid angle of a step of `over_normals`.
            let step = ax * ay * slope * (1.0 + slope * slope) * m.z.powi(3) * (PI / 2.0 / 400.0) * (TAU / 400.0);
            expected[cell(m)] += density * step * f64::from(SAMPLES);
            0.0
        });
        let (mut sum, mut degrees_of_freedom, mut pooled) = (0.0, -1.0, (0.0, 0.0));
        for (count, expected) in counts.iter().zip(&expected) {
            if *expected < 10.0 {
                pooled = (pooled.0 + count, pooled.1 + expected);
            } else {
                sum += (count - expected) * (count - expected) / expected;
                degrees_of_freedom += 1.0;
            }
        }
        if pooled.1 > 10.0 {
            sum += (pooled.0 - pooled.1) * (pooled.0 - pooled.1) / pooled.1;
            degrees_of_freedom += 1.0;
        }
        assert!(degrees_of_freedom > 20.0, "{degrees_of_freedom}");
        (sum - degrees_of_freedom) / (2.0 * degrees_of_freedom).sqrt()
    }

    #[test]
    fn sampled_normals_follow_their_pdf() {
        for alpha in ALPHAS {
            for wo in [unit(0.95, 0.4), unit(0.3, 2.5), unit(0.6, 1.5)] {
                let correct = chi_square(alpha, wo, 1.0);
                assert!(correct < 6.0, "{alpha:?}, {wo}: {correct}");
                let incorrect = chi_square(alpha, wo, 1.06);
                assert!(
                    incorrect > 6.0,
                    "{alpha:?}, {wo}: a wrong pdf is not detected: {incorrect}"
                );
            }
        }
    }

    /// Returns the single-scattering albedo as factors of f0 and f90, integrated over normals with Heitz' Lambda.
    fn albedo(alpha: (f64, f64), wo: DVec3) -> (f64, f64) {
        let lambda = |w: DVec3| {
            let tangent2 = ((alpha.0 * w.x).powi(2) + (alpha.1 * w.y).powi(2)) / w.z.powi(2);
            ((1.0 + tangent2).sqrt() - 1.0) / 2.0
        };
        let (ax2, ay2) = (alpha.0.powi(2), alpha.1.powi(2));
        let term = |m: DVec3, edge: bool| {
            let c = wo.dot(m);
            let wi = m * (2.0 * c) - wo;
            if c <= 0.0 || wi.z <= 0.0 {
                return 0.0;
            }
            let tangent2 = (m.x * m.x / ax2 + m.y * m.y / ay2) / (m.z * m.z);
            let d = 1.0 / (PI * alpha.0 * alpha.1 * m.z.powi(4) * (1.0 + tangent2).powi(2));
            let g = 1.0 / (1.0 + lambda(wo) + lambda(wi));
            let schlick = (1.0 - c).powi(5);
            d * g * c / wo.z * if edge { schlick } else { 1.0 - schlick }
        };
        (
            over_normals(alpha, |m| term(m, false)),
            over_normals(alpha, |m| term(m, true)),
        )
    }

    #[test]
    fn albedos_match_quadrature() {
        for alpha in [0.001, 0.01, 0.06, 0.2, 0.45, 0.8, 1.0] {
            for cosine in [1.0, 0.8, 0.5, 0.25, 0.1, 0.03] {
                let wo = unit(cosine, 0.4);
                let (x, y) = albedo((alpha, alpha), wo.as_dvec3());
                let found = ggx_albedo(alpha as f32, wo.z).as_dvec2();
                let label = format!("{alpha} {cosine}: {found} {x} {y}");
                assert!((found.y - y).abs() < 4.5e-3, "{label}");
                assert!((found.x + found.y - x - y).abs() < 5.5e-3 * (x + y), "{label}");
                let anisotropic = ggx_albedo_along(Vec2::splat(alpha as f32), wo).as_dvec2();
                assert!(anisotropic.abs_diff_eq(found, 1e-5), "{label} {anisotropic}");
            }
        }
        let mut errors = Vec::new();
        for alpha in [(0.3, 0.2), (0.04, 0.36), (0.5, 0.01), (1.0, 0.04)] {
            for (cosine, longitude) in [(1.0, 0.0), (0.6, 0.0), (0.6, 1.5), (0.2, 0.7), (0.1, 1.5)] {
                let wo = unit(cosine, longitude);
                let (x, y) = albedo(alpha, wo.as_dvec3());
                let found = ggx_albedo_along(pair(alpha), wo).as_dvec2();
                let error = (found.x + found.y - x - y).abs() / (x + y);
                assert!(error < 0.075, "{alpha:?} {wo}: {error}");
                errors.push(error);
            }
        }
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        assert!(mean < 0.02, "{mean}");
    }

    #[test]
    fn results_are_finite_at_the_ends_of_all_ranges() {
        let tiny = f32::from_bits(1);
        for alpha in [Vec2::splat(0.001), Vec2::ONE, Vec2::new(0.001, 1.0)] {
            for wo in [Vec3::Z, Vec3::X, Vec3::new(0.6, -0.8, tiny), Vec3::new(0.0, 1.0, 1e-20)] {
                for u in [
                    Vec2::ZERO,
                    Vec2::splat(0.5),
                    Vec2::splat(1.0 - 6e-8),
                    Vec2::new(0.0, 0.5),
                ] {
                    let m = ggx_sample(alpha, wo, u);
                    assert!((m.length() - 1.0).abs() < 1e-5, "{alpha} {wo} {u}: {m}");
                    let values = [
                        ggx_pdf(alpha, wo, m),
                        ggx_d(alpha, m),
                        ggx_g1(alpha, wo),
                        ggx_g2(alpha, wo, wo),
                        ggx_albedo(alpha.x, wo.z).x,
                        ggx_albedo_along(alpha, wo).y,
                    ];
                    assert!(values.iter().all(|x| x.is_finite()), "{alpha} {wo} {u}: {values:?}");
                }
            }
        }
    }
}
