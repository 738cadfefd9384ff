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

// The part of a cylinder that faces a point, from which light is sampled there. Areas are relative to the area of a cap.
struct CylinderPart {
    arc: f32,              // half the angle of the part of the side, 1 for the whole side
    middle: vec2f,         // unit vector to its middle
    side: f32,             // its area
    end: f32,              // 1 if the cap at the end faces the point, else 0
    start: f32,            // the same for the cap at the start
}

// A point on the surface of a cylinder: the vector to it, and its outward normal.
struct CylinderPoint {
    to: vec3f,
    normal: vec3f,
}

// Returns the part that faces a point: an arc of the side if the point is outside of the infinite cylinder, and a cap if it is beyond it; the whole
// surface if the point is inside.
fn cylinder_part(q: Primitive, o: vec3f, levels: vec2f) -> CylinderPart {
    let inside = (levels.x <= 0.0) & (levels.y <= 0.0);
    let r2 = o.x * o.x + o.y * o.y;
    let away = vec2f(o.x, o.y) / sqrt(r2);
    let seen = max(atan2(sqrt(max(levels.x, 0.0)), 1.0) * 0.3183098861837907, 1e-6);
    let arc = select(select(0.0, seen, levels.x > 0.0), 1.0, inside);
    let beyond = levels.y > 0.0;
    let end = select(0.0, 1.0, inside | (beyond & (o.z > 0.0)));
    let start = select(0.0, 1.0, inside | (beyond & !(o.z > 0.0)));
    return CylinderPart(arc, select(vec2f(1.0, 0.0), away, r2 > 0.0), 4.0 * arc * cylinder_height_ratio(q), end, start);
}

// Half the height of a cylinder divided by its radius.
fn cylinder_height_ratio(q: Primitive) -> f32 {
    return sqrt(dot(q.x, q.x) / dot(q.z, q.z));
}

// A uniform point of the part of a cylinder that faces p.
fn cylinder_sample(q: Primitive, p: vec3f, u: vec2f) -> CylinderPoint {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let part = cylinder_part(q, o, cylinder_levels(q, from_anchor));
    let caps = part.end + part.start;
    let at = u.x * (part.side + caps);
    let on_side = (at < part.side) | (caps == 0.0);
    let angle = (2.0 * min(at / part.side, 1.0) - 1.0) * part.arc;
    let sn = sine(angle);
    let cs = sine(angle + 0.5);
    let m = part.middle;
    let side = vec3f(m.x * cs - m.y * sn, m.y * cs + m.x * sn, 2.0 * u.y - 1.0);
    let rest = at - part.side;
    let at_end = rest < part.end;
    let disk = disk_sample(vec2f(min(rest - select(part.end, 0.0, at_end), 1.0), u.y));
    let up = select(-1.0, 1.0, at_end);
    let local = select(vec3f(disk.x, disk.y, up), side, on_side);
    let gradient = select(vec3f(0.0, 0.0, up), vec3f(side.x, side.y, 0.0), on_side);
    let normal = normalize(q.x * gradient.x + q.y * gradient.y + q.z * gradient.z);
    return CylinderPoint(vector_to_world(q, local - o), normal);
}

// The density of the points of `cylinder_sample` as a multiple of that of uniform points of the whole cylinder.
fn cylinder_share(q: Primitive, p: vec3f) -> f32 {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let part = cylinder_part(q, from_anchor - q.middle, cylinder_levels(q, from_anchor));
    return (4.0 * cylinder_height_ratio(q) + 2.0) / (part.side + part.end + part.start);
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
