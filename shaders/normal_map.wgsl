// Normal mapping.

// Returns the unit normal for a vector n of a normal map, with x along u, y along v, and z outward. The result is on
// the side of the surface's normal and never points into the surface.
fn mapped_normal(surface: Surface, t: Texture, n: vec3f) -> vec3f {
    // Tangents along the texture's own u and v, up to a positive factor: du and dv times the inverse of its UV
    // transform.
    let sign = select(-1.0, 1.0, t.u.x * t.v.y - t.u.y * t.v.x > 0.0);
    let along_u = (surface.du * t.v.y - surface.dv * t.v.x) * sign;
    let along_v = (surface.dv * t.u.x - surface.du * t.u.y) * sign;
    let outward = surface.shading_normal * surface.side;
    let tangent = normalize(along_u - outward * dot(outward, along_u));
    let perpendicular = cross(outward, tangent);
    let bitangent = perpendicular * select(-1.0, 1.0, dot(perpendicular, along_v) > 0.0);
    return normalize(tangent * n.x + bitangent * n.y + outward * max(n.z, 0.001)) * surface.side;
}
