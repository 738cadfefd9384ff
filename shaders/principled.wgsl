// The material `principled`: the metallic-roughness model of glTF 2.0 with extensions (Khronos, "glTF 2.0
// Specification", 2021, appendix B; KHR_materials_anisotropy, _clearcoat, _ior, _sheen, _specular, _transmission,
// _volume). Clearcoat lies over sheen, and sheen over metal or a dielectric, diffuse or transmissive. Metal and the
// diffuse base are two-sided. A layer's albedo towards the viewer attenuates the layers below, which conserves energy.
// Transmission works as in `dielectric`. In the local frame, z is the shading normal on the viewer's side, and x the
// tangent.

// The lobes as seen from one direction.
struct PrincipledLobes {
    diffuse: vec3f,        // albedo of the diffuse base
    alpha: vec2f,          // of the specular lobe, along x and y
    f0: vec3f,             // reflectance of the specular lobe at normal incidence, with multiple scattering
    f90: vec3f,            // reflectance of the specular lobe at grazing angles, with multiple scattering
    glass: f32,            // weight of glass, with multiple scattering
    transmission_tint: vec3f, // weight of glass for transmitted light, with multiple scattering
    glass_f0: vec3f,       // reflectance of glass at normal incidence
    glass_f90: f32,        // reflectance of glass at grazing angles
    f0_ior: f32,           // reflectance by the index alone, at normal incidence
    ratio: f32,            // ratio of the indices in front of and behind the surface, thin or not
    eta: f32,              // ratio of the indices for refraction: 1 if thin
    thin: bool,            // transmission keeps the direction
    coat: f32,             // weight of the clearcoat lobe
    coat_alpha: f32,
    coat_normal: vec3f,
    sheen: vec3f,          // weight of the sheen lobe
    sheen_alpha: f32,
    lobe_probs: vec4f,     // probabilities of diffuse, specular, glass and coat; sheen has the remaining probability
}

