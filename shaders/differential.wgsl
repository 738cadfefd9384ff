// Ray differentials: how a ray changes with the point of the picture that it belongs to. Homan Igehy, "Tracing Ray
// Differentials", SIGGRAPH 1999; sections are those of that paper.

// Of a ray with respect to one coordinate of the picture, times the distance of two samples.
struct Derivative {
    position: vec3f,
    direction: vec3f,
}

struct Differential {
    x: Derivative,
    y: Derivative,
}

// Along the ray to its hit at t, on a surface with this normal: section 3.1, transfer.
fn transferred(derivative: Derivative, ray: Ray, t: f32, normal: vec3f) -> Derivative {
    let moved = derivative.position + derivative.direction * t;
    let dt = dot(moved, normal) / dot(ray.direction, normal);
    return Derivative(moved - ray.direction * dt, derivative.direction);
}

// Of an outward unit normal where the position on the primitive has the derivative `dp`: section 3.2. The gradient of
// |M (P - c)|^2 / 2 is g = M^T M (P - c), on the side of a cylinder without the third row of M; with N = g / |g|,
// dN = (dg - N (N . dg)) / |g|.
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

// By a mirror with the normal n: section 3.1, reflection.
fn reflected_derivative(derivative: Derivative, d: vec3f, n: vec3f, dn: vec3f) -> Derivative {
    let d_n = dot(derivative.direction, n) + dot(d, dn);
    return Derivative(derivative.position, derivative.direction - (dn * dot(d, n) + n * d_n) * 2.0);
}

// Into a medium, eta the ratio of the indices of refraction and `cosine` that of the refracted ray: section 3.1,
// refraction.
fn refracted_derivative(derivative: Derivative, d: vec3f, n: vec3f, dn: vec3f, eta: f32, cosine: f32) -> Derivative {
    let d_n = dot(d, n);
    let mu = eta * d_n + cosine;
    let dmu = (eta + eta * eta * d_n / cosine) * (dot(derivative.direction, n) + dot(d, dn));
    return Derivative(derivative.position, derivative.direction * eta - (dn * mu + n * dmu));
}

// A ray's differential at a surface: the positions on it, the directions still those before it, and the normal's.
struct HitDifferential {
    x: Derivative,
    y: Derivative,
    normal_x: vec3f,
    normal_y: vec3f,
}

fn arrival(q: Primitive, differential: Differential, ray: Ray, t: f32, surface: Surface) -> HitDifferential {
    let local = point_to_local(q, surface.position);
    let x = transferred(differential.x, ray, t, surface.normal);
    let y = transferred(differential.y, ray, t, surface.normal);
    let normal_x = normal_derivative(q, local, x.position) * surface.side;
    let normal_y = normal_derivative(q, local, y.position) * surface.side;
    return HitDifferential(x, y, normal_x, normal_y);
}

fn reflected_differential(at: HitDifferential, d: vec3f, n: vec3f) -> Differential {
    return Differential(reflected_derivative(at.x, d, n, at.normal_x), reflected_derivative(at.y, d, n, at.normal_y));
}

fn refracted_differential(at: HitDifferential, d: vec3f, n: vec3f, eta: f32, cosine: f32) -> Differential {
    return Differential(refracted_derivative(at.x, d, n, at.normal_x, eta, cosine),
                        refracted_derivative(at.y, d, n, at.normal_y, eta, cosine));
}
