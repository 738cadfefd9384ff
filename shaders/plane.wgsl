// The infinite plane z = 0 in local space.

// Returns the t of the hit in (0, limit), else `limit`.
fn intersect_plane(q: Primitive, ray: Ray, limit: f32) -> f32 {
    let t = plane_distance(q, ray);
    return select(limit, t, (t > 0.0) & (t < limit));
}

// Returns true if the plane occludes the local segment o + s d, s in (0, t_max).
fn plane_occludes(o: vec3f, d: vec3f, t_max: f32) -> bool {
    return crosses_plane(o, d, t_max);
}
