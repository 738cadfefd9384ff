// Traversal of the BVHs over items (mesh instances and standalone primitives) and over mesh triangles. Hits do not
// depend on the BVHs (docs/decisions/trees.md).

// Pending children of a node, per level. x: first child node; y: bits 0 to 7 mark slots of nodes, bits 8 to 15 mark
// pending slots, in visiting order.
struct TraversalStack {
    octant: u32,
    depth: u32,
    pending: array<vec2u, BVH_MAX_DEPTH>,
}

// Module variables, since software Vulkan zeroes function variables for each ray, which takes a fifth of the render
// time.
var<private> tlas_stack: TraversalStack;
var<private> blas_stack: TraversalStack;

fn traversal_begin(stack: ptr<private, TraversalStack>, octant: u32) {
    (*stack).octant = octant;
    (*stack).depth = 1u;
    (*stack).pending[0] = vec2u(0u, 1u | (256u << octant)); // the root, as the only child
}

// Returns the next node; a node must be pending.
fn pop_node(stack: ptr<private, TraversalStack>) -> u32 {
    let top = (*stack).depth - 1u;
    let group = (*stack).pending[top];
    let bit = firstTrailingBit(group.y >> 8u);
    let slot = bit ^ (*stack).octant;
    let remaining = group.y & ~(256u << bit);
    (*stack).pending[top].y = remaining;
    (*stack).depth = select(top + 1u, top, (remaining >> 8u) == 0u);
    return group.x + countOneBits(group.y & ((1u << slot) - 1u));
}

// Pushes the hit nodes, and returns the hit leaves.
fn push_children(stack: ptr<private, TraversalStack>, node: Node, hit_children: u32) -> u32 {
    let inner = node.scales >> 24u;
    let inner_in_order = in_order(hit_children & inner, (*stack).octant);
    if inner_in_order != 0u {
        (*stack).pending[(*stack).depth] = vec2u(node.first_child, inner | (inner_in_order << 8u));
        (*stack).depth += 1u;
    }
    return hit_children & ~inner;
}

fn item_pad(origin: vec3f) -> f32 {
    return counts.item_padding.x * (largest(origin) + counts.item_padding.y);
}

// Returns the nearer of `before` and the nearest hit on items.
fn closest_in_bvh(before: Hit, ray: Ray, origin_prim: vec2u, inside_prim: vec2u) -> Hit {
    var hit = before;
    let s = slabs(ray.origin, ray.direction, item_pad(ray.origin));
    traversal_begin(&tlas_stack, octant_of(ray.direction));
    while tlas_stack.depth > 0u {
        let node = load_node(5u * pop_node(&tlas_stack));
        var leaves = push_children(&tlas_stack, node, children_hit(node, s, hit.t));
        while leaves != 0u {
            let items = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < items.y; k++) {
                hit = closest_of_item(hit, load_item(items.x + k), ray, s, origin_prim, inside_prim);
            }
        }
    }
    return hit;
}

fn closest_of_item(before: Hit, item: BvhItem, ray: Ray, s: Slabs, origin_prim: vec2u, inside_prim: vec2u) -> Hit {
    var hit = before;
    let interval = box_interval(item.low, item.high, s);
    if !interval_hits(interval, hit.t) {
        return hit;
    }
    // A loop instead of an `if`: software Vulkan executes both sides of a branch, but skips loops.
    for (var once = has_kind(item, INSTANCE); once; once = false) {
        hit = closest_of_mesh(hit, item.index, ray, max(interval.x, 0.0), origin_prim);
    }
    return closest_of_primitive_item(hit, item, ray, interval.x, origin_prim, inside_prim);
}

// Returns false at compile time if no item of the scene is of the kind.
fn has_kind(item: BvhItem, kind: u32) -> bool {
    if (TLAS_KINDS & (1u << kind)) == 0u {
        return false;
    }
    return (item.kind & 0xffu) == kind;
}

