// Which of a light's samples are hidden. First a cheap test finds the primitives that may hide any, then only these are
// looked at: software Vulkan cannot skip a branch, but it leaves a loop as soon as none of its lanes goes on.

// Bit i is set where any primitive hides sample i of the block from a surface. The one that the surface is of hides none
// that are above it, unless it is seen from inside.
fn hidden_samples(surface: Surface, light: Light, block: Block) -> u32 {
    let cone = cone_to_light(light, surface.start);
    let triangles = RECTANGLES + TRIANGLES;
    let ellipsoids = triangles + ELLIPSOIDS;
    return hidden_by(RECTANGLE, 0u, BLOCKING_RECTANGLES, surface, cone, light, block)
        | hidden_by(TRIANGLE, RECTANGLES, RECTANGLES + BLOCKING_TRIANGLES, surface, cone, light, block)
        | hidden_by(ELLIPSOID, triangles, triangles + BLOCKING_ELLIPSOIDS, surface, cone, light, block)
        | hidden_by(PLANE, ellipsoids, ellipsoids + BLOCKING_PLANES, surface, cone, light, block);
}

// The same for the primitives of one kind from `start` to before `end`.
fn hidden_by(kind: u32, start: u32, end: u32, surface: Surface, cone: Cone, light: Light, block: Block) -> u32 {
    var bits = 0u;
    for (var first = start; first < end; first += 32u) {
        let own = surface.above - first;
        var candidates = shadow_candidates(first, end, cone);
        candidates &= ~select(0u, 1u << (own & 31u), own < 32u);
        while candidates != 0u {
            let i = first + firstTrailingBit(candidates);
            candidates &= candidates - 1u;
            bits |= shadow_bits(kind, load_blocker(kind, i), cone.apex, i == surface.below, light, block);
        }
    }
    return bits;
}
