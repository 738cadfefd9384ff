// Sample footprints on surfaces, in texture coordinates.

struct Footprint {
    uv: vec2f,
    dx: vec2f,             // edges of the sample's parallelogram
    dy: vec2f,
}

fn surface_footprint(q: Primitive, surface: Surface, dx: vec3f, dy: vec3f) -> Footprint {
    let local = point_to_local(q, surface.position);
    return Footprint(surface.uv, uv_derivative(q, local, vector_to_local(q, dx)),
                     uv_derivative(q, local, vector_to_local(q, dy)));
}

fn wrap_u(t: Texture) -> u32 {
    return t.wrap & 3u;
}

fn wrap_v(t: Texture) -> u32 {
    return t.wrap >> 2u;
}

// Transforms a footprint from surface to texture coordinates. Outside of [0, 1] on a clamped axis, the footprint has no
// extent along the axis, so that coarse levels do not mix in distant texels.
fn texture_footprint(t: Texture, f: Footprint) -> Footprint {
    let dx = vec2f(t.u.x * f.dx.x + t.u.y * f.dx.y, t.v.x * f.dx.x + t.v.y * f.dx.y);
    let dy = vec2f(t.u.x * f.dy.x + t.u.y * f.dy.y, t.v.x * f.dy.x + t.v.y * f.dy.y);
    let uv = vec2f(t.u.x * f.uv.x + t.u.y * f.uv.y + t.u.z, t.v.x * f.uv.x + t.v.y * f.uv.y + t.v.z);
    let x = (wrap_u(t) == CLAMP) & ((uv.x < 0.0) | (uv.x > 1.0));
    let y = (wrap_v(t) == CLAMP) & ((uv.y < 0.0) | (uv.y > 1.0));
    return Footprint(uv, vec2f(select(dx.x, 0.0, x), select(dx.y, 0.0, y)),
                     vec2f(select(dy.x, 0.0, x), select(dy.y, 0.0, y)));
}

// An ellipse p^T M^-1 p <= 1.
struct Ellipse {
    m: vec3f,              // xx, xy and yy of M
    major: f32,            // semi-axes
    minor: f32,
}

// Returns the ellipse with the conjugate semi-diameters dx and dy. The minor semi-axis is enlarged to at least 1 /
// `anisotropy` of the major semi-axis. The eigenvalues of J J^T for J = (dx, dy) are the squared semi-axes.
fn footprint_ellipse(dx: vec2f, dy: vec2f, anisotropy: f32) -> Ellipse {
    let p = dx.x * dx.x + dy.x * dy.x;
    let q = dx.x * dx.y + dy.x * dy.y;
    let r = dx.y * dx.y + dy.y * dy.y;
    let half = 0.5 * (p - r);
    let root = sqrt(half * half + q * q);
    let large = 0.5 * (p + r) + root;
    let area = dx.x * dy.y - dx.y * dy.x;
    let lower_bound = large / (anisotropy * anisotropy);
    let small = min(max(area * area / max(large, 1e-30), lower_bound), large);
    // M = small I + (large - small) e e^T, e the unit vector of the major axis.
    let wide = half >= 0.0;
    let e = vec2f(select(q, half + root, wide), select(root - half, q, wide));
    let e2 = e.x * e.x + e.y * e.y;
    let stretch = select(0.0, (large - small) / e2, e2 > 0.0);
    let m = vec3f(small + stretch * (e.x * e.x), stretch * (e.x * e.y), small + stretch * (e.y * e.y));
    return Ellipse(m, sqrt(large), sqrt(small));
}
