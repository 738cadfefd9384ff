// Sample positions on the unit square.

// Position `index` of group `group`. A group has side x side positions where the pattern needs squares. `key` tells sets of
// different pixels, lights and seeds apart.
fn sample_square(pattern: u32, side: u32, index: u32, group: u32, key: vec2u) -> vec2f {
    if pattern == GRID {
        return grid_sample(side, index);
    }
    return random_sample(index, group, key);
}

// Cell centres of a regular grid, row by row.
fn grid_sample(side: u32, index: u32) -> vec2f {
    let cell = 1.0 / f32(side);
    return vec2f((f32(index % side) + 0.5) * cell, (f32(index / side) + 0.5) * cell);
}

fn random_sample(index: u32, group: u32, key: vec2u) -> vec2f {
    let bits = hash4(vec4u(key.x, key.y, group, index));
    return vec2f(unit_float(bits.x), unit_float(bits.y));
}

// The key of one purpose of random numbers: 0 is the pixel's area, 1 + n the light n, NOTHING the
// choice of branches.
fn sample_key(pixel: vec2u, seed: u32, purpose: u32) -> vec2u {
    let bits = hash4(vec4u(pixel.x, pixel.y, seed, purpose));
    return bits.xy;
}
