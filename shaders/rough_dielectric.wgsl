// The rough material `dielectric`: Walter, Marschner, Li and Torrance, "Microfacet Models for Refraction through Rough
// Surfaces", EGSR 2007, with GGX microfacets. `ior` is the index behind the surface relative to the viewer's side;
// radiance scales with the square of `ior`.

// Returns the factor of reflection and transmission that compensates for multiple scattering.
fn dielectric_gain(material: Material) -> f32 {
    return 1.0 + material.loss;
}

// Returns the microfacet normal that refracts wi to wo: Walter et al., equation 16.
fn refracting_normal(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    let sum = wo + wi * material.ior;
    let unit = sum * (1.0 / sqrt(max(dot(sum, sum), 1e-20)));
    return unit * select(-1.0, 1.0, unit.z > 0.0);
}

// Returns the BSDF times |cos| of the angle between wi and the normal, wi above or below: equations 20 and 21.
fn rough_dielectric_eval(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    let alpha = facet_alpha(material);
    let eta = 1.0 / material.ior;
    let above = wi.z > 0.0;
    let m = select(refracting_normal(material, wo, wi), half_vector(wo, wi), above);
    let o = dot(wo, m);
    let i = dot(wi, m);
    let reflected = fresnel(max(o, 1e-6), refracted_cosine(max(o, 1e-6), eta), eta);
    let mirrored = vec3f(reflected * facet_eval(alpha, wo, wi));
    let transmits = (o > 0.0) & (i < 0.0) & (wi.z < 0.0);
    let d = o + material.ior * i;
    let visible = 2.0 / max(wo.z + ggx_length(alpha, wo), 1e-30) * ggx_g1(alpha, wi);
    let btdf = (1.0 - reflected) * ggx_d(alpha, m) * visible * o * -i / max(d * d, 1e-30);
    let refracted = select(vec3f(0.0), material.tint * btdf, transmits);
    return select(vec3f(0.0), select(refracted, mirrored, above) * dielectric_gain(material), wo.z > 0.0);
}

// Returns the pdf of `rough_dielectric_sample`, per solid angle: equations 14 and 17.
fn rough_dielectric_pdf(material: Material, wo: vec3f, wi: vec3f) -> f32 {
    let alpha = facet_alpha(material);
    let eta = 1.0 / material.ior;
    let above = wi.z > 0.0;
    let m = select(refracting_normal(material, wo, wi), half_vector(wo, wi), above);
    let o = dot(wo, m);
    let i = dot(wi, m);
    let reflected = fresnel(max(o, 1e-6), refracted_cosine(max(o, 1e-6), eta), eta);
    let mirrored = reflected * facet_pdf(alpha, wo, wi);
    let transmits = (o > 0.0) & (i < 0.0) & (wi.z < 0.0);
    let d = o + material.ior * i;
    let transmitted = (1.0 - reflected) * ggx_pdf(alpha, wo, m) * (material.ior * material.ior) * -i / max(d * d, 1e-30);
    return select(0.0, select(select(0.0, transmitted, transmits), mirrored, above), wo.z > 0.0);
}

// Samples reflection or refraction, as `random` in [0, 1) selects.
fn rough_dielectric_sample(material: Material, wo: vec3f, u: vec2f, random: f32) -> LobeSample {
    let alpha = facet_alpha(material);
    let eta = 1.0 / material.ior;
    let m = ggx_sample(alpha, wo, u);
    let o = max(dot(wo, m), 1e-6);
    let t = refracted_cosine(o, eta);
    let reflected = fresnel(o, t, eta);
    let reflects = random < reflected;
    let gain = dielectric_gain(material);
    let reflected_wi = m * (2.0 * o) - wo;
    let refracted_wi = m * (eta * o - t) - wo * eta;
    let wi = normalize(select(refracted_wi, reflected_wi, reflects));
    let d = o - material.ior * t;
    let normal_pdf = ggx_pdf(alpha, wo, m);
    let mirrored = normal_pdf * reflected * 0.25 / o;
    let transmitted = normal_pdf * (1.0 - reflected) * (material.ior * material.ior) * t / max(d * d, 1e-30);
    let transmitted_weight = material.tint * (ggx_g1(alpha, wi) * (eta * eta));
    let weight = select(transmitted_weight, vec3f(facet_weight(alpha, wo, wi)), reflects) * gain;
    let lit = (wo.z > 0.0) & (wi.z * select(-1.0, 1.0, reflects) > 0.0);
    return LobeSample(wi, select(vec3f(0.0), weight, lit), select(0.0, select(transmitted, mirrored, reflects), lit),
                      select(eta, 1.0, reflects));
}
