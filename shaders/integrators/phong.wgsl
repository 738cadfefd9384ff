// The integrator `phong`: direct light by Phong's model on surfaces seen directly, in mirrors or through glass.

// Returns the radiance along a camera ray. A path branches at glass. Branches are traced depth first; at most
// MAX_SPLIT_DEPTH branches are pending. A path that hits a mirror or glass after BOUNCES bounces returns the
// background.
fn radiance(ray: Ray, differential: Differential, pixel: vec2u, sample: u32) -> vec3f {
    var path = Path(ray, differential, vec3f(1.0), 0u, 0u, NO_PRIMITIVE, NO_PRIMITIVE);
    if CAMERA_INVISIBLE != 0u {
        path = skip_camera_invisible(path);
    }
    if BOUNCES == 0u {
        let hit = closest_hit(path.ray, path.origin_prim, path.inside_prim);
        if hit.primitive == NO_INDEX {
            return environment.background;
        }
        return radiance_from(fetch_hit_primitive(hit), hit, path, pixel, sample);
    }
    var sum = vec3f(0.0);
    var pending: array<Path, MAX_SPLIT_DEPTH>;
    var pending_count = 0u;
    for (var leaf = 0u; leaf < MAX_PATH_LEAVES; leaf++) {
        var hit = no_hit();
        var prim: HitPrimitive;
        while path.depth <= BOUNCES {
            hit = closest_hit(path.ray, path.origin_prim, path.inside_prim);
            if hit.primitive == NO_INDEX {
                break;
            }
            prim = fetch_hit_primitive(hit);
            if !is_specular(material_of(prim)) {
                break;
            }
            if path.depth == BOUNCES {
                hit.primitive = NO_INDEX;
                break;
            }
            let split = scatter(prim, hit, path, pixel, sample);
            path = split.primary;
            if split.splits {
                pending[pending_count] = split.secondary;
                pending_count++;
            }
        }
        var radiance = environment.background;
        if hit.primitive != NO_INDEX {
            radiance = radiance_from(prim, hit, path, pixel, sample);
        }
        sum += path.throughput * radiance;
        if pending_count == 0u {
            break;
        }
        pending_count--;
        path = pending[pending_count];
    }
    return sum;
}

fn scatter(prim: HitPrimitive, hit: Hit, path: Path, pixel: vec2u, sample: u32) -> SpecularSplit {
    var surface = surface_of(prim, hit, path.ray);
    let hit_diff = hit_differential(prim, hit, surface, path.ray, path.differential);
    let shading = evaluate_material(prim, hit, material_of(prim), surface, hit_diff, SPECULAR_LOOKUPS);
    let material = shading.material;
    surface.shading_normal = usable_normal(surface, shading.normal);
    if material.kind == MIRROR {
        return mirrored_path(path, surface, hit_diff, material);
    }
    let bits = decision_bits(pixel, camera.seed, sample, path.depth * MAX_PATH_LEAVES + path.branch, NO_INDEX);
    return glass_path(path, surface, hit_diff, material, unit_float(bits.x));
}

fn radiance_from(prim: HitPrimitive, hit: Hit, path: Path, pixel: vec2u, sample: u32) -> vec3f {
    let untextured = material_of(prim);
    if untextured.kind == EMITTER {
        return untextured.emission;
    }
    var surface = surface_of(prim, hit, path.ray);
    let hit_diff = hit_differential(prim, hit, surface, path.ray, path.differential);
    let shading = evaluate_material(prim, hit, untextured, surface, hit_diff, LOOKUPS);
    let material = shading.material;
    surface.shading_normal = shading.normal;
    if (TLAS_KINDS & (1u << INSTANCE)) != 0u {
        surface.ray_origin += surface.terminator_offset;
    }
    var sum = environment.ambient * material.ambient;
    let lights = light_counts();
    if (LIGHTS & 1u) != 0u {
        for (var i = 0u; i < lights.x; i++) {
            let light = load_light(i);
            let lobes = lobes_of_light(prim, surface, material, light, LIGHT_PATTERN, LIGHT_SIDE, LIGHT_SAMPLES, pixel, sample);
            sum += phong_radiance(material, light, lobes, environment.light_weight);
        }
    }
    if (LIGHTS & 2u) != 0u {
        for (var i = lights.x; i < lights.y; i++) {
            var light = load_light(i);
            if (LIGHTS & 4u) != 0u {
                if light.kind == SPOT {
                    light.color *= spot_falloff(light, light.center - surface.position);
                }
            }
            let lobes = lobes_of_light(prim, surface, material, light, GRID, 1u, 1u, pixel, sample);
            sum += phong_radiance(material, light, lobes, 1.0);
        }
    }
    return sum;
}

fn lobes_of_light(prim: HitPrimitive, surface: Surface, material: Material, light: Light, pattern: u32, side: u32, count: u32,
                  pixel: vec2u, sample: u32) -> Lobes {
    let segments = segments_to_light(light, surface.position);
    let key = sample_key(pixel, camera.seed, 1u + light.number);
    var lobes = Lobes(0.0, 0.0);
    for (var first = 0u; first < count; first += SAMPLE_BLOCK) {
        let block = SampleBlock(pattern, side, first, select(SAMPLE_BLOCK, count - first, count - first < SAMPLE_BLOCK), sample, key);
        var unlit = 0u;
        if TLAS_KINDS != 0u {
            unlit = unlit_mask(prim, surface, segments, block);
        }
        let occluded = occluded_samples(surface, light, block, unlit);
        lobes = phong_block(surface, material, segments, block, occluded, EXPONENT_BITS, lobes);
    }
    return lobes;
}

fn phong_radiance(material: Material, light: Light, lobes: Lobes, weight: f32) -> vec3f {
    let light_color = light.color * weight;
    return light_color * (material.diffuse * lobes.diffuse + material.specular * lobes.specular);
}
