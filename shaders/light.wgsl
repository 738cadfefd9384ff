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

fn segments_to_local(q: Primitive, to: LightSegments) -> LightSegments {
    return LightSegments(vector_to_local(q, to.towards), vector_to_local(q, to.u), vector_to_local(q, to.v));
}

// Returns the vector to `at` in the unit square.
fn segment(to: LightSegments, at: vec2f) -> vec3f {
    return to.towards + to.u * (2.0 * at.x - 1.0) + to.v * (2.0 * at.y - 1.0);
}

// Returns a spot light's relative intensity: a squared ramp in the cosine, as in glTF's KHR_lights_punctual. `to` is
// the vector to the light. The difference of unit vectors gives 1 - cosine with the digits of small angles.
fn spot_falloff(light: Light, to: vec3f) -> f32 {
    let away = normalize(to) + light.normal;
    let ramp = (light.cone - 0.5 * dot(away, away)) * light.falloff;
    let bounded = min(max(ramp, 0.0), 1.0);
    return bounded * bounded;
}
