// What is different from one kind of primitives to the next. A kind has a file of its own for how rays meet it; all else
// is here. `kind` is known when compiled, or is the primitive's own.

// The distance of the nearest hit in (0, limit), else `limit`. `inside_prim` says that the ray starts on the primitive and goes
// through its inside.
fn intersect(kind: u32, q: Primitive, inside_prim: bool, ray: Ray, limit: f32) -> f32 {
    if kind == RECTANGLE {
        return intersect_rectangle(q, ray, limit);
    }
    if kind == TRIANGLE {
        return intersect_triangle(q, ray, limit);
    }
    if kind == ELLIPSOID {
        return intersect_ellipsoid(q, inside_prim, ray, limit);
    }
    if kind == DISK {
        return intersect_disk(q, ray, limit);
    }
    if kind == CYLINDER {
        return intersect_cylinder(q, inside_prim, ray, limit);
    }
    return intersect_plane(q, ray, limit);
}

// Returns whether a primitive cuts the segment o + s d, s in (0, reach), of local space; `levels` are the `solid_levels` of o.
fn occludes(kind: u32, o: vec3f, d: vec3f, levels: vec2f, t_max: f32) -> bool {
    if kind == RECTANGLE {
        return rectangle_occludes(o, d, t_max);
    }
    if kind == TRIANGLE {
        return triangle_occludes(o, d, t_max);
    }
    if kind == ELLIPSOID {
        return ellipsoid_occludes(o, d, levels.x, t_max);
    }
    if kind == DISK {
        return disk_occludes(o, d, t_max);
    }
    if kind == CYLINDER {
        return cylinder_occludes(o, d, levels, t_max);
    }
    return plane_occludes(o, d, t_max);
}

// Returns whether primitives of a kind are the surfaces of convex solids: a ray that leaves one through the inside hits it again.
fn is_solid(kind: u32) -> bool {
    return ((SOLID_KINDS >> kind) & 1u) == 1u;
}

// Whether its local space goes from -1 to 1 where its texture coordinates go from 0 to 1.
fn is_centered(kind: u32) -> bool {
    return (kind == RECTANGLE) | (kind == DISK);
}

// The levels of a point of local space for `blocks`, below 0 inside of a solid; y is used by cylinders only. `inside_prim` says that the point is on the
// surface and counts as inside, by the least amount: rays inwards are occluded if they end outside.
fn solid_levels(kind: u32, q: Primitive, from_anchor: vec3f, inside_prim: bool) -> vec2f {
    if kind == CYLINDER {
        let levels = cylinder_levels(q, from_anchor);
        return select(levels, levels_on_surface(levels, -1e-30), inside_prim);
    }
    return vec2f(select(ellipsoid_level(q, from_anchor), -1e-30, inside_prim), 0.0);
}

// The gradient, at a point of local space, of what is 0 on a primitive: of z, of (x^2 + y^2 + z^2 - 1) / 2, or that of a cylinder.
fn primitive_gradient(q: Primitive, local: vec3f) -> vec3f {
    let solid = solid_gradient(q.kind, local);
    let gradient = q.x * solid.x + q.y * solid.y + q.z * solid.z;
    return select(q.z, gradient, is_solid(q.kind));
}

// The gradient of a solid in local space.
fn solid_gradient(kind: u32, local: vec3f) -> vec3f {
    return select(local, cylinder_gradient(local), kind == CYLINDER);
}

// The change of `solid_gradient` where the local point changes by d.
fn solid_gradient_derivative(kind: u32, local: vec3f, d: vec3f) -> vec3f {
    return select(d, cylinder_gradient_derivative(local, d), kind == CYLINDER);
}

// The function whose gradient `primitive_gradient` is, 0 on the primitive.
fn primitive_height(q: Primitive, from_anchor: vec3f) -> f32 {
    let round = 0.5 * ellipsoid_level(q, from_anchor);
    let solid = select(round, cylinder_height(q, from_anchor), q.kind == CYLINDER);
    return select(from_anchor.z, solid, is_solid(q.kind));
}

fn primitive_normal(q: Primitive, local: vec3f) -> vec3f {
    return normalize(primitive_gradient(q, local));
}

// Texture coordinates of a point of local space. Rectangle and disk: 0 to 1 along tangent and bitangent. Triangle: barycentric
// coordinates of the second and third vertex. Plane: lengths along tangent and bitangent. Ellipsoid: longitude from
// the first towards the second axis and latitude from the third axis' foot, each from 0 to 1. Cylinder: `cylinder_uv`.
fn primitive_uv(q: Primitive, local: vec3f) -> vec2f {
    if is_centered(q.kind) {
        return vec2f(0.5 * local.x + 0.5, 0.5 * local.y + 0.5);
    }
    if q.kind == ELLIPSOID {
        let latitude = atan2(sqrt(local.x * local.x + local.y * local.y), -local.z) * 0.3183098861837907;
        return vec2f(longitude(local), latitude);
    }
    if q.kind == CYLINDER {
        return cylinder_uv(local);
    }
    return local.xy;
}

// Of `primitive_uv`, where the local point has the derivative d.
fn uv_derivative(q: Primitive, local: vec3f, d: vec3f) -> vec2f {
    if is_centered(q.kind) {
        return d.xy * 0.5;
    }
    if q.kind == ELLIPSOID {
        let r2 = max(local.x * local.x + local.y * local.y, 1e-12); // 0 at the poles
        let du = (local.x * d.y - local.y * d.x) / r2;
        let r = sqrt(r2);
        let dv = r * d.z - local.z * ((local.x * d.x + local.y * d.y) / r);
        return vec2f(du * 0.15915494309189535, dv * 0.3183098861837907);
    }
    if q.kind == CYLINDER {
        return cylinder_uv_derivative(local, d);
    }
    return d.xy;
}

// The derivatives of a point by u and by v.
struct Tangents {
    u: vec3f,
    v: vec3f,
}

// The derivatives of a point of local space by u and by v. Where an ellipsoid's u has no direction, at its poles, that of the nearest meridian is taken.
fn local_tangents(q: Primitive, local: vec3f) -> Tangents {
    if q.kind == ELLIPSOID {
        let r = sqrt(max(local.x * local.x + local.y * local.y, 1e-12));
        let u = vec3f(-local.y, local.x, 0.0) * 6.283185307179586;
        let v = vec3f(-local.z * local.x / r, -local.z * local.y / r, r) * 3.141592653589793;
        return Tangents(u, v);
    }
    if q.kind == CYLINDER {
        return Tangents(cylinder_tangent(local), cylinder_bitangent(local));
    }
    let scale = select(1.0, 2.0, is_centered(q.kind));
    return Tangents(vec3f(scale, 0.0, 0.0), vec3f(0.0, scale, 0.0));
}
