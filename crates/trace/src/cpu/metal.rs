//! Twin of `shaders/metal.wgsl`.

use super::ggx::{ggx_d, ggx_length, ggx_sample};
use super::lanes::{Condition, MaterialFields, Real, Vector3, constant, select};
use super::lobe::{LobeSample, facet_alpha, facet_eval, facet_pdf, facet_weight, half_vector};
use super::math::{dot, max, min};

#[inline(always)]
pub fn conductor_fresnel<F: Real>(eta: F, k: F, cosine: F) -> F {
    let zero = cosine.splat(0.0);
    let c2 = cosine * cosine;
    let s2 = constant(1.0) - c2;
    let real = eta * eta - k * k - s2;
    let magnitude = (real * real + constant(4.0) * (eta * eta) * (k * k)).sqrt();
    let a = constant(2.0) * cosine * max(constant(0.5) * (magnitude + real), zero).sqrt();
    let s = (magnitude + c2 - a) / (magnitude + c2 + a);
    let p = s * ((c2 * magnitude + s2 * s2 - a * s2) / (c2 * magnitude + s2 * s2 + a * s2));
    max(constant(0.5) * (s + p), zero)
}

#[inline(always)]
pub fn metal_fresnel<F: Real, M: MaterialFields<Real = F>>(material: &M, cosine: F) -> F::Vec3 {
    let (tint, eta, k) = (material.tint(), material.eta(), material.k());
    let has_index = eta.x().gt(cosine.splat(0.0));
    if !has_index.any() {
        return tint;
    }
    let c = min(max(cosine, cosine.splat(0.0)), cosine.splat(1.0));
    let reflected = F::Vec3::new(
        conductor_fresnel(eta.x(), k.x(), c),
        conductor_fresnel(eta.y(), k.y(), c),
        conductor_fresnel(eta.z(), k.z(), c),
    );
    Vector3::select(tint, tint * reflected, has_index)
}

#[inline(always)]
pub fn metal_factor<F: Real, M: MaterialFields<Real = F>>(material: &M, cosine: F) -> F::Vec3 {
    let one = cosine.splat(1.0);
    let gain = F::Vec3::repeat(one) + metal_fresnel(material, one) * material.loss();
    metal_fresnel(material, cosine) * gain
}

#[inline(always)]
pub fn metal_eval<F: Real, M: MaterialFields<Real = F>>(material: &M, wo: F::Vec3, wi: F::Vec3) -> F::Vec3 {
    let zero = wo.z().splat(0.0);
    let lit = wo.z().gt(zero) & wi.z().gt(zero);
    if !lit.any() {
        return F::Vec3::repeat(zero);
    }
    let reflected = metal_factor(material, dot(wo, half_vector(wo, wi))) * facet_eval(facet_alpha(material), wo, wi);
    Vector3::select(F::Vec3::repeat(zero), reflected, lit)
}

#[inline(always)]
pub fn metal_pdf<F: Real, M: MaterialFields<Real = F>>(material: &M, wo: F::Vec3, wi: F::Vec3) -> F {
    let zero = wo.z().splat(0.0);
    let lit = wo.z().gt(zero) & wi.z().gt(zero);
    if !lit.any() {
        return zero;
    }
    select(zero, facet_pdf(facet_alpha(material), wo, wi), lit)
}

#[inline(always)]
pub fn metal_sample<F: Real, M: MaterialFields<Real = F>>(material: &M, wo: F::Vec3, u: F::Vec2) -> LobeSample<F> {
    let alpha = facet_alpha(material);
    let m = ggx_sample(alpha, wo, u);
    let cosine = dot(wo, m);
    let zero = cosine.splat(0.0);
    let wi = m * (constant(2.0) * cosine) - wo;
    let lit = wo.z().gt(zero) & wi.z().gt(zero) & cosine.gt(zero);
    let weight = metal_factor(material, cosine) * facet_weight(alpha, wo, wi);
    let pdf = ggx_d(alpha, m) * 0.5 / max(wo.z() + ggx_length(alpha, wo), cosine.splat(1e-30));
    LobeSample {
        wi,
        weight: Vector3::select(F::Vec3::repeat(zero), weight, lit),
        pdf: select(zero, pdf, lit),
        eta: cosine.splat(1.0),
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
