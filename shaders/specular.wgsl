// Specular reflection and refraction.

// Reflects direction d, towards the surface, at n.
fn reflected_direction(d: vec3f, n: vec3f) -> vec3f {
    return d - n * (2.0 * dot(d, n));
}

// Refracts direction d at the normal n, which is on the side that d comes from. `eta` is the index of refraction on
// that side, relative to the index on the other; `cosine_i` and `cosine_t` are the cosines of the incident and the
// refracted direction.
fn refracted_direction(d: vec3f, n: vec3f, eta: f32, cosine_i: f32, cosine_t: f32) -> vec3f {
    return d * eta + n * (eta * cosine_i - cosine_t);
}

// Returns the refracted cosine by Snell's law; 0 on total internal reflection. Exactly `cosine_i` if eta is 1.
fn refracted_cosine(cosine_i: f32, eta: f32) -> f32 {
    return sqrt(max((1.0 - eta * eta) + eta * eta * (cosine_i * cosine_i), 0.0));
}

// Returns the Fresnel reflectance for unpolarized light (Born and Wolf, "Principles of Optics", 1.5.2); exactly 1 if
// `cosine_t` is 0.
fn fresnel(cosine_i: f32, cosine_t: f32, eta: f32) -> f32 {
    let s = (eta * cosine_i - cosine_t) / (eta * cosine_i + cosine_t);
    let p = (cosine_i - eta * cosine_t) / (cosine_i + eta * cosine_t);
    return 0.5 * (s * s + p * p);
}
