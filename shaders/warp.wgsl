// Mappings from the unit square to points and directions.

// Samples the unit disk uniformly: Shirley and Chiu, "A Low Distortion Map between Disk and Square", Journal of
// Graphics Tools 2(3), 1997. Sine and cosine of angles up to pi / 4 are Taylor series, with an error below 3e-8.
fn disk_sample(u: vec2f) -> vec2f {
    let a = 2.0 * u.x - 1.0;
    let b = 2.0 * u.y - 1.0;
    let wide = abs(a) > abs(b);
    let r = select(b, a, wide);
    let part = select(a, b, wide) / select(r, 1.0, r == 0.0);
    let p2 = part * part;
    let y_tail = 0.0024903945 - p2 * (0.000036576205 - p2 * 3.1336164e-7);
    let y = part * (0.7853982 - p2 * (0.080745511 - p2 * y_tail));
    let x_tail = 0.00032599189 - p2 * 3.5908605e-6;
    let x = 1.0 - p2 * (0.30842513 - p2 * (0.015854344 - p2 * x_tail));
    return select(vec2f(y, x), vec2f(x, y), wide) * r;
}

// Samples a triangle uniformly, as barycentric coordinates of its second and third vertex: Heitz, "A Low-Distortion Map
// Between Triangle and Square", 2019.
fn triangle_sample(u: vec2f) -> vec2f {
    let upper = u.y > u.x;
    let x = select(u.x - 0.5 * u.y, 0.5 * u.x, upper);
    let y = select(0.5 * u.y, u.y - 0.5 * u.x, upper);
    return vec2f(x, y);
}

// Returns two unit vectors that complete a right-handed basis with n: Duff et al., "Building an Orthonormal Basis,
// Revisited", JCGT 6(1), 2017.
fn frame_around(n: vec3f) -> Tangents {
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    return Tangents(vec3f(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), vec3f(b, sign + n.y * n.y * a, -n.y));
}

// Rotates a vector from a local frame to a frame with the z axis n.
fn vector_around(n: vec3f, v: vec3f) -> vec3f {
    let frame = frame_around(n);
    return frame.u * v.x + frame.v * v.y + n * v.z;
}

// Samples a unit vector on the side of n proportionally to the cosine: disk points are projected to the hemisphere
// (Malley's method). The length is 1 within 3e-7.
fn hemisphere_sample(n: vec3f, u: vec2f) -> vec3f {
    let p = disk_sample(u);
    return vector_around(n, vec3f(p, sqrt(max(1.0 - p.x * p.x - p.y * p.y, 0.0))));
}

// Maps the unit disk to the spherical cap of height `cap_height` around z, preserving relative areas. The vector's
// length is 1 up to rounding.
fn cap_sample(p: vec2f, cap_height: f32) -> vec3f {
    let h = (p.x * p.x + p.y * p.y) * cap_height;
    return vec3f(p * sqrt(max(cap_height * (2.0 - h), 0.0)), 1.0 - h);
}
