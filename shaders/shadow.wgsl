// Shadow rays from a point to a block of at most 32 samples of a light. Terms that depend only on primitive, point and
// light are computed once, and the loop loads no primitive.

struct SampleBlock {
    pattern: u32,
    side: u32,
    first: u32,            // first sample of the light
    count: u32,            // 1 to SAMPLE_BLOCK
    group: u32,
    key: vec2u,
}

// Returns the mask of samples that the primitive occludes from p. Callers pass a constant for `kind`, so that code for
// other kinds is removed. With `from_inside`, p is on a solid seen from inside (`solid_levels`).
fn occlusion_mask(kind: u32, q: Primitive, p: vec3f, from_inside: bool, light: Light, block: SampleBlock) -> u32 {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let levels = solid_levels(kind, q, from_anchor, from_inside);
    let segments = segments_to_local(q, segments_to_light(light, p));
    var bits = 0u;
    for (var i = 0u; i < block.count; i++) {
        let d = segment(segments, block_sample(block, i));
        bits |= select(0u, 1u << i, occludes(kind, o, d, levels, light.t_max));
    }
    return bits;
}

// Returns true if the primitive occludes the segment p + s `to_light`, s in (0, t_max).
fn occludes_segment(kind: u32, q: Primitive, p: vec3f, from_inside: bool, to_light: vec3f, t_max: f32) -> bool {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let levels = solid_levels(kind, q, from_anchor, from_inside);
    return occludes(kind, from_anchor - q.middle, vector_to_local(q, to_light), levels, t_max);
}

fn block_sample(block: SampleBlock, i: u32) -> vec2f {
    return sample_square(block.pattern, block.side, block.first + i, block.group, block.key);
}

// The shadow rays from p to a light: s (towards + u a + v b) for s >= 0 and a, b in -1..=1.
struct ShadowFrustum {
    apex: vec3f,
    segments: LightSegments,
    length2: f32,          // |towards|^2
    inverse_depth: f32,    // 1 / (the minimum of dot(towards, ray)); negative if the minimum is not positive
}

fn light_frustum(light: Light, p: vec3f) -> ShadowFrustum {
    let segments = segments_to_light(light, p);
    let length2 = dot(segments.towards, segments.towards);
    let depth = length2 - abs(dot(segments.towards, segments.u)) - abs(dot(segments.towards, segments.v));
    return ShadowFrustum(p, segments, length2, select(-1.0, 1.0 / depth, depth > 0.0));
}

// Returns false if a plane through the apex separates the sphere from the frustum. The plane's normal is n = m - slope
// * `towards`, where m is the part of the vector to the sphere's center that is perpendicular to `towards`, and `slope`
// is the smallest slope with which all rays stay below the plane.
fn may_block(sphere: Sphere, frustum: ShadowFrustum) -> bool {
    let w = sphere.center - frustum.apex;
    let along = dot(w, frustum.segments.towards);
    let m = w - frustum.segments.towards * (along / frustum.length2);
    let m2 = dot(m, m);
    let slope = (abs(dot(m, frustum.segments.u)) + abs(dot(m, frustum.segments.v))) * frustum.inverse_depth;
    let height = m2 - slope * along;
    let radius2 = sphere.radius * sphere.radius;
    return (slope < 0.0) | (height <= 0.0)
        | (height * height <= radius2 * (m2 + slope * slope * frustum.length2));
}
