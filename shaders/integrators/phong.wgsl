// The integrator `phong`: direct light by Phong's model, seen directly or through mirrors and glass.

// The radiance that comes along a camera's ray. The paths through glass form a tree; it is walked depth first, each
// path as far as its end, and the branches that wait are fewer than LEAVES. A path that meets a mirror or glass after
// BOUNCES bounces is cut off: there it sees the background.
fn radiance(ray: Ray, differential: Differential, pixel: vec2u, sample: u32) -> vec3f {
    var path = Path(ray, differential, vec3f(1.0), 0u, 0u, NOWHERE, NOWHERE);
    if HIDDEN != 0u {
        path = seen_path(path);
    }
    if BOUNCES == 0u {
        let hit = closest_hit(path.ray, path.left, path.wall);
        if hit.primitive == NO_INDEX {
            return environment.background;
        }
        return radiance_from(spot_of(hit), hit, path, pixel, sample);
    }
    var sum = vec3f(0.0);
    var pending: array<Path, SPLITS>;
    var waiting = 0u;
    for (var leaf = 0u; leaf < LEAVES; leaf++) {
        var hit = no_hit();
        var spot: Spot;
        while path.depth <= BOUNCES {
            hit = closest_hit(path.ray, path.left, path.wall);
            if hit.primitive == NO_INDEX {
                break;
            }
            spot = spot_of(hit);
            if !is_specular(material_of(spot)) {
                break;
            }
            if path.depth == BOUNCES {
                hit.primitive = NO_INDEX;
                break;
            }
            let scattered = scatter(spot, hit, path, pixel, sample);
            path = scattered.onward;
            if scattered.splits {
                pending[waiting] = scattered.other;
                waiting++;
            }
        }
        var seen = environment.background;
        if hit.primitive != NO_INDEX {
            seen = radiance_from(spot, hit, path, pixel, sample);
        }
        sum += path.throughput * seen;
        if waiting == 0u {
            break;
        }
        waiting--;
        path = pending[waiting];
    }
    return sum;
}

fn scatter(spot: Spot, hit: Hit, path: Path, pixel: vec2u, sample: u32) -> Scattered {
    var surface = surface_of(spot, hit, path.ray);
    let at = arrival_of(spot, hit, surface, path.ray, path.differential);
    let look = appearance(spot, hit, material_of(spot), surface, at, SPECULAR_LOOKUPS);
    let material = look.material;
    surface.shading_normal = usable_normal(surface, look.normal);
    if material.kind == MIRROR {
        return mirrored_path(path, surface, at, material);
    }
    let bits = decision_bits(pixel, camera.seed, sample, path.depth * LEAVES + path.branch, NO_INDEX);
    return glass_path(path, surface, at, material, unit_float(bits.x));
}

// The radiance of what a path ends at.
fn radiance_from(spot: Spot, hit: Hit, path: Path, pixel: vec2u, sample: u32) -> vec3f {
    let plain = material_of(spot);
    if plain.kind == EMITTER {
        return plain.emission;
    }
    var surface = surface_of(spot, hit, path.ray);
    let at = arrival_of(spot, hit, surface, path.ray, path.differential);
    let look = appearance(spot, hit, plain, surface, at, LOOKUPS);
    let material = look.material;
    surface.shading_normal = look.normal;
    if (IN_TREE & (1u << INSTANCE)) != 0u {
        surface.start += surface.bulge;
    }
    var sum = environment.ambient * material.ambient;
    let lights = light_counts();
    if (LIGHTS & 1u) != 0u {
        for (var i = 0u; i < lights.x; i++) {
            let light = load_light(i);
            let lobes = lobes_of_light(spot, surface, material, light, LIGHT_PATTERN, LIGHT_SIDE, LIGHT_SAMPLES, pixel, sample);
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
            let lobes = lobes_of_light(spot, surface, material, light, GRID, 1u, 1u, pixel, sample);
            sum += phong_radiance(material, light, lobes, 1.0);
        }
    }
    return sum;
}

// Phong's lobes, summed over all samples of a light.
fn lobes_of_light(spot: Spot, surface: Surface, material: Material, light: Light, pattern: u32, side: u32, count: u32,
                  pixel: vec2u, sample: u32) -> Lobes {
    let to = segments_to_light(light, surface.position);
    let key = sample_key(pixel, camera.seed, 1u + light.number);
    var lobes = Lobes(0.0, 0.0);
    for (var first = 0u; first < count; first += BLOCK) {
        let block = Block(pattern, side, first, select(BLOCK, count - first, count - first < BLOCK), sample, key);
        var unlit = 0u;
        if IN_TREE != 0u {
            unlit = unlit_samples(spot, surface, to, block);
        }
        let hidden = hidden_samples(surface, light, block, unlit);
        lobes = phong_block(surface, material, to, block, hidden, EXPONENT_BITS, lobes);
    }
    return lobes;
}

fn phong_radiance(material: Material, light: Light, lobes: Lobes, weight: f32) -> vec3f {
    let light_color = light.color * weight;
    return light_color * (material.diffuse * lobes.diffuse + material.specular * lobes.specular);
}
