// The triangle x >= 0, y >= 0, x + y <= 1, z = 0 in local space: x and y are the barycentric coordinates of the second
// and third vertex.

// Returns the t of the hit in (0, limit), else `limit`.
fn intersect_triangle(q: Primitive, ray: Ray, limit: f32) -> f32 {
    let t = plane_distance(q, ray);
    let p = ray.origin + ray.direction * t - q.anchor;
    let x = dot(q.x, p);
    let y = dot(q.y, p);
    let inside = (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0);
    return select(limit, t, (t > 0.0) & (t < limit) & inside);
}

// Returns true if the triangle occludes the local segment o + s d, s in (0, t_max).
fn triangle_occludes(o: vec3f, d: vec3f, t_max: f32) -> bool {
    let p = scaled_crossing(o, d);
    return crosses_plane(o, d, t_max) & (p.x >= 0.0) & (p.y >= 0.0) & (p.x + p.y <= abs(d.z));
}
