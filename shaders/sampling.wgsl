// Sample patterns on the unit square.

// Returns point `index` of the point set `group`. The sets of a pixel, or of a light, are numbered in order of use.
// `side` is the number of cells along a side for grids, and the number of points in a set for other patterns. `key`
// differs by pixel, light and seed.
fn sample_square(pattern: u32, side: u32, index: u32, group: u32, key: vec2u) -> vec2f {
    if pattern == GRID {
        return grid_sample(side, index);
    }
    if pattern == ROTATED_GRID {
        return rotated_grid_sample(side, index);
    }
    if pattern == JITTERED {
        return jittered_sample(side, index, group, key);
    }
    if pattern == HALTON {
        return halton_sample(group * side + index, key);
    }
    if pattern == SOBOL {
        return sobol_sample(group * side + index, key);
    }
    return random_sample(index, group, key);
}

// Returns the center of grid cell `index`, counted row by row.
fn grid_sample(side: u32, index: u32) -> vec2f {
    let cell = 1.0 / f32(side);
    return vec2f((f32(index % side) + 0.5) * cell, (f32(index / side) + 0.5) * cell);
}

// Returns the center of a cell of a grid that is rotated by atan(1/2) around the square's center, and wrapped.
fn rotated_grid_sample(side: u32, index: u32) -> vec2f {
    let p = grid_sample(side, index) - 0.5;
    let x = 0.8944272 * p.x - 0.4472136 * p.y;
    let y = 0.4472136 * p.x + 0.8944272 * p.y;
    return vec2f(wrap(x + 0.5), wrap(y + 0.5));
}

// Wraps x from -1..2 to 0..1.
fn wrap(x: f32) -> f32 {
    let nonnegative = select(x, x + 1.0, x < 0.0);
    return select(nonnegative, nonnegative - 1.0, nonnegative >= 1.0);
}

// Returns a uniform position in grid cell `index`, counted row by row. With integer division, the position cannot be
// rounded into the next cell. `side` is at most 256.
fn jittered_sample(side: u32, index: u32, group: u32, key: vec2u) -> vec2f {
    let bits = hash4(vec4u(key.x, key.y, group, index));
    let x = (((index % side) << 24u) | (bits.x >> 8u)) / side;
    let y = (((index / side) << 24u) | (bits.y >> 8u)) / side;
    return vec2f(f32(x), f32(y)) * 5.9604644775390625e-8;
}

fn random_sample(index: u32, group: u32, key: vec2u) -> vec2f {
    let bits = hash4(vec4u(key.x, key.y, group, index));
    return vec2f(unit_float(bits.x), unit_float(bits.y));
}

// Returns the key of a purpose: 0 for the pixel's area, 1 + n for light n, NO_INDEX for the choice of branches.
fn sample_key(pixel: vec2u, seed: u32, purpose: u32) -> vec2u {
    let bits = hash4(vec4u(pixel.x, pixel.y, seed, purpose));
    return bits.xy;
}

// Returns four random numbers for a decision, unique if no two decisions of a purpose have the same `bounce`.
fn decision_bits(pixel: vec2u, seed: u32, sample: u32, bounce: u32, purpose: u32) -> vec4u {
    let key = sample_key(pixel, seed, purpose);
    return hash4(vec4u(key.x, key.y, sample, bounce));
}
