// Scene access in storage buffers, and loops over the primitives outside the BVH, called by generated functions
// (crates/render/src/gpu/dispatch.rs).

fn load_primitive(i: u32) -> Primitive {
    return primitives[i];
}

// Returns the number of area lights, which come first (x), and of all lights (y).
fn light_counts() -> vec2u {
    return counts.lights;
}

fn closest_of(kind: u32, before: Hit, ray: Ray, origin_prim: u32, inside_prim: u32) -> Hit {
    var hit = before;
    let range = counts.primitives[kind];
    for (var i = range.x; i < range.z; i++) {
        hit = closer(hit, intersect(kind, primitives[i], i == inside_prim, ray, hit.t), i, origin_prim);
    }
    return hit;
}

// Returns true if `already_occluded` is true, or if a primitive of the kind, except `target_prim`, occludes the segment
// from the surface along `t_max * to_light`.
fn is_occluded_by(kind: u32, already_occluded: bool, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool {
    let range = counts.primitives[kind];
    var occluded = already_occluded;
    for (var i = range.x; i < range.y && !occluded; i++) {
        occluded = is_occluded_by_primitive(kind, primitives[i], i, surface, to_light, t_max, target_prim);
    }
    return occluded;
}

fn emitter_count() -> u32 {
    return counts.emitters.y;
}

// Returns a mask of the primitives that may occlude a light, for up to 32 primitives in `first..end`: bit i stands for
// primitive `first + i`.
fn shadow_candidates(first: u32, end: u32, frustum: ShadowFrustum) -> u32 {
    var candidates = 0u;
    for (var i = 0u; i < 32u && first + i < end; i++) {
        candidates |= select(0u, 1u << i, may_block(bounds[first + i], frustum));
    }
    return candidates;
}

// Loads a shadow caster of a kind known at compile time.
fn load_blocker(kind: u32, i: u32) -> Primitive {
    return primitives[i];
}
