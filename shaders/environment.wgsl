// The image that surrounds the scene: what arrives from a direction, and samples of it.

// What arrives from a direction.
struct Arriving {
    radiance: vec3f,
    pdf: f32,              // of samples of light there, per solid angle, with the choice of the image among all that shines
}

fn environment_texel(row: u32, column: u32) -> vec3f {
    let at = environment.texels + 3u * (row * environment.width + column);
    return vec3f(bitcast<f32>(texel_word(at)), bitcast<f32>(texel_word(at + 1u)), bitcast<f32>(texel_word(at + 2u)));
}

// Bilinear between the centres of texels. A cell is as likely as the mean of its corners says, and inside of it all directions are alike.
fn arriving_from(direction: vec3f) -> Arriving {
    let d = vec3f(dot(environment.x, direction), dot(environment.y, direction), dot(environment.z, direction));
    let cell = cell_towards(d, environment.width, environment.height);
    let next = column_after(cell.column, environment.width);
    let a = environment_texel(cell.row, cell.column);
    let b = environment_texel(cell.row, next);
    let c = environment_texel(cell.row + 1u, cell.column);
    let e = environment_texel(cell.row + 1u, next);
    let upper = a + (b - a) * cell.x;
    let lower = c + (e - c) * cell.x;
    let sum = a + b + c + e;
    return Arriving(upper + (lower - upper) * cell.y, (sum.x + sum.y + sum.z) * environment.density);
}

// What a ray that leaves the scene finds, weighed against the samples of light that find the same; `pdf` is that of the ray's direction.
fn light_from_afar(direction: vec3f, pdf: f32) -> vec3f {
    let arriving = arriving_from(direction);
    return arriving.radiance * select(1.0, power_heuristic(pdf, arriving.pdf), pdf > 0.0);
}

// A direction by the table of cells: Walker's method, as for `chosen_emitter`. What the sample brings is looked up as for any other ray, so
// that both have one density for it. The digits that u has no room for are hashed of it.
fn sample_environment(light: Light, u: vec2f) -> LightSample {
    let bits = vec2u(u32(u.x * 16777216.0), u32(u.y * 16777216.0));
    let more = hash4(vec4u(bits.x, bits.y, 0u, 0u));
    let width = environment.width;
    let height = environment.height;
    let first = whole_below((bits.x << 8u) | (more.x & 255u), width * (height + 1u));
    let at = environment.cells + 2u * first;
    let threshold = texel_word(at);
    let chosen = select(texel_word(at + 1u), first, ((bits.y << 8u) | ((more.x >> 8u) & 255u)) < threshold);
    let inside = vec2f(unit_float(more.y), unit_float(more.z));
    let row = chosen / width;
    let d = direction_in_cell(chosen - row * width, row, inside, width, height);
    let to = normalize(environment.x * d.x + environment.y * d.y + environment.z * d.z);
    let arriving = arriving_from(to);
    return LightSample(to, arriving.radiance, arriving.pdf, false, light.reach, NOTHING);
}
