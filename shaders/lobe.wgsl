// Microfacet lobes: frame, anisotropy, and GGX reflection.

// A sampled direction, in the frame of the lobe.
struct LobeSample {
    wi: vec3f,             // z < 0: transmitted
    weight: vec3f,         // BSDF times cosine over pdf; 0 if the path ends
    pdf: f32,              // per solid angle
    eta: f32,              // ratio of the indices in front of and behind the surface if transmitted, else 1
}

// Returns alpha along the two axes of the lobe: Burley, "Physically Based Shading at Disney", 2012, section 5.4, with
// the anisotropy of KHR_materials_anisotropy (glTF).
fn plain_alpha(material: Material) -> vec2f {
    let alpha_v = material.roughness * material.roughness;
    let alpha_u = alpha_v + (1.0 - alpha_v) * (material.anisotropy * material.anisotropy);
    return vec2f(alpha_u, alpha_v);
}

fn is_polished(material: Material) -> bool {
    return plain_alpha(material).x < SMALLEST_ALPHA;
}

// Returns alpha along the two axes, at least SMALLEST_ALPHA, for lobes that are not deltas.
fn facet_alpha(material: Material) -> vec2f {
    let alpha = plain_alpha(material);
    return vec2f(max(alpha.x, SMALLEST_ALPHA), max(alpha.y, SMALLEST_ALPHA));
}

// Returns the axes of a lobe around the shading normal: the direction of texture u, rotated towards v by `rotation`
// half turns; arbitrary axes without usable texture coordinates.
fn lobe_frame(surface: Surface, rotation: f32) -> Tangents {
    let n = surface.shading_normal;
    let tangent = surface.du - n * dot(n, surface.du);
    let length2 = dot(tangent, tangent);
    let is_usable = (length2 > 1e-12 * dot(surface.du, surface.du)) & (length2 < 1e30);
    let fallback = frame_around(n);
    let first = select(fallback.u, tangent * (1.0 / sqrt(max(length2, 1e-30))), is_usable);
    let perpendicular = cross(n, first);
    let second = perpendicular * select(-1.0, 1.0, dot(perpendicular, surface.dv) >= 0.0);
    let u = normalize(first * sine(rotation + 0.5) + second * sine(rotation));
    return Tangents(u, cross(n, u));
}

// Decodes the direction in a texel's red and green channels, where 0 to 1 encode -1 to 1 (KHR_materials_anisotropy).
// Returns the angle of the direction, measured from u towards v, in half turns; 0 for the zero vector.
fn direction_turn(color: vec3f) -> f32 {
    return atan2(2.0 * color.y - 1.0, 2.0 * color.x - 1.0) * 0.31830988618379067;
}

fn vector_to_lobe(frame: Tangents, n: vec3f, w: vec3f) -> vec3f {
    return vec3f(dot(frame.u, w), dot(frame.v, w), dot(n, w));
}

fn vector_from_lobe(frame: Tangents, n: vec3f, w: vec3f) -> vec3f {
    return frame.u * w.x + frame.v * w.y + n * w.z;
}

// Returns the microfacet normal of a reflection; for opposite directions, the surface normal.
fn half_vector(wo: vec3f, wi: vec3f) -> vec3f {
    let sum = wo + wi;
    let length2 = dot(sum, sum);
    return select(vec3f(0.0, 0.0, 1.0), sum * (1.0 / sqrt(length2)), length2 > 1e-20);
}

// Returns the BRDF with a Fresnel term of 1, times the cosine between wi and the normal: D G2 / (4 cos).
fn facet_eval(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    let o = abs(wo.z);
    let i = abs(wi.z);
    let masking = 0.5 * i / max(o * ggx_length(alpha, wi) + i * ggx_length(alpha, wo), 1e-30);
    return ggx_d(alpha, half_vector(wo, wi)) * masking;
}

// Returns the pdf, per solid angle, of directions reflected about sampled visible normals (VNDF).
fn facet_pdf(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    return ggx_d(alpha, half_vector(wo, wi)) * 0.5 / max(wo.z + ggx_length(alpha, wo), 1e-30);
}

// Returns `facet_eval` / `facet_pdf`.
fn facet_weight(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    let length = ggx_length(alpha, wo);
    return wi.z * (wo.z + length) / max(wo.z * ggx_length(alpha, wi) + wi.z * length, 1e-30);
}

// Returns the position of w in an anisotropic albedo table, 0 to 1. x depends on the roughness in the azimuth of w,
// from alpha.y to alpha.x, with finer steps near alpha.y. y depends on the cosine, with finer steps near 0 at low
// roughness.
fn aniso_table_position(alpha: vec2f, w: vec3f) -> vec2f {
    let x = alpha.x * w.x;
    let y = alpha.y * w.y;
    let square = (x * x + y * y) / max(w.x * w.x + w.y * w.y, 1e-30);
    let roughness = max(sqrt(square), alpha.y);
    let line = sqrt(min((roughness - alpha.y) / max(alpha.x - alpha.y, 1e-6), 1.0));
    let half_way = 0.5 * sqrt(roughness);
    let cosine = min(max(w.z, 0.0), 1.0);
    return vec2f(line, 0.5 * (cosine + cosine * (1.0 + half_way) / (cosine + half_way)));
}

// Returns the energy that single scattering loses, as a multiple of the single-scattering albedo, reduced by the error
// of the fit so that compensation creates no energy.
fn facet_loss(alpha: vec2f, wo: vec3f) -> f32 {
    let albedo = ggx_albedo_along(alpha, wo);
    return max(1.0 / (albedo.x + albedo.y) - 1.005, 0.0);
}
