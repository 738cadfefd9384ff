// The ellipsoid: the unit sphere in local space.

// Returns |l|^2 - 1 for a local position l = `from_anchor` - `q.middle`; negative inside. `from_anchor` is p - anchor
// in local space. The square is expanded, and `q.level` is the precomputed |middle|^2 - 1. This avoids cancellation
// near the anchor, where `from_anchor` is short.
fn ellipsoid_level(q: Primitive, from_anchor: vec3f) -> f32 {
    return dot(from_anchor, from_anchor - q.middle * 2.0) + q.level;
}

// Returns the quarter discriminant of |o + s d|^2 = 1, in one of two equal forms (Lagrange's identity). (o.d)^2 - d.d
// `start_level`, where `start_level` is |o|^2 - 1, is precise near the surface; d.d - |o x d|^2 is precise far from the
// surface.
fn ellipsoid_discriminant(o: vec3f, d: vec3f, start_level: f32) -> f32 {
    let a = dot(d, d);
    let b = dot(o, d);
    let moment = cross(o, d);
    return select(a - dot(moment, moment), b * b - a * start_level, start_level < 1.0);
}

// Returns the angle from the first towards the second axis, in turns.
fn longitude(local: vec3f) -> f32 {
    let turn = atan2(local.y, local.x) * 0.15915494309189535;
    return select(turn, turn + 1.0, turn < 0.0);
}

// Returns the t of the nearest hit in (0, limit), else `limit`. With `from_inside`, the ray starts on the surface and
// goes inwards, and the hit is the other end of the chord. The nearer root avoids cancellation: Haines, Guenther and
// Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019, ch. 7.
fn intersect_ellipsoid(q: Primitive, from_inside: bool, ray: Ray, limit: f32) -> f32 {
    let from_anchor = vector_to_local(q, ray.origin - q.anchor);
    let o = from_anchor - q.middle;
    let d = vector_to_local(q, ray.direction);
    let a = dot(d, d);
    let b = dot(o, d);
    let start_level = select(ellipsoid_level(q, from_anchor), 0.0, from_inside);
    let discriminant = ellipsoid_discriminant(o, d, start_level);
    let root = sqrt(max(discriminant, 0.0));
    let sum = select(-b - root, root - b, b < 0.0);
    let t0 = start_level / sum;
    let t1 = sum / a;
    let near = min(t0, t1);
    let t = select(max(t0, t1), near, near > 0.0);
    return select(limit, t, (discriminant >= 0.0) & (t > 0.0) & (t < limit));
}

// Returns true if the surface occludes the segment o + s d, s in (0, t_max): the ends lie on different sides, or both
// ends are outside, the point nearest to the center is in between, and the line hits the sphere.
fn ellipsoid_occludes(o: vec3f, d: vec3f, start_level: f32, t_max: f32) -> bool {
    let a = dot(d, d);
    let b = dot(o, d);
    let end_level = start_level + t_max * (2.0 * b + t_max * a);
    let crosses_twice = (b < 0.0) & (-b < t_max * a) & (ellipsoid_discriminant(o, d, start_level) >= 0.0);
    return ((start_level < 0.0) != (end_level < 0.0)) | ((start_level > 0.0) & crosses_twice);
}
