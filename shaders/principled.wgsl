// The material `principled`: glTF 2.0's metallic-roughness model with its extensions (Khronos, "glTF 2.0 Specification", 2021, appendix B;
// KHR_materials_anisotropy, _clearcoat, _ior, _sheen, _specular, _transmission, _volume). A coat lies over sheen, which lies over what
// is metal, or a dielectric with its diffuse ground or the light that it passes. A layer takes of what is below it the share that it
// reflects by itself towards the viewer, so that no light is made and none is lost. Directions are in a local frame: z is the shading normal on the
// viewer's side, x the tangent.

// What is there of a material where it is looked at from one direction.
struct Mixture {
    diffuse: vec3f,        // share of the light that the ground spreads
    alpha: vec2f,          // of the specular lobe, along x and y
    f0: vec3f,             // its reflectance head-on
    f90: f32,              // and at grazing angles
    gain: vec3f,           // its factor, with what is lost between facets given back
    passed: vec3f,         // factor of the light that passes the surface
    inner_f0: vec3f,       // the dielectric's reflectance, which such light has lost
    inner_f90: f32,
    eta: f32,              // the ratio of the indices before and behind it; 1 where it is thin
    thin: bool,            // whether light that passes keeps its direction
    coat: f32,             // factor of the coat's lobe
    coat_alpha: f32,
    coat_normal: vec3f,
    sheen: vec3f,          // factor of the sheen's lobe
    sheen_alpha: f32,
    chances: vec4f,        // of ground, specular lobe, passing light and coat; the rest is the sheen's
}

// The lobes that a kernel has are bits of `lobes`, so that it computes no others.
fn principled_mixture(material: Material, wo: vec3f, outside: bool, coat_normal: vec3f, lobes: u32) -> Mixture {
    var m = Mixture();
    let rough = max(material.roughness * material.roughness, SMALLEST_ALPHA);
    m.alpha = vec2f(rough, rough);
    if (lobes & LOBE_ANISOTROPY) != 0u {
        m.alpha.x = rough + (1.0 - rough) * (material.anisotropy * material.anisotropy);
    }
    let volume = (material.thin == 0u) & (material.transmission > 0.0);
    m.thin = material.thin != 0u;
    m.eta = select(1.0, select(material.ior, 1.0 / material.ior, outside), volume);
    var left = 1.0;
    m.coat_normal = coat_normal;
    let over = outside | !volume;
    var coat_share = 0.0;
    if (lobes & LOBE_COAT) != 0u {
        let cosine = dot(wo, coat_normal);
        m.coat_alpha = max(material.clearcoat_roughness * material.clearcoat_roughness, SMALLEST_ALPHA);
        m.coat = select(0.0, material.clearcoat, over & (cosine > 0.0));
        let reflected = ggx_albedo(m.coat_alpha, max(cosine, 0.0));
        coat_share = min(m.coat * (COAT_F0 * reflected.x + reflected.y), 1.0);
        left = 1.0 - coat_share;
    }
    var sheen_share = 0.0;
    if (lobes & LOBE_SHEEN) != 0u {
        let roughness = max(material.sheen_roughness, LEAST_SHEEN);
        m.sheen_alpha = roughness * roughness;
        let albedo = sheen_albedo(roughness, wo.z);
        m.sheen = material.sheen * (select(0.0, left, over) / max(albedo, 1.0));
        let bounded = min(albedo, 1.0);
        sheen_share = luminance(m.sheen) * albedo;
        left *= select(1.0, max(1.0 - largest(material.sheen) * bounded, 0.0), over);
    }
    let base = material.diffuse;
    let dielectric = 1.0 - material.metallic;
    var reflected = vec3f(0.0);
    var inner = vec3f(0.0);
    if (lobes & LOBE_SPECULAR) != 0u {
        let ratio = (material.ior - 1.0) / (material.ior + 1.0);
        let f0 = material.specular * (ratio * ratio);
        m.inner_f0 = vec3f(min(f0.x, 1.0), min(f0.y, 1.0), min(f0.z, 1.0)) * material.specular_weight;
        m.inner_f90 = material.specular_weight;
        m.f0 = m.inner_f0 * dielectric + base * material.metallic;
        m.f90 = m.inner_f90 * dielectric + material.metallic;
        // From inside the angle in the thinner medium counts.
        let cosine = select(wo.z, refracted_cosine(wo.z, m.eta), m.eta > 1.0);
        var share = ggx_albedo(m.alpha.y, cosine);
        if (lobes & LOBE_ANISOTROPY) != 0u {
            // The most of both axes and what lies between: that of streaks is known roughly, and what is below must not get too much.
            let along = select(share, ggx_albedo_along(m.alpha, wo), m.eta <= 1.0);
            let other = ggx_albedo(m.alpha.x, cosine);
            share = vec2f(max(max(share.x, other.x), along.x), max(max(share.y, other.y), along.y));
        }
        let whole = max(share.x + share.y, 1e-3);
        // Turquin, "Practical multiple scattering compensation for microfacet models", 2019.
        // What streaks lose is known roughly, and less of it is given back.
        let known = select(1.0, 1.0 - material.anisotropy * material.anisotropy, (lobes & LOBE_ANISOTROPY) != 0u);
        let lost = max(1.0 / whole - 1.005, 0.0) * known;
        let gain = vec3f(1.0) + m.f0 * lost;
        m.gain = gain * left;
        reflected = (m.f0 * share.x + vec3f(m.f90 * share.y)) * gain;
        inner = m.inner_f0 * share.x + vec3f(m.inner_f90 * share.y);
        inner *= vec3f(1.0) + m.inner_f0 * lost;
    }
    let ground = dielectric * (1.0 - material.transmission);
    m.diffuse = base * (ground * left * max(1.0 - largest(inner), 0.0));
    var passing = 0.0;
    if (lobes & LOBE_TRANSMISSION) != 0u {
        m.passed = base * (dielectric * material.transmission * left);
        passing = luminance(m.passed) * max(1.0 - largest(inner), 0.0);
    }
    let weights = vec4f(luminance(m.diffuse), luminance(reflected) * left, passing, coat_share);
    let sum = weights.x + weights.y + weights.z + weights.w + sheen_share;
    m.chances = select(vec4f(1.0, 0.0, 0.0, 0.0), weights * (1.0 / max(sum, 1e-30)), sum > 1e-30);
    return m;
}

