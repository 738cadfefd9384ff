// Paths through smooth `dielectric` and `glass`.

// Returns the Beer-Lambert transmittance over `distance`.
fn transmittance(absorption: vec3f, distance: f32) -> vec3f {
    let d = absorption * (distance * -1.4426950408889634);
    return vec3f(exp2(d.x), exp2(d.y), exp2(d.z));
}

// Returns the index of refraction on the viewer's side relative to the index behind the surface.
fn eta_of(surface: Surface, material: Material) -> f32 {
    return select(material.ior, 1.0 / material.ior, surface.side > 0.0);
}

// Returns true if the refracted ray is on the other side of the surface, or if there is total internal reflection.
// Mapped and interpolated normals can bend the refracted ray back to the viewer's side, although the path would count
// as inside.
fn refracts_inwards(surface: Surface, material: Material, normal: vec3f) -> bool {
    let eta = eta_of(surface, material);
    let cosine_i = max(dot(surface.wo, normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    let d = refracted_direction(-surface.wo, normal, eta, cosine_i, cosine_t);
    return (dot(d, surface.normal) < 0.0) | (cosine_t == 0.0);
}

struct DielectricSample {
    path: Path,
    is_transmitted: bool,
    eta: f32,              // if transmitted, the refractive index on the viewer's side divided by the one behind the surface; else 1
}

// Samples reflection or refraction. Radiance scales with the squared index: Veach, "Robust Monte Carlo Methods for
// Light Transport Simulation", thesis, 1997, section 5.2.
fn dielectric_sample(path: Path, surface: Surface, hit_diff: HitDifferential, material: Material, random: f32) -> DielectricSample {
    let eta = eta_of(surface, material);
    let cosine_i = max(dot(surface.wo, surface.shading_normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    if random < fresnel(cosine_i, cosine_t, eta) {
        return DielectricSample(reflected_path(path, surface, hit_diff, path.throughput), false, 1.0);
    }
    let throughput = path.throughput * material.tint * (eta * eta);
    return DielectricSample(refracted_path(path, surface, hit_diff, throughput, eta, cosine_i, cosine_t), true, eta);
}
