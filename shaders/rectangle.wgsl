// The rectangle |x| <= 1, |y| <= 1, z = 0 in local space.

// Returns the t of the hit in (0, limit), else `limit`.
fn intersect_rectangle(q: Primitive, ray: Ray, limit: f32) -> f32 {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - q.anchor;
    let inside = (abs(dot(q.x, p)) <= 1.0) & (abs(dot(q.y, p)) <= 1.0);
    return select(limit, t, (t > 0.0) & (t < limit) & inside);
}

// Returns true if the rectangle occludes the local segment o + s d, s in (0, t_max).
fn rectangle_occludes(o: vec3f, d: vec3f, t_max: f32) -> bool {
    let p = scaled_crossing(o, d);
    return crosses_plane(o, d, t_max) & (abs(p.x) <= abs(d.z)) & (abs(p.y) <= abs(d.z));
}
