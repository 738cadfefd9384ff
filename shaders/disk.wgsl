// The disk: x^2 + y^2 <= 1, z = 0 in local space.

// Returns the t of the hit in (0, limit), else `limit`.
fn intersect_disk(q: Primitive, ray: Ray, limit: f32) -> f32 {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - q.anchor;
    let x = dot(q.x, p);
    let y = dot(q.y, p);
    return select(limit, t, (t > 0.0) & (t < limit) & (x * x + y * y <= 1.0));
}

// Returns true if the disk occludes the local segment o + s d, s in (0, t_max).
fn disk_occludes(o: vec3f, d: vec3f, t_max: f32) -> bool {
    let p = scaled_crossing(o, d);
    return crosses_plane(o, d, t_max) & (p.x * p.x + p.y * p.y <= d.z * d.z);
}
