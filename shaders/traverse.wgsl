// Which of a light's samples are hidden. First a cheap test finds the primitives that may hide any, then only these are
// looked at: software Vulkan cannot skip a branch, but it leaves a loop as soon as none of its lanes goes on.

// Bit i is set where any primitive hides sample i of the block from p.
fn hidden_samples(p: vec3f, light: Light, block: Block) -> u32 {
    let cone = cone_to_light(light, p);
    let triangles = RECTANGLES + TRIANGLES;
    let ellipsoids = triangles + ELLIPSOIDS;
    return hidden_by(RECTANGLE, 0u, BLOCKING_RECTANGLES, cone, light, block)
        | hidden_by(TRIANGLE, RECTANGLES, RECTANGLES + BLOCKING_TRIANGLES, cone, light, block)
        | hidden_by(ELLIPSOID, triangles, triangles + BLOCKING_ELLIPSOIDS, cone, light, block)
        | hidden_by(PLANE, ellipsoids, ellipsoids + BLOCKING_PLANES, cone, light, block);
}

// The same for the primitives of one kind from `start` to before `end`.
fn hidden_by(kind: u32, start: u32, end: u32, cone: Cone, light: Light, block: Block) -> u32 {
    var bits = 0u;
    for (var first = start; first < end; first += 32u) {
        var candidates = shadow_candidates(first, end, cone);
        while candidates != 0u {
            let q = load_blocker(kind, first + firstTrailingBit(candidates));
            candidates &= candidates - 1u;
            bits |= shadow_bits(kind, q, cone.apex, light, block);
        }
    }
    return bits;
}
