// The scene from buffers, by loops over all primitives outside of the BVH. The functions that call a loop for each kind of primitive are
// generated (crates/render/src/gpu/dispatch.rs).

fn load_primitive(i: u32) -> Primitive {
    return primitives[i];
}

// How many lights there are: x of those with an area, which come first, y of all.
fn light_counts() -> vec2u {
    return counts.lights;
}

// Of the hit so far and the primitives of a kind.
fn closest_of(kind: u32, before: Hit, ray: Ray, origin_prim: u32, inside_prim: u32) -> Hit {
    var hit = before;
    let range = counts.primitives[kind];
    for (var i = range.x; i < range.z; i++) {
        hit = closer(hit, intersect(kind, primitives[i], i == inside_prim, ray, hit.t), i, origin_prim);
    }
    return hit;
}

// Returns whether any primitive of a kind except `target_prim` occludes the segment from a surface to `t_max` times `to`, or `before`.
fn is_occluded_by(kind: u32, before: bool, surface: Surface, to: vec3f, t_max: f32, target_prim: u32) -> bool {
    let range = counts.primitives[kind];
    var hidden = before;
    for (var i = range.x; i < range.y && !hidden; i++) {
        hidden = is_occluded_by_primitive(kind, primitives[i], i, surface, to, t_max, target_prim);
    }
    return hidden;
}

// How many things shine that light is sampled of.
fn emitter_count() -> u32 {
    return counts.emitters.y;
}

// Which of the primitives from `first` to before `end` may hide a light: bit i stands for first + i, up to 32 of them.
fn shadow_candidates(first: u32, end: u32, cone: Cone) -> u32 {
    var candidates = 0u;
    for (var i = 0u; i < 32u && first + i < end; i++) {
        candidates |= select(0u, 1u << i, may_block(bounds[first + i], cone));
    }
    return candidates;
}

// One of those that can cast a shadow, of a kind that is known when compiled.
fn load_blocker(kind: u32, i: u32) -> Primitive {
    return primitives[i];
}