// Returns the lobes for the outgoing direction wo. Lobes without a bit in `lobes` are omitted. `energy` contains
// tabulated albedos: x and y as in `ggx_albedo` for anisotropic lobes, z for rough glass.
fn principled_mixture(material: Material, wo: vec3f, outside: bool, coat_normal: vec3f, lobes: u32, energy: vec3f) -> PrincipledLobes {
    var m = PrincipledLobes();
    let rough = max(material.roughness * material.roughness, SMALLEST_ALPHA);
    m.alpha = vec2f(rough, rough);
    if (lobes & LOBE_ANISOTROPY) != 0u {
        m.alpha.x = rough + (1.0 - rough) * (material.anisotropy * material.anisotropy);
    }
    let volume = (material.thin == 0u) & (material.transmission > 0.0);
    m.thin = material.thin != 0u;
    m.eta = select(1.0, select(material.ior, 1.0 / material.ior, outside), volume);
    var layer_throughput = 1.0;
    m.coat_normal = coat_normal;
    let has_layers = outside | !volume;
    var coat_share = 0.0;
    if (lobes & LOBE_COAT) != 0u {
        let cosine = dot(wo, coat_normal);
        m.coat_alpha = max(material.clearcoat_roughness * material.clearcoat_roughness, SMALLEST_ALPHA);
        m.coat = select(0.0, material.clearcoat, has_layers & (cosine > 0.0));
        let reflected = ggx_albedo(m.coat_alpha, max(cosine, 0.0));
        coat_share = min(m.coat * (COAT_F0 * reflected.x + reflected.y), 1.0);
        layer_throughput = 1.0 - coat_share;
    }
    var sheen_share = 0.0;
    if (lobes & LOBE_SHEEN) != 0u {
        let roughness = max(material.sheen_roughness, MIN_SHEEN_ROUGHNESS);
        m.sheen_alpha = roughness * roughness;
        let albedo = sheen_albedo(roughness, wo.z);
        m.sheen = material.sheen * (select(0.0, layer_throughput, has_layers) / max(albedo, 1.0));
        let bounded = min(albedo, 1.0);
        sheen_share = luminance(m.sheen) * albedo;
        layer_throughput *= select(1.0, max(1.0 - largest(material.sheen) * bounded, 0.0), has_layers);
    }
    let base = material.diffuse;
    let dielectric = 1.0 - material.metallic;
    let diffuse_weight = dielectric * (1.0 - material.transmission);
    let ratio = (material.ior - 1.0) / (material.ior + 1.0);
    var reflected = vec3f(0.0);
    var inner = vec3f(0.0);
    var albedo_factors = vec2f(0.0);
    var compensation = 0.0;
    if (lobes & (LOBE_SPECULAR | LOBE_TRANSMISSION)) != 0u {
        albedo_factors = ggx_albedo(m.alpha.y, wo.z);
        var lower_bound = 1.005; // the fit may be too low by up to 0.5 %
        if (lobes & LOBE_ANISOTROPY) != 0u {
            if material.aniso_table != 0u {
                albedo_factors = energy.xy;
                lower_bound = 1.0;
            }
        }
        // Turquin, "Practical multiple scattering compensation for microfacet models", 2019.
        compensation = max(1.0 / max(albedo_factors.x + albedo_factors.y, 1e-3) - lower_bound, 0.0);
        let inner_f0 = bounded_color(material.specular * (ratio * ratio)) * material.specular_weight;
        // With the refractive index of air, f0 and thus f90 are 0: Lagarde and de Rousiers, "Moving Frostbite to
        // Physically Based Rendering", SIGGRAPH 2014 course, section 3.
        let inner_f90 = material.specular_weight * min(50.0 * (ratio * ratio), 1.0);
        let inner_gain = vec3f(1.0) + inner_f0 * compensation;
        let metal_gain = (vec3f(1.0) + base * compensation) * (material.metallic * layer_throughput);
        m.f0 = inner_f0 * inner_gain * (diffuse_weight * layer_throughput) + base * metal_gain;
        m.f90 = inner_gain * (inner_f90 * (diffuse_weight * layer_throughput)) + metal_gain;
        reflected = m.f0 * albedo_factors.x + m.f90 * albedo_factors.y;
        inner = (inner_f0 * albedo_factors.x + vec3f(inner_f90 * albedo_factors.y)) * inner_gain;
    }
    m.diffuse = base * (diffuse_weight * layer_throughput * max(1.0 - largest(inner), 0.0));
    var glass_weight = 0.0;
    if (lobes & LOBE_TRANSMISSION) != 0u {
        let f0_ior = ratio * ratio;
        m.f0_ior = select(f0_ior, 2.0 * f0_ior / (1.0 + f0_ior), m.thin);
        m.glass_f0 = bounded_color(material.specular * m.f0_ior) * material.specular_weight;
        m.glass_f90 = material.specular_weight;
        m.ratio = select(material.ior, 1.0 / material.ior, outside | m.thin);
        let glass_albedo = max(energy.z, 1e-3);
        let gain = select(1.0, select(1.0 / glass_albedo, 1.0 + compensation, m.thin), !transmits_straight(m));
        let glass = dielectric * material.transmission * layer_throughput;
        m.glass = glass * gain;
        m.transmission_tint = base * m.glass;
        let mirrored = min(luminance(m.glass_f0 * albedo_factors.x + vec3f(m.glass_f90 * albedo_factors.y)), 1.0);
        glass_weight = glass * (luminance(base) * (1.0 - mirrored) + mirrored);
    }
    let weights = vec4f(luminance(m.diffuse), luminance(reflected), glass_weight, coat_share);
    let sum = weights.x + weights.y + weights.z + weights.w + sheen_share;
    m.lobe_probs = select(vec4f(1.0, 0.0, 0.0, 0.0), weights * (1.0 / max(sum, 1e-30)), sum > 1e-30);
    return m;
}

