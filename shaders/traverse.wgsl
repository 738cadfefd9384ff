// Which primitives a ray meets, by one loop for each kind of primitive.

fn closest_hit(ray: Ray) -> Hit {
    var hit = Hit(FAR, NOTHING);
    var i = 0u;
    for (; i < RECTANGLES; i++) {
        hit = closer(hit, intersect_rectangle(load_primitive(i), ray, hit.t), i);
    }
    for (; i < RECTANGLES + TRIANGLES; i++) {
        hit = closer(hit, intersect_triangle(load_primitive(i), ray, hit.t), i);
    }
    for (; i < RECTANGLES + TRIANGLES + ELLIPSOIDS; i++) {
        hit = closer(hit, intersect_ellipsoid(load_primitive(i), ray, hit.t), i);
    }
    for (; i < RECTANGLES + TRIANGLES + ELLIPSOIDS + PLANES; i++) {
        hit = closer(hit, intersect_plane(load_primitive(i), ray, hit.t), i);
    }
    return hit;
}

// Bit i is set where any primitive hides sample i of the block from p.
fn hidden_samples(p: vec3f, light: Light, block: Block) -> u32 {
    var bits = 0u;
    for (var i = 0u; i < BLOCKING_RECTANGLES; i++) {
        bits |= shadow_bits(RECTANGLE, load_primitive(i), p, light, block);
    }
    for (var i = 0u; i < BLOCKING_TRIANGLES; i++) {
        bits |= shadow_bits(TRIANGLE, load_primitive(RECTANGLES + i), p, light, block);
    }
    for (var i = 0u; i < BLOCKING_ELLIPSOIDS; i++) {
        bits |= shadow_bits(ELLIPSOID, load_primitive(RECTANGLES + TRIANGLES + i), p, light, block);
    }
    for (var i = 0u; i < BLOCKING_PLANES; i++) {
        bits |= shadow_bits(PLANE, load_primitive(RECTANGLES + TRIANGLES + ELLIPSOIDS + i), p, light, block);
    }
    return bits;
}
