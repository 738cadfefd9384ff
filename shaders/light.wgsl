// Vectors to the samples of a light, and the falloff of spot lights.

// Vectors `towards + u a + v b` from a point to a light's samples, a and b in -1..1.
struct LightSegments {
    towards: vec3f,
    u: vec3f,
    v: vec3f,
}

fn segments_to_light(light: Light, p: vec3f) -> LightSegments {
    return LightSegments(light.center - p * light.finite, light.u, light.v);
}

fn segments_to_local(q: Primitive, segments: LightSegments) -> LightSegments {
    return LightSegments(vector_to_local(q, segments.towards), vector_to_local(q, segments.u), vector_to_local(q, segments.v));
}

// Returns the vector to the sample `at` in the unit square.
fn segment(segments: LightSegments, at: vec2f) -> vec3f {
    return segments.towards + segments.u * (2.0 * at.x - 1.0) + segments.v * (2.0 * at.y - 1.0);
}

// Returns a spot light's relative intensity: the square of a ramp in the cosine, as in glTF's KHR_lights_punctual.
// Computes 1 - cosine from the difference of unit vectors, which is precise for small angles.
fn spot_falloff(light: Light, to_light: vec3f) -> f32 {
    let difference = normalize(to_light) + light.normal;
    let ramp = (light.cone - 0.5 * dot(difference, difference)) * light.falloff;
    let bounded = min(max(ramp, 0.0), 1.0);
    return bounded * bounded;
}
