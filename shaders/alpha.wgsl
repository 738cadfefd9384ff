// Surfaces with alpha. Whether a surface accepts a ray depends on pixel, sample, bounce and hit, not on traversal
// order.

// Purposes of rays. The random decisions at a surface are independent for rays of different purposes.
const RAY_BSDF: u32 = 0u;
const RAY_SHADOW: u32 = 1u;

// Returns true if the hit surface accepts the ray.
fn alpha_accepts(material: Material, pixel: vec2u, sample: u32, bounce: u32, purpose: u32, hit: Hit, side: f32) -> bool {
    let key = hash4(vec4u(pixel.x, pixel.y, camera.seed, sample));
    let face = select(0u, 1u, side > 0.0);
    let bits = hash4(vec4u(key.x, key.y + 2u * bounce + purpose, hit.instance, 2u * hit.primitive + face));
    let is_visible = unit_float(bits.x) < material.opacity;
    let accepted = select(is_visible, material.opacity >= material.cutoff, material.alpha_mode == MASK);
    return accepted | (material.alpha_mode == OPAQUE);
}

// Returns the material with textured and vertex-colored opacity.
fn with_opacity_at(before: Material, prim: HitPrimitive, hit: Hit, uv: vec2f) -> Material {
    var material = before;
    for (var i = 0u; i < LOOKUPS; i++) {
        if i < material.lookups.y {
            let lookup = load_lookup(material.lookups.x + i);
            if (lookup.purposes & FOR_OPACITY) != 0u {
                let set_uv = uv_in_set(uv, prim, hit, lookup.uv_set);
                let color = texture_color(load_texture(lookup.texture), Footprint(set_uv, vec2f(0.0), vec2f(0.0)));
                material.opacity = channel_of(color, lookup, OPACITY_CHANNEL);
            }
        }
    }
    if VERTEX_COLORS != 0u {
        material = with_vertex_colors(material, hit);
    }
    return material;
}

// Returns the fraction of rays that the surface accepts.
fn opacity_at(before: Material, prim: HitPrimitive, hit: Hit, uv: vec2f) -> f32 {
    let material = with_opacity_at(before, prim, hit, uv);
    let masked = select(0.0, 1.0, material.opacity >= material.cutoff);
    let opacity = select(min(material.opacity, 1.0), masked, material.alpha_mode == MASK);
    return select(opacity, 1.0, material.alpha_mode == OPAQUE);
}

// Variant of `is_occluded` for scenes with alpha: skips surfaces that do not accept the shadow ray. Returns true if the
// ray skips more than MAX_ALPHA_SKIPS surfaces.
fn is_occluded_alpha(already_occluded: bool, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32, pixel: vec2u, sample: u32,
             bounce: u32) -> bool {
    if already_occluded {
        return true;
    }
    let distance = sqrt(dot(to_light, to_light));
    var ray = Ray(surface.ray_origin, to_light * (1.0 / distance));
    var origin_prim = surface.exclude_front;
    var inside_prim = surface.exclude_back;
    var remaining = distance * t_max;
    for (var i = 0u; i <= MAX_ALPHA_SKIPS; i++) {
        let hit = closest_hit(ray, origin_prim, inside_prim);
        if (hit.primitive == NO_INDEX) | !(hit.t < remaining) {
            return false;
        }
        let prim = fetch_hit_primitive(hit);
        let skipped = surface_of(prim, hit, ray);
        let material = with_opacity_at(material_of(prim), prim, hit, skipped.uv);
        let is_target = (hit.instance == 0u) & (hit.primitive == target_prim);
        if !is_target & alpha_accepts(material, pixel, sample, bounce, RAY_SHADOW, hit, skipped.side) {
            return true;
        }
        remaining -= hit.t;
        ray.origin = skipped.position - (skipped.ray_origin - skipped.position);
        origin_prim = skipped.exclude_back;
        inside_prim = skipped.exclude_front;
    }
    return true;
}

// Returns the first hit, starting at `first`, that is opaque or whose opacity is at least its cutoff (MASK) or 0.5
// (BLEND). Skips at most MAX_ALPHA_SKIPS hits. t is measured from the origin of `ray`.
fn skip_transparent(ray: Ray, first: Hit) -> Hit {
    var hit = first;
    var continued = ray;
    var distance = 0.0;
    for (var i = 0u; i < MAX_ALPHA_SKIPS; i++) {
        if hit.primitive == NO_INDEX {
            break;
        }
        let prim = fetch_hit_primitive(hit);
        let surface = surface_of(prim, hit, continued);
        let material = with_opacity_at(material_of(prim), prim, hit, surface.uv);
        let min_opacity = select(0.5, material.cutoff, material.alpha_mode == MASK);
        if (material.alpha_mode == OPAQUE) | (material.opacity >= min_opacity) {
            break;
        }
        distance += hit.t;
        continued.origin = surface.position - (surface.ray_origin - surface.position);
        hit = closest_hit(continued, surface.exclude_back, surface.exclude_front);
    }
    hit.t += distance;
    return hit;
}
