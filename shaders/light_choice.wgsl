// Light selection by the light tree, and the pdf of hit emitters.

struct EmitterSelection {
    emitter: Emitter,
    density: f32,          // pdf per area, including the selection; 0 if the light tree did not select
}

// Returns `emitter`; if it stands for the light tree, the emitter that the tree selects at p. n is as in
// `light_importances`. Each pair of levels uses a two-dimensional point set over the pixel's samples.
fn light_tree_select(emitter: Emitter, p: vec3f, n: vec3f, key: vec2u, sample: u32) -> EmitterSelection {
    var chosen = EmitterSelection(emitter, 0.0);
    if emitter.index != NO_INDEX {
        return chosen;
    }
    var probability = 1.0;
    var at = 0u;
    var last = 0u;
    var child = 0u;
    var level = 0u;
    var bits = vec2u(0u);
    while at != NO_INDEX {
        last = at;
        let node = load_light_node(at);
        let shares = light_shares(light_importances(node, p, n));
        if (level & 1u) == 0u {
            bits = decision_set(hash4(vec4u(key.x, key.y, level, 1u)).xy, sample);
        }
        child = light_child(shares, unit_float(select(bits.x, bits.y, (level & 1u) == 1u)));
        probability *= shares[child];
        at = node.children[child];
        level++;
    }
    let node = load_light_node(last);
    chosen.emitter.instance = node.instance[child];
    chosen.emitter.index = node.index[child];
    chosen.density = node.density[child] * probability;
    return chosen;
}

// Returns the pdf per area of sampling a hit by `light_tree_select` at p; 0 if `wanted` is false or the hit is not in
// the tree.
fn light_tree_pdf(hit: Hit, wanted: bool, p: vec3f, n: vec3f) -> f32 {
    var at = NO_INDEX;
    if wanted {
        at = light_leaf(hit);
    }
    if at == NO_INDEX {
        return 0.0;
    }
    var density = load_light_node(at / 4u).density[at % 4u];
    while at != NO_INDEX {
        let node = load_light_node(at / 4u);
        density *= light_shares(light_importances(node, p, n))[at % 4u];
        at = node.parent.x;
    }
    return density;
}

// Returns a hit's leaf, encoded as `LightNode.parent`, or NO_INDEX.
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
