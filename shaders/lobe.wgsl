// Lobes of rough surfaces: the frame that they lie in, and how rough they are along its two axes.

// A way on from a surface, in its lobe's frame.
struct LobeSample {
    wi: vec3f,             // z < 0: through the surface
    weight: vec3f,         // the BSDF times the cosine, divided by the density; 0 where nothing goes on
    pdf: f32,              // per solid angle
    eta: f32,              // the ratio of the indices before and behind the surface if it passes, else 1
}

// The squares of the roughness along the two axes: Burley, "Physically Based Shading at Disney", 2012, section 5.4; anisotropy as
// glTF's extension KHR_materials_anisotropy has it.
fn plain_alpha(material: Material) -> vec2f {
    let across = material.roughness * material.roughness;
    let along = across + (1.0 - across) * (material.anisotropy * material.anisotropy);
    return vec2f(along, across);
}

// Whether facets differ so little that the lobe is one direction.
fn is_polished(material: Material) -> bool {
    return plain_alpha(material).x < SMALLEST_ALPHA;
}

// The alpha of a lobe that is none.
fn facet_alpha(material: Material) -> vec2f {
    let alpha = plain_alpha(material);
    return vec2f(max(alpha.x, SMALLEST_ALPHA), max(alpha.y, SMALLEST_ALPHA));
}

// The axes of a lobe beside the shading normal: the first is the texture's u, turned towards its v by so many half turns. Any axes
// where there are no texture coordinates to say them.
fn lobe_frame(surface: Surface, rotation: f32) -> Tangents {
    let n = surface.shading_normal;
    let along = surface.du - n * dot(n, surface.du);
    let length2 = dot(along, along);
    let usable = (length2 > 1e-12 * dot(surface.du, surface.du)) & (length2 < 1e30);
    let other = frame_around(n);
    let first = select(other.u, along * (1.0 / sqrt(max(length2, 1e-30))), usable);
    let across = cross(n, first);
    let second = across * select(-1.0, 1.0, dot(across, surface.dv) >= 0.0);
    let u = normalize(first * sine(rotation + 0.5) + second * sine(rotation));
    return Tangents(u, cross(n, u));
}

// How far a direction, whose parts along u and v are red and green from 0 to 1 as -1 to 1, is turned from u towards v, in half turns; 0 where
// it has no length: KHR_materials_anisotropy.
fn direction_turn(color: vec3f) -> f32 {
    return atan2(2.0 * color.y - 1.0, 2.0 * color.x - 1.0) * 0.31830988618379067;
}

// A vector in a lobe's frame.
fn vector_to_lobe(frame: Tangents, n: vec3f, w: vec3f) -> vec3f {
    return vec3f(dot(frame.u, w), dot(frame.v, w), dot(n, w));
}

// The same out of it again.
fn vector_from_lobe(frame: Tangents, n: vec3f, w: vec3f) -> vec3f {
    return frame.u * w.x + frame.v * w.y + n * w.z;
}

// The normal of the facets that mirror one direction to the other; the surface's where they are opposite.
fn half_vector(wo: vec3f, wi: vec3f) -> vec3f {
    let sum = wo + wi;
    let length2 = dot(sum, sum);
    return select(vec3f(0.0, 0.0, 1.0), sum * (1.0 / sqrt(length2)), length2 > 1e-20);
}

// What facets mirror from wi to wo if all light is reflected, times the cosine of wi: D G2 / (4 cos).
fn facet_eval(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    let o = abs(wo.z);
    let i = abs(wi.z);
    let seen = 0.5 * i / max(o * ggx_length(alpha, wi) + i * ggx_length(alpha, wo), 1e-30);
    return ggx_d(alpha, half_vector(wo, wi)) * seen;
}

// The density of directions that are mirrored by visible normals, per solid angle.
fn facet_pdf(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    return ggx_d(alpha, half_vector(wo, wi)) * 0.5 / max(wo.z + ggx_length(alpha, wo), 1e-30);
}

// The quotient of both.
fn facet_weight(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    let length = ggx_length(alpha, wo);
    return wi.z * (wo.z + length) / max(wo.z * ggx_length(alpha, wi) + wi.z * length, 1e-30);
}

// Where a direction lies in a table of facets that are rougher along x: by its direction along the surface, from across the streaks, 0, to along
// them, 1, finer where less and less roughness is seen; and by its cosine, finer near 0 where little is seen.
fn streak_place(alpha: vec2f, w: vec3f) -> vec2f {
    let x = alpha.x * w.x;
    let y = alpha.y * w.y;
    let square = (x * x + y * y) / max(w.x * w.x + w.y * w.y, 1e-30);
    let seen = max(sqrt(square), alpha.y);
    let line = sqrt(min((seen - alpha.y) / max(alpha.x - alpha.y, 1e-6), 1.0));
    let half_way = 0.5 * sqrt(seen);
    let cosine = min(max(w.z, 0.0), 1.0);
    return vec2f(line, 0.5 * (cosine + cosine * (1.0 + half_way) / (cosine + half_way)));
}

// What facets do not reflect at once, but after further bounces between them, as a multiple of what they do, for light from everywhere.
// Less by the error of the fit, which so makes no light. Where they are rougher along one axis a table knows better.
fn facet_loss(alpha: vec2f, wo: vec3f) -> f32 {
    let once = ggx_albedo_along(alpha, wo);
    return max(1.0 / (once.x + once.y) - 1.005, 0.0);
}
