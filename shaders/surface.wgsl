// The point where a ray meets a primitive.

struct Surface {
    position: vec3f,
    normal: vec3f,         // the primitive's own, unit length, towards the viewer: it says on which side a point lies
    smooth_normal: vec3f,  // the same, but on a mesh between the normals of the vertices: light that is behind it lights nothing
    shading_normal: vec3f, // what light is reflected and refracted by: a normal map's, else the smooth one
    wo: vec3f,             // unit vector to the viewer
    ray_origin: vec3f,     // where rays that leave it begin: a little above it
    terminator_offset: vec3f, // from there to where shadow rays begin, on a mesh that stands for a smooth surface
    side: f32,             // 1 where the normal is the outward one, -1 where it is the opposite
    exclude_front: vec2u,  // the instance and primitive if no ray that leaves it on the viewer's side can meet it again
    exclude_back: vec2u,   // the same for rays that leave it on the other side; else NOWHERE
    uv: vec2f,             // texture coordinates
    du: vec3f,             // the position's derivatives by them, which span the tangent frame
    dv: vec3f,
}

fn largest(v: vec3f) -> f32 {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

// Where a ray meets primitive i, which is q; without texture coordinates. A step of Newton's method takes the point back onto the primitive, so that it
// is off it by the rounding of its coordinates and of its way from the anchor alone; rays start `epsilon` times the
// largest of these above it.
fn surface_at(q: Primitive, i: u32, ray: Ray, t: f32, epsilon: f32) -> Surface {
    let met = ray.origin + ray.direction * t;
    let way = met - q.anchor;
    let from_anchor = vector_to_local(q, way);
    let gradient = primitive_gradient(q, from_anchor - q.middle);
    let inverse_slope = 1.0 / sqrt(dot(gradient, gradient));
    let outward = gradient * inverse_slope;
    let solid = is_solid(q.kind);
    let height = primitive_height(q, from_anchor);
    let position = met - outward * (height * inverse_slope);
    let inside = dot(outward, ray.direction) > 0.0;
    let side = select(1.0, -1.0, inside);
    let normal = outward * side;
    let size = max(largest(position), largest(way));
    let start = position + normal * (epsilon * size);
    let above = vec2u(0u, select(i, NO_INDEX, solid & inside));
    let below = vec2u(0u, select(i, NO_INDEX, solid & !inside));
    return Surface(position, normal, normal, normal, -ray.direction, start, vec3f(0.0), side, above, below, vec2f(0.0),
                   vec3f(0.0), vec3f(0.0));
}

// A surface of the primitive q with texture coordinates and their frame.
fn with_coordinates(surface: Surface, q: Primitive) -> Surface {
    let local = point_to_local(q, surface.position);
    let tangents = local_tangents(q, local);
    var result = surface;
    result.uv = primitive_uv(q, local);
    result.du = vector_to_world(q, tangents.u);
    result.dv = vector_to_world(q, tangents.v);
    return result;
}

fn with_positive_zeros(v: vec3f) -> vec3f {
    return vec3f(positive_zero(v.x), positive_zero(v.y), positive_zero(v.z));
}

fn first_hit(q: Primitive, ray: Ray, t: f32) -> FirstHit {
    let local = point_to_local(q, ray.origin + ray.direction * t);
    let n = primitive_normal(q, local);
    let normal = with_positive_zeros(n);
    let uv = primitive_uv(q, local);
    return FirstHit(normal, t, vec2f(positive_zero(uv.x), positive_zero(uv.y)), q.shape, q.material, normal, q.shape,
                    vec2f(0.0), vec2u(0u));
}
