// The scene from buffers, by loops over all primitives outside of the tree.

fn load_primitive(i: u32) -> Primitive {
    return primitives[i];
}

// How many lights there are: x of those with an area, which come first, y of all.
fn light_counts() -> vec2u {
    return counts.lights;
}

// The nearest primitive that a ray meets, of those outside of the tree; not the one that it has left. It may start on the wall
// of a round one, inside of it.
fn closest_primitive(ray: Ray, left: u32, wall: u32) -> Hit {
    var hit = no_hit();
    if (PRIMITIVES & (1u << RECTANGLE)) != 0u {
        hit = closest_of(RECTANGLE, hit, ray, left, wall);
    }
    if (PRIMITIVES & (1u << TRIANGLE)) != 0u {
        hit = closest_of(TRIANGLE, hit, ray, left, wall);
    }
    if (PRIMITIVES & (1u << ELLIPSOID)) != 0u {
        hit = closest_of(ELLIPSOID, hit, ray, left, wall);
    }
    if (PRIMITIVES & (1u << PLANE)) != 0u {
        hit = closest_of(PLANE, hit, ray, left, wall);
    }
    if (PRIMITIVES & (1u << DISK)) != 0u {
        hit = closest_of(DISK, hit, ray, left, wall);
    }
    return hit;
}

// Of the hit so far and the primitives of a kind.
fn closest_of(kind: u32, before: Hit, ray: Ray, left: u32, wall: u32) -> Hit {
    var hit = before;
    let range = counts.primitives[kind];
    for (var i = range.x; i < range.z; i++) {
        hit = closer(hit, intersect(kind, primitives[i], i == wall, ray, hit.t), i, left);
    }
    return hit;
}

// Bit i is set where any of these primitives hides sample i of the block from a surface.
fn hidden_by_primitives(surface: Surface, light: Light, block: Block) -> u32 {
    let cone = cone_to_light(light, surface.start);
    var bits = 0u;
    if (SHADOW_CASTERS & (1u << RECTANGLE)) != 0u {
        bits |= hidden_by(RECTANGLE, counts.primitives[RECTANGLE].xy, surface, cone, light, block);
    }
    if (SHADOW_CASTERS & (1u << TRIANGLE)) != 0u {
        bits |= hidden_by(TRIANGLE, counts.primitives[TRIANGLE].xy, surface, cone, light, block);
    }
    if (SHADOW_CASTERS & (1u << ELLIPSOID)) != 0u {
        bits |= hidden_by(ELLIPSOID, counts.primitives[ELLIPSOID].xy, surface, cone, light, block);
    }
    if (SHADOW_CASTERS & (1u << PLANE)) != 0u {
        bits |= hidden_by(PLANE, counts.primitives[PLANE].xy, surface, cone, light, block);
    }
    if (SHADOW_CASTERS & (1u << DISK)) != 0u {
        bits |= hidden_by(DISK, counts.primitives[DISK].xy, surface, cone, light, block);
    }
    return bits;
}

// Whether it is so before, or any of these primitives but `goal` cuts the way from a surface to `reach` times `to`.
fn is_hidden_by_primitives(before: bool, surface: Surface, to: vec3f, reach: f32, goal: u32) -> bool {
    var hidden = before;
    if (SHADOW_CASTERS & (1u << RECTANGLE)) != 0u {
        hidden = is_hidden_by(RECTANGLE, hidden, surface, to, reach, goal);
    }
    if (SHADOW_CASTERS & (1u << TRIANGLE)) != 0u {
        hidden = is_hidden_by(TRIANGLE, hidden, surface, to, reach, goal);
    }
    if (SHADOW_CASTERS & (1u << ELLIPSOID)) != 0u {
        hidden = is_hidden_by(ELLIPSOID, hidden, surface, to, reach, goal);
    }
    if (SHADOW_CASTERS & (1u << PLANE)) != 0u {
        hidden = is_hidden_by(PLANE, hidden, surface, to, reach, goal);
    }
    if (SHADOW_CASTERS & (1u << DISK)) != 0u {
        hidden = is_hidden_by(DISK, hidden, surface, to, reach, goal);
    }
    return hidden;
}

fn is_hidden_by(kind: u32, before: bool, surface: Surface, to: vec3f, reach: f32, goal: u32) -> bool {
    let range = counts.primitives[kind];
    var hidden = before;
    for (var i = range.x; i < range.y && !hidden; i++) {
        hidden = is_cut(kind, primitives[i], i, surface, to, reach, goal);
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
