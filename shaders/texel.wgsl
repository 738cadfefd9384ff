// Images as arrays of texels: coordinates, formats, weights.

// A coordinate brought near to the image: from 0 to 1, from 0 to 2 for mirrored ones; clamped ones at most some widths
// beyond its edges.
fn near_coordinate(u: f32, wrap: u32) -> f32 {
    let small = select(0.0, u, abs(u) < 8388608.0); // larger ones have no fraction
    let repeated = small - floor(small);
    let mirrored = small - 2.0 * floor(0.5 * small);
    let clamped = min(max(u, -8.0), 9.0);
    return select(select(repeated, clamped, wrap == CLAMP), mirrored, wrap == MIRRORED);
}

// The column or row that stands for i in a level with `size` of them.
fn wrapped_index(i: i32, size: u32, wrap: u32) -> u32 {
    let n = i32(size);
    if wrap == CLAMP {
        return u32(select(select(i, n - 1, i > n - 1), 0, i < 0));
    }
    let period = select(n, 2 * n, wrap == MIRRORED);
    let whole = i32(floor((f32(i) + 0.5) / f32(period)));
    let j = i - whole * period;
    return u32(select(j, period - 1 - j, j >= n));
}

// Columns or rows of a level.
fn level_size(size: u32, level: u32) -> u32 {
    return select(size >> level, 1u, (size >> level) == 0u);
}

// Nine bits for each of red, green and blue, from the lowest on, and five for the exponent that they share: units of
// 2^(exponent - 32) of a step of 8 bits. Every colour of 8 bits is exact, and so is the mean of dark ones nearly.
fn unpacked_color(word: u32, format: u32) -> vec3f {
    let unit = bitcast<f32>(((word >> 27u) + 95u) << 23u);
    let digits = vec3f(f32(word & 511u), f32((word >> 9u) & 511u), f32((word >> 18u) & 511u));
    let color = digits * unit / 255.0;
    if format == SRGB8 {
        return vec3f(srgb_to_linear(color.x), srgb_to_linear(color.y), srgb_to_linear(color.z));
    }
    return color;
}

// IEC 61966-2-1.
fn srgb_to_linear(x: f32) -> f32 {
    return select(power((x + 0.055) / 1.055, 2.4), x / 12.92, x <= 0.04045);
}

// A Gaussian of the distance from an ellipse's centre, its square 1 at the edge, less its value there: Heckbert,
// "Fundamentals of Texture Mapping and Image Warping", 1989, section 3.5.8; alpha 2 as in pbrt.
fn gaussian_weight(r2: f32) -> f32 {
    return exp2(r2 * -2.8853900817779268) - 0.1353352832366127;
}
