// The trees: one over the scene's items, which are instances of meshes and primitives by themselves, and one over each mesh's
// triangles. What is found does not depend on the trees (docs/decisions/trees.md).

// Children of one node that wait for their visit: x is where the node's children start, bits 0 to 7 of y which slots are nodes,
// bits 8 to 15 which of them wait, in the order of visits.
struct Walk {
    octant: u32,
    depth: u32,
    waiting: array<vec2u, LEVELS>,
}

fn start_walk(octant: u32) -> Walk {
    var walk: Walk;
    walk.octant = octant;
    walk.depth = 1u;
    walk.waiting[0] = vec2u(0u, 1u | (256u << octant)); // the root, as the only child
    return walk;
}

// The number, in its tree, of the next node to visit. There is one.
fn next_node(walk: ptr<function, Walk>) -> u32 {
    let top = (*walk).depth - 1u;
    let group = (*walk).waiting[top];
    let place = firstTrailingBit(group.y >> 8u);
    let slot = place ^ (*walk).octant;
    let rest = group.y & ~(256u << place);
    (*walk).waiting[top].y = rest;
    (*walk).depth = select(top + 1u, top, (rest >> 8u) == 0u);
    return group.x + countOneBits(group.y & ((1u << slot) - 1u));
}

// The children of a node wait that are nodes and were passed; returned are those that are leaves.
fn children_wait(walk: ptr<function, Walk>, node: Node, passed: u32) -> u32 {
    let inner = node.scales >> 24u;
    let waiting = in_order(passed & inner, (*walk).octant);
    if waiting != 0u {
        (*walk).waiting[(*walk).depth] = vec2u(node.first_child, inner | (waiting << 8u));
        (*walk).depth += 1u;
    }
    return passed & ~inner;
}

// How far from the boxes of items a ray counts as passing them.
fn item_pad(origin: vec3f) -> f32 {
    return counts.room.x * (largest(origin) + counts.room.y);
}

// The nearest hit of the scene's tree, if it is nearer than `before`.
fn closest_in_tree(before: Hit, ray: Ray, left: vec2u, wall: vec2u) -> Hit {
    var hit = before;
    let s = slabs(ray.origin, ray.direction, item_pad(ray.origin));
    var walk = start_walk(octant_of(ray.direction));
    while walk.depth > 0u {
        let node = load_node(5u * next_node(&walk));
        var leaves = children_wait(&walk, node, children_passed(node, s, hit.t));
        while leaves != 0u {
            let items = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < items.y; k++) {
                hit = closest_of_item(hit, load_item(items.x + k), ray, s, left, wall);
            }
        }
    }
    return hit;
}

fn closest_of_item(before: Hit, item: Item, ray: Ray, s: Slabs, left: vec2u, wall: vec2u) -> Hit {
    var hit = before;
    let passage = box_passage(item.low, item.high, s);
    if !is_passed(passage, hit.t) {
        return hit;
    }
    // Loops where an `if` would do: software Vulkan skips them.
    for (var once = has_kind(item, INSTANCE); once; once = false) {
        hit = closest_of_mesh(hit, item.index, ray, max(passage.x, 0.0), left);
    }
    let i = item.index;
    for (var once = has_kind(item, RECTANGLE); once; once = false) {
        hit = nearer_hit(hit, hit_by_itself(RECTANGLE, i, ray, passage.x, left, wall));
    }
    for (var once = has_kind(item, TRIANGLE); once; once = false) {
        hit = nearer_hit(hit, hit_by_itself(TRIANGLE, i, ray, passage.x, left, wall));
    }
    for (var once = has_kind(item, ELLIPSOID); once; once = false) {
        hit = nearer_hit(hit, hit_by_itself(ELLIPSOID, i, ray, passage.x, left, wall));
    }
    for (var once = has_kind(item, DISK); once; once = false) {
        hit = nearer_hit(hit, hit_by_itself(DISK, i, ray, passage.x, left, wall));
    }
    return hit;
}

// Whether an item is of a kind; false without a look at it where no item of the scene is.
fn has_kind(item: Item, kind: u32) -> bool {
    if (IN_TREE & (1u << kind)) == 0u {
        return false;
    }
    return (item.kind & 0xffu) == kind;
}

// The hit on primitive i, no nearer than its box.
fn hit_by_itself(kind: u32, i: u32, ray: Ray, near: f32, left: vec2u, wall: vec2u) -> Hit {
    let t = max(intersect(kind, primitives[i], i == by_itself(wall), ray, FAR), near);
    return Hit(select(FAR, t, i != by_itself(left)), 0u, i, 0u, vec2f(0.0));
}

// How far beyond `start` what is nearer than t can be: more than t - start by what the sum of both may be rounded.
fn limit_from(start: f32, t: f32) -> f32 {
    return (t - start) + t * 4.7683716e-7;
}

// Of the triangles of instance `number`. The ray is looked at from `start` on: so its origin is near the mesh.
fn closest_of_mesh(before: Hit, number: u32, ray: Ray, start: f32, left: vec2u) -> Hit {
    var hit = before;
    let i = load_instance(number);
    let direction = vector_to_mesh(i, ray.direction);
    let origin = point_to_mesh(i, ray.origin) + direction * start;
    let s = slabs(origin, direction, mesh_pad(i, origin));
    let shear = shear_of(direction);
    var walk = start_walk(octant_of(direction));
    while walk.depth > 0u {
        let node = load_node(i.nodes + 5u * next_node(&walk));
        var leaves = children_wait(&walk, node, children_passed(node, s, limit_from(start, hit.t)));
        while leaves != 0u {
            let triangles = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < triangles.y; k++) {
                let slot = triangles.x + k;
                let corners = meshes[i.triangles + slot];
                let found = triangle_crossing(load_position(i, corners.x), load_position(i, corners.y),
                                              load_position(i, corners.z), origin, shear, s);
                let t = start + max(found.t, 0.0);
                let own = (left.x == number + 1u) & (left.y == corners.w);
                let met = found.met & !own & (t > 0.0);
                hit = nearer_hit(hit, Hit(select(FAR, t, met), number + 1u, corners.w, slot, found.barycentric));
            }
        }
    }
    return hit;
}