// Returns the hit on primitive i, no nearer than the primitive's box.
fn standalone_hit(kind: u32, i: u32, ray: Ray, near: f32, origin_prim: vec2u, inside_prim: vec2u) -> Hit {
    let t = max(intersect(kind, primitives[i], i == standalone_prim(inside_prim), ray, INFINITE_T), near);
    return Hit(select(INFINITE_T, t, i != standalone_prim(origin_prim)), 0u, i, 0u, vec2f(0.0));
}

// Returns an upper bound of the distance from `start` to hits nearer than t, with a margin for rounding.
fn remaining_t_max(start: f32, t: f32) -> f32 {
    return (t - start) + t * 4.7683716e-7;
}

// Returns the nearer of `before` and the nearest hit on a mesh instance. The ray is traced from distance `start`, near
// the mesh, for precision.
fn closest_of_mesh(before: Hit, instance_index: u32, ray: Ray, start: f32, origin_prim: vec2u) -> Hit {
    var hit = before;
    let i = load_instance(instance_index);
    let direction = vector_to_mesh(i, ray.direction);
    let origin = point_to_mesh(i, ray.origin) + direction * start;
    let s = slabs(origin, direction, mesh_pad(i, origin));
    let shear = shear_of(direction);
    traversal_begin(&blas_stack, octant_of(direction));
    while blas_stack.depth > 0u {
        let node = load_node(i.nodes + 5u * pop_node(&blas_stack));
        var leaves = push_children(&blas_stack, node, children_hit(node, s, remaining_t_max(start, hit.t)));
        while leaves != 0u {
            let triangles = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < triangles.y; k++) {
                let slot = triangles.x + k;
                let corners = meshes[i.triangles + slot];
                let found = triangle_crossing(load_position(i, corners.x), load_position(i, corners.y),
                                              load_position(i, corners.z), origin, shear, s);
                let t = start + max(found.t, 0.0);
                let is_origin = (origin_prim.x == instance_index + 1u) & (origin_prim.y == corners.w);
                let is_hit = found.is_hit & !is_origin & (t > 0.0);
                hit = nearer_hit(hit, Hit(select(INFINITE_T, t, is_hit), instance_index + 1u, corners.w, slot, found.barycentric));
            }
        }
    }
    return hit;
}

// Two shadow rays from one point, which share loads: on software Vulkan, loading a node or triangle takes longer than
// testing it.
struct RayPair {
    direction: array<vec3f, 2>,
    s: array<Slabs, 2>,
}

fn ray_pair(origin: vec3f, first: vec3f, second: vec3f, pad: f32) -> RayPair {
    return RayPair(array(first, second), array(slabs(origin, first, pad), slabs(origin, second, pad)));
}

// Returns the children hit by a ray of the pair that is not yet occluded.
fn children_hit_by_pair(node: Node, pair: RayPair, occluded: u32, t_max: f32) -> u32 {
    return children_hit(node, pair.s[0], select(t_max, -1.0, (occluded & 1u) != 0u))
        | children_hit(node, pair.s[1], select(t_max, -1.0, (occluded & 2u) != 0u));
}

// Returns the mask of a block's samples that items occlude or that are set in `already_occluded`.
fn occluded_by_bvh(already_occluded: u32, surface: Surface, light: Light, block: SampleBlock) -> u32 {
    let all_samples = select((1u << block.count) - 1u, 0xffffffffu, block.count >= 32u);
    var bits = already_occluded & all_samples;
    let segments = segments_to_light(light, surface.ray_origin);
    let pad = item_pad(surface.ray_origin);
    // Skips the tests of samples if no ray hits a child of the root, the usual case.
    let interval = interval_to_light(surface.ray_origin, segments, pad);
    let may_hit = children_in_interval(load_node(0u), interval, light.t_max) != 0u;
    var untested = select(0u, all_samples & ~bits, may_hit);
    while untested != 0u {
        let first = firstTrailingBit(untested);
        untested &= untested - 1u;
        let second = select(firstTrailingBit(untested), first, untested == 0u);
        untested &= untested - 1u;
        let occluded = occluded_pair(surface, segments, light, block, vec2u(first, second), pad);
        bits |= ((occluded & 1u) << first) | ((occluded >> 1u) << second);
    }
    return bits;
}

