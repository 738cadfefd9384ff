// Radiance along a path: direct light by Phong's model, seen directly or through mirrors and glass.

// The radiance that comes along a camera's path. The paths through glass form a tree; it is walked depth first, each
// path as far as its end, and the branches that wait are fewer than LEAVES. A path that meets a mirror or glass after
// BOUNCES bounces is cut off: there it sees the background.
fn radiance(camera_path: Path, pixel: vec2u, sample: u32) -> vec3f {
    var path = camera_path;
    if BOUNCES == 0u {
        return radiance_from(closest_hit(path.ray, NOTHING, NOTHING), path, pixel, sample);
    }
    var sum = vec3f(0.0);
    var pending: array<Path, SPLITS>;
    var waiting = 0u;
    for (var leaf = 0u; leaf < LEAVES; leaf++) {
        var hit = Hit(FAR, NOTHING);
        while path.depth <= BOUNCES {
            hit = closest_hit(path.ray, path.left, path.wall);
            if !is_specular(hit) {
                break;
            }
            if path.depth == BOUNCES {
                hit.primitive = NOTHING;
                break;
            }
            let scattered = scatter(hit, path, pixel, sample);
            path = scattered.onward;
            if scattered.splits {
                pending[waiting] = scattered.other;
                waiting++;
            }
        }
        sum += path.throughput * radiance_from(hit, path, pixel, sample);
        if waiting == 0u {
            break;
        }
        waiting--;
        path = pending[waiting];
    }
    return sum;
}

// Whether light is mirrored or refracted there.
fn is_specular(hit: Hit) -> bool {
    if hit.primitive == NOTHING {
        return false;
    }
    let kind = load_material(load_primitive(hit.primitive).material).kind;
    return (kind == MIRROR) | (kind == GLASS);
}

fn scatter(hit: Hit, path: Path, pixel: vec2u, sample: u32) -> Scattered {
    let q = load_primitive(hit.primitive);
    var surface = surface_at(q, hit.primitive, path.ray, hit.t, environment.shadow_epsilon);
    let at = arrival_of(q, path, hit.t, surface);
    let look = appearance(q, load_material(q.material), surface, at, SPECULAR_LOOKUPS);
    let material = look.material;
    surface.normal = usable_normal(surface, look.normal);
    if material.kind == MIRROR {
        return mirrored_path(path, surface, at, material);
    }
    let key = sample_key(pixel, camera.seed, NOTHING);
    let random = unit_float(hash4(vec4u(key, sample, path.depth * LEAVES + path.branch)).x);
    return glass_path(path, surface, at, material, random);
}

fn arrival_of(q: Primitive, path: Path, t: f32, surface: Surface) -> Arrival {
    if DIFFERENTIALS == 0u {
        return Arrival();
    }
    return arrival(q, path.differential, path.ray, t, surface);
}

// The radiance of what a path ends at.
fn radiance_from(hit: Hit, path: Path, pixel: vec2u, sample: u32) -> vec3f {
    if hit.primitive == NOTHING {
        return environment.background;
    }
    let q = load_primitive(hit.primitive);
    let plain = load_material(q.material);
    if plain.kind == EMITTER {
        return plain.ambient;
    }
    var surface = surface_at(q, hit.primitive, path.ray, hit.t, environment.shadow_epsilon);
    let look = appearance(q, plain, surface, arrival_of(q, path, hit.t, surface), LOOKUPS);
    let material = look.material;
    surface.normal = look.normal;
    var sum = environment.ambient * material.ambient;
    for (var i = 0u; i < AREA_LIGHTS; i++) {
        let light = load_light(i);
        let lobes = lobes_of_light(surface, material, light, LIGHT_PATTERN, LIGHT_SIDE, LIGHT_SAMPLES, pixel, sample);
        sum += reflected(material, light, lobes, environment.light_weight);
    }
    for (var i = AREA_LIGHTS; i < AREA_LIGHTS + DELTA_LIGHTS; i++) {
        let light = load_light(i);
        let lobes = lobes_of_light(surface, material, light, GRID, 1u, 1u, pixel, sample);
        sum += reflected(material, light, lobes, 1.0);
    }
    return sum;
}

// Phong's lobes, summed over all samples of a light.
fn lobes_of_light(surface: Surface, material: Material, light: Light, pattern: u32, side: u32, count: u32,
                  pixel: vec2u, sample: u32) -> Lobes {
    let to = segments_to_light(light, surface.position);
    let key = sample_key(pixel, camera.seed, 1u + light.number);
    var lobes = Lobes(0.0, 0.0);
    for (var first = 0u; first < count; first += BLOCK) {
        let block = Block(pattern, side, first, select(BLOCK, count - first, count - first < BLOCK), sample, key);
        let hidden = hidden_samples(surface, light, block);
        lobes = phong_block(surface, material, to, block, hidden, EXPONENT_BITS, lobes);
    }
    return lobes;
}

fn reflected(material: Material, light: Light, lobes: Lobes, weight: f32) -> vec3f {
    let light_color = light.color * weight;
    return light_color * (material.diffuse * lobes.diffuse + material.specular * lobes.specular);
}

// One sample of a pixel: its radiance times its weight, and its weight.
fn pixel_radiance(pixel: vec2u, sample: u32) -> vec4f {
    let round = sample / PIXEL_SAMPLES;
    let index = sample % PIXEL_SAMPLES;
    let u = sample_square(PIXEL_PATTERN, PIXEL_SIDE, index, round, sample_key(pixel, camera.seed, 0u));
    let at = filtered(u);
    return vec4f(radiance(camera_path(vec2f(pixel) + at.xy), pixel, sample) * at.z, at.z);
}

// The path through a place of the picture.
fn camera_path(place: vec2f) -> Path {
    var differential = Differential();
    if DIFFERENTIALS == 1u {
        differential = camera_differential(camera, place, 1.0 / sqrt(f32(PIXEL_SAMPLES)));
    }
    return Path(camera_ray(camera, place), differential, vec3f(1.0), 0u, 0u, NOTHING, NOTHING);
}

// A uniform position as one that is distributed like the filter, from the pixel's corner, and its weight.
fn filtered(u: vec2f) -> vec3f {
    if FILTER_BINS == 0u {
        return vec3f(u, 1.0);
    }
    let i = filter_bin(u.x, FILTER_BINS);
    let j = filter_bin(u.y, FILTER_BINS);
    let x = filter_offset(u.x, i, FILTER_BINS, filter_table[i].x, filter_table[i].y);
    let y = filter_offset(u.y, j, FILTER_BINS, filter_table[j].x, filter_table[j].y);
    return vec3f(0.5 + x, 0.5 + y, filter_table[i].z * filter_table[j].z);
}

// What the ray through a pixel's centre meets.
fn pixel_first_hit(pixel: vec2u) -> FirstHit {
    let ray = camera_ray(camera, vec2f(pixel) + 0.5);
    let hit = closest_hit(ray, NOTHING, NOTHING);
    if hit.primitive == NOTHING {
        return FirstHit(vec3f(0.0), 0.0, vec2f(0.0), NOTHING, NOTHING);
    }
    return first_hit(load_primitive(hit.primitive), ray, hit.t);
}
