// The point where a ray hits a surface.

struct Surface {
    position: vec3f,
    normal: vec3f,            // unit geometric normal towards the viewer, which defines the sides of the surface
    smooth_normal: vec3f,     // interpolated vertex normal of a mesh, else `normal`; light from behind is ignored
    shading_normal: vec3f,    // from the normal map, else `smooth_normal`
    wo: vec3f,                // unit vector to the viewer
    ray_origin: vec3f,        // origin of rays that leave the surface, slightly above it
    terminator_offset: vec3f, // from `ray_origin` to the origin of shadow rays, on smooth meshes
    side: f32,                // 1 if `normal` points outward, else -1
    exclude_front: vec2u,     // primitive that rays on the viewer's side cannot hit again, else NO_PRIMITIVE
    exclude_back: vec2u,      // primitive that rays on the other side cannot hit again, else NO_PRIMITIVE
    uv: vec2f,                // texture coordinates
    du: vec3f,                // derivatives of the position by u and v, which span the tangent frame
    dv: vec3f,
}

// Returns the largest absolute component.
fn largest(v: vec3f) -> f32 {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

// Returns the surface where a ray hits the primitive q with index i, without texture coordinates. A Newton step moves
// the point back onto the primitive, up to the rounding of the point's coordinates and of the offset from the anchor.
// Rays start above the surface by `epsilon` times the largest of these coordinates.
fn surface_at(q: Primitive, i: u32, ray: Ray, t: f32, epsilon: f32) -> Surface {
    let point = ray.origin + ray.direction * t;
    let offset = point - q.anchor;
    let from_anchor = vector_to_local(q, offset);
    let gradient = primitive_gradient(q, from_anchor - q.middle);
    let inverse_slope = 1.0 / sqrt(dot(gradient, gradient));
    let outward = gradient * inverse_slope;
    let solid = is_solid(q.kind);
    let height = primitive_height(q, from_anchor);
    let position = point - outward * (height * inverse_slope);
    let inside = dot(outward, ray.direction) > 0.0;
    let side = select(1.0, -1.0, inside);
    let normal = outward * side;
    let size = max(largest(position), largest(offset));
    let ray_origin = position + normal * (epsilon * size);
    let exclude_front = vec2u(0u, select(i, NO_INDEX, solid & inside));
    let exclude_back = vec2u(0u, select(i, NO_INDEX, solid & !inside));
    return Surface(position, normal, normal, normal, -ray.direction, ray_origin, vec3f(0.0), side, exclude_front, exclude_back, vec2f(0.0),
                   vec3f(0.0), vec3f(0.0));
}

// Adds texture coordinates and tangents.
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

// Returns the record of a first hit on a standalone primitive.
fn first_hit(q: Primitive, ray: Ray, t: f32) -> FirstHit {
    let local = point_to_local(q, ray.origin + ray.direction * t);
    let n = primitive_normal(q, local);
    let normal = with_positive_zeros(n);
    let uv = primitive_uv(q, local);
    return FirstHit(normal, t, vec2f(positive_zero(uv.x), positive_zero(uv.y)), q.shape, q.material, normal, q.shape,
                    vec2f(0.0), vec2u(0u));
}
