// The ellipsoid: the unit sphere of local space.

// The distance of the nearest hit in (0, limit), else `limit`. The discriminant comes from the vector between the
// centre and the ray's nearest point, which keeps its digits far away; the nearer root avoids cancellation: Haines,
// Guenther and Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019, ch. 7.
fn intersect_ellipsoid(q: Primitive, ray: Ray, limit: f32) -> f32 {
    let o = point_to_local(q, ray.origin);
    let d = vector_to_local(q, ray.direction);
    let a = dot(d, d);
    let b = dot(o, d);
    let nearest = o - d * (b / a);
    let discriminant = 1.0 - dot(nearest, nearest);
    let root = sqrt(a * max(discriminant, 0.0));
    let sum = select(-b - root, root - b, b < 0.0);
    let t0 = (dot(o, o) - 1.0) / sum;
    let t1 = sum / a;
    let near = min(t0, t1);
    let t = select(max(t0, t1), near, near > 0.0);
    return select(limit, t, (discriminant >= 0.0) & (t > 0.0) & (t < limit));
}

// Whether its surface cuts the segment o + s d, s in (0, reach), of local space. It does if the ends lie on different
// sides; or if both are outside, the nearest point to the centre is between them, and the line comes within the
// sphere: |o x d|^2 <= |d|^2 (Lagrange's identity for the discriminant, without its cancellation).
fn ellipsoid_blocks(o: vec3f, d: vec3f, reach: f32) -> bool {
    let a = dot(d, d);
    let b = dot(o, d);
    let start = dot(o, o) - 1.0;
    let end = start + reach * (2.0 * b + reach * a);
    let moment = cross(o, d);
    let passes = (b < 0.0) & (-b < reach * a) & (dot(moment, moment) <= a);
    return ((start < 0.0) & (end > 0.0)) | ((start > 0.0) & ((end < 0.0) | passes));
}
