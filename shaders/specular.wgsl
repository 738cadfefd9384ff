// Specular reflection and refraction.

// Reflects the direction d, which points towards the surface, about the normal n.
fn reflected_direction(d: vec3f, n: vec3f) -> vec3f {
    return d - n * (2.0 * dot(d, n));
}

// Refracts direction d at the normal n, which is on the side of the incident ray. `eta` is the index of refraction on
// that side, relative to the index on the other side; `cosine_i` and `cosine_t` are the cosines of the incident and the
// refracted direction.
fn refracted_direction(d: vec3f, n: vec3f, eta: f32, cosine_i: f32, cosine_t: f32) -> vec3f {
    return d * eta + n * (eta * cosine_i - cosine_t);
}

// Returns the cosine of the refracted direction by Snell's law; 0 on total internal reflection, exactly `cosine_i` if
// eta is 1.
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
