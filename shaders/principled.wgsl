// The material `principled`: glTF 2.0's metallic-roughness model with its extensions (Khronos, "glTF 2.0 Specification", 2021, appendix B;
// KHR_materials_anisotropy, _clearcoat, _ior, _sheen, _specular, _transmission, _volume). A coat lies over sheen, which lies over what
// is metal, or a dielectric with its diffuse ground or the light that it passes. Metal and ground are the same from both sides. A layer takes of what is below it the share that it
// reflects by itself towards the viewer, so that no light is made and none is lost. Light passes as through the material `dielectric`: by Fresnel's
// equations, not by Schlick's formula, and with what its facets lose given back. Directions are in a local frame: z is the shading normal on the
// viewer's side, x the tangent.

// What is there of a material where it is looked at from one direction.
struct PrincipledLobes {
    diffuse: vec3f,        // share of the light that the ground spreads
    alpha: vec2f,          // of the specular lobe, along x and y
    f0: vec3f,             // what of light it reflects head-on, with what is lost between facets given back
    f90: vec3f,            // and at grazing angles
    glass: f32,            // factor of what is glass, with what is lost between its facets given back
    passed: vec3f,         // the same of the light that passes it
    glass_f0: vec3f,       // its reflectance head-on
    glass_f90: f32,        // and at grazing angles
    head_on: f32,          // that of its index alone, head-on
    ratio: f32,            // of the indices before and behind it, also where it is thin
    eta: f32,              // the same for what changes its direction: 1 where it is thin
    thin: bool,            // whether light that passes keeps its direction
    coat: f32,             // factor of the coat's lobe
    coat_alpha: f32,
    coat_normal: vec3f,
    sheen: vec3f,          // factor of the sheen's lobe
    sheen_alpha: f32,
    chances: vec4f,        // of ground, specular lobe, glass and coat; the rest is the sheen's
}

// The lobes that a kernel has are bits of `lobes`, so that it computes no others. `energy` is what tables know of the facets: of those that are
// rougher along one axis the two parts of `ggx_albedo`, x and y; of rough glass, z, the share of light that it reflects and lets pass at once.
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
    let ground = dielectric * (1.0 - material.transmission);
    let ratio = (material.ior - 1.0) / (material.ior + 1.0);
    var reflected = vec3f(0.0);
    var inner = vec3f(0.0);
    var share = vec2f(0.0);
    var lost = 0.0;
    if (lobes & (LOBE_SPECULAR | LOBE_TRANSMISSION)) != 0u {
        share = ggx_albedo(m.alpha.y, wo.z);
        var certain = 1.005; // beyond the error of the fit
        if (lobes & LOBE_ANISOTROPY) != 0u {
            if material.aniso_table != 0u {
                share = energy.xy;
                certain = 1.0;
            }
        }
        // Turquin, "Practical multiple scattering compensation for microfacet models", 2019.
        lost = max(1.0 / max(share.x + share.y, 1e-3) - certain, 0.0);
        let inner_f0 = bounded_color(material.specular * (ratio * ratio)) * material.specular_weight;
        // Where the index is that of air nothing reflects, at no angle: Lagarde and de Rousiers, "Moving Frostbite to Physically Based
        // Rendering", SIGGRAPH 2014 course, section 3.
        let inner_f90 = material.specular_weight * min(50.0 * (ratio * ratio), 1.0);
        let inner_gain = vec3f(1.0) + inner_f0 * lost;
        let metal_gain = (vec3f(1.0) + base * lost) * (material.metallic * left);
        m.f0 = inner_f0 * inner_gain * (ground * left) + base * metal_gain;
        m.f90 = inner_gain * (inner_f90 * (ground * left)) + metal_gain;
        reflected = m.f0 * share.x + m.f90 * share.y;
        inner = (inner_f0 * share.x + vec3f(inner_f90 * share.y)) * inner_gain;
    }
    m.diffuse = base * (ground * left * max(1.0 - largest(inner), 0.0));
    var clear = 0.0;
    if (lobes & LOBE_TRANSMISSION) != 0u {
        let head_on = ratio * ratio;
        m.head_on = select(head_on, 2.0 * head_on / (1.0 + head_on), m.thin);
        m.glass_f0 = bounded_color(material.specular * m.head_on) * material.specular_weight;
        m.glass_f90 = material.specular_weight;
        m.ratio = select(material.ior, 1.0 / material.ior, outside | m.thin);
        let kept = max(energy.z, 1e-3);
        let gain = select(1.0, select(1.0 / kept, 1.0 + lost, m.thin), !passes_straight(m));
        let glass = dielectric * material.transmission * left;
        m.glass = glass * gain;
        m.passed = base * m.glass;
        let mirrored = min(luminance(m.glass_f0 * share.x + vec3f(m.glass_f90 * share.y)), 1.0);
        clear = glass * (luminance(base) * (1.0 - mirrored) + mirrored);
    }
    let weights = vec4f(luminance(m.diffuse), luminance(reflected), clear, coat_share);
    let sum = weights.x + weights.y + weights.z + weights.w + sheen_share;
    m.chances = select(vec4f(1.0, 0.0, 0.0, 0.0), weights * (1.0 / max(sum, 1e-30)), sum > 1e-30);
    return m;
}

// A colour of at most 1.
fn bounded_color(color: vec3f) -> vec3f {
    return vec3f(min(color.x, 1.0), min(color.y, 1.0), min(color.z, 1.0));
}

// How bright a colour is: ITU-R BT.709.
fn luminance(color: vec3f) -> f32 {
    return 0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z;
}

fn sheen_chance(m: PrincipledLobes) -> f32 {
    return max(1.0 - (m.chances.x + m.chances.y + m.chances.z + m.chances.w), 0.0);
}

// Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Computer Graphics Forum 13(3), 1994.
fn schlick(f0: vec3f, f90: vec3f, cosine: f32) -> vec3f {
    let x = 1.0 - min(cosine, 1.0);
    let x2 = x * x;
    return f0 + (f90 - f0) * (x2 * x2 * x);
}

// What glass reflects: as its index says, or a sheet's two sides; with another reflectance head-on, or at grazing angles, the same in between.
fn glass_fresnel(m: PrincipledLobes, cosine: f32) -> vec3f {
    let c = min(max(cosine, 1e-6), 1.0);
    let behind = refracted_cosine(c, m.ratio);
    let once = fresnel(c, behind, m.ratio);
    let exact = select(once, 2.0 * once / (1.0 + once), m.thin);
    let x = (exact - m.head_on) / max(1.0 - m.head_on, 1e-6);
    let f = m.glass_f0 + (vec3f(m.glass_f90) - m.glass_f0) * x;
    return select(bounded_color(vec3f(max(f.x, 0.0), max(f.y, 0.0), max(f.z, 0.0))), vec3f(1.0), behind == 0.0);
}

// How likely a facet of glass mirrors.
fn glass_chance(m: PrincipledLobes, cosine: f32) -> f32 {
    return min(luminance(glass_fresnel(m, cosine)), 1.0);
}

// Whether light passes in one direction alone: where facets are flat, or what is behind the surface bends nothing.
fn passes_straight(m: PrincipledLobes) -> bool {
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
fn principled_eval(m: PrincipledLobes, wo: vec3f, wi: vec3f, lobes: u32) -> vec3f {
    var value = m.diffuse * (max(wi.z, 0.0) * 0.31830988618379067);
    if (lobes & LOBE_SPECULAR) != 0u {
        if (wi.z > 0.0) & !is_flat(m.alpha) {
            let half = half_between(wo, wi);
            value += schlick(m.f0, m.f90, max(dot(wo, half), 0.0)) * facets_eval(m.alpha, wo, wi, half);
        }
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if !passes_straight(m) {
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

// What is glass, by the facets of `rough_dielectric.wgsl` and `thin.wgsl`.
fn glass_eval(m: PrincipledLobes, wo: vec3f, wi: vec3f) -> vec3f {
    let above = wi.z > 0.0;
    if above | m.thin {
        let up = vec3f(wi.x, wi.y, abs(wi.z));
        let half = half_between(wo, up);
        let reflected = glass_fresnel(m, dot(wo, half));
        let factor = select(m.passed * (vec3f(1.0) - reflected), reflected * m.glass, above);
        return factor * facets_eval(m.alpha, wo, up, half);
    }
    let half = refracting_half(wo, wi, m.eta);
    let reflected = glass_fresnel(m, dot(wo, half));
    let seen = ggx_pdf(m.alpha, wo, half) * ggx_g1(m.alpha, wi);
    let density = seen * refracting_density(wo, wi, half, m.eta) * (m.eta * m.eta);
    return m.passed * (vec3f(1.0) - reflected) * density;
}

// How densely its samples lie, per solid angle.
fn glass_pdf(m: PrincipledLobes, wo: vec3f, wi: vec3f) -> f32 {
    let above = wi.z > 0.0;
    if above | m.thin {
        let half = half_between(wo, vec3f(wi.x, wi.y, abs(wi.z)));
        let chance = glass_chance(m, dot(wo, half));
        return mirrored_pdf(m.alpha, wo, half) * select(1.0 - chance, chance, above);
    }
    let half = refracting_half(wo, wi, m.eta);
    let chance = glass_chance(m, dot(wo, half));
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

// The density of `principled_sample`, per solid angle, but for deltas.
fn principled_pdf(m: PrincipledLobes, wo: vec3f, wi: vec3f, lobes: u32) -> f32 {
    var pdf = m.chances.x * (max(wi.z, 0.0) * 0.31830988618379067);
    if (lobes & LOBE_SPECULAR) != 0u {
        if (wi.z > 0.0) & !is_flat(m.alpha) {
            pdf += m.chances.y * mirrored_pdf(m.alpha, wo, half_between(wo, wi));
        }
    }
    if (lobes & LOBE_TRANSMISSION) != 0u {
        if (m.chances.z > 0.0) & !passes_straight(m) {
            pdf += m.chances.z * glass_pdf(m, wo, wi);
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
fn principled_sample(m: PrincipledLobes, wo: vec3f, u: vec2f, random: f32, lobes: u32) -> LobeSample {
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
            weight = schlick(m.f0, m.f90, wo.z) * (1.0 / m.chances.y);
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
            let cosine = max(dot(wo, half), 1e-6);
            let reflected = glass_fresnel(m, cosine);
            let chance = glass_chance(m, cosine);
            let mirrors = rest < m.chances.z * chance;
            let mirrored = half * (2.0 * cosine) - wo;
            let behind = refracted_cosine(cosine, m.eta);
            let bent = refracted_direction(-wo, half, m.eta, cosine, behind);
            let through = select(bent, vec3f(mirrored.x, mirrored.y, -mirrored.z), m.thin);
            wi = normalize(select(through, mirrored, mirrors));
            eta = select(m.eta, 1.0, mirrors);
            let passing = m.passed * (vec3f(1.0) - reflected) * (m.eta * m.eta);
            let share = max(m.chances.z * select(1.0 - chance, chance, mirrors), 1e-30);
            weight = select(passing, reflected * m.glass, mirrors) * (1.0 / share);
            if wi.z * select(-1.0, 1.0, mirrors) <= 0.0 {
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
            let reflected = schlick(vec3f(COAT_F0), vec3f(1.0), o.z) * (m.coat / m.chances.w);
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
