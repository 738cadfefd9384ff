// The integrator `path`: path tracing with one light sample (NEE) and one BSDF sample per surface, combined by multiple
// importance sampling (MIS). Kajiya, "The Rendering Equation", SIGGRAPH 1986; Veach, "Robust Monte Carlo Methods for
// Light Transport Simulation", thesis, 1997, chapter 9.

// The path of a sample.
struct PathState {
    path: Path,            // with the next ray
    radiance: vec3f,       // accumulated
    pdf: f32,              // of the ray's direction, per solid angle; 0 if NEE cannot sample what it hits
    eta2: f32,             // product of the squared index ratios in the throughput
    absorption: vec3f,     // of the ray's medium
    sample: u32,           // index in the pixel
    weight: f32,           // of the sample
    ended: bool,
    layers: Layers,        // if enabled
    albedo_recorded: bool,
    prev_position: vec3f,  // of the last scattering, for a light tree
    prev_normal: vec3f,    // there, or 0 if light may arrive from both sides; also for an environment map
    skipped_distance: f32, // from the last bounce to the ray's origin, past skipped surfaces
    skips: u32,            // number of surfaces skipped because of their alpha
}

fn begin_path(pixel: vec2u, sample: u32) -> PathState {
    let start = camera_sample(pixel, sample);
    var path = Path(start.ray, start.differential, vec3f(1.0), 0u, 0u, NO_PRIMITIVE, NO_PRIMITIVE);
    var skipped_distance = 0.0;
    if CAMERA_INVISIBLE != 0u {
        path = skip_camera_invisible(path);
        skipped_distance = dot(path.ray.origin - start.ray.origin, path.ray.direction);
    }
    return PathState(path, vec3f(0.0), 0.0, 1.0, vec3f(0.0), sample, start.weight, false, Layers(), false,
                     vec3f(0.0), vec3f(0.0), skipped_distance, 0u);
}

// Advances a path by one surface. Short code also runs for ended paths, and its results are discarded: software Vulkan
// executes both sides of a branch, and each value kept across it adds cost.
fn advance(before: PathState, pixel: vec2u) -> PathState {
    var state = before;
    let path = before.path;
    let hit = closest_hit(path.ray, path.origin_prim, path.inside_prim);
    let is_hit = hit.primitive != NO_INDEX;
    let shown = ((ALPHA == 0u) & ((ENVIRONMENT_FLAGS & ENVIRONMENT_INVISIBLE) == 0u)) | (path.depth > 0u);
    var environment_light = environment.radiance;
    if (ENVIRONMENT_FLAGS & ENVIRONMENT_MAP) != 0u {
        if !is_hit {
            environment_light = environment_mis(path.ray.direction, state.pdf, state.prev_normal);
        }
    }
    if (ENVIRONMENT_FLAGS & BACKGROUND) != 0u {
        environment_light = select(environment_light, environment.background, path.depth == 0u);
    }
    state = add_radiance(state, path.throughput * environment_light, !is_hit & shown, path.depth);
    if (TLAS_KINDS != 0u) | (LOOKUPS != 0u) {
        if !is_hit {
            state.ended = true;
            return state;
        }
    }
    let prim = fetch_hit_primitive(hit);
    var surface = surface_of(prim, hit, path.ray);
    let at = hit_differential(prim, hit, surface, path.ray, path.differential);
    var shading = evaluate_material(prim, hit, material_of(prim), surface, at, LOOKUPS);
    if VERTEX_COLORS != 0u {
        shading.material = with_vertex_colors(shading.material, hit);
    }
    var material = bounded(shading.material);
    if ALPHA_SURFACES != 0u {
        if is_hit & !alpha_accepts(material, pixel, state.sample, path.depth, RAY_BSDF, hit, surface.side) {
            return continue_through(state, surface, at, hit.t);
        }
    }
    if ABSORPTION != 0u {
        // An opaque surface hit from inside determines the medium of the whole segment. A surface with alpha does not:
        // the ray may have skipped the surface on entry.
        let inside = has_inside(material) & (surface.side < 0.0) & (material.alpha_mode == OPAQUE);
        let absorption = select(state.absorption, material.absorption, inside);
        state.path.throughput *= transmittance(absorption, hit.t + state.skipped_distance);
    }
    if EMISSIVE != 0u {
        state = add_emission(state, prim, hit, surface, material, is_hit);
    }
    surface.shading_normal = shaded_normal(surface, material, shading.normal);
    state.skipped_distance = 0.0;
    var mixture = PrincipledLobes();
    if (MATERIALS & (1u << PRINCIPLED)) != 0u {
        if material.kind == PRINCIPLED {
            let frame = facet_frame(surface, material);
            surface.du = frame.u;
            surface.dv = frame.v;
            mixture = mixture_at(surface, material, shading.coat_normal);
        }
    }
    if LAYERS != 0u {
        if is_hit {
            state = record_first_hit_layers(state, surface, material);
        }
    }
    let continues = is_hit & (path.depth < BOUNCES) & (material.kind != EMITTER);
    let key = hash4(vec4u(pixel.x, pixel.y, camera.seed, 1u + 2u * path.depth));
    let other_key = hash4(vec4u(pixel.x, pixel.y, camera.seed, 2u + 2u * path.depth));
    var choices = vec2u(0u); // lobe, Russian roulette
    if ((MATERIALS & ~((1u << DIFFUSE) | (1u << EMITTER))) != 0u) | (RR_DEPTH < BOUNCES) {
        choices = decision_set(other_key.zw, state.sample);
    }
    var specular = false;
    if DELTA_KINDS != 0u {
        specular = is_delta(material);
        if specular {
            state = sample_delta_bsdf(state, surface, at, material, unit_float(choices.x));
        }
    }
    if (MATERIALS & ~SPECULAR_KINDS) != 0u {
        if !specular {
            if (TLAS_KINDS & (1u << INSTANCE)) != 0u {
                surface.ray_origin += surface.terminator_offset;
            }
            if (MATERIALS & MICROFACET_KINDS) != 0u {
                if has_facets(material) {
                    let frame = facet_frame(surface, material);
                    surface.du = frame.u;
                    surface.dv = frame.v;
                    material = facets_of(surface, material);
                }
            }
            if EMITTERS != 0u {
                var bits = vec2u(0u);
                if EMITTERS > 1u {
                    bits = decision_set(other_key.xy, state.sample);
                }
                var chosen = EmitterSelection(select_emitter(bits), 0.0);
                if LIGHT_TREE != 0u {
                    let normal = lit_normal(surface, material);
                    chosen = light_tree_select(chosen.emitter, surface.ray_origin, normal, other_key.xy, state.sample);
                }
                let u = decision(key.xy, state.sample);
                state = add_direct_light(state, prim, surface, material, mixture, chosen, u, continues, pixel);
            }
            state = sample_bsdf(state, prim, surface, material, mixture, decision(key.zw, state.sample), unit_float(choices.x));
        }
    }
    if RR_DEPTH < BOUNCES {
        state = with_roulette(state, unit_float(choices.y));
    }
    state.ended |= !continues | !(largest(state.path.throughput) > 0.0);
    return state;
}