fn interval_to_light(origin: vec3f, segments: LightSegments, pad: f32) -> RayInterval {
    return ray_interval(origin, segments.towards - abs(segments.u) - abs(segments.v), segments.towards + abs(segments.u) + abs(segments.v), pad);
}

fn segments_to_two(segments: LightSegments, block: SampleBlock, samples: vec2u) -> array<vec3f, 2> {
    return array(segment(segments, block_sample(block, samples.x)), segment(segments, block_sample(block, samples.y)));
}

// Returns the mask of the two samples, bits 0 and 1, that items occlude.
fn occluded_pair(surface: Surface, segments: LightSegments, light: Light, block: SampleBlock, samples: vec2u, pad: f32) -> u32 {
    let directions = segments_to_two(segments, block, samples);
    let pair = ray_pair(surface.ray_origin, directions[0], directions[1], pad);
    var occluded = 0u;
    traversal_begin(&tlas_stack, octant_of(directions[0]));
    while tlas_stack.depth > 0u && occluded != 3u {
        let node = load_node(5u * pop_node(&tlas_stack));
        var leaves = push_children(&tlas_stack, node, children_hit_by_pair(node, pair, occluded, light.t_max));
        while leaves != 0u && occluded != 3u {
            let items = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < items.y; k++) {
                let item = load_item(items.x + k);
                let box_hits = select(0u, 1u, interval_hits(box_interval(item.low, item.high, pair.s[0]), light.t_max))
                    | select(0u, 2u, interval_hits(box_interval(item.low, item.high, pair.s[1]), light.t_max));
                let candidates = select(0u, box_hits & ~occluded, (item.kind & CASTS_SHADOW) != 0u);
                occluded |= occluded_by_item(item, candidates, surface, light, block, samples);
            }
        }
    }
    return occluded;
}

fn occluded_by_item(item: BvhItem, candidates: u32, surface: Surface, light: Light, block: SampleBlock, samples: vec2u) -> u32 {
    var bits = 0u;
    for (var once = has_kind(item, INSTANCE) & (candidates != 0u); once; once = false) {
        bits = candidates & occluded_by_mesh(item.index, candidates, surface, light, block, samples);
    }
    let i = item.index;
    let p = surface.ray_origin;
    let is_inside = i == standalone_prim(surface.exclude_back);
    var pending = select(candidates, 0u, i == standalone_prim(surface.exclude_front));
    if (TLAS_KINDS & ~(1u << INSTANCE)) == 0u {
        pending = 0u;
    }
    for (; pending != 0u; pending &= pending - 1u) {
        let sample = select(samples.y, samples.x, (pending & 1u) != 0u);
        let single_sample = SampleBlock(block.pattern, block.side, block.first + sample, 1u, block.group, block.key);
        let bit = occluded_by_primitive_item(item, p, is_inside, light, single_sample);
        bits |= select(0u, pending & (~pending + 1u), bit != 0u);
    }
    return bits;
}

