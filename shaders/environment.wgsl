// The environment map and its importance sampling by radiance and clamped cosine.
//
// The map is divided into at most 32 x 32 blocks of cells. A block is chosen in proportion to its irradiance on a
// surface, from cumulative distributions for 290 bins of normals; a cell of the block is chosen in proportion to its
// radiance. Thus pdfs are exact, and a pixel's samples stay stratified over blocks.

struct EnvironmentEval {
    radiance: vec3f,
    pdf: f32,              // of `sample_environment`, per solid angle, including the selection
}

// An interval of a cumulative distribution.
struct Interval {
    index: u32,
    width: f32,            // probability
    position: f32,         // of the random number in it, 0 to 1
}

fn environment_texel(row: u32, column: u32) -> vec3f {
    let at = environment.texels + 3u * (row * environment.width + column);
    return vec3f(bitcast<f32>(texel_word(at)), bitcast<f32>(texel_word(at + 1u)), bitcast<f32>(texel_word(at + 2u)));
}

fn environment_float(at: u32) -> f32 {
    return bitcast<f32>(texel_word(at));
}

// Returns the offset of the distribution of rows for a normal; the distributions of blocks follow.
fn block_distributions(normal: vec3f) -> u32 {
    let rows = (environment.height >> (environment.shifts >> 8u)) + 1u;
    return environment.blocks + rows * ENVIRONMENT_BLOCKS + normal_bin(normal) * (rows + 1u) * (ENVIRONMENT_BLOCKS + 1u);
}

// Finds the interval that contains u among 32 intervals, of which empty ones come last. `digits` extends u's 24 binary
// digits.
fn interval_at(distribution: u32, u: f32, digits: f32) -> Interval {
    var at = distribution;
    at += select(0u, 16u, u >= environment_float(at + 16u));
    at += select(0u, 8u, u >= environment_float(at + 8u));
    at += select(0u, 4u, u >= environment_float(at + 4u));
    at += select(0u, 2u, u >= environment_float(at + 2u));
    at += select(0u, 1u, u >= environment_float(at + 1u));
    let low = environment_float(at);
    let width = environment_float(at + 1u) - low;
    let position = ((u - low) + digits * 5.9604644775390625e-8) / width;
    return Interval(at - distribution, width, min(position, 0.99999994));
}

fn interval_width(distribution: u32, index: u32) -> f32 {
    return environment_float(distribution + index + 1u) - environment_float(distribution + index);
}

// Returns the bilinear radiance, and the pdf at a surface: the block's probability times the cell's mean radiance over
// the block's integral.
fn environment_eval(direction: vec3f, normal: vec3f) -> EnvironmentEval {
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
    let row = cell.row >> (environment.shifts >> 8u);
    let column = cell.column >> (environment.shifts & 255u);
    let rows = block_distributions(normal);
    let columns = rows + (row + 1u) * (ENVIRONMENT_BLOCKS + 1u);
    let probability = interval_width(rows, row) * interval_width(columns, column) * environment.density;
    let inverse = environment_float(environment.blocks + row * ENVIRONMENT_BLOCKS + column);
    return EnvironmentEval(upper + (lower - upper) * cell.y, (sum.x + sum.y + sum.z) * inverse * probability);
}

// Returns the weighted radiance of a ray that leaves the scene; `pdf` is the pdf of the ray, `normal` the normal of the
// surface that it left.
fn environment_mis(direction: vec3f, pdf: f32, normal: vec3f) -> vec3f {
    let eval = environment_eval(direction, normal);
    return eval.radiance * select(1.0, power_heuristic(pdf, eval.pdf), pdf > 0.0);
}

// Samples the map for a surface normal, or 0 if light may arrive from both sides. Inverts the distributions of rows and
// blocks, then picks a cell by Walker's alias method; the position in the block selects the entry. The radiance is
// evaluated as for other rays, so that pdfs agree.
fn sample_environment(light: Light, normal: vec3f, u: vec2f) -> LightSample {
    let more = hash4(vec4u(bitcast<u32>(u.x), bitcast<u32>(u.y), 0u, 0u));
    let rows = block_distributions(normal);
    let row = interval_at(rows, u.y, unit_float(more.y));
    let column = interval_at(rows + (row.index + 1u) * (ENVIRONMENT_BLOCKS + 1u), u.x, unit_float(more.x));
    let width = environment.width;
    let height = environment.height;
    let down = environment.shifts >> 8u;
    let along = environment.shifts & 255u;
    let remaining = vec2u(width - (column.index << along), height + 1u - (row.index << down));
    let full = vec2u(1u << along, 1u << down);
    let size = select(remaining, full, full < remaining);
    let x = column.position * f32(size.x);
    let y = row.position * f32(size.y);
    let cell = vec2u(u32(x), u32(y));
    let first = (row.index << down) * width + size.y * (column.index << along) + cell.y * size.x + cell.x;
    let at = environment.cells + 2u * first;
    let own = ((row.index << down) + cell.y) * 65536u + (column.index << along) + cell.x;
    let chosen = select(texel_word(at + 1u), own, more.z < texel_word(at));
    let inside = vec2f(x - f32(cell.x), y - f32(cell.y));
    let d = direction_in_cell(chosen & 65535u, chosen >> 16u, inside, width, height);
    let to = normalize(environment.x * d.x + environment.y * d.y + environment.z * d.z);
    let eval = environment_eval(to, normal);
    return LightSample(to, eval.radiance, eval.pdf, false, light.t_max, NO_INDEX);
}
