// Dispatch by the kind of a primitive, which may be a compile-time constant.

// Returns the t of the nearest hit in (0, limit), else `limit`. With `from_inside`, the ray starts on the primitive and
// goes inwards.
fn intersect(kind: u32, q: Primitive, from_inside: bool, ray: Ray, limit: f32) -> f32 {
    if kind == RECTANGLE {
        return intersect_rectangle(q, ray, limit);
    }
    if kind == TRIANGLE {
        return intersect_triangle(q, ray, limit);
    }
    if kind == ELLIPSOID {
        return intersect_ellipsoid(q, from_inside, ray, limit);
    }
    if kind == DISK {
        return intersect_disk(q, ray, limit);
    }
    if kind == CYLINDER {
        return intersect_cylinder(q, from_inside, ray, limit);
    }
    return intersect_plane(q, ray, limit);
}

// Returns true if a primitive occludes the local segment o + s d, s in (0, t_max); `levels` are `solid_levels` of o.
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

// Returns true for convex solids: a ray that leaves the surface through the inside hits it again.
fn is_solid(kind: u32) -> bool {
    return ((SOLID_KINDS >> kind) & 1u) == 1u;
}

// Returns true if texture coordinates 0 to 1 correspond to local coordinates -1 to 1.
fn is_centered(kind: u32) -> bool {
    return (kind == RECTANGLE) | (kind == DISK);
}

// Returns the levels of a local point for `occludes`, negative inside; y is for cylinders only. With `from_inside`, a
// point on the surface counts as barely inside: segments inwards are occluded if they end outside.
fn solid_levels(kind: u32, q: Primitive, from_anchor: vec3f, from_inside: bool) -> vec2f {
    if kind == CYLINDER {
        let levels = cylinder_levels(q, from_anchor);
        return select(levels, levels_on_surface(levels, -1e-30), from_inside);
    }
    return vec2f(select(ellipsoid_level(q, from_anchor), -1e-30, from_inside), 0.0);
}

// Returns the world-space gradient, at a local point, of a function that is 0 on the primitive: z, (x^2 + y^2 + z^2 -
// 1) / 2, or the function of a cylinder.
fn primitive_gradient(q: Primitive, local: vec3f) -> vec3f {
    let solid = solid_gradient(q.kind, local);
    let gradient = q.x * solid.x + q.y * solid.y + q.z * solid.z;
    return select(q.z, gradient, is_solid(q.kind));
}

fn solid_gradient(kind: u32, local: vec3f) -> vec3f {
    return select(local, cylinder_gradient(local), kind == CYLINDER);
}

// Returns the change of `solid_gradient` for the offset d.
fn solid_gradient_derivative(kind: u32, local: vec3f, d: vec3f) -> vec3f {
    return select(d, cylinder_gradient_derivative(local, d), kind == CYLINDER);
}

// Returns the value of the function whose gradient is `primitive_gradient`.
fn primitive_height(q: Primitive, from_anchor: vec3f) -> f32 {
    let ellipsoid_height = 0.5 * ellipsoid_level(q, from_anchor);
    let solid_height = select(ellipsoid_height, cylinder_height(q, from_anchor), q.kind == CYLINDER);
    return select(from_anchor.z, solid_height, is_solid(q.kind));
}

fn primitive_normal(q: Primitive, local: vec3f) -> vec3f {
    return normalize(primitive_gradient(q, local));
}

// Returns the texture coordinates of a local point. Rectangle, disk: 0 to 1 along tangent and bitangent. Triangle:
// barycentric, of the second and third vertex. Plane: lengths along tangent and bitangent. Ellipsoid: longitude from
// the first towards the second axis, latitude from the negative to the positive end of the third axis, each 0 to 1.
// Cylinder: `cylinder_uv`.
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

// Returns the change of `primitive_uv` for the offset d.
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

// Derivatives by u and by v.
struct Tangents {
    u: vec3f,
    v: vec3f,
}

// Returns the tangents at a local point. At the poles of an ellipsoid, they follow the nearest meridian.
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
