// Lights: the samples of one light, as seen from a point.

// The vector from p to the light's sample at (a, b) is towards + u a + v b.
struct Segments {
    towards: vec3f,
    u: vec3f,
    v: vec3f,
}

fn segments_to_light(light: Light, p: vec3f) -> Segments {
    return Segments(light.center - p * light.finite, light.u, light.v);
}

// The vectors to a light's samples in a primitive's local space.
fn segments_to_local(q: Primitive, to: Segments) -> Segments {
    return Segments(vector_to_local(q, to.towards), vector_to_local(q, to.u), vector_to_local(q, to.v));
}

// The one to the sample at `at` of the unit square.
fn segment(to: Segments, at: vec2f) -> vec3f {
    return to.towards + to.u * (2.0 * at.x - 1.0) + to.v * (2.0 * at.y - 1.0);
}

// How bright a spot is in the direction from which a point sees it, `to` being the vector from the point to the spot: the square of
// a ramp that is linear in the cosine, as glTF's KHR_lights_punctual has it, 1 in the middle. 1 - cosine is computed from the
// difference of two unit vectors, which loses nothing of small angles.
fn spot_falloff(light: Light, to: vec3f) -> f32 {
    let away = normalize(to) + light.normal;
    let ramp = (light.cone - 0.5 * dot(away, away)) * light.falloff;
    let bounded = min(max(ramp, 0.0), 1.0);
    return bounded * bounded;
}
