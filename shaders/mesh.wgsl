// Mesh triangles: intersection and surface properties. Directions in object space are not normalized, so that t is the
// world-space distance.

// The shear that maps a ray to the z axis; `axis` is the axis of the direction's largest component.
struct Shear {
    axis: u32,
    slope: vec2f,
    scale: f32,
}

fn shear_of(direction: vec3f) -> Shear {
    let size = abs(direction);
    let axis = select(select(2u, 1u, size.y >= size.z), 0u, (size.x >= size.y) & (size.x >= size.z));
    let d = permuted(direction, axis);
    return Shear(axis, vec2f(d.x / d.z, d.y / d.z), 1.0 / d.z);
}

// Returns the coordinates in cyclic order, `axis` last.
fn permuted(v: vec3f, axis: u32) -> vec3f {
    return select(select(v.xyz, v.zxy, axis == 1u), v.yzx, axis == 0u);
}

fn sheared(v: vec3f, shear: Shear) -> vec3f {
    let p = permuted(v, shear.axis);
    return vec3f(p.x - shear.slope.x * p.z, p.y - shear.slope.y * p.z, shear.scale * p.z);
}

struct Crossing {
    is_hit: bool,
    t: f32,
    barycentric: vec2f,    // weights of the second and third vertex
}

// Intersects a triangle: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013. Points on an
// edge count as inside. The ray must also hit the triangle's box, and t is clamped to the interval inside the box, so
// that a BVH misses no hit (docs/decisions/trees.md).
fn triangle_crossing(v0: vec3f, v1: vec3f, v2: vec3f, origin: vec3f, shear: Shear, s: Slabs) -> Crossing {
    let a = sheared(v0 - origin, shear);
    let b = sheared(v1 - origin, shear);
    let c = sheared(v2 - origin, shear);
    let u = c.x * b.y - c.y * b.x;
    let v = a.x * c.y - a.y * c.x;
    let w = b.x * a.y - b.y * a.x;
    let sum = u + v + w;
    let inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
    let t = (u * a.z + v * b.z + w * c.z) / sum;
    let interval = box_interval(lowest(v0, v1, v2), highest(v0, v1, v2), s);
    let is_hit = inside & (abs(sum) > 0.0) & interval_hits(interval, INFINITE_T);
    return Crossing(is_hit, min(interval.y, max(interval.x, t)), vec2f(v / sum, w / sum));
}

fn lowest(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return vec3f(min(min(a.x, b.x), c.x), min(min(a.y, b.y), c.y), min(min(a.z, b.z), c.z));
}

fn highest(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return vec3f(max(max(a.x, b.x), c.x), max(max(a.y, b.y), c.y), max(max(a.z, b.z), c.z));
}

fn point_to_mesh(i: Instance, p: vec3f) -> vec3f {
    return vector_to_mesh(i, p - i.anchor);
}

fn vector_to_mesh(i: Instance, v: vec3f) -> vec3f {
    return vec3f(dot(i.x, v), dot(i.y, v), dot(i.z, v));
}

fn vector_from_mesh(i: Instance, v: vec3f) -> vec3f {
    return i.u * v.x + i.v * v.y + i.w * v.z;
}

// Transforms a normal to a world-space unit vector; 0 stays 0.
fn normal_from_mesh(i: Instance, n: vec3f) -> vec3f {
    let v = i.x * n.x + i.y * n.y + i.z * n.z;
    let scaled = v / max(largest(v), 1.1754943508222875e-38);
    return scaled / sqrt(max(dot(scaled, scaled), 0.5));
}

// Returns the object-space padding of boxes for the rounding of a ray.
fn mesh_pad(i: Instance, origin: vec3f) -> f32 {
    return BOX_PAD * (largest(origin) + i.size);
}

// The primitive of a hit: a standalone primitive, with all other fields 0, or a mesh triangle in world space.
struct HitPrimitive {
    primitive: Primitive,  // the standalone primitive, or the mesh triangle as a primitive
    edge_1: vec3f,         // from the first to the second vertex
    edge_2: vec3f,
    uv_0: vec2f,           // texture coordinates of the vertices
    uv_1: vec2f,
    uv_2: vec2f,
    normal_0: vec3f,       // unit outward vertex normals; 0 if the mesh has none
    normal_1: vec3f,
    normal_2: vec3f,
    tangents_0: Tangents,  // vertex tangents, unnormalized; 0 if the mesh has none
    tangents_1: Tangents,
    tangents_2: Tangents,
    anchor: vec3f,         // origin of object space
    condition_number: f32, // of the instance's transform
}

fn standalone_hit_primitive(q: Primitive) -> HitPrimitive {
    let zero = vec3f(0.0);
    let none = Tangents(zero, zero);
    return HitPrimitive(q, zero, zero, zero.xy, zero.xy, zero.xy, zero, zero, zero, none, none, none, zero, 0.0);
}