fn path_value(state: PathState) -> vec4f {
    return vec4f(state.radiance * state.weight, state.weight);
}

fn path_layers(state: PathState) -> Layers {
    let layers = state.layers;
    let weight = state.weight;
    return Layers(layers.emission * weight, layers.direct * weight, layers.indirect * weight, layers.albedo * weight,
                  layers.normal * weight);
}

// Returns two 32-bit numbers of a randomized (0,2)-sequence over the pixel's samples, independent per key. Burley,
// "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, section 5.
fn decision_set(key: vec2u, sample: u32) -> vec2u {
    if PIXEL_PATTERN == RANDOM {
        return hash4(vec4u(key.x, key.y, sample, 0u)).xy;
    }
    return sobol_bits(sample, key);
}

fn decision(key: vec2u, sample: u32) -> vec2f {
    let bits = decision_set(key, sample);
    return vec2f(unit_float(bits.x), unit_float(bits.y));
}

// Adds radiance that arrives after `bounces` bounces, if `taken` is true. Clamps indirect samples.
fn add_radiance(before: PathState, found: vec3f, taken: bool, bounces: u32) -> PathState {
    var state = before;
    var radiance = select(vec3f(0.0), found, taken);
    if MAX_INDIRECT != 0u {
        let scale = bitcast<f32>(MAX_INDIRECT) / max(largest(found), 1e-30);
        radiance *= select(1.0, min(scale, 1.0), bounces > 1u);
    }
    state.radiance += radiance;
    if LAYERS != 0u {
        state.layers.emission += vec4f(select(vec3f(0.0), radiance, bounces == 0u), 0.0);
        state.layers.direct += vec4f(select(vec3f(0.0), radiance, bounces == 1u), 0.0);
        state.layers.indirect += vec4f(select(vec3f(0.0), radiance, bounces > 1u), 0.0);
    }
    return state;
}

