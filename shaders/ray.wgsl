// Rays, and the local space that every primitive is intersected in.

// The points origin + t direction, t > 0.
struct Ray {
    origin: vec3f,
    direction: vec3f,      // unit length
}

// The nearest intersection so far: INFINITE_T and NO_INDEX where there is none.
struct Hit {
    t: f32,
    instance: u32,         // 0 for a primitive by itself, else one more than the number of a mesh's instance
    primitive: u32,        // its number among the scene's, or that of a triangle in its mesh
    slot: u32,             // where the triangle is in its mesh
    barycentric: vec2f,    // of the triangle's second and third vertex
}

// No hit.
fn no_hit() -> Hit {
    return Hit(INFINITE_T, 0u, NO_INDEX, 0u, vec2f(0.0));
}

// The number of a primitive by itself at a place, which is an instance and a primitive; NO_INDEX for a triangle of a mesh.
fn by_itself(place: vec2u) -> u32 {
    return select(NO_INDEX, place.y, place.x == 0u);
}

fn point_to_local(q: Primitive, p: vec3f) -> vec3f {
    return vector_to_local(q, p - q.anchor) - q.middle;
}

fn vector_to_local(q: Primitive, v: vec3f) -> vec3f {
    return vec3f(dot(q.x, v), dot(q.y, v), dot(q.z, v));
}

// The derivative of a point of the world by a texture coordinate, from that of its local point. The columns of the
// linear map are the cross products of the inverse map's rows, over its determinant.
fn vector_to_world(q: Primitive, v: vec3f) -> vec3f {
    let sum = cross(q.y, q.z) * v.x + cross(q.z, q.x) * v.y + cross(q.x, q.y) * v.z;
    return sum / q.determinant;
}

// Where the ray meets the plane z = 0 of a flat primitive; not finite if it does not.
fn plane_distance(q: Primitive, ray: Ray) -> f32 {
    return dot(q.z, q.anchor - ray.origin) / dot(q.z, ray.direction);
}

// Whether the segment o + s d, s in (0, reach), of local space crosses the plane z = 0.
fn crosses_plane(o: vec3f, d: vec3f, t_max: f32) -> bool {
    return (o.z * d.z < 0.0) & (abs(o.z) < t_max * abs(d.z));
}

// Where it does so, as x |d.z| and y |d.z|: no division.
fn scaled_crossing(o: vec3f, d: vec3f) -> vec2f {
    let a = abs(d.z);
    let s = abs(o.z);
    return vec2f(o.x * a + s * d.x, o.y * a + s * d.y);
}

// The hit on a primitive by itself, or the one at t of primitive i if that is nearer and not the one that the ray has left.
fn closer(hit: Hit, t: f32, i: u32, origin_prim: u32) -> Hit {
    let nearer = (t < hit.t) & (i != origin_prim);
    return Hit(select(hit.t, t, nearer), hit.instance, select(hit.primitive, i, nearer), hit.slot, hit.barycentric);
}

// Returns the nearer of two hits; if they are equally near, the one with the lower instance and primitive. The second one misses if its t is
// INFINITE_T.
fn nearer_hit(a: Hit, b: Hit) -> Hit {
    let lower = (b.instance < a.instance) | ((b.instance == a.instance) & (b.primitive < a.primitive));
    let nearer = (b.t < INFINITE_T) & ((b.t < a.t) | ((b.t == a.t) & lower));
    return Hit(select(a.t, b.t, nearer), select(a.instance, b.instance, nearer), select(a.primitive, b.primitive, nearer),
               select(a.slot, b.slot, nearer), select(a.barycentric, b.barycentric, nearer));
}