// Bit i is set where an item of the tree hides sample i of the block from a surface, or the bit was set before.
fn hidden_by_tree(before: u32, surface: Surface, light: Light, block: Block) -> u32 {
    let all = select((1u << block.count) - 1u, 0xffffffffu, block.count >= 32u);
    var bits = before & all;
    let to = segments_to_light(light, surface.start);
    let pad = item_pad(surface.start);
    // Most often no ray to the light comes near anything.
    let fan = fan_to_light(surface.start, to, pad);
    let some = children_in_fan(load_node(0u), fan, light.reach) != 0u;
    for (var wanted = select(0u, all & ~bits, some); wanted != 0u; wanted &= wanted - 1u) {
        let i = firstTrailingBit(wanted);
        let one = Block(block.pattern, block.side, block.first + i, 1u, block.group, block.key);
        bits |= select(0u, 1u << i, is_hidden(surface, to, light, one, pad));
    }
    return bits;
}

// The fan of all shadow rays from a point to a light.
fn fan_to_light(origin: vec3f, to: Segments, pad: f32) -> Fan {
    return fan(origin, to.towards - abs(to.u) - abs(to.v), to.towards + abs(to.u) + abs(to.v), pad);
}

// Whether an item hides the one sample of a block.
fn is_hidden(surface: Surface, to: Segments, light: Light, one: Block, pad: f32) -> bool {
    let direction = segment(to, block_sample(one, 0u));
    let s = slabs(surface.start, direction, pad);
    var hidden = false;
    var walk = start_walk(octant_of(direction));
    while walk.depth > 0u && !hidden {
        let node = load_node(5u * next_node(&walk));
        var leaves = children_wait(&walk, node, children_passed(node, s, light.reach));
        while leaves != 0u && !hidden {
            let items = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < items.y; k++) {
                let item = load_item(items.x + k);
                let is_near = is_passed(box_passage(item.low, item.high, s), light.reach);
                hidden |= item_hides(item, is_near & ((item.kind & CASTS_SHADOW) != 0u), surface, light, one);
            }
        }
    }
    return hidden;
}

// Whether an item hides the one sample of a block, if it may.
fn item_hides(item: Item, may: bool, surface: Surface, light: Light, one: Block) -> bool {
    var bits = 0u;
    for (var once = has_kind(item, INSTANCE) & may; once; once = false) {
        bits = select(0u, 1u, mesh_hides(item.index, surface, light, one));
    }
    let i = item.index;
    let p = surface.start;
    let is_wall = i == by_itself(surface.below);
    let other = may & (i != by_itself(surface.above));
    for (var once = has_kind(item, RECTANGLE) & other; once; once = false) {
        bits = shadow_bits(RECTANGLE, primitives[i], p, is_wall, light, one);
    }
    for (var once = has_kind(item, TRIANGLE) & other; once; once = false) {
        bits = shadow_bits(TRIANGLE, primitives[i], p, is_wall, light, one);
    }
    for (var once = has_kind(item, ELLIPSOID) & other; once; once = false) {
        bits = shadow_bits(ELLIPSOID, primitives[i], p, is_wall, light, one);
    }
    for (var once = has_kind(item, DISK) & other; once; once = false) {
        bits = shadow_bits(DISK, primitives[i], p, is_wall, light, one);
    }
    return bits != 0u;
}

// Whether a triangle of instance `number` hides the one sample of a block; not the triangle that the surface is of.
fn mesh_hides(number: u32, surface: Surface, light: Light, one: Block) -> bool {
    let i = load_instance(number);
    let origin = point_to_mesh(i, surface.start);
    let to = segments_to_light(light, surface.start);
    let to_mesh = Segments(vector_to_mesh(i, to.towards), vector_to_mesh(i, to.u), vector_to_mesh(i, to.v));
    let direction = segment(to_mesh, block_sample(one, 0u));
    let s = slabs(origin, direction, mesh_pad(i, origin));
    let shear = shear_of(direction);
    var hidden = false;
    var walk = start_walk(octant_of(direction));
    while walk.depth > 0u && !hidden {
        let node = load_node(i.nodes + 5u * next_node(&walk));
        var leaves = children_wait(&walk, node, children_passed(node, s, light.reach));
        while leaves != 0u && !hidden {
            let triangles = leaf_items(node, firstTrailingBit(leaves));
            leaves &= leaves - 1u;
            for (var k = 0u; k < triangles.y; k++) {
                let slot = triangles.x + k;
                let corners = meshes[i.triangles + slot];
                let found = triangle_crossing(load_position(i, corners.x), load_position(i, corners.y),
                                              load_position(i, corners.z), origin, shear, s);
                let own = (surface.above.x == number + 1u) & (surface.above.y == corners.w);
                let crosses = found.met & (found.t > 0.0) & (found.t < light.reach);
                hidden |= crosses & !own & triangle_casts(i, slot);
            }
        }
    }
    return hidden;
}