fn add_emission(state: PathState, prim: HitPrimitive, hit: Hit, surface: Surface, material: Material, is_hit: bool) -> PathState {
    let one_sided = material.kind == EMITTER;
    let is_emissive = (material.density > 0.0) & (!one_sided | (surface.side > 0.0));
    var ray = state.path.ray;
    var from_previous = hit;
    if ALPHA_SURFACES != 0u {
        ray.origin -= ray.direction * state.skipped_distance;
        from_previous.t += state.skipped_distance;
    }
    var uses_mis = (state.pdf > 0.0) & (EMITTERS != 0u);
    var density = material.density;
    if LIGHT_TREE != 0u {
        density = light_tree_pdf(hit, is_hit & is_emissive & uses_mis, state.prev_position, state.prev_normal);
        uses_mis &= density > 0.0;
    }
    let mis_weight = power_heuristic(state.pdf, emitter_pdf(prim, from_previous, density, ray, surface.normal));
    let weight = select(1.0, mis_weight, uses_mis);
    return add_radiance(state, state.path.throughput * material.emission * weight, is_hit & is_emissive, state.path.depth);
}

// Continues behind a skipped surface.
fn continue_through(before: PathState, surface: Surface, at: HitDifferential, t: f32) -> PathState {
    var state = before;
    state.path = pass_through_path(before.path, surface, at);
    if CAMERA_INVISIBLE != 0u {
        if before.path.depth == 0u {
            let start = state.path.ray;
            state.path = skip_camera_invisible(state.path);
            state.skipped_distance += dot(state.path.ray.origin - start.origin, start.direction);
        }
    }
    state.skipped_distance += t;
    state.skips += 1u;
    state.ended |= state.skips > MAX_ALPHA_SKIPS;
    return state;
}

// Records the first hit's layers, and the first non-specular albedo.
fn record_first_hit_layers(before: PathState, surface: Surface, material: Material) -> PathState {
    var state = before;
    if state.path.depth == 0u {
        state.layers.emission.w = 1.0;
        state.layers.normal = vec4f(surface.shading_normal * surface.side, 0.0);
    }
    if !state.albedo_recorded & !is_delta(material) {
        state.layers.albedo = vec4f(state.path.throughput * albedo(material), 0.0);
        state.albedo_recorded = true;
    }
    return state;
}

fn sample_delta_bsdf(before: PathState, surface: Surface, at: HitDifferential, material: Material, random: f32) -> PathState {
    var state = before;
    state.pdf = 0.0;
    var path = mirrored_path(before.path, surface, at, material).primary;
    if (DELTA_KINDS & (1u << METAL)) != 0u {
        if material.kind == METAL {
            path.throughput = before.path.throughput * metal_fresnel(material, dot(surface.wo, surface.shading_normal));
        }
    }
    if (DELTA_KINDS & (1u << THIN)) != 0u {
        if material.kind == THIN {
            let cosine = dot(surface.wo, surface.shading_normal);
            path.throughput = before.path.throughput;
            if random >= thin_reflectance(material.ior, cosine) {
                path = refracted_path(before.path, surface, at, before.path.throughput * material.tint, 1.0, cosine, cosine);
            }
        }
    }
    if (DELTA_KINDS & ((1u << GLASS) | (1u << ROUGH_GLASS))) != 0u {
        if (material.kind == GLASS) | (material.kind == ROUGH_GLASS) {
            let passage = dielectric_sample(before.path, surface, at, material, random);
            path = passage.path;
            state.eta2 = before.eta2 * passage.eta * passage.eta;
            if ABSORPTION != 0u {
                let ahead = select(vec3f(0.0), material.absorption, surface.side > 0.0);
                state.absorption = select(before.absorption, ahead, passage.passes);
            }
        }
    }
    path.ray.direction = normalize(path.ray.direction);
    state.path = path;
    return state;
}

