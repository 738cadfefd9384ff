// The material `phong` with the integrator `path`: the modified model of Lafortune and Willems, "Using the Modified
// Phong Reflectance Model for Physically Based Rendering", report CW 197, Leuven, 1994.

// Reflectances, scaled down to a sum of at most 1 per channel.
struct PhongFactors {
    diffuse: vec3f,
    specular: vec3f,
    diffuse_share: f32,    // probability of sampling the diffuse term
}

fn phong_factors(material: Material) -> PhongFactors {
    let max_sum = largest(material.diffuse + material.specular);
    let diffuse = select(material.diffuse, material.diffuse / max_sum, max_sum > 1.0);
    let specular = select(material.specular, material.specular / max_sum, max_sum > 1.0);
    let d = diffuse.x + diffuse.y + diffuse.z;
    let s = specular.x + specular.y + specular.z;
    return PhongFactors(diffuse, specular, select(1.0, d / (d + s), s > 0.0));
}

// Returns the power of the cosine between wi and the mirror direction of wo.
fn phong_lobe(material: Material, angles: Angles) -> f32 {
    let cosine = 2.0 * angles.wi * angles.wo - angles.between;
    return power(min(max(cosine, 0.0), 1.0), material.shininess);
}

// Returns the BRDF times the cosine between wi and the normal.
fn modified_phong_eval(material: Material, angles: Angles) -> vec3f {
    let factors = phong_factors(material);
    let specular = phong_lobe(material, angles) * (material.shininess + 2.0) * 0.15915494309189535;
    return (factors.diffuse * 0.31830988618379067 + factors.specular * specular) * max(angles.wi, 0.0);
}

// Returns the pdf of `modified_phong_sample`, per solid angle.
fn modified_phong_pdf(material: Material, angles: Angles) -> f32 {
    let share = phong_factors(material).diffuse_share;
    let specular = phong_lobe(material, angles) * (material.shininess + 1.0) * 0.15915494309189535;
    return diffuse_pdf(angles) * share + specular * (1.0 - share);
}

// Samples a direction, which may be below the surface. `random` in [0, 1) selects the term.
fn modified_phong_sample(material: Material, normal: vec3f, wo: vec3f, u: vec2f, random: f32) -> vec3f {
    if random < phong_factors(material).diffuse_share {
        return diffuse_sample(normal, u);
    }
    let p = disk_sample(u);
    let r2 = p.x * p.x + p.y * p.y;
    let cosine = power(max(1.0 - r2, 0.0), 1.0 / (material.shininess + 1.0));
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let offset = p * (sine / sqrt(max(r2, 1e-20)));
    return normalize(vector_around(normalize(normal * (2.0 * dot(normal, wo)) - wo), vec3f(offset, cosine)));
}
