// The capped cylinder: the surface of x^2 + y^2 <= 1, |z| <= 1 in local space. The axes are perpendicular, and the x
// and y axes have equal lengths.

// Returns the levels of a local point, x^2 + y^2 - 1 and |z| - 1, both negative inside; `from_anchor` as in
// `ellipsoid_level`.
fn cylinder_levels(q: Primitive, from_anchor: vec3f) -> vec2f {
    let side = from_anchor.x * (from_anchor.x - q.middle.x * 2.0) + from_anchor.y * (from_anchor.y - q.middle.y * 2.0) + q.level;
    let top = from_anchor.z - (q.middle.z + 1.0);
    let bottom = (q.middle.z - 1.0) - from_anchor.z;
    return vec2f(side, max(top, bottom));
}

// Returns the interval of s, from x to y, where o + s d is inside; empty unless x < y. `levels` are the levels of o.
fn cylinder_interval(o: vec3f, d: vec3f, levels: vec2f) -> vec2f {
    // Side: as `ellipsoid_discriminant`, in two dimensions.
    let a = d.x * d.x + d.y * d.y;
    let b = o.x * d.x + o.y * d.y;
    let moment = o.x * d.y - o.y * d.x;
    let discriminant = select(a - moment * moment, b * b - a * levels.x, levels.x < 1.0);
    let root = sqrt(max(discriminant, 0.0));
    let sum = select(-b - root, root - b, b < 0.0);
    let s0 = levels.x / sum;
    let s1 = sum / a;
    let is_parallel = a == 0.0;
    // Negated comparisons, so that NaN is a miss.
    let misses = select(!(discriminant >= 0.0), !((levels.x <= 0.0) & (b == 0.0)), is_parallel);
    let near_side = select(min(s0, s1), -INFINITE_T, is_parallel);
    let far_side = select(max(s0, s1), INFINITE_T, is_parallel);
    // Caps: between the caps, z - 1 and -z - 1 are negative.
    let above = o.z > 0.0;
    let upper = select(-2.0 - levels.y, levels.y, above);
    let lower = select(levels.y, -2.0 - levels.y, above);
    let slope = select(d.z, 1e-30, d.z == 0.0);
    let s2 = -upper / slope;
    let s3 = lower / slope;
    let near = max(near_side, min(s2, s3));
    let far = min(far_side, max(s2, s3));
    return vec2f(select(near, INFINITE_T, misses), select(far, -INFINITE_T, misses));
}

// Returns the t of the nearest hit in (0, limit), else `limit`. With `from_inside`, the ray starts on the surface and
// goes inwards.
fn intersect_cylinder(q: Primitive, from_inside: bool, ray: Ray, limit: f32) -> f32 {
    let from_anchor = vector_to_local(q, ray.origin - q.anchor);
    let d = vector_to_local(q, ray.direction);
    let raw_levels = cylinder_levels(q, from_anchor);
    let levels = select(raw_levels, levels_on_surface(raw_levels, 0.0), from_inside);
    return nearest_end(cylinder_interval(from_anchor - q.middle, d, levels), limit);
}

// Returns true if the surface occludes the local segment o + s d, s in (0, t_max).
fn cylinder_occludes(o: vec3f, d: vec3f, levels: vec2f, t_max: f32) -> bool {
    return interval_occludes(cylinder_interval(o, d, levels), t_max);
}

// Returns true on the caps, false on the side.
fn is_on_cap(local: vec3f) -> bool {
    return local.z * local.z > local.x * local.x + local.y * local.y;
}

// Returns 1 on the end cap, -1 on the start cap.
fn cap_side(local: vec3f) -> f32 {
    return select(-1.0, 1.0, local.z > 0.0);
}

// Returns the gradient of (x^2 + y^2 - 1) / 2 on the side, and of |z| - 1 on the caps.
fn cylinder_gradient(local: vec3f) -> vec3f {
    return select(vec3f(local.x, local.y, 0.0), vec3f(0.0, 0.0, cap_side(local)), is_on_cap(local));
}

// Returns the change of `cylinder_gradient` for the offset d.
fn cylinder_gradient_derivative(local: vec3f, d: vec3f) -> vec3f {
    return select(vec3f(d.x, d.y, 0.0), vec3f(0.0), is_on_cap(local));
}

// Returns the value of the function whose gradient is `cylinder_gradient`.
fn cylinder_height(q: Primitive, from_anchor: vec3f) -> f32 {
    let levels = cylinder_levels(q, from_anchor);
    return select(0.5 * levels.x, levels.y, is_on_cap(from_anchor - q.middle));
}

// Returns the texture coordinates. On the side: u is the longitude, and v is 0 to 1 from start to end. On the caps: as
// on a disk, mirrored on the start cap, which faces the opposite direction.
fn cylinder_uv(local: vec3f) -> vec2f {
    let cap = vec2f(0.5 * local.x + 0.5, 0.5 * (local.y * cap_side(local)) + 0.5);
    return select(vec2f(longitude(local), 0.5 * local.z + 0.5), cap, is_on_cap(local));
}

// Returns the change of `cylinder_uv` for the offset d.
fn cylinder_uv_derivative(local: vec3f, d: vec3f) -> vec2f {
    let cap = vec2f(0.5 * d.x, 0.5 * (d.y * cap_side(local)));
    let du = (local.x * d.y - local.y * d.x) / max(local.x * local.x + local.y * local.y, 1e-12);
    return select(vec2f(du * 0.15915494309189535, 0.5 * d.z), cap, is_on_cap(local));
}

// Returns the derivative of the local position by u.
fn cylinder_tangent(local: vec3f) -> vec3f {
    return select(vec3f(-local.y, local.x, 0.0) * 6.283185307179586, vec3f(2.0, 0.0, 0.0), is_on_cap(local));
}

// Returns the derivative of the local position by v.
fn cylinder_bitangent(local: vec3f) -> vec3f {
    return select(vec3f(0.0, 0.0, 2.0), vec3f(0.0, 2.0 * cap_side(local), 0.0), is_on_cap(local));
}
