// Points of what shines as seen from another point, and how densely they lie.

// The density per solid angle of a point in the direction and distance of `to`, on a surface with this unit normal, where it is
// `density` per area.
fn solid_angle_pdf(density: f32, to: vec3f, normal: vec3f) -> f32 {
    let d2 = dot(to, to);
    return density * d2 * sqrt(d2) / abs(dot(normal, to));
}

// An ellipsoid's area, within a sixth: exact for a sphere. It is the root of the mean square of what the map from the unit sphere
// does to areas there.
fn ellipsoid_area(q: Primitive) -> f32 {
    return 7.255197456936871 * sqrt(dot(q.x, q.x) + dot(q.y, q.y) + dot(q.z, q.z)) / abs(q.determinant);
}

// The height of the cap of directions in which the unit sphere is seen from a point of its own space, by that point's |o|^2 - 1:
// 1 minus the cosine of half the cone's angle; 2, which is all directions, from inside.
fn ellipsoid_cap(level: f32) -> f32 {
    let sine2 = 1.0 / (1.0 + level);
    return select(2.0, sine2 / (1.0 + sqrt(max(1.0 - sine2, 0.0))), level > 0.0);
}

// From p to a point of an ellipsoid: in its space, where it is the unit sphere, all directions that meet it are alike.
fn ellipsoid_sample(q: Primitive, p: vec3f, u: vec2f) -> vec3f {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let level = ellipsoid_level(q, from_anchor);
    let axis = select(vec3f(0.0, 0.0, 1.0), -normalize(o), level > 0.0);
    let direction = normalize(vector_around(axis, cap_sample(disk_sample(u), ellipsoid_cap(level))));
    let b = dot(o, direction);
    let root = sqrt(max(ellipsoid_discriminant(o, direction, level), 0.0));
    let outside = level / (root - b);
    let inside = select(root - b, -level / (b + root), b > 0.0);
    return vector_to_world(q, direction * select(inside, outside, level > 0.0));
}

// The density of the direction of `ellipsoid_sample`, per solid angle. The map of directions from the ellipsoid's space has the
// derivative |l|^3 / det, for the local vector l of a unit vector of the world.
fn ellipsoid_pdf(q: Primitive, p: vec3f, wi: vec3f) -> f32 {
    let cap = ellipsoid_cap(ellipsoid_level(q, vector_to_local(q, p - q.anchor)));
    let l = vector_to_local(q, wi);
    let l2 = dot(l, l);
    return 0.15915494309189535 / cap * abs(q.determinant) / (l2 * sqrt(l2));
}

// The weight of a sample whose direction has the density `own`, where another way to find it has the density `other`: the power
// heuristic with the exponent 2, Veach's thesis, section 9.2.4. 0 for what has no density.
fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    return select(0.0, 1.0 / (1.0 + ratio * ratio), own > 0.0);
}

// The upper 32 bits of a product: a whole number below `count`, uniform where the bits are.
fn whole_below(bits: u32, count: u32) -> u32 {
    let low = (bits & 0xffffu) * (count & 0xffffu);
    let middle = (bits >> 16u) * (count & 0xffffu) + (low >> 16u);
    let cross = (bits & 0xffffu) * (count >> 16u) + (middle & 0xffffu);
    return (bits >> 16u) * (count >> 16u) + (middle >> 16u) + (cross >> 16u);
}