// Adds an NEE sample, if `wanted` is true.
fn add_direct_light(state: PathState, prim: HitPrimitive, surface: Surface, material: Material, mixture: PrincipledLobes, chosen: EmitterSelection, u: vec2f,
              wanted: bool, pixel: vec2u) -> PathState {
    let light = sample_emitter(chosen, surface.ray_origin, lit_normal(surface, material), u);
    let reflected = reflection(prim, surface, material, mixture, normalize(light.to));
    var found = state.path.throughput * reflected.value * light.radiance * (1.0 / light.pdf);
    var from_side = surface;
    var to = light.to;
    var absorption = state.absorption;
    if ((MATERIALS & TRANSMISSIVE_KINDS) != 0u) | ((LOBES & LOBE_TRANSMISSION) != 0u) {
        if is_transmissive(material) & (dot(surface.normal, to) < 0.0) {
            from_side = flipped(surface);
            to = light.to + select(vec3f(0.0), surface.ray_origin - from_side.ray_origin, light.t_max < 2.0);
            absorption = absorption_after(absorption, surface, material);
        }
    }
    if ABSORPTION != 0u {
        found *= transmittance(absorption, light.t_max * sqrt(dot(light.to, light.to)));
    }
    found *= select(power_heuristic(light.pdf, reflected.pdf), 1.0, light.is_delta);
    let most = largest(found);
    let is_dark = !wanted | !(most > 0.0) | !(most < INFINITE_T);
    if ALPHA_SURFACES != 0u {
        let bounce = state.path.depth + 1u;
        let occluded = is_occluded_alpha(is_dark, from_side, to, light.t_max, light.primitive, pixel, state.sample, bounce);
        return add_radiance(state, found, !occluded, bounce);
    }
    let occluded = is_occluded(is_dark, from_side, to, light.t_max, light.primitive);
    return add_radiance(state, found, !occluded, state.path.depth + 1u);
}

fn sample_bsdf(before: PathState, prim: HitPrimitive, surface: Surface, material: Material, mixture: PrincipledLobes, u: vec2f,
             random: f32) -> PathState {
    var state = before;
    var wi = diffuse_sample(surface.shading_normal, u);
    if (MATERIALS & (1u << PHONG)) != 0u {
        if material.kind == PHONG {
            wi = modified_phong_sample(material, surface.shading_normal, surface.wo, u, random);
        }
    }
    let reflected = plain_reflection(surface, material, wi);
    let value = select(vec3f(0.0), reflected.value, direction_allowed(prim, surface, material, wi));
    let factor = value * select(0.0, 1.0 / reflected.pdf, reflected.pdf > 0.0);
    let throughput = before.path.throughput * factor;
    state.path = Path(Ray(surface.ray_origin, wi), Differential(), throughput, before.path.depth + 1u, 0u, surface.exclude_front, surface.exclude_back);
    state.pdf = reflected.pdf;
    if (MATERIALS & MICROFACET_KINDS) != 0u {
        if has_facets(material) {
            let wo = vector_to_lobe(Tangents(surface.du, surface.dv), surface.shading_normal, surface.wo);
            state = apply_lobe_sample(before, prim, surface, material, facet_sample(material, wo, u, random));
        }
    }
    if (MATERIALS & (1u << PRINCIPLED)) != 0u {
        if material.kind == PRINCIPLED {
            let found = principled_sample(mixture, local_wo(surface), u, random, LOBES);
            state = apply_lobe_sample(before, prim, surface, material, found);
        }
    }
    if LIGHT_TREE != 0u {
        state.prev_position = surface.ray_origin;
    }
    if (LIGHT_TREE != 0u) | ((ENVIRONMENT_FLAGS & ENVIRONMENT_MAP) != 0u) {
        state.prev_normal = lit_normal(surface, material);
    }
    return state;
}

// Applies a sample in the surface's frame.
fn apply_lobe_sample(before: PathState, prim: HitPrimitive, surface: Surface, material: Material, found: LobeSample) -> PathState {
    var state = before;
    let frame = Tangents(surface.du, surface.dv);
    let wi = normalize(vector_from_lobe(frame, surface.shading_normal, found.wi));
    let weight = select(vec3f(0.0), found.weight, direction_allowed(prim, surface, material, wi));
    var from_side = surface;
    if ((MATERIALS & TRANSMISSIVE_KINDS) != 0u) | ((LOBES & LOBE_TRANSMISSION) != 0u) {
        if found.wi.z < 0.0 {
            from_side = flipped(surface);
            state.eta2 = before.eta2 * found.eta * found.eta;
            state.absorption = absorption_after(before.absorption, surface, material);
        }
    }
    state.path = Path(Ray(from_side.ray_origin, wi), Differential(), before.path.throughput * weight, before.path.depth + 1u, 0u,
                      from_side.exclude_front, from_side.exclude_back);
    state.pdf = found.pdf;
    return state;
}

// Applies Russian roulette from bounce RR_DEPTH on.
fn with_roulette(before: PathState, random: f32) -> PathState {
    var state = before;
    if state.path.depth < RR_DEPTH {
        return state;
    }
    let chance = min(largest(state.path.throughput) / state.eta2, 1.0);
    state.ended |= random >= chance;
    state.path.throughput *= 1.0 / chance;
    return state;
}
