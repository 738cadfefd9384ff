// Shadow rays against primitives outside of the BVH. Only primitives that pass a cheap test are intersected, in a loop:
// software Vulkan cannot skip a branch, but leaves a loop as soon as no lane needs another iteration.

// Returns the mask of the samples that are occluded by primitives of a kind: those with indices in the half-open range
// `range`.
fn occluded_by(kind: u32, range: vec2u, surface: Surface, frustum: ShadowFrustum, light: Light, block: SampleBlock) -> u32 {
    var bits = 0u;
    for (var first = range.x; first < range.y; first += 32u) {
        let own_bit = standalone_prim(surface.exclude_front) - first;
        var candidates = shadow_candidates(first, range.y, frustum);
        candidates &= ~select(0u, 1u << (own_bit & 31u), own_bit < 32u);
        while candidates != 0u {
            let i = first + firstTrailingBit(candidates);
            candidates &= candidates - 1u;
            bits |= occlusion_mask(kind, load_blocker(kind, i), frustum.apex, i == standalone_prim(surface.exclude_back), light, block);
        }
    }
    return bits;
}

// Returns true if the primitive q, with index i, occludes the segment from the surface along `t_max * to_light`.
fn is_occluded_by_primitive(kind: u32, q: Primitive, i: u32, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool {
    let is_inside = i == standalone_prim(surface.exclude_back);
    return (i != standalone_prim(surface.exclude_front)) & (i != target_prim) & occludes_segment(kind, q, surface.ray_origin, is_inside, to_light, t_max);
}