fn bounded_color(color: vec3f) -> vec3f {
    return vec3f(min(color.x, 1.0), min(color.y, 1.0), min(color.z, 1.0));
}

// ITU-R BT.709.
fn luminance(color: vec3f) -> f32 {
    return 0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z;
}

fn sheen_probability(m: PrincipledLobes) -> f32 {
    return max(1.0 - (m.lobe_probs.x + m.lobe_probs.y + m.lobe_probs.z + m.lobe_probs.w), 0.0);
}

// Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Computer Graphics Forum 13(3), 1994.
fn schlick(f0: vec3f, f90: vec3f, cosine: f32) -> vec3f {
    let x = 1.0 - min(cosine, 1.0);
    let x2 = x * x;
    return f0 + (f90 - f0) * (x2 * x2 * x);
}

// Returns the reflectance of glass, or of both sides of a thin sheet, scaled to `glass_f0` and `glass_f90`.
fn glass_fresnel(m: PrincipledLobes, cosine: f32) -> vec3f {
    let c = min(max(cosine, 1e-6), 1.0);
    let cosine_t = refracted_cosine(c, m.ratio);
    let one_side = fresnel(c, cosine_t, m.ratio);
    let exact = select(one_side, 2.0 * one_side / (1.0 + one_side), m.thin);
    let x = (exact - m.f0_ior) / max(1.0 - m.f0_ior, 1e-6);
    let f = m.glass_f0 + (vec3f(m.glass_f90) - m.glass_f0) * x;
    return select(bounded_color(vec3f(max(f.x, 0.0), max(f.y, 0.0), max(f.z, 0.0))), vec3f(1.0), cosine_t == 0.0);
}

fn glass_probability(m: PrincipledLobes, cosine: f32) -> f32 {
    return min(luminance(glass_fresnel(m, cosine)), 1.0);
}

// Returns true if transmission is a delta: the surface is smooth, or the index does not change.
fn transmits_straight(m: PrincipledLobes) -> bool {
    return is_flat(m.alpha) | (!m.thin & (abs(m.eta - 1.0) < 1e-3));
}

fn is_flat(alpha: vec2f) -> bool {
    return max(alpha.x, alpha.y) <= SMALLEST_ALPHA;
}

// Returns the specular BRDF with a Fresnel term of 1, times the cosine between wi and the normal.
fn facets_eval(alpha: vec2f, wo: vec3f, wi: vec3f, half: vec3f) -> f32 {
    return ggx_d(alpha, half) * ggx_g2(alpha, wo, wi) / (4.0 * max(wo.z, 1e-6));
}

fn half_between(wo: vec3f, wi: vec3f) -> vec3f {
    let sum = wo + wi;
    return sum * (1.0 / sqrt(max(dot(sum, sum), 1e-20)));
}

// Returns the microfacet normal that refracts wi, below the surface, to wo: Walter et al., "Microfacet Models for
// Refraction through Rough Surfaces", EGSR 2007, equation 16.
fn refracting_half(wo: vec3f, wi: vec3f, eta: f32) -> vec3f {
    let sum = wo * eta + wi;
    let unit = sum * (1.0 / sqrt(max(dot(sum, sum), 1e-20)));
    return select(-unit, unit, unit.z > 0.0);
}

// Returns the Jacobian from transmitted directions to normals, equation 17 of the same paper; 0 if no normal refracts
// wi to wo.
fn refracting_density(wo: vec3f, wi: vec3f, half: vec3f, eta: f32) -> f32 {
    let o = dot(wo, half);
    let i = dot(wi, half);
    let sum = eta * o + i;
    let density = abs(i) / max(sum * sum, 1e-20);
    return select(0.0, density, (o > 0.0) & (i < 0.0));
}