// Returns the mask of the samples in `candidates` that a mesh instance, except the surface's own triangle, occludes.
// Bits outside of `candidates` are set, too.
fn occluded_by_mesh(instance_index: u32, candidates: u32, surface: Surface, light: Light, block: SampleBlock, samples: vec2u) -> u32 {
    let i = load_instance(instance_index);
    let origin = point_to_mesh(i, surface.ray_origin);
    let segments = segments_to_light(light, surface.ray_origin);
    let mesh_segments = LightSegments(vector_to_mesh(i, segments.towards), vector_to_mesh(i, segments.u), vector_to_mesh(i, segments.v));
    let directions = segments_to_two(mesh_segments, block, samples);
    let pair = ray_pair(origin, directions[0], directions[1], mesh_pad(i, origin));
    let first_shear = shear_of(directions[0]);
    let second_shear = shear_of(directions[1]);
    var occluded = 3u & ~candidates;
    traversal_begin(&blas_stack, octant_of(directions[0]));
    while blas_stack.depth > 0u && occluded != 3u {
        let node = load_node(i.nodes + 5u * pop_node(&blas_stack));
        var leaves = push_children(&blas_stack, node, children_hit_by_pair(node, pair, occluded, light.t_max));
        while leaves != 0u && occluded != 3u {
            let triangles = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < triangles.y; k++) {
                let slot = triangles.x + k;
                let corners = meshes[i.triangles + slot];
                let v0 = load_position(i, corners.x);
                let v1 = load_position(i, corners.y);
                let v2 = load_position(i, corners.z);
                let first = triangle_crossing(v0, v1, v2, origin, first_shear, pair.s[0]);
                let second = triangle_crossing(v0, v1, v2, origin, second_shear, pair.s[1]);
                let crosses = select(0u, 1u, first.is_hit & (first.t > 0.0) & (first.t < light.t_max))
                    | select(0u, 2u, second.is_hit & (second.t > 0.0) & (second.t < light.t_max));
                let is_excluded = all(surface.exclude_front == vec2u(instance_index + 1u, corners.w));
                occluded |= select(0u, crosses, !is_excluded & triangle_casts(i, slot));
            }
        }
    }
    return occluded;
}

// Returns true if `already_occluded` is true, or if an item except `target_prim` occludes the segment from the surface
// along `t_max * to_light`.
fn is_occluded_by_bvh(already_occluded: bool, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool {
    var occluded = already_occluded;
    let s = slabs(surface.ray_origin, to_light, item_pad(surface.ray_origin));
    traversal_begin(&tlas_stack, octant_of(to_light));
    while tlas_stack.depth > 0u && !occluded {
        let node = load_node(5u * pop_node(&tlas_stack));
        var leaves = push_children(&tlas_stack, node, children_hit(node, s, t_max));
        while leaves != 0u && !occluded {
            let items = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < items.y && !occluded; k++) {
                let item = load_item(items.x + k);
                let hits_box = interval_hits(box_interval(item.low, item.high, s), t_max);
                for (var once = hits_box & ((item.kind & CASTS_SHADOW) != 0u); once; once = false) {
                    occluded = is_occluded_by_item(item, surface, to_light, t_max, target_prim);
                }
            }
        }
    }
    return occluded;
}

fn is_occluded_by_item(item: BvhItem, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool {
    var occluded = false;
    let i = item.index;
    for (var once = has_kind(item, INSTANCE); once; once = false) {
        occluded = is_occluded_by_mesh(i, surface, to_light, t_max);
    }
    return occluded | is_occluded_by_primitive_item(item, surface, to_light, t_max, target_prim);
}

// Returns true if a triangle of the instance, except the surface's own triangle, occludes the segment from the surface
// along `t_max * to_light`.
fn is_occluded_by_mesh(instance_index: u32, surface: Surface, to_light: vec3f, t_max: f32) -> bool {
    let i = load_instance(instance_index);
    let origin = point_to_mesh(i, surface.ray_origin);
    let direction = vector_to_mesh(i, to_light);
    let s = slabs(origin, direction, mesh_pad(i, origin));
    let shear = shear_of(direction);
    var occluded = false;
    traversal_begin(&blas_stack, octant_of(direction));
    while blas_stack.depth > 0u && !occluded {
        let node = load_node(i.nodes + 5u * pop_node(&blas_stack));
        var leaves = push_children(&blas_stack, node, children_hit(node, s, t_max));
        while leaves != 0u && !occluded {
            let triangles = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < triangles.y; k++) {
                let corners = meshes[i.triangles + triangles.x + k];
                let found = triangle_crossing(load_position(i, corners.x), load_position(i, corners.y),
                                              load_position(i, corners.z), origin, shear, s);
                let is_excluded = all(surface.exclude_front == vec2u(instance_index + 1u, corners.w));
                occluded |= found.is_hit & !is_excluded & (found.t > 0.0) & (found.t < t_max);
            }
        }
    }
    return occluded;
}
