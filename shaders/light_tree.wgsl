// Importance sampling of light-tree nodes: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive
// Tree Splitting", HPG 2018, without splitting and with four children per node.

// Returns the mean of max(h, 0) for h uniform in [m - r, m + r].
fn mean_above(m: vec4f, r: vec4f) -> vec4f {
    return select(max4(m, vec4f(0.0)), 0.25 * (m + r) * ((m + r) / r), abs(m) < r);
}

// Returns the importances of the children at p, up to a factor: section 4.1, with each cosine replaced by a mean height
// divided by the distance. The height is that of p above the plane of the emitters, or of the emitters above the plane
// of the surface, averaged over the bounding sphere. The mean height is at least 0.03 of the radius, because the sphere
// overestimates the extent of its emitters. A tenth of the squared radius is added to the squared distance. n is the
// surface normal, or 0 if light may arrive from both sides. Importances are positive where light can arrive, with a
// margin for rounding.
fn light_importances(node: LightNode, p: vec3f, n: vec3f) -> vec4f {
    let x = node.x - p.x;
    let y = node.y - p.y;
    let z = node.z - p.z;
    let d2 = x * x + y * y + z * z;
    let d = sqrt(d2);
    let signed_axial = -(node.axis_x * x + node.axis_y * y + node.axis_z * z);
    let axial = select(signed_axial, abs(signed_axial), node.sides == vec4u(2u));
    let sine = sqrt(max4(1.0 - node.cosine * node.cosine, vec4f(0.0)));
    let rotated = axial * node.cosine + sqrt(max4(d2 - signed_axial * signed_axial, vec4f(0.0))) * sine;
    let emitter_height = select(rotated, d, axial >= node.cosine * d); // d times the cosine to the nearest emitter normal
    let surface_height = select(x * n.x + y * n.y + z * n.z, d, vec4<bool>(dot(n, n) == 0.0));
    let min_height = 0.03 * node.radius;
    let mean_emitter_height = max4(mean_above(emitter_height, node.radius), min_height);
    let mean_surface_height = max4(mean_above(surface_height, node.radius), min_height);
    let inverse = 1.0 / max4(sqrt(d2 + 0.1 * node.radius * node.radius), vec4f(1e-15));
    let value = node.intensity * (mean_emitter_height * inverse) * (mean_surface_height * inverse) * (inverse * inverse);
    // The extent of the sphere changes the angle, and therefore the cosine, by at most pi / 2 * radius / d.
    let may_emit = emitter_height + 1.5707964 * node.radius > (node.edge - 1e-3) * d;
    let may_arrive = may_emit & (surface_height + node.radius > -1e-3 * d) & (node.intensity > vec4f(0.0));
    return select(vec4f(0.0), max4(value, vec4f(1e-36)), may_arrive);
}

// Returns probabilities proportional to the importances; (1, 0, 0, 0) if all are 0. Positive importances are raised to
// at least 2^-12 of the sum, well above the resolution of random numbers.
fn light_shares(importances: vec4f) -> vec4f {
    let sum = (importances.x + importances.y) + (importances.z + importances.w);
    let clamped = select(vec4f(0.0), max4(importances, vec4f(sum * 0.00024414063)), importances > vec4f(0.0));
    let shares = clamped / ((clamped.x + clamped.y) + (clamped.z + clamped.w));
    return select(shares, vec4f(1.0, 0.0, 0.0, 0.0), vec4<bool>(sum == 0.0));
}

// Returns the child that `random` in [0, 1) selects, never a child of probability 0.
fn light_child(shares: vec4f, random: f32) -> u32 {
    let second = shares.x + shares.y;
    let third = second + shares.z;
    let child = select(0u, 1u, random >= shares.x) + select(0u, 1u, random >= second) + select(0u, 1u, random >= third);
    let last = select(select(select(0u, 1u, shares.y > 0.0), 2u, shares.z > 0.0), 3u, shares.w > 0.0);
    return select(child, last, child > last);
}
