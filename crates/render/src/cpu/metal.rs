//! Twin of `shaders/metal.wgsl`.

use glam::{Vec2, Vec3};

use super::ggx::{ggx_d, ggx_length, ggx_sample};
use super::lobe::{LobeSample, facet_alpha, facet_eval, facet_pdf, facet_weight, half_vector};
use super::math::{dot, max, min};
use crate::records::Material;

pub fn conductor_fresnel(eta: f32, k: f32, cosine: f32) -> f32 {
    let c2 = cosine * cosine;
    let s2 = 1.0 - c2;
    let real = eta * eta - k * k - s2;
    let magnitude = (real * real + 4.0 * (eta * eta) * (k * k)).sqrt();
    let a = 2.0 * cosine * max(0.5 * (magnitude + real), 0.0).sqrt();
    let s = (magnitude + c2 - a) / (magnitude + c2 + a);
    let p = s * ((c2 * magnitude + s2 * s2 - a * s2) / (c2 * magnitude + s2 * s2 + a * s2));
    max(0.5 * (s + p), 0.0)
}

pub fn metal_fresnel(material: &Material, cosine: f32) -> Vec3 {
    let eta = material.eta;
    let k = material.k;
    let c = min(max(cosine, 0.0), 1.0);
    if eta.x > 0.0 {
        material.tint
            * Vec3::new(
                conductor_fresnel(eta.x, k.x, c),
                conductor_fresnel(eta.y, k.y, c),
                conductor_fresnel(eta.z, k.z, c),
            )
    } else {
        material.tint
    }
}

pub fn metal_factor(material: &Material, cosine: f32) -> Vec3 {
    metal_fresnel(material, cosine) * (Vec3::ONE + metal_fresnel(material, 1.0) * material.loss)
}

pub fn metal_eval(material: &Material, wo: Vec3, wi: Vec3) -> Vec3 {
    if (wo.z > 0.0) & (wi.z > 0.0) {
        metal_factor(material, dot(wo, half_vector(wo, wi))) * facet_eval(facet_alpha(material), wo, wi)
    } else {
        Vec3::ZERO
    }
}

pub fn metal_pdf(material: &Material, wo: Vec3, wi: Vec3) -> f32 {
    if (wo.z > 0.0) & (wi.z > 0.0) {
        facet_pdf(facet_alpha(material), wo, wi)
    } else {
        0.0
    }
}

pub fn metal_sample(material: &Material, wo: Vec3, u: Vec2) -> LobeSample {
    let alpha = facet_alpha(material);
    let m = ggx_sample(alpha, wo, u);
    let cosine = dot(wo, m);
    let wi = m * (2.0 * cosine) - wo;
    let lit = (wo.z > 0.0) & (wi.z > 0.0) & (cosine > 0.0);
    let weight = metal_factor(material, cosine) * facet_weight(alpha, wo, wi);
    let pdf = ggx_d(alpha, m) * 0.5 / max(wo.z + ggx_length(alpha, wo), 1e-30);
    LobeSample {
        wi,
        weight: if lit { weight } else { Vec3::ZERO },
        pdf: if lit { pdf } else { 0.0 },
        eta: 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy)]
    struct Complex(f64, f64);

    impl Complex {
        fn times(self, factor: Complex) -> Complex {
            Complex(
                self.0 * factor.0 - self.1 * factor.1,
                self.0 * factor.1 + self.1 * factor.0,
            )
        }
        fn add_scaled(self, other: Complex, factor: f64) -> Complex {
            Complex(self.0 + factor * other.0, self.1 + factor * other.1)
        }
        fn norm_squared(self) -> f64 {
            self.0 * self.0 + self.1 * self.1
        }
        fn root(self) -> Complex {
            let length = self.norm_squared().sqrt();
            let re = ((length + self.0) / 2.0).sqrt();
            let im = ((length - self.0) / 2.0).max(0.0).sqrt();
            Complex(re, if self.1 < 0.0 { -im } else { im })
        }
    }

    fn reflectance_by_amplitudes(eta: f64, k: f64, cosine: f64) -> f64 {
        let n = Complex(eta, k);
        let n2 = n.times(n);
        // Refractive index times cosine of the refracted direction: sqrt(n^2 - sin^2).
        let nt = n2.add_scaled(Complex(1.0 - cosine * cosine, 0.0), -1.0).root();
        let s = Complex(cosine, 0.0);
        let s_ratio = s.add_scaled(nt, -1.0).norm_squared() / s.add_scaled(nt, 1.0).norm_squared();
        let p = n2.times(Complex(cosine, 0.0));
        let p_ratio = p.add_scaled(nt, -1.0).norm_squared() / p.add_scaled(nt, 1.0).norm_squared();
        (s_ratio + p_ratio) / 2.0
    }

    #[test]
    fn metal_fresnel_matches_complex_amplitudes() {
        for (eta, k) in [
            (0.2, 3.9),
            (1.4, 1.8),
            (3.1, 3.3),
            (0.05, 8.0),
            (1.5, 0.0),
            (100.0, 100.0),
            (0.001, 0.0),
        ] {
            for cosine in [1.0, 0.9, 0.5, 0.2, 0.03, 1e-4, 0.0] {
                let found = f64::from(conductor_fresnel(eta as f32, k as f32, cosine as f32));
                let expected = reflectance_by_amplitudes(eta, k, cosine);
                assert!(
                    (found - expected).abs() < 2e-5,
                    "{eta} + {k} i, {cosine}: {found} {expected}"
                );
            }
        }
        // With k = 0, the metal is a dielectric.
        let glass =
            crate::cpu::specular::fresnel(0.6, crate::cpu::specular::refracted_cosine(0.6, 1.0 / 1.5), 1.0 / 1.5);
        assert!((conductor_fresnel(1.5, 0.0, 0.6) - glass).abs() < 1e-6);
    }
}