// Returns the BSDF without deltas, times |cos| of the angle between wi and the normal.
fn principled_eval(m: PrincipledLobes, wo: vec3f, wi: vec3f, lobes: u32) -> vec3f {
    var value = m.diffuse * (max(wi.z, 0.0) * 0.31830988618379067);
    if (lobes & LOBE_SPECULAR) != 0u {
        if (wi.z > 0.0) & !is_flat(m.alpha) {
            let half = half_between(wo, wi);
            value += schlick(m.f0, m.f90, max(dot(wo, half), 0.0)) * facets_eval(m.alpha, wo, wi, half);
        }
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if !transmits_straight(m) {
            value += glass_eval(m, wo, wi);
        }
    }
    if (lobes & LOBE_COAT) != 0u {
        if (wi.z > 0.0) & (m.coat > 0.0) {
            value += vec3f(coat_eval(m, wo, wi));
        }
    }
    if (lobes & LOBE_SHEEN) != 0u {
        if wi.z > 0.0 {
            value += m.sheen * (sheen_lobe(m.sheen_alpha, wo, wi) * wi.z);
        }
    }
    return value;
}

// Evaluates the glass lobe as in `rough_dielectric.wgsl` and `thin.wgsl`.
fn glass_eval(m: PrincipledLobes, wo: vec3f, wi: vec3f) -> vec3f {
    let above = wi.z > 0.0;
    if above | m.thin {
        let up = vec3f(wi.x, wi.y, abs(wi.z));
        let half = half_between(wo, up);
        let reflected = glass_fresnel(m, dot(wo, half));
        let factor = select(m.transmission_tint * (vec3f(1.0) - reflected), reflected * m.glass, above);
        return factor * facets_eval(m.alpha, wo, up, half);
    }
    let half = refracting_half(wo, wi, m.eta);
    let reflected = glass_fresnel(m, dot(wo, half));
    let visible = ggx_pdf(m.alpha, wo, half) * ggx_g1(m.alpha, wi);
    let density = visible * refracting_density(wo, wi, half, m.eta) * (m.eta * m.eta);
    return m.transmission_tint * (vec3f(1.0) - reflected) * density;
}

fn glass_pdf(m: PrincipledLobes, wo: vec3f, wi: vec3f) -> f32 {
    let above = wi.z > 0.0;
    if above | m.thin {
        let half = half_between(wo, vec3f(wi.x, wi.y, abs(wi.z)));
        let chance = glass_probability(m, dot(wo, half));
        return mirrored_pdf(m.alpha, wo, half) * select(1.0 - chance, chance, above);
    }
    let half = refracting_half(wo, wi, m.eta);
    let chance = glass_probability(m, dot(wo, half));
    return ggx_pdf(m.alpha, wo, half) * refracting_density(wo, wi, half, m.eta) * (1.0 - chance);
}

fn coat_eval(m: PrincipledLobes, wo: vec3f, wi: vec3f) -> f32 {
    let o = to_frame_around(m.coat_normal, wo);
    let i = to_frame_around(m.coat_normal, wi);
    let alpha = vec2f(m.coat_alpha);
    if is_flat(alpha) | (o.z <= 0.0) | (i.z <= 0.0) {
        return 0.0;
    }
    let half = half_between(o, i);
    let f = schlick(vec3f(COAT_F0), vec3f(1.0), max(dot(o, half), 0.0));
    return m.coat * f.x * facets_eval(alpha, o, i, half);
}

fn to_frame_around(n: vec3f, v: vec3f) -> vec3f {
    let frame = frame_around(n);
    return vec3f(dot(frame.u, v), dot(frame.v, v), dot(n, v));
}

