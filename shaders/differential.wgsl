// Ray differentials: derivatives by image coordinates. Igehy, "Tracing Ray Differentials", SIGGRAPH 1999; section
// numbers refer to that paper.

// The derivative of a ray by one image coordinate, times the sample spacing.
struct Derivative {
    position: vec3f,
    direction: vec3f,
}

struct Differential {
    x: Derivative,
    y: Derivative,
}

// Transfers the derivative of a ray to the hit at t (section 3.1).
fn transferred(derivative: Derivative, ray: Ray, t: f32, normal: vec3f) -> Derivative {
    let moved = derivative.position + derivative.direction * t;
    let dt = dot(moved, normal) / dot(ray.direction, normal);
    return Derivative(moved - ray.direction * dt, derivative.direction);
}

// Returns the derivative of the outward unit normal for the derivative `dp` of the position (section 3.2). With the
// matrix M of the rows q.x, q.y and q.z, a point p of a solid with the center c has the local position l = M (p - c).
// With the gradient s of the solid's function at l (`solid_gradient`), the gradient in world space is g = M^T s. The
// normal is n = g / |g|, with the derivative (dg - n (n . dg)) / |g|.
fn normal_derivative(q: Primitive, local: vec3f, dp: vec3f) -> vec3f {
    let dl = vector_to_local(q, dp);
    let s = solid_gradient(q.kind, local);
    let ds = solid_gradient_derivative(q.kind, local, dl);
    let g = q.x * s.x + q.y * s.y + q.z * s.z;
    let dg = q.x * ds.x + q.y * ds.y + q.z * ds.z;
    let scale = 1.0 / sqrt(dot(g, g));
    let n = g * scale;
    return select(vec3f(0.0), (dg - n * dot(n, dg)) * scale, is_solid(q.kind));
}

// Reflects a derivative at the normal n (section 3.1).
fn reflected_derivative(derivative: Derivative, d: vec3f, n: vec3f, dn: vec3f) -> Derivative {
    let d_n = dot(derivative.direction, n) + dot(d, dn);
    return Derivative(derivative.position, derivative.direction - (dn * dot(d, n) + n * d_n) * 2.0);
}

// Refracts a derivative (section 3.1) with the index ratio eta and the refracted ray's cosine.
fn refracted_derivative(derivative: Derivative, d: vec3f, n: vec3f, dn: vec3f, eta: f32, cosine: f32) -> Derivative {
    let d_n = dot(d, n);
    let mu = eta * d_n + cosine;
    let dmu = (eta + eta * eta * d_n / cosine) * (dot(derivative.direction, n) + dot(d, dn));
    return Derivative(derivative.position, derivative.direction * eta - (dn * mu + n * dmu));
}

// A differential at a hit, before scattering.
struct HitDifferential {
    x: Derivative,
    y: Derivative,
    normal_x: vec3f,
    normal_y: vec3f,
}

fn primitive_hit_differential(q: Primitive, differential: Differential, ray: Ray, t: f32, surface: Surface) -> HitDifferential {
    let local = point_to_local(q, surface.position);
    let x = transferred(differential.x, ray, t, surface.normal);
    let y = transferred(differential.y, ray, t, surface.normal);
    let normal_x = normal_derivative(q, local, x.position) * surface.side;
    let normal_y = normal_derivative(q, local, y.position) * surface.side;
    return HitDifferential(x, y, normal_x, normal_y);
}

fn reflected_differential(hit_diff: HitDifferential, d: vec3f, n: vec3f) -> Differential {
    return Differential(reflected_derivative(hit_diff.x, d, n, hit_diff.normal_x), reflected_derivative(hit_diff.y, d, n, hit_diff.normal_y));
}

fn refracted_differential(hit_diff: HitDifferential, d: vec3f, n: vec3f, eta: f32, cosine: f32) -> Differential {
    return Differential(refracted_derivative(hit_diff.x, d, n, hit_diff.normal_x, eta, cosine),
                        refracted_derivative(hit_diff.y, d, n, hit_diff.normal_y, eta, cosine));
}
