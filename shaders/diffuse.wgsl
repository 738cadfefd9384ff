// The material `diffuse`: Lambertian, or energy-preserving Oren-Nayar (EON) if rough.

// Cosines of the angles between normal, wi and wo.
struct Angles {
    wi: f32,               // cosine between normal and wi
    wo: f32,               // cosine between normal and wo
    between: f32,          // cosine between wi and wo
}

fn angles_at(normal: vec3f, wo: vec3f, wi: vec3f) -> Angles {
    return Angles(dot(normal, wi), dot(normal, wo), dot(wi, wo));
}

// Returns the BRDF times the cosine between wi and the normal.
fn diffuse_eval(material: Material, angles: Angles) -> vec3f {
    return material.diffuse * (max(angles.wi, 0.0) * 0.31830988618379067);
}

// Returns the BRDF times the cosine between wi and the normal: Fujii's Oren-Nayar model with multiple scattering,
// Lambertian at roughness 0. Portsmouth, Kutz and Hill, "EON: A Practical Energy-Preserving Rough Diffuse BRDF", 2024.
fn rough_diffuse_eval(material: Material, angles: Angles) -> vec3f {
    let wi = max(angles.wi, 0.0);
    let wo = max(angles.wo, 0.0);
    let r = material.roughness;
    let scale = 1.0 / (1.0 + r * 0.2877934092108062);
    let s = angles.between - wi * wo;
    let single = scale * (1.0 + r * s / select(1.0, max(max(wi, wo), 1e-6), s > 0.0));
    let lost_i = max(1.0 - scale * (1.0 + r * albedo_growth(wi)), 1e-6);
    let lost_o = max(1.0 - scale * (1.0 + r * albedo_growth(wo)), 1e-6);
    let mean = scale * (1.0 + r * 0.07248821245692394);
    let lost = max(1.0 - mean, 1e-6);
    let color = material.diffuse;
    let multiple = color * color * (mean * lost_i * lost_o / lost) / (vec3f(1.0) - color * (1.0 - mean));
    return (color * single + multiple) * (wi * 0.31830988618379067);
}

// Returns G / pi of the EON paper: the growth of the single-scattering albedo with roughness.
fn albedo_growth(cosine: f32) -> f32 {
    let s = sqrt(max(1.0 - cosine * cosine, 0.0));
    let angle = atan2(s, cosine);
    let tangent = s * cosine * (1.0 + s + s * s) / (1.0 + s); // tan (1 - sin^3)
    return (s * (angle - s * cosine) + 0.6666667 * (tangent - s)) * 0.31830988618379067;
}

fn diffuse_pdf(angles: Angles) -> f32 {
    return max(angles.wi, 0.0) * 0.31830988618379067;
}

fn diffuse_sample(normal: vec3f, u: vec2f) -> vec3f {
    return hemisphere_sample(normal, u);
}