fn principled_pdf(m: PrincipledLobes, wo: vec3f, wi: vec3f, lobes: u32) -> f32 {
    var pdf = m.lobe_probs.x * (max(wi.z, 0.0) * 0.31830988618379067);
    if (lobes & LOBE_SPECULAR) != 0u {
        if (wi.z > 0.0) & !is_flat(m.alpha) {
            pdf += m.lobe_probs.y * mirrored_pdf(m.alpha, wo, half_between(wo, wi));
        }
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if (m.lobe_probs.z > 0.0) & !transmits_straight(m) {
            pdf += m.lobe_probs.z * glass_pdf(m, wo, wi);
        }
    }
    if (lobes & LOBE_COAT) != 0u {
        let o = to_frame_around(m.coat_normal, wo);
        let i = to_frame_around(m.coat_normal, wi);
        let alpha = vec2f(m.coat_alpha);
        if (m.lobe_probs.w > 0.0) & (i.z > 0.0) & !is_flat(alpha) {
            pdf += m.lobe_probs.w * mirrored_pdf(alpha, o, half_between(o, i));
        }
    }
    if (lobes & LOBE_SHEEN) != 0u {
        pdf += select(0.0, sheen_probability(m) * 0.15915494309189535, wi.z > 0.0);
    }
    return pdf;
}

// Returns the pdf of a reflected direction, from the pdf of the microfacet normal.
fn mirrored_pdf(alpha: vec2f, wo: vec3f, half: vec3f) -> f32 {
    let cosine = dot(wo, half);
    return select(0.0, ggx_pdf(alpha, wo, half) / (4.0 * max(cosine, 1e-6)), cosine > 0.0);
}

fn no_sample() -> LobeSample {
    return LobeSample(vec3f(0.0, 0.0, 1.0), vec3f(0.0), 0.0, 1.0);
}

// Samples wi from the lobe that `random` selects. The pdf is 0 if the sample is complete: for delta lobes, and without a
// direction. Otherwise it is 1, and `evaluated_sample` returns the complete sample.
fn principled_direction(m: PrincipledLobes, wo: vec3f, u: vec2f, random: f32, lobes: u32) -> LobeSample {
    let p = disk_sample(u);
    var wi = vec3f(p, sqrt(max(1.0 - p.x * p.x - p.y * p.y, 0.0)));
    var is_delta = false;
    var weight = vec3f(0.0); // of a delta lobe
    var eta = 1.0;
    var remaining = random - m.lobe_probs.x;
    if (lobes & LOBE_SPECULAR) != 0u {
        if (remaining >= 0.0) & (remaining < m.lobe_probs.y) {
            is_delta = is_flat(m.alpha);
            let half = select(ggx_sample(m.alpha, wo, u), vec3f(0.0, 0.0, 1.0), is_delta);
            wi = half * (2.0 * dot(wo, half)) - wo;
            weight = schlick(m.f0, m.f90, wo.z) * (1.0 / m.lobe_probs.y);
            if wi.z <= 0.0 {
                return no_sample();
            }
        }
        remaining -= m.lobe_probs.y;
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if (remaining >= 0.0) & (remaining < m.lobe_probs.z) {
            is_delta = transmits_straight(m);
            let half = select(ggx_sample(m.alpha, wo, u), vec3f(0.0, 0.0, 1.0), is_delta);
            let cosine = max(dot(wo, half), 1e-6);
            let reflected = glass_fresnel(m, cosine);
            let chance = glass_probability(m, cosine);
            let reflects = remaining < m.lobe_probs.z * chance;
            let mirrored = half * (2.0 * cosine) - wo;
            let cosine_t = refracted_cosine(cosine, m.eta);
            let refracted = refracted_direction(-wo, half, m.eta, cosine, cosine_t);
            let transmitted = select(refracted, vec3f(mirrored.x, mirrored.y, -mirrored.z), m.thin);
            wi = normalize(select(transmitted, mirrored, reflects));
            eta = select(m.eta, 1.0, reflects);
            let transmitted_weight = m.transmission_tint * (vec3f(1.0) - reflected) * (m.eta * m.eta);
            let probability = max(m.lobe_probs.z * select(1.0 - chance, chance, reflects), 1e-30);
            weight = select(transmitted_weight, reflected * m.glass, reflects) * (1.0 / probability);
            if wi.z * select(-1.0, 1.0, reflects) <= 0.0 {
                return no_sample();
            }
        }
        remaining -= m.lobe_probs.z;
    }
    if (lobes & LOBE_COAT) != 0u {
        if (remaining >= 0.0) & (remaining < m.lobe_probs.w) {
            let alpha = vec2f(m.coat_alpha);
            is_delta = is_flat(alpha);
            let o = to_frame_around(m.coat_normal, wo);
            let half = select(ggx_sample(alpha, o, u), vec3f(0.0, 0.0, 1.0), is_delta);
            wi = vector_around(m.coat_normal, half * (2.0 * dot(o, half)) - o);
            let reflected = schlick(vec3f(COAT_F0), vec3f(1.0), o.z) * (m.coat / m.lobe_probs.w);
            weight = select(vec3f(0.0), reflected, wi.z > 0.0);
        }
        remaining -= m.lobe_probs.w;
    }
    if (lobes & LOBE_SHEEN) != 0u {
        if remaining >= 0.0 {
            // Uniform over the hemisphere.
            let height = 1.0 - p.x * p.x - p.y * p.y;
            wi = vec3f(p * sqrt(max(1.0 + height, 0.0)), max(height, 0.0));
            is_delta = false;
        }
    }
    return LobeSample(wi, weight, select(1.0, 0.0, is_delta), eta);
}

