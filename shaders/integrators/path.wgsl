// The integrator `path`: path tracing with one light sample (NEE) and one BSDF sample per surface, combined by multiple
// importance sampling (MIS). Kajiya, "The Rendering Equation", SIGGRAPH 1986; Veach, "Robust Monte Carlo Methods for
// Light Transport Simulation", thesis, 1997, chapter 9.

// The path of a sample.
struct PathState {
    path: Path,            // with the next ray
    radiance: vec3f,       // accumulated
    pdf: f32,              // of the ray's direction, per solid angle; 0 if NEE cannot sample the direction
    eta2: f32,             // product of the squared index ratios in the throughput
    absorption: vec3f,     // of the ray's medium
    sample: u32,           // index in the pixel
    weight: f32,           // of the sample
    ended: bool,
    layers: Layers,        // if enabled
    albedo_recorded: bool,
    prev_position: vec3f,  // where the ray was scattered, for a light tree
    prev_normal: vec3f,    // normal at `prev_position`; 0 if light may arrive from both sides
    skipped_distance: f32, // from the last bounce, past skipped surfaces, to the ray's origin
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

// Traces a path to its next surface. Short code also runs for paths that have ended, and its results are discarded:
// software Vulkan executes both sides of a branch, and each value that is live across the branch adds cost.
fn advance(before: PathState, pixel: vec2u) -> PathState {
    var state = before;
    let path = before.path;
    let hit = closest_hit(path.ray, path.origin_prim, path.inside_prim);
    let is_hit = hit.primitive != NO_INDEX;
    let is_environment_visible = ((ALPHA == 0u) & ((ENVIRONMENT_FLAGS & ENVIRONMENT_INVISIBLE) == 0u)) | (path.depth > 0u);
    var environment_light = environment.radiance;
    if (ENVIRONMENT_FLAGS & ENVIRONMENT_MAP) != 0u {
        if !is_hit {
            environment_light = environment_mis(environment_eval(path.ray.direction, state.prev_normal), state.pdf);
        }
    }
    if (ENVIRONMENT_FLAGS & BACKGROUND) != 0u {
        environment_light = select(environment_light, environment.background, path.depth == 0u);
    }
    state = add_radiance(state, path.throughput * environment_light, !is_hit & is_environment_visible, path.depth);
    if (TLAS_KINDS != 0u) | (LOOKUPS != 0u) {
        if !is_hit {
            state.ended = true;
            return state;
        }
    }
    let prim = fetch_hit_primitive(hit);
    var surface = surface_of(prim, hit, path.ray);
    let hit_diff = hit_differential(prim, hit, surface, path.ray, path.differential);
    var shading = evaluate_material(prim, hit, material_of(prim), surface, hit_diff, LOOKUPS);
    if VERTEX_COLORS != 0u {
        shading.material = with_vertex_colors(shading.material, hit);
    }
    var material = bounded(shading.material);
    if ALPHA_SURFACES != 0u {
        if is_hit & !alpha_accepts(material, pixel, state.sample, path.depth, RAY_BSDF, hit, surface.side) {
            return continue_through(state, surface, hit_diff, hit.t);
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
    let distance = hit.t + state.skipped_distance;
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
            state = record_first_hit_layers(state, surface, material, distance);
        }
    }
    let continues = is_hit & (path.depth < BOUNCES) & (material.kind != EMITTER);
    let key = hash4(vec4u(pixel.x, pixel.y, camera.seed, 1u + 2u * path.depth));
    let decision_key = hash4(vec4u(pixel.x, pixel.y, camera.seed, 2u + 2u * path.depth));
    var choices = vec2u(0u); // random bits: x selects the lobe, y is for Russian roulette
    if ((MATERIALS & ~((1u << DIFFUSE) | (1u << EMITTER))) != 0u) | (RR_DEPTH < BOUNCES) {
        choices = decision_set(decision_key.zw, state.sample);
    }
    var specular = false;
    if DELTA_KINDS != 0u {
        specular = is_delta(material);
        if specular {
            state = sample_delta_bsdf(state, surface, hit_diff, material, unit_float(choices.x));
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
                    material = material_for_view(surface, material);
                }
            }
            if EMITTERS != 0u {
                var bits = vec2u(0u);
                if EMITTERS > 1u {
                    bits = decision_set(decision_key.xy, state.sample);
                }
                var selection = EmitterSelection(select_emitter(bits), 0.0);
                if LIGHT_TREE != 0u {
                    let normal = lit_normal(surface, material);
                    selection = light_tree_select(selection.emitter, surface.ray_origin, normal, decision_key.xy, state.sample);
                }
                let u = decision(key.xy, state.sample);
                state = add_direct_light(state, prim, surface, material, mixture, selection, u, continues, pixel);
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

// Returns two 32-bit numbers of a randomized (0,2)-sequence over the pixel's samples. Sequences of different keys are
// independent. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, section 5.
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

// Adds a sample of radiance that arrives after `bounces` bounces, if `is_enabled` is true. Clamps samples after more
// than one bounce.
fn add_radiance(before: PathState, contribution: vec3f, is_enabled: bool, bounces: u32) -> PathState {
    var state = before;
    var radiance = select(vec3f(0.0), contribution, is_enabled);
    if MAX_INDIRECT != 0u {
        let scale = bitcast<f32>(MAX_INDIRECT) / max(largest(contribution), 1e-30);
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

// Continues a path behind a surface that does not accept the ray.
fn continue_through(before: PathState, surface: Surface, hit_diff: HitDifferential, t: f32) -> PathState {
    var state = before;
    state.path = pass_through_path(before.path, surface, hit_diff);
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

// Records coverage, normal and distance of the first hit, and the albedo of the first hit that is not specular.
fn record_first_hit_layers(before: PathState, surface: Surface, material: Material, distance: f32) -> PathState {
    var state = before;
    if state.path.depth == 0u {
        state.layers.emission.w = 1.0;
        state.layers.normal = vec4f(surface.shading_normal * surface.side, select(0.0, distance, NOISE != 0u));
    }
    if !state.albedo_recorded & !is_delta(material) {
        state.layers.albedo = vec4f(state.path.throughput * albedo(material), 0.0);
        state.albedo_recorded = true;
    }
    return state;
}

fn sample_delta_bsdf(before: PathState, surface: Surface, hit_diff: HitDifferential, material: Material, random: f32) -> PathState {
    var state = before;
    state.pdf = 0.0;
    var path = mirrored_path(before.path, surface, hit_diff, material).primary;
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
                path = refracted_path(before.path, surface, hit_diff, before.path.throughput * material.tint, 1.0, cosine, cosine);
            }
        }
    }
    if (DELTA_KINDS & ((1u << GLASS) | (1u << ROUGH_GLASS))) != 0u {
        if (material.kind == GLASS) | (material.kind == ROUGH_GLASS) {
            let glass_sample = dielectric_sample(before.path, surface, hit_diff, material, random);
            path = glass_sample.path;
            state.eta2 = before.eta2 * glass_sample.eta * glass_sample.eta;
            if ABSORPTION != 0u {
                let next_absorption = select(vec3f(0.0), material.absorption, surface.side > 0.0);
                state.absorption = select(before.absorption, next_absorption, glass_sample.is_transmitted);
            }
        }
    }
    path.ray.direction = normalize(path.ray.direction);
    state.path = path;
    return state;
}

// Adds an NEE sample, if `is_enabled` is true.
fn add_direct_light(state: PathState, prim: HitPrimitive, surface: Surface, material: Material, mixture: PrincipledLobes, selection: EmitterSelection, u: vec2f,
              is_enabled: bool, pixel: vec2u) -> PathState {
    let light = sample_emitter(selection, surface.ray_origin, lit_normal(surface, material), u);
    let reflected = reflection(prim, surface, material, mixture, normalize(light.to));
    var contribution = state.path.throughput * reflected.value * light.radiance * (1.0 / light.pdf);
    var exit_surface = surface;
    var to_light = light.to;
    var absorption = state.absorption;
    if ((MATERIALS & TRANSMISSIVE_KINDS) != 0u) | ((LOBES & LOBE_TRANSMISSION) != 0u) {
        if is_transmissive(material) & (dot(surface.normal, to_light) < 0.0) {
            exit_surface = flipped(surface);
            to_light = light.to + select(vec3f(0.0), surface.ray_origin - exit_surface.ray_origin, light.t_max < 2.0);
            absorption = absorption_after(absorption, surface, material);
        }
    }
    if ABSORPTION != 0u {
        contribution *= transmittance(absorption, light.t_max * sqrt(dot(light.to, light.to)));
    }
    contribution *= select(power_heuristic(light.pdf, reflected.pdf), 1.0, light.is_delta);
    let max_component = largest(contribution);
    let is_dark = !is_enabled | !(max_component > 0.0) | !(max_component < INFINITE_T);
    if ALPHA_SURFACES != 0u {
        let bounce = state.path.depth + 1u;
        let occluded = is_occluded_alpha(is_dark, exit_surface, to_light, light.t_max, light.primitive, pixel, state.sample, bounce);
        return add_radiance(state, contribution, !occluded, bounce);
    }
    let occluded = is_occluded(is_dark, exit_surface, to_light, light.t_max, light.primitive);
    return add_radiance(state, contribution, !occluded, state.path.depth + 1u);
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
            let lobe_sample = principled_sample(mixture, local_wo(surface), u, random, LOBES);
            state = apply_lobe_sample(before, prim, surface, material, lobe_sample);
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

// Applies a BSDF sample in the surface's frame.
fn apply_lobe_sample(before: PathState, prim: HitPrimitive, surface: Surface, material: Material, lobe_sample: LobeSample) -> PathState {
    var state = before;
    let frame = Tangents(surface.du, surface.dv);
    let wi = normalize(vector_from_lobe(frame, surface.shading_normal, lobe_sample.wi));
    let weight = select(vec3f(0.0), lobe_sample.weight, direction_allowed(prim, surface, material, wi));
    var exit_surface = surface;
    if ((MATERIALS & TRANSMISSIVE_KINDS) != 0u) | ((LOBES & LOBE_TRANSMISSION) != 0u) {
        if lobe_sample.wi.z < 0.0 {
            exit_surface = flipped(surface);
            state.eta2 = before.eta2 * lobe_sample.eta * lobe_sample.eta;
            state.absorption = absorption_after(before.absorption, surface, material);
        }
    }
    state.path = Path(Ray(exit_surface.ray_origin, wi), Differential(), before.path.throughput * weight, before.path.depth + 1u, 0u,
                      exit_surface.exclude_front, exit_surface.exclude_back);
    state.pdf = lobe_sample.pdf;
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
