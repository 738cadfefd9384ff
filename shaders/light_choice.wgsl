// Emitter selection by the light tree, and the pdf of hit emitters.

struct EmitterSelection {
    emitter: Emitter,
    density: f32,          // pdf per area, including the selection; 0 if the light tree did not select
}

// Returns `emitter`, or if `emitter` stands for the light tree, the emitter that the tree selects at p. n is as in
// `light_importances`. Each pair of levels uses a two-dimensional point set over the pixel's samples.
fn light_tree_select(emitter: Emitter, p: vec3f, n: vec3f, key: vec2u, sample: u32) -> EmitterSelection {
    var selection = EmitterSelection(emitter, 0.0);
    if emitter.index != NO_INDEX {
        return selection;
    }
    var probability = 1.0;
    var node_index = 0u;
    var last_index = 0u;
    var child = 0u;
    var level = 0u;
    var bits = vec2u(0u);
    while node_index != NO_INDEX {
        last_index = node_index;
        let node = load_light_node(node_index);
        let shares = light_shares(light_importances(node, p, n));
        if (level & 1u) == 0u {
            bits = decision_set(hash4(vec4u(key.x, key.y, level, 1u)).xy, sample);
        }
        child = light_child(shares, unit_float(select(bits.x, bits.y, (level & 1u) == 1u)));
        probability *= shares[child];
        node_index = node.children[child];
        level++;
    }
    let node = load_light_node(last_index);
    selection.emitter.instance = node.instance[child];
    selection.emitter.index = node.index[child];
    selection.density = node.density[child] * probability;
    return selection;
}

// Returns the pdf, per area, with which `light_tree_select` at p samples a hit; 0 if `is_enabled` is false or the hit
// emitter is not in the tree.
fn light_tree_pdf(hit: Hit, is_enabled: bool, p: vec3f, n: vec3f) -> f32 {
    var child = NO_INDEX;
    if is_enabled {
        child = light_leaf(hit);
    }
    if child == NO_INDEX {
        return 0.0;
    }
    var density = load_light_node(child / 4u).density[child % 4u];
    while child != NO_INDEX {
        let node = load_light_node(child / 4u);
        density *= light_shares(light_importances(node, p, n))[child % 4u];
        child = node.parent.x;
    }
    return density;
}

// Returns the leaf of a hit emitter, encoded as `LightNode.parent`, or NO_INDEX.
fn light_leaf(hit: Hit) -> u32 {
    var position_in_tree = hit.primitive;
    if (TLAS_KINDS & (1u << INSTANCE)) != 0u {
        if hit.instance != 0u {
            let leaves = load_instance(hit.instance - 1u).leaves;
            if leaves == NO_INDEX {
                return NO_INDEX;
            }
            position_in_tree = leaves + hit.slot;
        }
    }
    return word_of(records[counts.emitters.w + position_in_tree / 4u], position_in_tree % 4u);
}
