// The point where a ray meets a primitive.

struct Surface {
    position: vec3f,
    normal: vec3f,         // unit length, towards the viewer
    wo: vec3f,             // unit vector to the viewer
    start: vec3f,          // where rays that leave it begin: a little above it
    side: f32,             // 1 where the normal is the outward one, -1 where it is the opposite
    facing: vec3f,         // the primitive's own normal, whatever a normal map makes of `normal`
    above: u32,            // the primitive's number if no ray that leaves it on the viewer's side can meet it again
    below: u32,            // the same for rays that leave it on the other side; else NOTHING
}

// The gradient, at a point of local space, of what is 0 on a primitive: of z, or of (x^2 + y^2 + z^2 - 1) / 2.
fn primitive_gradient(q: Primitive, local: vec3f) -> vec3f {
    let round = q.x * local.x + q.y * local.y + q.z * local.z;
    return select(q.z, round, q.kind == ELLIPSOID);
}

fn primitive_normal(q: Primitive, local: vec3f) -> vec3f {
    return normalize(primitive_gradient(q, local));
}

fn largest(v: vec3f) -> f32 {
    return max(max(abs(v.x), abs(v.y)), abs(v.z));
}

// Where a ray meets primitive i, which is q. A step of Newton's method takes the point back onto the primitive, so that it
// is off it by the rounding of its coordinates and of its way from the anchor alone; rays start `epsilon` times the
// largest of these above it.
fn surface_at(q: Primitive, i: u32, ray: Ray, t: f32, epsilon: f32) -> Surface {
    let met = ray.origin + ray.direction * t;
    let way = met - q.anchor;
    let from_anchor = vector_to_local(q, way);
    let gradient = primitive_gradient(q, from_anchor - q.middle);
    let inverse_slope = 1.0 / sqrt(dot(gradient, gradient));
    let outward = gradient * inverse_slope;
    let height = select(from_anchor.z, 0.5 * ellipsoid_level(q, from_anchor), q.kind == ELLIPSOID);
    let position = met - outward * (height * inverse_slope);
    let inside = dot(outward, ray.direction) > 0.0;
    let side = select(1.0, -1.0, inside);
    let normal = outward * side;
    let size = max(largest(position), largest(way));
    let start = position + normal * (epsilon * size);
    let round = q.kind == ELLIPSOID;
    let above = select(i, NOTHING, round & inside);
    let below = select(i, NOTHING, round & !inside);
    return Surface(position, normal, -ray.direction, start, side, normal, above, below);
}

// Texture coordinates of a point of local space. Rectangle: 0 to 1 along tangent and bitangent. Triangle: barycentric
// coordinates of the second and third vertex. Plane: lengths along tangent and bitangent. Ellipsoid: longitude from
// the first towards the second axis and latitude from the third axis' foot, each from 0 to 1.
fn primitive_uv(q: Primitive, local: vec3f) -> vec2f {
    if q.kind == RECTANGLE {
        return vec2f(0.5 * local.x + 0.5, 0.5 * local.y + 0.5);
    }
    if q.kind == ELLIPSOID {
        let longitude = atan2(local.y, local.x) * 0.15915494309189535;
        let latitude = atan2(sqrt(local.x * local.x + local.y * local.y), -local.z) * 0.3183098861837907;
        return vec2f(select(longitude, longitude + 1.0, longitude < 0.0), latitude);
    }
    return local.xy;
}

fn first_hit(q: Primitive, ray: Ray, t: f32) -> FirstHit {
    let local = point_to_local(q, ray.origin + ray.direction * t);
    let n = primitive_normal(q, local);
    let normal = vec3f(positive_zero(n.x), positive_zero(n.y), positive_zero(n.z));
    let uv = primitive_uv(q, local);
    return FirstHit(normal, t, vec2f(positive_zero(uv.x), positive_zero(uv.y)), q.shape, q.material);
}
