// The scene, from the buffers.

fn load_primitive(i: u32) -> Primitive {
    return primitives[i];
}

// A primitive of a kind that is known when compiled, one of those that can cast a shadow.
fn load_blocker(kind: u32, i: u32) -> Primitive {
    return primitives[i];
}

fn load_material(i: u32) -> Material {
    return materials[i];
}

fn load_light(i: u32) -> Light {
    return lights[i];
}

fn load_texture(i: u32) -> Texture {
    return textures[i];
}

// The nearest primitive that a ray meets, by one loop for each kind of primitive; not the one that it has left. It may
// start on the wall of an ellipsoid, inside of it.
fn closest_hit(ray: Ray, left: u32, wall: u32) -> Hit {
    var hit = Hit(FAR, NOTHING);
    var i = 0u;
    for (; i < RECTANGLES; i++) {
        hit = closer(hit, intersect_rectangle(primitives[i], ray, hit.t), i, left);
    }
    for (; i < RECTANGLES + TRIANGLES; i++) {
        hit = closer(hit, intersect_triangle(primitives[i], ray, hit.t), i, left);
    }
    for (; i < RECTANGLES + TRIANGLES + ELLIPSOIDS; i++) {
        hit = closer(hit, intersect_ellipsoid(primitives[i], i == wall, ray, hit.t), i, left);
    }
    for (; i < RECTANGLES + TRIANGLES + ELLIPSOIDS + PLANES; i++) {
        hit = closer(hit, intersect_plane(primitives[i], ray, hit.t), i, left);
    }
    return hit;
}

// Which of the primitives from `first` to before `end` may hide a light: bit i stands for first + i, up to 32 of them.
fn shadow_candidates(first: u32, end: u32, cone: Cone) -> u32 {
    var candidates = 0u;
    for (var i = 0u; i < 32u && first + i < end; i++) {
        candidates |= select(0u, 1u << i, may_block(bounds[first + i], cone));
    }
    return candidates;
}
