// Tangents of surfaces, and the normals that normal maps give in them.

// The derivative of a point of the world by a texture coordinate, from that of its local point. The columns of the
// linear map are the cross products of the inverse map's rows, over its determinant.
fn vector_to_world(q: Primitive, v: vec3f) -> vec3f {
    let sum = cross(q.y, q.z) * v.x + cross(q.z, q.x) * v.y + cross(q.x, q.y) * v.z;
    return sum / q.determinant;
}

// The derivatives of the local point by u and by v: columns of a frame. Where an ellipsoid's u has no direction, at its
// poles, that of the nearest meridian is taken.
struct Tangents {
    u: vec3f,
    v: vec3f,
}

fn local_tangents(q: Primitive, local: vec3f) -> Tangents {
    if q.kind == ELLIPSOID {
        let r = sqrt(max(local.x * local.x + local.y * local.y, 1e-12));
        let u = vec3f(-local.y, local.x, 0.0) * 6.283185307179586;
        let v = vec3f(-local.z * local.x / r, -local.z * local.y / r, r) * 3.141592653589793;
        return Tangents(u, v);
    }
    let scale = select(1.0, 2.0, q.kind == RECTANGLE);
    return Tangents(vec3f(scale, 0.0, 0.0), vec3f(0.0, scale, 0.0));
}

// The unit normal of a normal map's vector n, whose x points along the texture's u, y along its v and z outwards; on
// the side of the surface's normal. It never points into the surface.
fn mapped_normal(q: Primitive, local: vec3f, surface: Surface, t: Texture, n: vec3f) -> vec3f {
    let tangents = local_tangents(q, local);
    let du = vector_to_world(q, tangents.u);
    let dv = vector_to_world(q, tangents.v);
    // By the texture's own coordinates: the inverse of its map, up to a positive factor.
    let sign = select(-1.0, 1.0, t.u.x * t.v.y - t.u.y * t.v.x > 0.0);
    let along_u = (du * t.v.y - dv * t.v.x) * sign;
    let along_v = (dv * t.u.x - du * t.u.y) * sign;
    let outward = surface.normal * surface.side;
    let tangent = normalize(along_u - outward * dot(outward, along_u));
    let across = cross(outward, tangent);
    let bitangent = across * select(-1.0, 1.0, dot(across, along_v) > 0.0);
    return normalize(tangent * n.x + bitangent * n.y + outward * max(n.z, 0.001)) * surface.side;
}
