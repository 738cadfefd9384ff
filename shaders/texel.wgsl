// Texels: wrapping, formats, filter weights.

// Returns an equivalent coordinate: from 0 to 1 for repeated textures, 0 to 2 for mirrored, -8 to 9 for clamped ones.
fn near_coordinate(u: f32, wrap: u32) -> f32 {
    let small = select(0.0, u, abs(u) < 8388608.0); // larger numbers are integers
    let repeated = small - floor(small);
    let mirrored = small - 2.0 * floor(0.5 * small);
    let clamped = min(max(u, -8.0), 9.0);
    return select(select(repeated, clamped, wrap == CLAMP), mirrored, wrap == MIRRORED);
}

// Returns the column, or the row, of the texel coordinate i in an image of `size` columns or rows.
fn wrapped_index(i: i32, size: u32, wrap: u32) -> u32 {
    let n = i32(size);
    if wrap == CLAMP {
        return u32(select(select(i, n - 1, i > n - 1), 0, i < 0));
    }
    let period = select(n, 2 * n, wrap == MIRRORED);
    let periods = i32(floor((f32(i) + 0.5) / f32(period)));
    let j = i - periods * period;
    return u32(select(j, period - 1 - j, j >= n));
}

fn level_size(size: u32, level: u32) -> u32 {
    return select(size >> level, 1u, (size >> level) == 0u);
}

// Unpacks nine bits each for red, green and blue, red lowest, and a shared exponent of five bits. The unit is
// 2^(exponent - 32) of the step between 8-bit values. 8-bit colors are exact, and means of dark colors almost exact.
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

// Returns the weight at the squared radius r2, which is 1 at the ellipse's edge: a Gaussian minus its value at the
// edge, with alpha 2 as in pbrt. Heckbert, "Fundamentals of Texture Mapping and Image Warping", 1989, section 3.5.8.
fn gaussian_weight(r2: f32) -> f32 {
    return exp2(r2 * -2.8853900817779268) - 0.1353352832366127;
}
