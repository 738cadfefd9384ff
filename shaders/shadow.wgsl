// Shadow rays, from one point to a block of at most 32 samples of one light at a time: what a primitive needs to know
// of the point and the light is computed once for the block, and no primitive is read inside the loop.

struct Block {
    pattern: u32,
    side: u32,
    first: u32,            // of the light's samples
    count: u32,            // 1 to BLOCK
}

// Where the samples of the block at hand are on the light, but for the grid, whose positions are constants of the kernel.
// A variable of the module: as a part of Block, or passed by pointer, it makes kernels 1.4 to 60 times slower.
var<private> block_positions: array<vec2f, BLOCK>;

// What takes hashing is computed once for all primitives.
fn sample_block(pattern: u32, side: u32, first: u32, count: u32, group: u32, key: vec2u) -> Block {
    if pattern != GRID {
        for (var i = 0u; i < count; i++) {
            block_positions[i] = sample_square(pattern, side, first + i, group, key);
        }
    }
    return Block(pattern, side, first, count);
}

// Bit i is set where the primitive hides sample i of the block from p. `kind` is the primitive's, known when compiled.
fn shadow_bits(kind: u32, q: Primitive, p: vec3f, light: Light, block: Block) -> u32 {
    let o = point_to_local(q, p);
    let to = segments_to_local(q, segments_to_light(light, p));
    var bits = 0u;
    for (var i = 0u; i < block.count; i++) {
        let d = segment(to, block_sample(block, i));
        bits |= select(0u, 1u << i, blocks(kind, o, d, light.reach));
    }
    return bits;
}

fn block_sample(block: Block, i: u32) -> vec2f {
    if block.pattern == GRID {
        return grid_sample(block.side, block.first + i);
    }
    return block_positions[i];
}

fn blocks(kind: u32, o: vec3f, d: vec3f, reach: f32) -> bool {
    if kind == RECTANGLE {
        return rectangle_blocks(o, d, reach);
    }
    if kind == TRIANGLE {
        return triangle_blocks(o, d, reach);
    }
    if kind == ELLIPSOID {
        return ellipsoid_blocks(o, d, reach);
    }
    return plane_blocks(o, d, reach);
}
