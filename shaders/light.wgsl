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
