// The material `dielectric` as a thin sheet, which does not change the direction of transmitted light. With
// interreflection between the sides of the sheet, the reflectance is 2 R / (1 + R): see the series in Stam, "An
// Illumination Model for a Skin Layer Bounded by Rough Surfaces", EGRW 2001. Roughness spreads transmitted light like
// reflected light.

fn thin_reflectance(ior: f32, cosine: f32) -> f32 {
    let c = min(max(cosine, 1e-6), 1.0);
    let eta = 1.0 / ior;
    let one_side = fresnel(c, refracted_cosine(c, eta), eta);
    return 2.0 * one_side / (1.0 + one_side);
}

// Mirrors a direction behind the sheet to the viewer's side.
fn to_upper_side(wi: vec3f) -> vec3f {
    return vec3f(wi.x, wi.y, abs(wi.z));
}

// Returns the BSDF times |cos| of the angle between wi and the normal; wi may be below the surface.
fn thin_eval(material: Material, wo: vec3f, wi: vec3f) -> vec3f {
    let up = to_upper_side(wi);
    let reflected = thin_reflectance(material.ior, dot(wo, half_vector(wo, up)));
    let share = select(material.tint * (1.0 - reflected), vec3f(reflected), wi.z > 0.0);
    let value = share * (facet_eval(facet_alpha(material), wo, up) * dielectric_gain(material));
    return select(vec3f(0.0), value, (wo.z > 0.0) & (up.z > 0.0));
}

// Returns the pdf of `thin_sample`, per solid angle.
fn thin_pdf(material: Material, wo: vec3f, wi: vec3f) -> f32 {
    let up = to_upper_side(wi);
    let reflected = thin_reflectance(material.ior, dot(wo, half_vector(wo, up)));
    let share = select(1.0 - reflected, reflected, wi.z > 0.0);
    return select(0.0, share * facet_pdf(facet_alpha(material), wo, up), (wo.z > 0.0) & (up.z > 0.0));
}

// Samples reflection or transmission, as `random` in [0, 1) selects.
fn thin_sample(material: Material, wo: vec3f, u: vec2f, random: f32) -> LobeSample {
    let alpha = facet_alpha(material);
    let m = ggx_sample(alpha, wo, u);
    let cosine = dot(wo, m);
    let reflected = thin_reflectance(material.ior, cosine);
    let reflects = random < reflected;
    let up = m * (2.0 * cosine) - wo;
    let lit = (wo.z > 0.0) & (up.z > 0.0) & (cosine > 0.0);
    let weight = select(material.tint, vec3f(1.0), reflects) * (facet_weight(alpha, wo, up) * dielectric_gain(material));
    let share = select(1.0 - reflected, reflected, reflects);
    let pdf = share * ggx_d(alpha, m) * 0.5 / max(wo.z + ggx_length(alpha, wo), 1e-30);
    let wi = vec3f(up.x, up.y, select(-up.z, up.z, reflects));
    return LobeSample(wi, select(vec3f(0.0), weight, lit), select(0.0, pdf, lit), 1.0);
}
