// The GGX microfacet distribution. In local vectors z is along the normal, x and y along the axes of the two `alpha`.
// Each `alpha` is at least SMALLEST_ALPHA.

// Returns the density of normals, per solid angle and area: Trowbridge and Reitz, "Average irregularity representation
// of a rough surface for ray reflection", JOSA 65(5), 1975. Uses the tangential components of m, because 1 - cos^2
// would lose precision on smooth surfaces.
fn ggx_d(alpha: vec2f, m: vec3f) -> f32 {
    let x = m.x / alpha.x;
    let y = m.y / alpha.y;
    let s = x * x + y * y + m.z * m.z;
    return select(0.0, 0.31830988618379067 / (alpha.x * alpha.y * s * s), m.z > 0.0);
}

// Returns the length of w, stretched to the hemispherical configuration.
fn ggx_length(alpha: vec2f, w: vec3f) -> f32 {
    let x = w.x * alpha.x;
    let y = w.y * alpha.y;
    return sqrt(x * x + y * y + w.z * w.z);
}

// Returns Smith's masking function: Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs",
// JCGT 3(2), 2014, equations 43 and 86.
fn ggx_g1(alpha: vec2f, w: vec3f) -> f32 {
    let cosine = abs(w.z);
    return 2.0 * cosine / max(cosine + ggx_length(alpha, w), 1e-30);
}

// Returns height-correlated masking-shadowing: equation 99 of the same paper.
fn ggx_g2(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    let o = abs(wo.z);
    let i = abs(wi.z);
    return 2.0 * i * o / max(o * ggx_length(alpha, wi) + i * ggx_length(alpha, wo), 1e-30);
}

// Samples a normal visible from wo: Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023.
fn ggx_sample(alpha: vec2f, wo: vec3f, u: vec2f) -> vec3f {
    let stretched = normalize(vec3f(wo.x * alpha.x, wo.y * alpha.y, wo.z));
    let middle = cap_sample(disk_sample(u), 1.0 + stretched.z) + stretched;
    let m = vec3f(middle.x * alpha.x, middle.y * alpha.y, max(middle.z, 0.0));
    let length2 = dot(m, m);
    return select(vec3f(0.0, 0.0, 1.0), m * (1.0 / sqrt(length2)), length2 > 1e-20);
}

// Returns the pdf of `ggx_sample`, per solid angle.
fn ggx_pdf(alpha: vec2f, wo: vec3f, m: vec3f) -> f32 {
    return 2.0 * max(dot(wo, m), 0.0) * ggx_d(alpha, m) / max(wo.z + ggx_length(alpha, wo), 1e-30);
}

// Returns the single-scattering albedo at the cosine mu, F0 x + F90 y, for Schlick's Fresnel term ("An Inexpensive BRDF
// Model for Physically-based Rendering", Eurographics 1994).
fn ggx_albedo(alpha: f32, mu: f32) -> vec2f {
    let length = sqrt(alpha * alpha * (1.0 - mu * mu) + mu * mu);
    return ggx_albedo_fit(alpha, mu / length, length);
}

// Approximates the albedo for two different alphas: masking uses the alpha along w, and shadowing uses the root mean
// square of the two alphas. The error is within 7 % if one alpha is 1 and the other is small, else within 2 %.
fn ggx_albedo_along(alpha: vec2f, w: vec3f) -> vec2f {
    let square = 0.5 * (alpha.x * alpha.x + alpha.y * alpha.y);
    let length = sqrt(square * (1.0 - w.z * w.z) + w.z * w.z);
    return ggx_albedo_fit(sqrt(square), abs(w.z) / ggx_length(alpha, w), length);
}

// Evaluates the fits of `scripts/fit-albedo`, where l is `ggx_length` and t the cosine divided by l. y is within 0.004,
// and x + y within 0.5 % (relative).
fn ggx_albedo_fit(alpha: f32, t: f32, l: f32) -> vec2f {
    let a = alpha;
    let lost_0 = 0.00548034 + t * (0.0632291 + t * (1.18311 - t * 1.24938));
    let lost_1 = -0.0095148 + t * (0.365153 - t * (0.350613 + t * 0.129283));
    let lost_2 = 0.00812975 + t * (1.56884 + t * (1.18546 - t * 1.09209));
    let divisor_0 = 1.0 + t * (3.34908 - t * (1.5592 + t * 1.9202));
    let divisor_1 = t * (t * 1.2091 - 0.391082) - 1.12089;
    let divisor_2 = 0.644689 + t * 1.02691;
    let lost = (lost_0 + a * (lost_1 + a * lost_2)) / (divisor_0 + a * (divisor_1 + a * divisor_2));
    let edge_0 = 0.966613 + l * (2.47501 - l * (12.6147 - l * (22.9802 - l * (18.2852 - l * 5.3897))));
    let edge_1 = -0.386341 - l * (7.14816 - l * (8.05595 - l * (7.34351 - l * 1.95036)));
    let edge_2 = -0.489888 + l * (9.38023 - l * (2.59002 - l * 2.93296));
    let edge_3 = 0.498131 - l * (5.66461 + l * 1.88525);
    let edge_4 = -0.553876 + l * 2.07251;
    let edge = edge_0 + t * (edge_1 + t * (edge_2 + t * (edge_3 + t * (edge_4 + t * 0.267055))));
    let edge_divisor = 1.0 + l * (17.865 + l * 1.84166) - t * (0.237295 + l * 15.3236 + t * 0.459621);
    let y = max(edge / edge_divisor, 0.0);
    return vec2f(max(1.0 - lost - y, 0.0), y);
}