// Returns a triangle as a primitive, with the barycentric coordinates of the second and third vertex as local x and y.
// Edges are in world space, `v0` is in object space.
fn face_primitive(i: Instance, v0: vec3f, edge_1: vec3f, edge_2: vec3f, material: u32) -> Primitive {
    let min_positive = 1.1754943508222875e-38;
    let scaled_normal = cross(edge_1 / max(largest(edge_1), min_positive), edge_2 / max(largest(edge_2), min_positive));
    // A triangle that is too thin for 32-bit floats gets the normal (0, 0, 1).
    let normal = select(vec3f(0.0, 0.0, 1.0), normalize(scaled_normal), dot(scaled_normal, scaled_normal) > 1e-30) * i.side;
    let area = dot(cross(edge_1, edge_2), normal);
    let determinant = select(min_positive, area, abs(area) > min_positive);
    let anchor = i.anchor + vector_from_mesh(i, v0);
    return Primitive(anchor, material, cross(edge_2, normal) / determinant, i.shape, cross(normal, edge_1) / determinant,
                     TRIANGLE, normal, 1.0 / determinant, vec3f(0.0), 0.0);
}

fn face_surface(face: HitPrimitive, prim_id: vec2u, b: vec2f, d: vec3f, epsilon: f32) -> Surface {
    let q = face.primitive;
    let from_anchor = face.edge_1 * b.x + face.edge_2 * b.y;
    let position = q.anchor + from_anchor;
    let side = select(1.0, -1.0, dot(q.z, d) > 0.0);
    let normal = q.z * side;
    let edge = max(max(largest(face.edge_1), largest(face.edge_2)), largest(face.edge_2 - face.edge_1));
    let size = max(max(largest(position), largest(position - face.anchor)), 0.25 * edge) * max(1.0, 0.125 * face.condition_number);
    // The component towards the viewer moves the ray origin of a hit on an edge also in front of the other faces at the
    // edge.
    let ray_origin = position + (normal - d) * (epsilon * size);
    let tangents = face_frame(face, b);
    let smooth_normal = face_normal(face, b) * side;
    return Surface(position, normal, smooth_normal, smooth_normal, -d, ray_origin, face_terminator_offset(face, b, side), side, prim_id, prim_id,
                   face_uv(face, b), tangents.u, tangents.v);
}

fn face_uv(face: HitPrimitive, b: vec2f) -> vec2f {
    return face.uv_0 + (face.uv_1 - face.uv_0) * b.x + (face.uv_2 - face.uv_0) * b.y;
}

// Returns the interpolated vertex color, at least 0.
fn color_between(c0: vec4f, c1: vec4f, c2: vec4f, b: vec2f) -> vec4f {
    return max4(c0 + (c1 - c0) * b.x + (c2 - c0) * b.y, vec4f(0.0));
}

// Returns the interpolated unit normal on the triangle's outer side; the geometric normal if the mesh has no vertex
// normals.
fn face_normal(face: HitPrimitive, b: vec2f) -> vec3f {
    let n = face.normal_0 * (1.0 - b.x - b.y) + face.normal_1 * b.x + face.normal_2 * b.y;
    let length2 = dot(n, n);
    let unit = n / sqrt(max(length2, 1e-12));
    return select(face.primitive.z, flipped_to(unit, face.primitive.z), length2 > 1e-12);
}

// Returns v or -v, whichever points towards `side`, because normals in files may be on either side.
fn flipped_to(v: vec3f, side: vec3f) -> vec3f {
    return v * select(1.0, -1.0, dot(v, side) < 0.0);
}

// Returns the offset from the triangle to the smooth surface that the vertex normals imply, so that a coarse mesh does
// not shadow itself in grazing light: Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021, chapter 4.
fn face_terminator_offset(face: HitPrimitive, b: vec2f, side: f32) -> vec3f {
    let p = face.edge_1 * b.x + face.edge_2 * b.y;
    let up = face.primitive.z * side;
    let lift_0 = lift(flipped_to(face.normal_0, up), p, up);
    let lift_1 = lift(flipped_to(face.normal_1, up), p - face.edge_1, up);
    let lift_2 = lift(flipped_to(face.normal_2, up), p - face.edge_2, up);
    return lift_0 * (1.0 - b.x - b.y) + lift_1 * b.x + lift_2 * b.y;
}

// Returns the offset that lifts a point onto a vertex's tangent plane; 0 for a point above the plane. `from_vertex` is
// the vector from the vertex to the point. A vertex normal more than 37 degrees off the triangle normal `up` implies no
// smooth surface, as at the corner of a cube: with an offset, objects on the cube would lose their contact shadows.
fn lift(n: vec3f, from_vertex: vec3f, up: vec3f) -> vec3f {
    return n * select(0.0, max(-dot(n, from_vertex), 0.0), dot(n, up) > 0.8);
}

