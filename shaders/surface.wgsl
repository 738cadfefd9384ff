// The point where a ray meets a primitive.

struct Surface {
    position: vec3f,
    normal: vec3f,         // unit length, towards the viewer
    wo: vec3f,             // unit vector to the viewer
    start: vec3f,          // where rays that leave it begin: a little above it
    side: f32,             // 1 where the normal is the outward one, -1 where it is the opposite
}

// The unit normal of a primitive at a point of its local space: the gradient of z, or of x^2 + y^2 + z^2.
fn primitive_normal(q: Primitive, local: vec3f) -> vec3f {
    let round = q.x * local.x + q.y * local.y + q.z * local.z;
    return normalize(select(q.z, round, q.kind == ELLIPSOID));
}

fn surface_at(q: Primitive, ray: Ray, t: f32, epsilon: f32) -> Surface {
    let position = ray.origin + ray.direction * t;
    let outward = primitive_normal(q, point_to_local(q, position));
    let side = select(1.0, -1.0, dot(outward, ray.direction) > 0.0);
    let normal = outward * side;
    let size = max(max(abs(position.x), abs(position.y)), max(abs(position.z), t));
    return Surface(position, normal, -ray.direction, position + normal * (epsilon * size), side);
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
