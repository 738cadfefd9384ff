// Samples of emitters as seen from a point, and their pdfs.

// Converts the pdf `density` from area to solid angle. `to_light` is the vector to the point on the light, and `normal`
// the unit normal there.
fn solid_angle_pdf(density: f32, to_light: vec3f, normal: vec3f) -> f32 {
    let d2 = dot(to_light, to_light);
    return density * d2 * sqrt(d2) / abs(dot(normal, to_light));
}

// Returns an ellipsoid's area with a relative error of at most a sixth, exact for spheres: the root mean square of the
// local area scale.
fn ellipsoid_area(q: Primitive) -> f32 {
    return 7.255197456936871 * sqrt(dot(q.x, q.x) + dot(q.y, q.y) + dot(q.z, q.z)) / abs(q.determinant);
}

// Returns the height of the cap of directions that the unit sphere subtends at a local point o: 1 - cos(half angle); 2
// if o is inside. `level` is |o|^2 - 1.
fn ellipsoid_cap(level: f32) -> f32 {
    let sine2 = 1.0 / (1.0 + level);
    return select(2.0, sine2 / (1.0 + sqrt(max(1.0 - sine2, 0.0))), level > 0.0);
}

// Samples a vector from p to an ellipsoid, uniform over the local directions to the unit sphere in local space.
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

// Returns the pdf of `ellipsoid_sample`, per solid angle. The Jacobian from local space is |l|^3 / det for the local
// image l of a unit vector.
fn ellipsoid_pdf(q: Primitive, p: vec3f, wi: vec3f) -> f32 {
    let cap = ellipsoid_cap(ellipsoid_level(q, vector_to_local(q, p - q.anchor)));
    let l = vector_to_local(q, wi);
    let l2 = dot(l, l);
    return 0.15915494309189535 / cap * abs(q.determinant) / (l2 * sqrt(l2));
}

// The part of a cylinder that faces a point. Areas are relative to the area of a cap.
struct CylinderPart {
    arc: f32,              // half angle on the side in units of pi
    middle: vec2f,         // unit vector to the arc's middle
    side: f32,             // area
    end: f32,              // 1 if the end cap faces the point, else 0
    start: f32,            // 1 if the start cap faces the point, else 0
}

// A vector to a point of a cylinder, and the normal at that point.
struct CylinderPoint {
    to: vec3f,
    normal: vec3f,
}

// Returns the part that faces the local point o: an arc of the side if o is outside of the side, a cap if o is beyond
// the cap, the full surface if o is inside.
fn cylinder_part(q: Primitive, o: vec3f, levels: vec2f) -> CylinderPart {
    let inside = (levels.x <= 0.0) & (levels.y <= 0.0);
    let r2 = o.x * o.x + o.y * o.y;
    let direction = vec2f(o.x, o.y) / sqrt(r2);
    let visible_arc = max(atan2(sqrt(max(levels.x, 0.0)), 1.0) * 0.3183098861837907, 1e-6);
    let arc = select(select(0.0, visible_arc, levels.x > 0.0), 1.0, inside);
    let is_beyond = levels.y > 0.0;
    let end = select(0.0, 1.0, inside | (is_beyond & (o.z > 0.0)));
    let start = select(0.0, 1.0, inside | (is_beyond & !(o.z > 0.0)));
    return CylinderPart(arc, select(vec2f(1.0, 0.0), direction, r2 > 0.0), 4.0 * arc * cylinder_height_ratio(q), end, start);
}

// Returns half the height divided by the radius.
fn cylinder_height_ratio(q: Primitive) -> f32 {
    return sqrt(dot(q.x, q.x) / dot(q.z, q.z));
}

// Samples the part of a cylinder that faces p, uniformly.
fn cylinder_sample(q: Primitive, p: vec3f, u: vec2f) -> CylinderPoint {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let part = cylinder_part(q, o, cylinder_levels(q, from_anchor));
    let caps = part.end + part.start;
    let area = u.x * (part.side + caps);
    let on_side = (area < part.side) | (caps == 0.0);
    let angle = (2.0 * min(area / part.side, 1.0) - 1.0) * part.arc;
    let sn = sine(angle);
    let cs = sine(angle + 0.5);
    let m = part.middle;
    let side = vec3f(m.x * cs - m.y * sn, m.y * cs + m.x * sn, 2.0 * u.y - 1.0);
    let cap_area = area - part.side;
    let on_end = cap_area < part.end;
    let disk = disk_sample(vec2f(min(cap_area - select(part.end, 0.0, on_end), 1.0), u.y));
    let up = select(-1.0, 1.0, on_end);
    let local = select(vec3f(disk.x, disk.y, up), side, on_side);
    let gradient = select(vec3f(0.0, 0.0, up), vec3f(side.x, side.y, 0.0), on_side);
    let normal = normalize(q.x * gradient.x + q.y * gradient.y + q.z * gradient.z);
    return CylinderPoint(vector_to_world(q, local - o), normal);
}

// Returns the pdf of `cylinder_sample`, relative to uniform samples of the full surface.
fn cylinder_share(q: Primitive, p: vec3f) -> f32 {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let part = cylinder_part(q, from_anchor - q.middle, cylinder_levels(q, from_anchor));
    return (4.0 * cylinder_height_ratio(q) + 2.0) / (part.side + part.end + part.start);
}

// Returns the MIS weight of a sample with the pdf `pdf`, against another strategy with the pdf `other_pdf`: the power
// heuristic with exponent 2 (Veach's thesis, section 9.2.4).
fn power_heuristic(pdf: f32, other_pdf: f32) -> f32 {
    let ratio = other_pdf / pdf;
    return select(0.0, 1.0 / (1.0 + ratio * ratio), pdf > 0.0);
}

// Returns the upper 32 bits of the product of `bits` and `count`: an integer below `count`, uniformly distributed if
// `bits` is.
fn uniform_below(bits: u32, count: u32) -> u32 {
    let low = (bits & 0xffffu) * (count & 0xffffu);
    let middle = (bits >> 16u) * (count & 0xffffu) + (low >> 16u);
    let cross = (bits & 0xffffu) * (count >> 16u) + (middle & 0xffffu);
    return (bits >> 16u) * (count >> 16u) + (middle >> 16u) + (cross >> 16u);
}