// How bright a colour is: ITU-R BT.709.
fn luminance(color: vec3f) -> f32 {
    return 0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z;
}

fn sheen_chance(m: Mixture) -> f32 {
    return max(1.0 - (m.chances.x + m.chances.y + m.chances.z + m.chances.w), 0.0);
}

// Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Computer Graphics Forum 13(3), 1994. From inside of a denser medium
// the angle behind the surface counts, and beyond the critical one all is reflected.
fn schlick(f0: vec3f, f90: f32, cosine: f32, eta: f32) -> vec3f {
    let behind = refracted_cosine(cosine, eta);
    let x = 1.0 - min(select(cosine, behind, eta > 1.0), 1.0);
    let x2 = x * x;
    let f = f0 + (vec3f(f90) - f0) * (x2 * x2 * x);
    return select(f, vec3f(1.0), (eta > 1.0) & (behind == 0.0));
}

// Whether light passes in one direction alone: where facets are flat, or what is behind the surface bends nothing.
fn passes_straight(m: Mixture) -> bool {
    return is_flat(m.alpha) | (!m.thin & (abs(m.eta - 1.0) < 1e-3));
}

fn is_flat(alpha: vec2f) -> bool {
    return max(alpha.x, alpha.y) <= SMALLEST_ALPHA;
}

// The specular lobe by itself, for a reflectance of 1, times the cosine of wi.
fn facets_eval(alpha: vec2f, wo: vec3f, wi: vec3f, half: vec3f) -> f32 {
    return ggx_d(alpha, half) * ggx_g2(alpha, wo, wi) / (4.0 * max(wo.z, 1e-6));
}

fn half_between(wo: vec3f, wi: vec3f) -> vec3f {
    let sum = wo + wi;
    return sum * (1.0 / sqrt(max(dot(sum, sum), 1e-20)));
}

// The normal of facets that refract wi, below the surface, to wo: Walter et al., "Microfacet Models for Refraction through Rough
// Surfaces", EGSR 2007, equation 16.
fn refracting_half(wo: vec3f, wi: vec3f, eta: f32) -> vec3f {
    let sum = wo * eta + wi;
    let unit = sum * (1.0 / sqrt(max(dot(sum, sum), 1e-20)));
    return select(-unit, unit, unit.z > 0.0);
}

// How many facets' normals lie in a direction of passing light: equation 17 there; 0 where no facet refracts so.
fn refracting_density(wo: vec3f, wi: vec3f, half: vec3f, eta: f32) -> f32 {
    let o = dot(wo, half);
    let i = dot(wi, half);
    let sum = eta * o + i;
    let density = abs(i) / max(sum * sum, 1e-20);
    return select(0.0, density, (o > 0.0) & (i < 0.0));
}

