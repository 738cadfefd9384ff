// Surfaces that rays pass by their alpha: whether one is there for a ray is a function of pixel, sample, bounce and what is met, so that no
// order in which a tree is walked decides on it.

// Rays to lights and rays to go on decide apart.
const ONWARD: u32 = 0u;
const TO_LIGHT: u32 = 1u;

// Whether a surface of this opacity, which the ray `purpose` of bounce `bounce` has met, is there for it.
fn is_there(material: Material, pixel: vec2u, sample: u32, bounce: u32, purpose: u32, hit: Hit, side: f32) -> bool {
    let key = hash4(vec4u(pixel.x, pixel.y, camera.seed, sample));
    let face = select(0u, 1u, side > 0.0);
    let bits = hash4(vec4u(key.x, key.y + 2u * bounce + purpose, hit.instance, 2u * hit.primitive + face));
    let shown = unit_float(bits.x) < material.opacity;
    let whole = select(shown, material.opacity >= material.cutoff, material.alpha_mode == MASK);
    return whole | (material.alpha_mode == OPAQUE);
}

// What is there at a point, by its texture if it has one, and by the colours of its vertices.
fn with_opacity_at(before: Material, spot: Spot, hit: Hit, uv: vec2f) -> Material {
    var material = before;
    for (var i = 0u; i < LOOKUPS; i++) {
        if i < material.lookups.y {
            let lookup = load_lookup(material.lookups.x + i);
            if (lookup.purposes & FOR_OPACITY) != 0u {
                let place = uv_in_set(uv, spot, hit, lookup.uv_set);
                let color = texture_color(load_texture(lookup.texture), Footprint(place, vec2f(0.0), vec2f(0.0)));
                material.opacity = channel_of(color, lookup, OPACITY_CHANNEL);
            }
        }
    }
    if VERTEX_COLORS != 0u {
        material = with_vertex_colors(material, hit);
    }
    return material;
}

// The share of rays that a surface is there for, at texture coordinates.
fn presence_at(before: Material, spot: Spot, hit: Hit, uv: vec2f) -> f32 {
    let material = with_opacity_at(before, spot, hit, uv);
    let whole = select(0.0, 1.0, material.opacity >= material.cutoff);
    let share = select(min(material.opacity, 1.0), whole, material.alpha_mode == MASK);
    return select(share, 1.0, material.alpha_mode == OPAQUE);
}

// `is_hidden`, where surfaces may be there or not: from one to the next.
fn is_veiled(before: bool, surface: Surface, to: vec3f, reach: f32, goal: u32, pixel: vec2u, sample: u32,
             bounce: u32) -> bool {
    if before {
        return true;
    }
    let way = sqrt(dot(to, to));
    var ray = Ray(surface.start, to * (1.0 / way));
    var left = surface.above;
    var wall = surface.below;
    var rest = way * reach;
    for (var i = 0u; i <= MOST_PASSED; i++) {
        let hit = closest_hit(ray, left, wall);
        if (hit.primitive == NO_INDEX) | !(hit.t < rest) {
            return false;
        }
        let spot = spot_of(hit);
        let met = surface_of(spot, hit, ray);
        let material = with_opacity_at(material_of(spot), spot, hit, met.uv);
        let is_goal = (hit.instance == 0u) & (hit.primitive == goal);
        if !is_goal & is_there(material, pixel, sample, bounce, TO_LIGHT, hit, met.side) {
            return true;
        }
        rest -= hit.t;
        ray.origin = met.position - (met.start - met.position);
        left = met.below;
        wall = met.above;
    }
    return true;
}

// The first thing on a ray, from what it meets on, that is rather there than not; by its distance from the ray's start.
fn first_seen(ray: Ray, met: Hit) -> Hit {
    var hit = met;
    var onward = ray;
    var way = 0.0;
    for (var i = 0u; i < MOST_PASSED; i++) {
        if hit.primitive == NO_INDEX {
            break;
        }
        let spot = spot_of(hit);
        let surface = surface_of(spot, hit, onward);
        let material = with_opacity_at(material_of(spot), spot, hit, surface.uv);
        let least = select(0.5, material.cutoff, material.alpha_mode == MASK);
        if (material.alpha_mode == OPAQUE) | (material.opacity >= least) {
            break;
        }
        way += hit.t;
        onward.origin = surface.position - (surface.start - surface.position);
        hit = closest_hit(onward, surface.below, surface.above);
    }
    hit.t += way;
    return hit;
}
