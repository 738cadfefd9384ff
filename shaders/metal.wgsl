// The material `conductor` with roughness or an index of refraction: Cook and Torrance, "A Reflectance Model for
// Computer Graphics", ACM TOG 1(1), 1982, with GGX microfacets.

// Returns the reflectance of a metal of index eta + i k for unpolarized light: Born and Wolf, "Principles of Optics",
// 14.2.
fn conductor_fresnel(eta: f32, k: f32, cosine: f32) -> f32 {
    let c2 = cosine * cosine;
    let s2 = 1.0 - c2;
    let real = eta * eta - k * k - s2;
    let magnitude = sqrt(real * real + 4.0 * (eta * eta) * (k * k));
    let a = 2.0 * cosine * sqrt(max(0.5 * (magnitude + real), 0.0));
    let s = (magnitude + c2 - a) / (magnitude + c2 + a);
    let p = s * ((c2 * magnitude + s2 * s2 - a * s2) / (c2 * magnitude + s2 * s2 + a * s2));
    return max(0.5 * (s + p), 0.0);
}

// Returns the tint, times the Fresnel reflectance if the material has an index of refraction.
fn metal_fresnel(material: Material, cosine: f32) -> vec3f {
    let eta = material.eta;
    let k = material.k;
    let c = min(max(cosine, 0.0), 1.0);
    let exact = vec3f(conductor_fresnel(eta.x, k.x, c), conductor_fresnel(eta.y, k.y, c), conductor_fresnel(eta.z, k.z, c));
    return material.tint * select(vec3f(1.0), exact, eta.x > 0.0);
}

// Returns `metal_fresnel` with multiple scattering: Turquin, "Practical Multiple Scattering Compensation for Microfacet
// Models", 2019, equation 14.
fn metal_factor(material: Material, cosine: f32) -> vec3f {
    return metal_fresnel(material, cosine) * (vec3f(1.0) + metal_fresnel(material, 1.0) * material.loss);
}

// Returns the BRDF times the cosine between wi and the normal.
fn metal_eval(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    let lit = (wo.z > 0.0) & (wi.z > 0.0);
    let value = metal_factor(material, dot(wo, half_vector(wo, wi))) * facet_eval(facet_alpha(material), wo, wi);
    return select(vec3f(0.0), value, lit);
}

fn metal_pdf(material: Material, wo: vec3f, wi: vec3f) -> f32 {
    return select(0.0, facet_pdf(facet_alpha(material), wo, wi), (wo.z > 0.0) & (wi.z > 0.0));
}

fn metal_sample(material: Material, wo: vec3f, u: vec2f) -> LobeSample {
    let alpha = facet_alpha(material);
    let m = ggx_sample(alpha, wo, u);
    let cosine = dot(wo, m);
    let wi = m * (2.0 * cosine) - wo;
    let lit = (wo.z > 0.0) & (wi.z > 0.0) & (cosine > 0.0);
    let weight = metal_factor(material, cosine) * facet_weight(alpha, wo, wi);
    let pdf = ggx_d(alpha, m) * 0.5 / max(wo.z + ggx_length(alpha, wo), 1e-30);
    return LobeSample(wi, select(vec3f(0.0), weight, lit), select(0.0, pdf, lit), 1.0);
}