// Returns the sample of `principled_direction` with the weight and the pdf of all lobes.
fn evaluated_sample(direction: LobeSample, value: vec3f, pdf: f32) -> LobeSample {
    if direction.pdf == 0.0 {
        return direction;
    }
    let factor = select(0.0, 1.0 / max(pdf, 1e-30), pdf > 1e-30);
    return LobeSample(direction.wi, value * factor, pdf, direction.eta);
}

// Samples wi, with a probability density of all lobes.
fn principled_sample(m: PrincipledLobes, wo: vec3f, u: vec2f, random: f32, lobes: u32) -> LobeSample {
    let direction = principled_direction(m, wo, u, random, lobes);
    if direction.pdf == 0.0 {
        return direction;
    }
    let value = principled_eval(m, wo, direction.wi, lobes);
    return evaluated_sample(direction, value, principled_pdf(m, wo, direction.wi, lobes));
}

// Returns the sheen BRDF: the distribution "Charlie" of Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF",
// SIGGRAPH 2017 course, with the visibility of Neubelt and Pettineo, "Crafting a Next-Gen Material Pipeline for The
// Order: 1886", 2013.
fn sheen_lobe(alpha: f32, wo: vec3f, wi: vec3f) -> f32 {
    let half = half_between(wo, wi);
    let sine = sqrt(min(half.x * half.x + half.y * half.y, 1.0));
    let d = (2.0 + 1.0 / alpha) * power(sine, 1.0 / alpha) * 0.15915494309189535;
    return d / (4.0 * max(wi.z + wo.z - wi.z * wo.z, 1e-4));
}

// Returns the directional albedo of sheen, which is above 1 at grazing angles for low roughness. The logarithm of the
// albedo is fitted as a function of the square root of the cosine. The result is at most 2 % above numerical
// quadrature.
fn sheen_albedo(roughness: f32, cosine: f32) -> f32 {
    let r = roughness;
    let q = 1.0 / r;
    let s = sqrt(max(cosine, 0.0));
    let p0 = 0.38902682 - 1.9041495 * r + 0.94304603 * r * r + 0.13234225 * q;
    let p1 = 1.0779977 - 1.3566161 * r + 0.20505367 * r * r - 0.2625957 * q;
    let p2 = -12.212699 + 15.173416 * r - 5.192227 * r * r + 0.10481846 * q;
    let p3 = 29.434828 - 40.606533 * r + 16.01573 * r * r - 2.2910678 * q;
    let p4 = -18.896416 + 29.188488 * r - 12.603876 * r * r + 0.7009865 * q;
    let logarithm = p0 + s * (p1 + s * (p2 + s * (p3 + s * p4)));
    return 1.02 * exp2(logarithm * 1.4426950408889634);
}
