// Low-discrepancy sequences on the unit square, randomized by integer hashing.

// Returns point `index` of the Sobol' (0,2)-sequence, Owen-scrambled by hashing: Burley, "Practical Hash-based Owen
// Scrambling", JCGT 9(4), 2020. Since the order is scrambled too, sequences of different keys are independent.
fn sobol_sample(index: u32, key: vec2u) -> vec2f {
    let bits = sobol_bits(index, key);
    return vec2f(unit_float(bits.x), unit_float(bits.y));
}

// Returns `sobol_sample` in units of 2^-32.
fn sobol_bits(index: u32, key: vec2u) -> vec2u {
    let i = shuffled_index(index, key.x ^ key.y);
    return vec2u(reverseBits(scramble(i, key.x)), reverseBits(scramble(sobol_reversed(i), key.y)));
}

// Returns the second coordinate of Sobol' point i as 32 digits, with the first digit in the lowest bit. The first
// coordinate in this representation is i. Digit j is the sum of the bits k of i with C(k, j) odd: Pascal's triangle
// modulo 2 in five factors (Ahmed, "An Implementation Algorithm of 2D Sobol Sequence Fast, Elegant, and Compact", EGSR
// 2024).
fn sobol_reversed(i: u32) -> u32 {
    var x = i;
    x ^= (x >> 1u) & 0x55555555u;
    x ^= (x >> 2u) & 0x33333333u;
    x ^= (x >> 4u) & 0x0f0f0f0fu;
    x ^= (x >> 8u) & 0x00ff00ffu;
    return x ^ (x >> 16u);
}

// Owen-scrambles bit-reversed digits: the change of each bit depends only on the lower bits. This is the permutation of
// Laine and Karras, "Stratified Sampling for Stochastic Transparency", EGSR 2011, with the constants of Burley 2020,
// listing 2.
fn scramble(digits: u32, seed: u32) -> u32 {
    var x = digits + seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// Permutes indices such that aligned runs of 2^k map to aligned runs.
fn shuffled_index(index: u32, seed: u32) -> u32 {
    return reverseBits(scramble(reverseBits(index), seed));
}

// Returns point `index` of the Halton sequence in bases 2 and 3, scrambled in order and rotated on the torus (Cranley
// and Patterson, "Randomization of Number Theoretic Methods for Multiple Integration", 1976).
fn halton_sample(index: u32, key: vec2u) -> vec2f {
    let i = shuffled_index(index, key.x ^ key.y);
    let x = reverseBits(i) + key.x;
    let y = (radical_inverse_3(i) + key.y % 14348907u) % 14348907u;
    return vec2f(unit_float(x), f32(y) * 6.969171550963438e-8);
}

// Returns the lowest 15 base-3 digits of i, reversed, below 3^15.
fn radical_inverse_3(i: u32) -> u32 {
    var remaining = i;
    var reversed = 0u;
    for (var k = 0u; k < 15u; k++) {
        reversed = reversed * 3u + remaining % 3u;
        remaining /= 3u;
    }
    return reversed;
}