// The BSDF times the cosine of wi, of what is no delta.
fn principled_eval(m: Mixture, wo: vec3f, wi: vec3f, lobes: u32) -> vec3f {
    var value = m.diffuse * (max(wi.z, 0.0) * 0.31830988618379067);
    if (lobes & LOBE_SPECULAR) != 0u {
        if (wi.z > 0.0) & !is_flat(m.alpha) {
            let half = half_between(wo, wi);
            value += schlick(m.f0, m.f90, max(dot(wo, half), 0.0), m.eta) * m.gain * facets_eval(m.alpha, wo, wi, half);
        }
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if (wi.z < 0.0) & !passes_straight(m) {
            value += passed_eval(m, wo, wi);
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

fn passed_eval(m: Mixture, wo: vec3f, wi: vec3f) -> vec3f {
    if m.thin {
        let mirrored = vec3f(wi.x, wi.y, -wi.z);
        let half = half_between(wo, mirrored);
        let reflected = schlick(m.inner_f0, m.inner_f90, max(dot(wo, half), 0.0), 1.0);
        return m.passed * (vec3f(1.0) - reflected) * facets_eval(m.alpha, wo, mirrored, half);
    }
    let half = refracting_half(wo, wi, m.eta);
    let o = max(dot(wo, half), 0.0);
    let reflected = schlick(m.inner_f0, m.inner_f90, o, m.eta);
    let facets = ggx_d(m.alpha, half) * ggx_g2(m.alpha, wo, vec3f(wi.x, wi.y, -wi.z)) * o / max(wo.z, 1e-6);
    return m.passed * (vec3f(1.0) - reflected) * (facets * refracting_density(wo, wi, half, m.eta) * (m.eta * m.eta));
}

fn coat_eval(m: Mixture, wo: vec3f, wi: vec3f) -> f32 {
    let o = to_frame_around(m.coat_normal, wo);
    let i = to_frame_around(m.coat_normal, wi);
    let alpha = vec2f(m.coat_alpha);
    if is_flat(alpha) | (o.z <= 0.0) | (i.z <= 0.0) {
        return 0.0;
    }
    let half = half_between(o, i);
    let f = schlick(vec3f(COAT_F0), 1.0, max(dot(o, half), 0.0), 1.0);
    return m.coat * f.x * facets_eval(alpha, o, i, half);
}

fn to_frame_around(n: vec3f, v: vec3f) -> vec3f {
    let frame = frame_around(n);
    return vec3f(dot(frame.u, v), dot(frame.v, v), dot(n, v));
}

// The density of `principled_sample`, per solid angle, but for deltas.
fn principled_pdf(m: Mixture, wo: vec3f, wi: vec3f, lobes: u32) -> f32 {
    var pdf = m.chances.x * (max(wi.z, 0.0) * 0.31830988618379067);
    if (lobes & LOBE_SPECULAR) != 0u {
        if (wi.z > 0.0) & !is_flat(m.alpha) {
            pdf += m.chances.y * mirrored_pdf(m.alpha, wo, half_between(wo, wi));
        }
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if (wi.z < 0.0) & !passes_straight(m) {
            let mirrored = vec3f(wi.x, wi.y, -wi.z);
            var density = 0.0;
            if m.thin {
                density = mirrored_pdf(m.alpha, wo, half_between(wo, mirrored));
            } else {
                let half = refracting_half(wo, wi, m.eta);
                density = ggx_pdf(m.alpha, wo, half) * refracting_density(wo, wi, half, m.eta);
            }
            pdf += m.chances.z * density;
        }
    }
    if (lobes & LOBE_COAT) != 0u {
        let o = to_frame_around(m.coat_normal, wo);
        let i = to_frame_around(m.coat_normal, wi);
        let alpha = vec2f(m.coat_alpha);
        if (m.chances.w > 0.0) & (i.z > 0.0) & !is_flat(alpha) {
            pdf += m.chances.w * mirrored_pdf(alpha, o, half_between(o, i));
        }
    }
    if (lobes & LOBE_SHEEN) != 0u {
        pdf += select(0.0, sheen_chance(m) * 0.15915494309189535, wi.z > 0.0);
    }
    return pdf;
}

// The density of a mirrored direction, by that of its facet's normal.
fn mirrored_pdf(alpha: vec2f, wo: vec3f, half: vec3f) -> f32 {
    let cosine = dot(wo, half);
    return select(0.0, ggx_pdf(alpha, wo, half) / (4.0 * max(cosine, 1e-6)), cosine > 0.0);
}

// A sample that is worth nothing.
fn nowhere() -> LobeSample {
    return LobeSample(vec3f(0.0, 0.0, 1.0), vec3f(0.0), 0.0, 1.0);
}

// A direction wi, by a lobe that `random` chooses.
fn principled_sample(m: Mixture, wo: vec3f, u: vec2f, random: f32, lobes: u32) -> LobeSample {
    let p = disk_sample(u);
    var wi = vec3f(p, sqrt(max(1.0 - p.x * p.x - p.y * p.y, 0.0)));
    var is_delta = false;
    var weight = vec3f(0.0); // of a delta
    var eta = 1.0;
    var rest = random - m.chances.x;
    if (lobes & LOBE_SPECULAR) != 0u {
        if (rest >= 0.0) & (rest < m.chances.y) {
            is_delta = is_flat(m.alpha);
            let half = select(ggx_sample(m.alpha, wo, u), vec3f(0.0, 0.0, 1.0), is_delta);
            wi = half * (2.0 * dot(wo, half)) - wo;
            weight = schlick(m.f0, m.f90, wo.z, m.eta) * m.gain * (1.0 / m.chances.y);
            if wi.z <= 0.0 {
                return nowhere();
            }
        }
        rest -= m.chances.y;
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if (rest >= 0.0) & (rest < m.chances.z) {
            is_delta = passes_straight(m);
            let half = select(ggx_sample(m.alpha, wo, u), vec3f(0.0, 0.0, 1.0), is_delta);
            let cosine = dot(wo, half);
            let mirrored = half * (2.0 * cosine) - wo;
            let behind = refracted_cosine(cosine, m.eta);
            let bent = refracted_direction(-wo, half, m.eta, cosine, behind);
            wi = select(bent, vec3f(mirrored.x, mirrored.y, -mirrored.z), m.thin);
            eta = m.eta;
            let through = vec3f(1.0) - schlick(m.inner_f0, m.inner_f90, wo.z, m.eta);
            weight = m.passed * through * (m.eta * m.eta / m.chances.z);
            if wi.z >= 0.0 {
                return nowhere();
            }
        }
        rest -= m.chances.z;
    }
    if (lobes & LOBE_COAT) != 0u {
        if (rest >= 0.0) & (rest < m.chances.w) {
            let alpha = vec2f(m.coat_alpha);
            is_delta = is_flat(alpha);
            let o = to_frame_around(m.coat_normal, wo);
            let half = select(ggx_sample(alpha, o, u), vec3f(0.0, 0.0, 1.0), is_delta);
            wi = vector_around(m.coat_normal, half * (2.0 * dot(o, half)) - o);
            let reflected = schlick(vec3f(COAT_F0), 1.0, o.z, 1.0) * (m.coat / m.chances.w);
            weight = select(vec3f(0.0), reflected, wi.z > 0.0);
        }
        rest -= m.chances.w;
    }
    if (lobes & LOBE_SHEEN) != 0u {
        if rest >= 0.0 {
            // Uniform over the hemisphere.
            let height = 1.0 - p.x * p.x - p.y * p.y;
            wi = vec3f(p * sqrt(max(1.0 + height, 0.0)), max(height, 0.0));
            is_delta = false;
        }
    }
    if is_delta {
        return LobeSample(wi, weight, 0.0, eta);
    }
    let pdf = principled_pdf(m, wo, wi, lobes);
    let value = principled_eval(m, wo, wi, lobes);
    let factor = select(0.0, 1.0 / max(pdf, 1e-30), pdf > 1e-30);
    return LobeSample(wi, value * factor, pdf, eta);
}

// Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", SIGGRAPH 2017 course: the distribution "Charlie"; and between fibres the
// visibility of Neubelt and Pettineo, "Crafting a Next-Gen Material Pipeline for The Order: 1886", 2013. Without the cosine.
fn sheen_lobe(alpha: f32, wo: vec3f, wi: vec3f) -> f32 {
    let half = half_between(wo, wi);
    let sine = sqrt(min(half.x * half.x + half.y * half.y, 1.0));
    let d = (2.0 + 1.0 / alpha) * power(sine, 1.0 / alpha) * 0.15915494309189535;
    return d / (4.0 * max(wi.z + wo.z - wi.z * wo.z, 1e-4));
}

// The share of light that it reflects towards a direction with this cosine, which grows beyond 1 where rough cloth is not: within
// 2 % from above of a quadrature (a fit of its logarithm by the root of the cosine).
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
