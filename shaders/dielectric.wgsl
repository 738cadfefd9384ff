// The materials `dielectric` and `glass` where light bounces: a path goes one way, mirrored or refracted, by Fresnel's equations.

// What is left of light on its way through a medium, by the law of Beer and Lambert; 1 where nothing absorbs.
fn transmittance(absorption: vec3f, distance: f32) -> vec3f {
    let d = absorption * (distance * -1.4426950408889634);
    return vec3f(exp2(d.x), exp2(d.y), exp2(d.z));
}

// The ratio of the index of refraction on the viewer's side to that behind the surface.
fn eta_of(surface: Surface, material: Material) -> f32 {
    return select(material.ior, 1.0 / material.ior, surface.side > 0.0);
}

// Whether what is refracted by a normal goes through the surface, or nothing is refracted at all. What a normal map or a mesh's
// vertices say may turn it back to the side that it came from, where it would count as being on the other.
fn refracts_inwards(surface: Surface, material: Material, normal: vec3f) -> bool {
    let eta = eta_of(surface, material);
    let cosine_i = max(dot(surface.wo, normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    let d = refracted_direction(-surface.wo, normal, eta, cosine_i, cosine_t);
    return (dot(d, surface.normal) < 0.0) | (cosine_t == 0.0);
}

// The path's way on, by `random` in [0, 1). Radiance grows with the square of the index of refraction where it enters: Veach,
// "Robust Monte Carlo Methods for Light Transport Simulation", thesis, 1997, section 5.2.
struct DielectricSample {
    path: Path,
    passes: bool,          // through the surface
    eta: f32,              // the ratio of the indices before and behind it if so, else 1
}

fn dielectric_sample(path: Path, surface: Surface, at: HitDifferential, material: Material, random: f32) -> DielectricSample {
    let eta = eta_of(surface, material);
    let cosine_i = max(dot(surface.wo, surface.shading_normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    if random < fresnel(cosine_i, cosine_t, eta) {
        return DielectricSample(reflected_path(path, surface, at, path.throughput), false, 1.0);
    }
    let throughput = path.throughput * material.tint * (eta * eta);
    return DielectricSample(refracted_path(path, surface, at, throughput, eta, cosine_i, cosine_t), true, eta);
}