// Returns false if the triangle itself occludes light from `direction` at the origin of shadow rays. Since the origin
// is above the triangle by the terminator offset, light from behind the triangle may pass beside it.
fn face_direction_allowed(face: HitPrimitive, surface: Surface, direction: vec3f) -> bool {
    let fall = -dot(surface.normal, direction);
    let height = dot(surface.normal, surface.terminator_offset);
    let crossing = surface.position + surface.terminator_offset + direction * (height / max(fall, 1e-30));
    let b = point_to_local(face.primitive, crossing);
    return (fall <= 0.0) | (b.x < 0.0) | (b.y < 0.0) | (b.x + b.y > 1.0);
}

// Returns the derivatives by u and v; arbitrary vectors in the triangle's plane if the texture coordinates are
// degenerate.
fn face_tangents(face: HitPrimitive) -> Tangents {
    let a = face.uv_1 - face.uv_0;
    let b = face.uv_2 - face.uv_0;
    let area = a.x * b.y - a.y * b.x;
    let is_valid = abs(area) > 1e-30;
    let scale = 1.0 / select(1.0, area, is_valid);
    let u = (face.edge_1 * b.y - face.edge_2 * a.y) * scale;
    let v = (face.edge_2 * a.x - face.edge_1 * b.x) * scale;
    return Tangents(select(face.edge_1, u, is_valid), select(cross(face.primitive.z, face.edge_1), v, is_valid));
}

// Returns the interpolated vertex tangents, continuous across edges; `face_tangents` if the mesh has no vertex
// tangents.
fn face_frame(face: HitPrimitive, b: vec2f) -> Tangents {
    let a = 1.0 - b.x - b.y;
    let u = face.tangents_0.u * a + face.tangents_1.u * b.x + face.tangents_2.u * b.y;
    let v = face.tangents_0.v * a + face.tangents_1.v * b.x + face.tangents_2.v * b.y;
    let fallback = face_tangents(face);
    let has_tangents = (largest(u) > 1e-12) & (largest(v) > 1e-12);
    return Tangents(select(fallback.u, u, has_tangents), select(fallback.v, v, has_tangents));
}

// Returns the change of the texture coordinates for the offset d.
fn face_uv_derivative(face: HitPrimitive, d: vec3f) -> vec2f {
    let b = vector_to_local(face.primitive, d);
    return (face.uv_1 - face.uv_0) * b.x + (face.uv_2 - face.uv_0) * b.y;
}

fn face_normal_derivative(face: HitPrimitive, b: vec2f, d: vec3f) -> vec3f {
    let db = vector_to_local(face.primitive, d);
    let n = face.normal_0 * (1.0 - b.x - b.y) + face.normal_1 * b.x + face.normal_2 * b.y;
    let dn = (face.normal_1 - face.normal_0) * db.x + (face.normal_2 - face.normal_0) * db.y;
    let length2 = dot(n, n);
    let scale = 1.0 / sqrt(max(length2, 1e-12));
    let unit = n * scale;
    let tangential = (dn - unit * dot(unit, dn)) * scale;
    let outward = tangential * select(1.0, -1.0, dot(unit, face.primitive.z) < 0.0);
    return select(vec3f(0.0), outward, length2 > 1e-12);
}

fn face_hit_differential(face: HitPrimitive, b: vec2f, differential: Differential, ray: Ray, t: f32, surface: Surface) -> HitDifferential {
    let x = transferred(differential.x, ray, t, surface.normal);
    let y = transferred(differential.y, ray, t, surface.normal);
    let normal_x = face_normal_derivative(face, b, x.position) * surface.side;
    let normal_y = face_normal_derivative(face, b, y.position) * surface.side;
    return HitDifferential(x, y, normal_x, normal_y);
}

fn face_footprint(face: HitPrimitive, surface: Surface, dx: vec3f, dy: vec3f) -> Footprint {
    return Footprint(surface.uv, face_uv_derivative(face, dx), face_uv_derivative(face, dy));
}

fn face_first_hit(face: HitPrimitive, hit: Hit) -> FirstHit {
    let b = hit.barycentric;
    let normal = with_positive_zeros(face.primitive.z);
    let shading_normal = with_positive_zeros(face_normal(face, b));
    let uv = face_uv(face, b);
    return FirstHit(normal, hit.t, vec2f(positive_zero(uv.x), positive_zero(uv.y)), face.primitive.shape,
                    face.primitive.material, shading_normal, hit.primitive, b, vec2u(0u));
}
