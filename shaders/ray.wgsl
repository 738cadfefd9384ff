// Rays, hits, and the local space in which primitives are intersected.

// The points origin + t direction, t > 0.
struct Ray {
    origin: vec3f,
    direction: vec3f,      // unit length
}

// The nearest hit. For a miss, t is INFINITE_T and `primitive` is NO_INDEX.
struct Hit {
    t: f32,
    instance: u32,         // 0 for a standalone primitive, else 1 + index of the mesh instance
    primitive: u32,        // index in the scene, or of the triangle in its mesh
    slot: u32,             // position of the triangle in the buffer of its mesh
    barycentric: vec2f,    // weights of the second and third vertex
}

fn no_hit() -> Hit {
    return Hit(INFINITE_T, 0u, NO_INDEX, 0u, vec2f(0.0));
}

// Returns a standalone primitive's index; NO_INDEX for a mesh triangle.
fn standalone_prim(prim_id: vec2u) -> u32 {
    return select(NO_INDEX, prim_id.y, prim_id.x == 0u);
}

fn point_to_local(q: Primitive, p: vec3f) -> vec3f {
    return vector_to_local(q, p - q.anchor) - q.middle;
}

fn vector_to_local(q: Primitive, v: vec3f) -> vec3f {
    return vec3f(dot(q.x, v), dot(q.y, v), dot(q.z, v));
}

// Transforms a local vector to world space: columns of the linear map are cross products of the rows of its inverse,
// over the determinant.
fn vector_to_world(q: Primitive, v: vec3f) -> vec3f {
    let sum = cross(q.y, q.z) * v.x + cross(q.z, q.x) * v.y + cross(q.x, q.y) * v.z;
    return sum / q.determinant;
}

// Returns the t at which a ray crosses the plane z = 0; not finite for parallel rays.
fn plane_distance(q: Primitive, ray: Ray) -> f32 {
    return dot(q.z, q.anchor - ray.origin) / dot(q.z, ray.direction);
}

// Returns true if the segment o + s d, s in (0, t_max), crosses z = 0.
fn crosses_plane(o: vec3f, d: vec3f, t_max: f32) -> bool {
    return (o.z * d.z < 0.0) & (abs(o.z) < t_max * abs(d.z));
}

// Returns the crossing with the plane z = 0 as (x |d.z|, y |d.z|), without a division.
fn scaled_crossing(o: vec3f, d: vec3f) -> vec2f {
    let a = abs(d.z);
    let s = abs(o.z);
    return vec2f(o.x * a + s * d.x, o.y * a + s * d.y);
}

// Returns the nearer of `hit` and a hit at t on primitive i. Ignores primitive `origin_prim`.
fn closer(hit: Hit, t: f32, i: u32, origin_prim: u32) -> Hit {
    let nearer = (t < hit.t) & (i != origin_prim);
    return Hit(select(hit.t, t, nearer), hit.instance, select(hit.primitive, i, nearer), hit.slot, hit.barycentric);
}

// Returns the nearer hit; at equal distance, the hit with the lower instance, then the lower primitive. b is a miss if
// b.t is INFINITE_T.
fn nearer_hit(a: Hit, b: Hit) -> Hit {
    let lower = (b.instance < a.instance) | ((b.instance == a.instance) & (b.primitive < a.primitive));
    let nearer = (b.t < INFINITE_T) & ((b.t < a.t) | ((b.t == a.t) & lower));
    return Hit(select(a.t, b.t, nearer), select(a.instance, b.instance, nearer), select(a.primitive, b.primitive, nearer),
               select(a.slot, b.slot, nearer), select(a.barycentric, b.barycentric, nearer));
}
