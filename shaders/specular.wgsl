// Mirrors and glass.

// The direction d (towards the surface) after reflection by a surface with the normal n.
fn reflected_direction(d: vec3f, n: vec3f) -> vec3f {
    return d - n * (2.0 * dot(d, n));
}

// The direction after refraction; n is on the side that d comes from, where its angle has `cosine_i`; `eta` is the ratio
// of the index of refraction there to the one behind the surface, `cosine_t` belongs to the refracted direction.
fn refracted_direction(d: vec3f, n: vec3f, eta: f32, cosine_i: f32, cosine_t: f32) -> vec3f {
    return d * eta + n * (eta * cosine_i - cosine_t);
}

// Snell's law for cosines; 0 where all light is reflected. Exactly `cosine_i` where eta is 1.
fn refracted_cosine(cosine_i: f32, eta: f32) -> f32 {
    return sqrt(max((1.0 - eta * eta) + eta * eta * (cosine_i * cosine_i), 0.0));
}

// The share of unpolarised light that is reflected, by Fresnel's equations (Born and Wolf, "Principles of Optics",
// 1.5.2); exactly 1 where `cosine_t` is 0.
fn fresnel(cosine_i: f32, cosine_t: f32, eta: f32) -> f32 {
    let s = (eta * cosine_i - cosine_t) / (eta * cosine_i + cosine_t);
    let p = (cosine_i - eta * cosine_t) / (cosine_i + eta * cosine_t);
    return 0.5 * (s * s + p * p);
}
